"""The equivalent circuit of an induction motor, from its nameplate."""

import math
import warnings

import numpy as np

from ...core.errors import InputError

_PLACE = "InductionMotor.from_nameplate"
_WORTH_TELLING = 0.03
# Starting values depend on the skin effect, which the circuit lacks: they are not to be bought with
# wrong running ones.
_WEIGHTS = {"starting torque": 0.05, "starting current": 0.05}


def equivalent_circuit(
    power,
    line_voltage,
    frequency,
    speed,
    power_factor,
    efficiency,
    breakdown_torque_ratio,
    starting_torque_ratio=None,
    starting_current_ratio=None,
) -> tuple[tuple[float, float, float, float, float], int]:
    """(Rs, Rr, Ls, Lr, Lm in ohm and H), and the pole pairs; arguments as for `from_nameplate`.

    Least squares on the relative errors, by the steady single-phase circuit: a stator branch, a
    magnetizing one and a rotor branch of resistance Rr/s. Both leakages are taken equal: how they
    are split cannot be seen from outside. Source: Krause et al., Analysis of Electric Machinery, ch. 4.
    """
    _check(locals())
    from scipy.optimize import least_squares

    turn = 2 * math.pi * frequency
    pole_pairs = max(1, math.floor(turn / speed * (1 + 1e-12)))
    synchronous = turn / pole_pairs
    slip = 1 - speed / synchronous
    if not 0 < slip < 0.2:
        raise InputError(
            f"{_PLACE}: speed must be a little below a synchronous one, {synchronous:g} rad/s with "
            f"{pole_pairs} pole pairs, but is {speed:g} rad/s: give the full-load speed in rad/s"
        )
    torque = power / speed
    volts = line_voltage / math.sqrt(3)
    current = power / (3 * volts * power_factor * efficiency)
    wanted = {
        "torque": torque,
        "current": current,
        "power factor": power_factor,
        "efficiency": efficiency,
        "breakdown torque": breakdown_torque_ratio * torque,
    }
    if starting_torque_ratio is not None:
        wanted["starting torque"] = starting_torque_ratio * torque
    if starting_current_ratio is not None:
        wanted["starting current"] = starting_current_ratio * current

    def circuit(x):
        rs, rr, leak, magnetizing = np.exp(x) * volts / current
        return rs, rr, leak, leak, magnetizing

    def found(x):
        rs, rr, xs, xr, xm = circuit(x)

        def at(s):
            rotor = rr / s + 1j * xr
            total = rs + 1j * xs + 1j * xm * rotor / (rotor + 1j * xm)
            stator = volts / total
            inner = stator * 1j * xm / (rotor + 1j * xm)
            return stator, 3 * abs(inner) ** 2 * rr / s / synchronous

        # what the rotor branch sees: the slip of the largest torque follows from it
        seen = 1j * xm * (rs + 1j * xs) / (rs + 1j * (xs + xm))
        breakdown_slip = rr / abs(seen + 1j * xr)
        rated, rated_torque = at(slip)
        start, start_torque = at(1.0)
        return {
            "torque": rated_torque,
            "current": abs(rated),
            "power factor": rated.real / abs(rated),
            "efficiency": rated_torque * speed / (3 * volts * rated.real),
            "breakdown torque": at(breakdown_slip)[1],
            "starting torque": start_torque,
            "starting current": abs(start),
        }

    def errors(x):
        have = found(x)
        return [_WEIGHTS.get(k, 1.0) * math.log(have[k] / v) for k, v in wanted.items()]

    starts = (
        (rs, max(slip, 2e-5), leak, xm)
        for rs in (0.01, 0.05)
        for leak in (0.07, 0.15)
        for xm in (2, 4)
    )
    bounds = np.log([1e-5, 1e-5, 0.01, 0.3]), np.log([1.0, 1.0, 1.0, 100.0])
    runs = []
    for first in starts:
        runs.append(
            least_squares(errors, np.log(first), bounds=bounds, xtol=1e-14, ftol=1e-14, gtol=1e-14)
        )
    x = min(runs, key=lambda r: r.cost).x
    _tell(found(x), wanted)
    rs, rr, xs, xr, xm = circuit(x)
    circuit_numbers = (rs, rr, (xs + xm) / turn, (xr + xm) / turn, xm / turn)
    rs, rr, ls, lr, lm = map(float, circuit_numbers)
    return (rs, rr, ls, lr, lm), pole_pairs


def _check(given: dict) -> None:
    for name, value in given.items():
        if value is None and name.startswith("starting"):
            continue
        if not isinstance(value, (int, float, np.floating)) or not 0 < value < math.inf:
            raise InputError(f"{_PLACE}: {name} must be a positive number, but is {value!r}")
    for name in ("power_factor", "efficiency"):
        if given[name] >= 1:
            raise InputError(f"{_PLACE}: {name} must be below 1, but is {given[name]:g}")
    if given["breakdown_torque_ratio"] <= 1:
        raise InputError(
            f"{_PLACE}: breakdown_torque_ratio must be more than 1, but is "
            f"{given['breakdown_torque_ratio']:g}: give it as a part of the full-load torque"
        )


def _tell(found: dict, wanted: dict) -> None:
    off = {k: found[k] / v - 1 for k, v in wanted.items()}
    missed = {k: e for k, e in off.items() if abs(e) > _WORTH_TELLING}
    if missed:
        listed = ", ".join(f"{k} {100 * e:+.0f} %" for k, e in missed.items())
        warnings.warn(
            f"{_PLACE}: the circuit misses the nameplate by {listed}: it has no skin effect, iron or "
            "friction loss",
            stacklevel=4,
        )
