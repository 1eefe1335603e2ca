"""By what factor the loads of shafts must grow until a machine buckles."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import names as one_or_more
from ..core.errors import InputError
from ..core.gate import takes
from ..core.quick import traced
from ..elements.shafts.finite import FiniteElementShaft
from ..machine.machine import Machine
from .coordinates import coordinate_order
from .eigen import eigensystem, eigensystem_numbers
from .linearise import check_linearized, linearize_checked

# An eigenvalue's imaginary part that is rounding; what is small beside the largest is no load at all.
_REAL, _LEAST = 1e-6, 1e-9
# Stiffnesses so far apart that rounding is all that holds a machine.
_LOOSE = 1e14
_LATERAL = ("x", "y", "psi", "theta")


@takes(shafts=one_or_more)
def buckling_factor(
    machine: Machine, shafts: str | Sequence[str] | None = None, at: Any = "undeformed"
) -> Float[Array, ""]:
    """The least positive factor by which `axial_force` and `torque` of the machine's shafts must be
    multiplied until it has no stiffness against some deflection, at rest: `(K0 + factor K_loads) u = 0`, one
    eigenvalue problem. Below 1 it buckles under what it carries. z and phi are held.

    - `shafts`: those whose loads grow, by name; what others carry stays as it is. By default all.
    - `at`: as for `linearize`.

    Its derivatives by every parameter are exact. Without buckling (tension alone, or a torque that makes a
    cantilever flutter: see `LinearModel.growth`) it raises `InputError`, and gives inf under `jit`. Raises
    `InputError` too where no shaft carries a load, for a name that is no such shaft, and for a machine that
    is not held sideways.

    Source: Ziegler, Principles of Structural Stability (1968).
    """
    check_linearized(at)
    machine.check()
    paths = _loads(machine, shafts)
    if traced(machine, at):
        return _derivable(machine, paths, at)
    if not any(np.any(np.asarray(machine.get(path))) for path in paths):
        raise InputError(
            f"`{paths[0]}`: is zero, as all loads of the machine's shafts are: give one that is to grow"
        )
    bare = machine.set({path: jnp.zeros_like(machine.get(path)) for path in paths})
    rows = _lateral(machine)
    loaded, free = (
        np.asarray(linearize_checked(m, jnp.zeros(()), at).K)[rows] for m in (machine, bare)
    )
    size = np.sqrt(np.abs(np.diagonal(free)))  # metres and radians differ by orders
    if not np.all(size > 0) or np.linalg.cond(free / size / size[:, None]) > _LOOSE:
        raise InputError(
            "the machine is not held sideways: nothing resists its loads; add supports"
        )
    found = _least(eigensystem_numbers(np.linalg.solve(free, free - loaded))[0], np)
    if not np.isfinite(found):
        raise InputError(
            "no factor of these loads makes the machine buckle: tension stiffens it, and a torque may make "
            "it flutter before (see linearize(machine).growth)"
        )
    return jnp.asarray(found)


def _loads(machine: Machine, shafts: Any) -> list[str]:
    """Paths of what grows."""
    carrying = {
        name: [
            f"{name}.{load}" for load in ("axial_force", "torque") if getattr(e, load) is not None
        ]
        for name, e in machine.elements().items()
        if isinstance(e, FiniteElementShaft)
    }
    carrying = {name: paths for name, paths in carrying.items() if paths}
    names = (
        list(carrying) if shafts is None else [shafts] if isinstance(shafts, str) else list(shafts)
    )
    for name in names:
        if name not in carrying:
            known = ", ".join(f"`{n}`" for n in carrying) or "none"
            raise InputError(
                f"`{name}`: carries neither axial_force nor torque: name one of those that do, {known}"
            )
    if not names:
        raise InputError(
            "no shaft carries a load: give axial_force or torque to a FiniteElementShaft"
        )
    return [path for name in names for path in carrying[name]]


def _lateral(machine: Machine) -> Any:
    labels = coordinate_order(machine)[3]
    rows = np.array([i for i, (_, c) in enumerate(labels) if c in _LATERAL], int)
    return np.ix_(rows, rows)


@eqx.filter_jit
def _derivable(machine: Machine, paths: list[str], at: Any) -> Array:
    rows = _lateral(machine)

    def stiffness(share: Array) -> Array:
        loads = {path: share * machine.get(path) for path in paths}
        return linearize_checked(machine.set(loads), jnp.zeros(()), at).K[rows]

    free, loaded = jax.lax.map(stiffness, jnp.array([0.0, 1.0]))
    return _least(eigensystem(jnp.linalg.solve(free, free - loaded))[0], jnp)


def _least(values: Any, xp: Any) -> Any:
    """Of the eigenvalues, which are one over each factor."""
    size = xp.abs(values)
    there = (xp.abs(values.imag) <= _REAL * size) & (values.real > _LEAST * xp.max(size))
    largest = xp.max(xp.where(there, values.real, 0.0))
    return xp.where(largest > 0, 1.0 / xp.where(largest > 0, largest, 1.0), xp.inf)
