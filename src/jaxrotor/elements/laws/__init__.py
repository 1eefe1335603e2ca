"""Force laws, for couplings and supports of any kind."""
