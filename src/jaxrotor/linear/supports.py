"""Critical speeds over the stiffness of the supports: which of them the bearings can move."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from ..arguments import names, numbers, whole
from ..attach.support import LinearSupport, SpeedDependentSupport
from ..errors import InputError
from ..gate import takes
from ..machine.machine import Machine
from ..machine.wiring import unknown
from .critical import at_rest
from .modes import whirl_of


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


@takes(stiffness=numbers("N/m", above=0.0), supports=names, count=whole(1))
def critical_speed_map(
    machine: Machine,
    stiffness: Any,
    supports: Sequence[str] | None = None,
    count: int = 4,
    progress: bool = False,
) -> CriticalSpeedMap:
    """The `count` lowest undamped forward critical speeds for each `stiffness` (N/m) of the `supports`
    (default: all linear and speed-dependent ones), their damping and cross-coupling left out.

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
    rest, G = at_rest(without, "undeformed")
    lateral = np.array(
        [i for i, (_, c) in enumerate(rest.coordinates) if c in ("x", "y", "psi", "theta")]
    )
    grid = np.ix_(lateral, lateral)
    labels = tuple(rest.coordinates[i] for i in lateral)
    held = np.zeros(lateral.size)
    for name in names:
        ((station, _),) = machine.wiring.ends[machine.wiring.connectors.index(name)]
        for i, (s, c) in enumerate(labels):
            held[i] += s == machine.wiring.stations[station] and c in ("x", "y")
    M, K = (np.asarray(x)[grid] for x in (rest.M, rest.K))
    whirling = M - 1j * np.asarray(G)[grid]  # K u = w² (M - i G1) u
    found = np.full((stiffness.size, count), np.nan)
    for i, k in enumerate(tqdm(stiffness, "critical speeds", disable=not progress, leave=False)):
        squares, shapes = np.linalg.eig(
            np.linalg.solve(whirling, 0.5 * (K + K.T) + k * np.diag(held))
        )
        size = np.abs(squares).max()
        straight = np.abs(np.imag(squares)) < 1e-6 * np.abs(squares)
        real = (np.real(squares) > 1e-12 * size) & straight
        forward = real & (whirl_of(labels, np.abs(np.diag(M)), shapes, np.ones(lateral.size)) > 0)
        speeds = np.sort(np.sqrt(np.real(squares)[forward]))[:count]
        found[i, : speeds.size] = speeds
    return CriticalSpeedMap(stiffness, found, names, {name: _own(known[name]) for name in names})


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
        replaced = LinearSupport(jnp.asarray(keep[:, None] * k * keep), jnp.zeros(6))
    return machine.set({name: replaced})


def _own(support: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    k = np.asarray(support.stiffness)
    if isinstance(support, SpeedDependentSupport):
        kx, ky = (k[:, 0], k[:, 1]) if k.ndim == 2 else (k[:, 0, 0], k[:, 1, 1])
        return np.asarray(support.speeds), kx, ky
    kx, ky = (k[0], k[1]) if k.ndim == 1 else (k[0, 0], k[1, 1])
    return np.zeros(1), np.atleast_1d(kx), np.atleast_1d(ky)
