"""Forced torsional response of a study: torque or stress over speed, and the life at meetings."""

import warnings
from typing import NamedTuple

import numpy as np

from ..elements.control.inverter import InverterDrive
from ..elements.drives.engine import EngineTorque
from ..elements.drives.ripple import TorqueRipple
from ..linear.orders import order_response
from ..linear.response import frequency_response
from ..linear.shafts import shafts_of
from ..linear.torsion import TorsionalMode, torque_carriers
from ..machine.machine import Machine
from ..standards.torsional import excitation_bands
from ..standards.torsional_life import stress_per_torque
from ..study.torsional import Exciting, StrengthOfShaft, Torsional

_POINTS, _BEYOND = 241, 1.2
# About a resonance, in half widths of its peak.
_BESIDE = np.array([-8.0, -4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0, 8.0])


class Forced(NamedTuple):
    """`values`: part -> excitation -> amplitude at `speeds` (n,), rad/s, in `units` (part -> "N*m" or "Pa");
    `limits`: part -> what is allowed."""

    speeds: np.ndarray
    values: dict[str, dict[str, np.ndarray]]
    units: dict[str, str]
    limits: dict[str, float]


def forced_response(
    machine: Machine, asked: Torsional, modes: list[TorsionalMode], speeds: tuple[float, float]
) -> Forced | None:
    """Of all that has a torque: the excitations of [torsional] and the orders of each `EngineTorque`. The
    machine is linear about its undeformed state at the middle of the speeds."""
    forced = [one for one in asked.excitations if one.torque is not None]
    engines = _engines(machine)
    strengths = {one.name: one for one in asked.shafts}
    parts = list(strengths) or [
        name for name, pair in torque_carriers(machine).items() if "torque" in pair
    ]
    if not (forced or engines) or not parts:
        return None
    high = speeds[1]
    bands = np.asarray(excitation_bands(machine, [f.excitation for f in forced], (high, high)))
    rates = [
        band[1] / high for band, f in zip(bands, forced) if not f.excitation.frequency > 0
    ]  # frequency per speed of the driven shaft
    rates += [order for _, orders in engines for order in orders]
    along = _grid(modes, rates, high)
    carriers = torque_carriers(machine)
    outputs = [carriers[p]["torque"][0] for p in parts]
    values: dict[str, dict[str, np.ndarray]] = {p: {} for p in parts}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*has no bound")  # inf in the table tells
        for band, one in zip(bands, forced):
            for part, amplitudes in zip(parts, _by(machine, one, outputs, band, along, speeds)):
                values[part][one.excitation.name] = amplitudes
        for station, orders in engines:
            found = order_response(machine, outputs, along, orders, "undeformed", station)
            for k, order in enumerate(orders):
                for i, part in enumerate(parts):
                    values[part][f"order {order:g}"] = np.abs(np.asarray(found.values)[:, k, i])
    units, limits = dict.fromkeys(parts, "N*m"), {}
    for name, strength in strengths.items():
        per = float(_per(machine, strength))
        values[name] = {k: per * v for k, v in values[name].items()}
        units[name] = strength.curve.unit
        if strength.curve.endless:
            limits[name] = float(strength.curve.amplitudes[-1])
    return Forced(along, values, units, limits)


def _per(machine: Machine, one: StrengthOfShaft):
    return stress_per_torque(
        machine, one.name, one.curve, one.diameter, one.inner_diameter, one.concentration
    )


def _orders(element) -> np.ndarray:
    """Per turn of its station."""
    if isinstance(element, EngineTorque):
        return np.asarray(element.orders)[np.asarray(element.amplitudes) != 0]
    if isinstance(element, TorqueRipple):
        some = np.any(np.asarray(element.amplitudes) != 0, axis=0)
        return element.pole_pairs * np.asarray(element.orders)[some]
    if isinstance(element, InverterDrive):
        some = np.asarray(element.shares) != 0
        return element.pole_pairs * np.asarray(element.orders)[some]
    return np.zeros(0)


def _engines(machine: Machine) -> list[tuple[str, tuple[float, ...]]]:
    """The first station of each shaft on which engines or inverters act, and the orders of all of them."""
    found: dict[str, set[float]] = {}
    for name, element in machine.elements().items():
        mine = _orders(element)
        if mine.size:
            station = machine.connections()[name][0].partition(".")[0]
            shaft = next(shaft[0] for shaft in shafts_of(machine) if station in shaft)
            whole = {float(order) for order in mine if float(2 * order).is_integer()}
            found[shaft] = found.get(shaft, set()) | whole
    return [(shaft, tuple(sorted(orders))) for shaft, orders in found.items() if orders]


def _grid(modes: list[TorsionalMode], rates: list[float], high: float) -> np.ndarray:
    """Even speeds, and more of them at the peaks."""
    top = _BEYOND * high
    points = [np.linspace(top / _POINTS, top, _POINTS)]
    for mode in modes:
        width = max(mode.damping_ratio, 1e-5)
        points += [mode.frequency / rate * (1 + width * _BESIDE) for rate in rates]
    along = np.unique(np.concatenate(points))
    return along[(along > 0) & (along <= top)]


def _by(machine, one: Exciting, outputs, band, along, speeds) -> np.ndarray:
    """(parts, n): amplitudes by one excitation."""
    high = speeds[1]
    fixed = one.excitation.frequency > 0
    frequencies = np.array([band[1]]) if fixed else band[1] / high * along
    found = frequency_response(
        machine, f"{one.station}.phi", outputs, frequencies, 0.5 * sum(speeds), at="undeformed"
    )
    values = np.abs(np.asarray(found.values)[:, :, 0].T) * (one.torque or 0.0)
    return np.broadcast_to(values, (len(outputs), len(along)))
