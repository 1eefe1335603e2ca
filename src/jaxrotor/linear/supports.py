"""Critical speeds over the stiffness of the supports: which of them the bearings can move."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..core.arguments import names, numbers, whole
from ..core.bar import with_bar
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from ..elements.bearings.support import LinearSupport, SpeedDependentSupport
from ..machine.machine import Machine
from ..machine.wiring import unknown
from .frozen import Matrices, matrices_at_rest, shares_and_whirl, solved


@shows(without=("actual",), stiffness="N/m", speeds="rad/s")
class CriticalSpeedMap(eqx.Module):
    """Undamped forward critical speeds over the radial stiffness of the supports, alike in x and y.

    - `stiffness`: (n,), N/m, of each support. `speeds`: (n, m), rad/s, rising; NaN where there is none.
    - `supports`: the names of those that were varied.
    - `actual`: support -> (speeds, kxx, kyy), rad/s and N/m: its own stiffness, over speed where it depends
      on it. Where that curve meets a line of the map lies a critical speed.
    """

    stiffness: np.ndarray
    speeds: np.ndarray
    supports: tuple[str, ...] = eqx.field(static=True)
    actual: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]

    plot = plot_door()


@takes(stiffness=numbers("N/m", above=0.0), supports=names, count=whole(1))
def critical_speed_map(
    machine: Machine,
    stiffness: Any,
    supports: Sequence[str] | None = None,
    count: int = 4,
    progress: bool | None = None,
) -> CriticalSpeedMap:
    """The `count` lowest undamped forward critical speeds for each `stiffness` (N/m) of the `supports`
    (default: all linear and speed-dependent ones), their damping and cross-coupling left out, and the inertia
    of those over the speed.

    Raises `InputError` where the machine has no such support, for a stiffness that is not positive, and
    where rounding hides critical speeds.

    Source: API RP 684, sec. 2.4 (undamped critical-speed map).
    """
    stiffness = np.atleast_1d(np.asarray(stiffness, float))
    kinds = (LinearSupport, SpeedDependentSupport)
    known = {name: e for name, e in machine.elements().items() if isinstance(e, kinds)}
    names = tuple(known) if supports is None else tuple(supports)
    for name in names:
        if name not in known:
            raise InputError(f"supports: {unknown('support', name, tuple(known))}")
    if not names:
        raise InputError("this machine has no linear or speed-dependent support to vary")
    without = machine
    for name in names:
        without = _without(without, name)
    rest, held = _lateral(without, machine, names)
    found = np.full((stiffness.size, count), np.nan)
    for i, k in enumerate(with_bar(stiffness, "critical speeds", progress)):
        supported = eqx.tree_at(lambda m: m.K, rest, rest.K + k * np.diag(held))
        there = solved(supported, 1.0)
        speeds = np.asarray(there.speeds)
        forward = np.isfinite(speeds) & (np.asarray(shares_and_whirl(there)[1]) > 0)
        if int(there.lost) and np.sum(forward[: int(there.complete)]) < count:
            raise InputError(
                f"stiffness: with {k:g} N/m critical speeds are hidden by rounding: take less, or hold these "
                "stations by `fixed`"
            )
        speeds = speeds[forward][:count]
        found[i, : speeds.size] = speeds
    return CriticalSpeedMap(stiffness, found, names, {name: _own(known[name]) for name in names})


def _lateral(
    without: Machine, machine: Machine, names: tuple[str, ...]
) -> tuple[Matrices, np.ndarray]:
    """The lateral motions of the machine without its supports, and how often each is held by them."""
    rest = matrices_at_rest(without, "undeformed")
    rows = np.array(
        [i for i, (_, c) in enumerate(rest.coordinates) if c in ("x", "y", "psi", "theta")]
    )
    held = np.zeros(rows.size)
    for name in names:
        ((station, _),) = machine.wiring.ends[machine.wiring.connectors.index(name)]
        for i, row in enumerate(rows):
            place, c = rest.coordinates[row]
            held[i] += place == machine.wiring.stations[station] and c in ("x", "y")
    return rest.part(rows), held


def _without(machine: Machine, name: str) -> Machine:
    """The support without its part in the plane; what else it holds stays."""
    support: Any = machine[name]
    keep = np.ones(6)
    keep[:2] = 0.0
    if isinstance(support, SpeedDependentSupport):
        replaced = LinearSupport(jnp.zeros(6), jnp.zeros(6))
    else:
        k = support.stiffness
        k = jnp.diag(k) if k.ndim == 1 else k
        kept = jnp.asarray(keep[:, None] * k * keep)
        replaced = LinearSupport(kept, jnp.zeros(6), mass=support.mass)
    return machine.set({name: replaced})


def _own(support: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    k = np.asarray(support.stiffness)
    if isinstance(support, SpeedDependentSupport):
        kx, ky = (k[:, 0], k[:, 1]) if k.ndim == 2 else (k[:, 0, 0], k[:, 1, 1])
        return np.asarray(support.speeds), kx, ky
    kx, ky = (k[0], k[1]) if k.ndim == 1 else (k[0, 0], k[1, 1])
    return np.zeros(1), np.atleast_1d(kx), np.atleast_1d(ky)
