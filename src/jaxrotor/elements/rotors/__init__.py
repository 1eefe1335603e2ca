"""Rotors and rigid bodies, with their unbalance."""
