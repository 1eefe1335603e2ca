"""The design example: critical speeds leave the range around the running speed, and are what they claim."""

import sys
from pathlib import Path

import numpy as np

import jaxrotor as jr

sys.path.insert(0, str(Path(__file__).parent.parent / "experiments"))
import critical_speed_design as design


def test_critical_speeds_are_moved_away():
    path = design.optimise(25)
    assert design.separation(path[0][1]) < 0.08
    values, speeds = path[-1]
    assert design.separation(speeds) > design.MARGIN
    assert np.all(np.abs(values / design.START - 1) < 0.5)
    # at each, a mode of the designed machine has just that frequency: by the eigenvalues at that speed
    machine = design.with_values(values)
    for speed in speeds:
        found = jr.modes(jr.linearize(machine, speed, at="undeformed"))
        assert min(abs(m.frequency - speed) for m in found) < 1e-6 * speed
