"""Pulses of an encoder or a keyphasor: instants instead of samples."""

import numpy as np
from jaxtyping import Array, Float
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from ..core.arguments import number, numbers, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..simulation.response import Response, StationResponse
from .record import Series


@takes(instants=numbers("s", fewest=2, rising=True), pulses=whole(1), first=number("rad"))
def angle_of(instants: Float[Array | np.ndarray, " n"], pulses: int, first: float = 0.0) -> Series:
    """The angle at recorded instants (s, rising): each of `pulses` in a turn is 2 pi/pulses further.

    `first`: rad, at the first instant. Raises `InputError` for instants that do not rise.
    """
    at = np.asarray(instants, float)
    return Series(at, first + 2 * np.pi / pulses * np.arange(at.size), unit="rad")


@takes(instants=numbers("s", fewest=2, rising=True), pulses=whole(1))
def speed_of(instants: Float[Array | np.ndarray, " n"], pulses: int) -> Series:
    """The mean speed between recorded instants, rad/s, in the middle between them. Raises `InputError`
    for instants that do not rise or are fewer than two, and for `pulses` below 1."""
    at = angle_of(instants, pulses).t
    return Series(0.5 * (at[1:] + at[:-1]), 2 * np.pi / pulses / np.diff(at), unit="rad/s")


@takes(pulses=whole(1))
def pulse_times(response: Response, station: str, pulses: int) -> np.ndarray:
    """Instants (s) at which a station passes the marks of an encoder, forwards, during a run.

    Between samples the angle is a cubic with its own rate, so the instants are far better than the samples
    are dense. Raises `InputError` where it is no station, and for `pulses` below 1.
    """
    part = response[station]
    if not isinstance(part, StationResponse):
        raise InputError(f"`{station}`: is no station, an encoder cannot be mounted there")
    t = np.asarray(response.t)
    phi, rate = np.asarray(part.phi), np.asarray(part.velocity[:, 5])
    curve = CubicHermiteSpline(t, phi, rate)
    pitch = 2 * np.pi / pulses
    found = []
    for i in np.flatnonzero(np.floor(phi[1:] / pitch) > np.floor(phi[:-1] / pitch)):
        for mark in np.arange(np.floor(phi[i] / pitch) + 1, np.floor(phi[i + 1] / pitch) + 1):
            found.append(
                brentq(lambda s, mark=mark: curve(s) - mark * pitch, t[i], t[i + 1], xtol=1e-13)
            )
    return np.asarray(found)
