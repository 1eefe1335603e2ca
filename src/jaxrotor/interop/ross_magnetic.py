"""ROSS's magnetic bearing, by the numbers that it was made of."""

from typing import Any

import numpy as np

from ..core.parameter import as_float64
from ..elements.control.magnet import Electromagnets
from ..elements.control.magnetic import MagneticBearing
from ..elements.control.position import PID, AbstractPositionController, TransferFunction


def magnetic_bearing(bearing: Any) -> MagneticBearing:
    """Of a `ross.MagneticBearingElement`."""
    (magnet, other_magnet), (controller, other_controller) = (
        [make(bearing, k) for k in (0, 1)] for make in (_magnet, _controller)
    )
    biases, gains = _pair(bearing.i0), _gains(bearing)
    return MagneticBearing(
        magnet,
        controller,
        angle=as_float64(bearing.sensors_axis_rotation),
        other_magnet=None if biases[0] == biases[1] else other_magnet,
        other_controller=None if gains[0] == gains[1] else other_controller,
        housed=bearing.n_link is not None,
    )


def _pair(value: Any) -> np.ndarray:
    """One number for both axes, or one for each."""
    return np.broadcast_to(np.ravel(np.asarray(value, float)), (2,))


def _gains(bearing: Any) -> np.ndarray:
    """A/m of each axis per unit of its controller."""
    return _pair(bearing.k_amp) * _pair(bearing.k_sense)


def _magnet(bearing: Any, axis: int) -> Electromagnets:
    given = _pair(bearing.i0)[axis], bearing.g0, bearing.nw, bearing.ag, bearing.alpha
    return Electromagnets(*map(as_float64, given))


def _controller(bearing: Any, axis: int) -> AbstractPositionController:
    gain = _gains(bearing)[axis]
    if bearing.controller_transfer_function_num is not None:
        rows = (
            np.atleast_1d(
                np.asarray(getattr(bearing, f"controller_transfer_function_{part}"), float)
            )
            for part in ("num", "den")
        )
        return TransferFunction(*map(as_float64, rows), as_float64(gain))
    kp, ki, kd, w = (
        float(getattr(bearing, name)) for name in ("kp_pid", "ki_pid", "kd_pid", "n_f")
    )
    if kp * gain > 0 and ki * gain >= 0 and kd * gain >= 0:
        numbers = gain * kp, gain * kd, w / (2 * np.pi), gain * ki if ki else None
        return PID(*(None if x is None else as_float64(x) for x in numbers))
    # kp + ki/s + kd s/(1 + s/w) over one denominator
    numerator = [kp + kd * w, kp * w + ki, ki * w] if ki else [kp + kd * w, kp * w]
    denominator = [1.0, w, 0.0] if ki else [1.0, w]
    return TransferFunction(as_float64(numerator), as_float64(denominator), as_float64(gain))
