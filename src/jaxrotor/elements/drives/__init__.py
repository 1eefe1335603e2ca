"""Motors, engines, loads, and given spin."""
