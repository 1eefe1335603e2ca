"""Bearings and seals of ROSS by their coefficients."""

import inspect
from typing import Any

import numpy as np

from ..core.parameter import as_float64
from ..core.protocol import AbstractElement
from ..elements.bearings.support import LinearSupport, SpeedDependentSupport
from ..elements.bearings.whirl_dependent import WhirlDependentSupport
from ..elements.couplings.matrix import ElasticMatrix
from .ross_common import Faults


def coefficients(
    bearing: Any, name: str, table_speeds: Any, faults: Faults
) -> AbstractElement | None:
    # over the frequency, which is the speed's in synchronous whirl; in ROSS 3 also over the speed
    given: dict[str, Any] = {axis: getattr(bearing, axis, None) for axis in ("frequency", "speed")}
    axes = {axis: np.asarray(x, float) for axis, x in given.items() if np.size(x) > 1}
    massive = any(np.any(getattr(bearing, m)) for m in ("mxx", "mxy", "myx", "myy", "mzz"))
    words = None
    if massive and bearing.n_link is not None:
        words = "mass coefficients between two nodes cannot be carried"
    elif axes and bearing.n_link is not None:
        words = "a table of coefficients between two nodes cannot be carried"
    if words is not None:
        faults.add(name, words)
        return None

    def at(matrix: Any, frequency: float, speed: float) -> np.ndarray:
        over_speed = "speed" in inspect.signature(matrix).parameters
        return _six(matrix(frequency, speed=speed) if over_speed else matrix(frequency))

    what = [bearing.K, bearing.C, *([bearing.M] if massive else [])]
    if len(axes) > 1:
        speeds, whirls = axes["speed"], axes["frequency"]
        tables = [np.array([[at(f, w, s) for w in whirls] for s in speeds]) for f in what]
        return WhirlDependentSupport(*map(as_float64, (speeds, whirls, *tables)))
    if axes:
        own = next(iter(axes.values())) if table_speeds is None else table_speeds
        speeds = np.asarray(own, float)
        tables = [np.array([at(f, w, w) for w in speeds]) for f in what]
        return SpeedDependentSupport(*map(as_float64, (speeds, *tables)))
    constant = [at(f, 0.0, 0.0) for f in what]
    if bearing.n_link is not None:
        return ElasticMatrix(*map(as_float64, constant))
    if massive and np.any(constant[2] != constant[2].T):  # which has no energy
        tables = [np.stack([x, x]) for x in constant]
        return SpeedDependentSupport(*map(as_float64, ((0.0, 1.0), *tables)))
    mass = as_float64(constant[2]) if massive else None
    return LinearSupport(as_float64(constant[0]), as_float64(constant[1]), mass=mass)


def _six(given: np.ndarray) -> np.ndarray:
    """A bearing's rows along x, y, z (of one node, or of two) among six coordinates of each."""
    nodes = len(given) // 3
    out = np.zeros((nodes, 6, nodes, 6))
    out[:, :3, :, :3] = np.reshape(given, (nodes, 3, nodes, 3))
    return out.reshape(6 * nodes, 6 * nodes)
