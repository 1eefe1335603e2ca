"""Shafts, with mass or without, and their defects."""
