"""Bearings whose force is not linear: oil films and rolling contacts."""
