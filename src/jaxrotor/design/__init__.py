"""Design by gradient: measures that judge a run by one number."""
