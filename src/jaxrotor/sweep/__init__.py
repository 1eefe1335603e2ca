"""Sweeps: one machine many times over, in batches."""
