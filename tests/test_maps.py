"""The map over support stiffness and the interference diagram: what is drawn is what was computed."""

import numpy as np

from jaxrotor.linear.supports import CriticalSpeedMap
from jaxrotor.linear.torsion import Interference, TorsionalMode
from jaxrotor.plot.maps import interference_diagram, support_map

RPM = 30 / np.pi


def test_support_map():
    stiffness = np.geomspace(1e5, 1e9, 5)
    speeds = np.stack([np.sqrt(stiffness), 3 * np.sqrt(stiffness)], axis=1)
    speeds[0, 1] = np.nan
    table = (np.array([10.0, 100.0]), np.array([1e6, 2e6]), np.array([3e6, 4e6]))
    actual = {"b1": (np.zeros(1), np.array([2e6]), np.array([2e6])), "b2": table}
    ax = support_map(CriticalSpeedMap(stiffness, speeds, ("b1", "b2"), actual), (50.0, 80.0))
    drawn = {line.get_label(): line for line in ax.lines}
    np.testing.assert_allclose(drawn["1. forward"].get_ydata(), RPM * speeds[:, 0])
    np.testing.assert_allclose(drawn["b1: x and y"].get_xdata(), 2e6)
    np.testing.assert_allclose(drawn["b2: y"].get_xdata(), table[2])
    assert ax.get_xlabel().endswith("N/m") and ax.get_ylabel().endswith("rpm")


def test_interference_diagram():
    modes = [TorsionalMode("torsional 1", 300.0, 0.0, {}, {}, {})]
    met = [
        Interference("torsional 1", 1.0, 300.0, 0.5),
        Interference("torsional 1", 2.0, 150.0, 0.0),
    ]
    ax = interference_diagram(modes, met, (140.0, 200.0))
    drawn = {line.get_label(): line for line in ax.lines}
    near, clear = drawn["within 10 % of operation"], drawn.get("clear")
    np.testing.assert_allclose(near.get_xdata(), [150.0 * RPM])
    np.testing.assert_allclose(near.get_ydata(), [300.0 / (2 * np.pi)])
    assert clear is None  # beyond the picture
