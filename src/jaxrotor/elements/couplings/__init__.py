"""Couplings, clutches, joints, gears, torsional dampers."""
