"""Bearings and supports: springs, oil films, rolling elements, contact."""
