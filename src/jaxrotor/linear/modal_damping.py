"""Damping told mode by mode, as a damping matrix of the machine."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import choice, names, numbers
from ..core.errors import InputError
from ..core.gate import takes
from ..core.kinematics import COORDINATES
from ..core.parameter import known
from ..elements.couplings.matrix import DampingMatrix
from ..machine.machine import Machine
from .linearise import linearize

KINDS = {"lateral": ("x", "y", "psi", "theta"), "axial": ("z",), "torsional": ("phi",)}
_NAME = "modal damping"
# Eigenvalues nearer than this part to each other count as one, in slopes.
_ONE = 1e-7


@takes(ratios=numbers(least=0.0), kinds=names)
def with_modal_damping(
    machine: Machine,
    ratios: Any,
    frequencies: Any = None,
    kinds: Any = ("lateral",),
) -> Machine:
    """The machine with damping told as ratios of its modes at rest, beside what damps it already: an
    attachment `"modal damping"` (`DampingMatrix`) on all its stations, which stands still while the shaft
    turns. It holds every station of a large machine: none follows others then (`Machine.reduced`).

    - `ratios`: of the critical damping: one number, or one for each of `frequencies`, Hz, rising; between
      them linear in the frequency, beyond them as at the end.
    - `kinds`: "lateral", "axial", "torsional": which coordinates' modes. What nothing holds is not damped.

    The matrix is `M F diag(2 zeta w) F' M`, F the mass-normalised modes of M and the symmetric K, those of
    the machine at rest and undeformed. Differentiable by `ratios` and by every parameter, where modes
    coincide too. Raises `InputError` for frequencies that do not rise, or are not as many as the
    ratios, for an unknown kind, and for a machine that has such damping already.
    Source: Wilson & Penzien, Earthquake Eng. Struct. Dyn. 1 (1972) 5.
    """
    zeta = _over_frequency(ratios, frequencies)
    for kind in (kinds,) if isinstance(kinds, str) else kinds:
        choice(*KINDS)(kind, "kinds")
    elements, connections = machine.elements(), machine.connections()
    if _NAME in elements:
        raise InputError(f"`{_NAME}`: this machine has it already: start from the one without")
    model = linearize(machine.full(), 0.0, "undeformed")
    stations = tuple(dict.fromkeys(station for station, _ in model.coordinates))
    rows = [6 * stations.index(s) + COORDINATES.index(c) for s, c in model.coordinates]
    whole = jnp.zeros((6 * len(stations),) * 2)
    for kind in (kinds,) if isinstance(kinds, str) else kinds:
        of = np.flatnonzero([c in KINDS[kind] for _, c in model.coordinates])
        if of.size:
            there, own = np.array(rows)[of], np.ix_(of, of)
            C = _damping(model.M[own], 0.5 * (model.K + model.K.T)[own], zeta)
            whole = whole.at[np.ix_(there, there)].add(C)
    return Machine(
        elements | {_NAME: DampingMatrix(whole)},
        connections | {_NAME: stations},
        machine.gravity,
        machine.fixed(),
        machine.prescribed(),
    )


def _over_frequency(ratios: Any, frequencies: Any) -> Callable[[Array], Array]:
    """Of frequencies in rad/s."""
    ratios = jnp.atleast_1d(jnp.asarray(ratios, float))
    if frequencies is None:
        if ratios.size != 1:
            raise InputError(f"frequencies are missing: {ratios.size} ratios need as many, in Hz")
        return lambda w: jnp.broadcast_to(ratios[0], w.shape)
    where = jnp.asarray(numbers("Hz", rising=True)(frequencies, "frequencies"), float)
    if where.size != ratios.size:
        raise InputError(
            f"frequencies and ratios must be as many, but are {where.size} and {ratios.size}"
        )
    return lambda w: jnp.interp(w, 2 * jnp.pi * where, ratios)


def _damping(M: Array, K: Array, zeta: Callable[[Array], Array]) -> Float[Array, "n n"]:
    """As a function of one symmetric matrix: then coincident modes have derivatives."""
    L = jnp.linalg.cholesky(M)
    back = jax.scipy.linalg.solve_triangular
    S = back(L, back(L, K, lower=True).T, lower=True)

    def ratio(squares: Array) -> Array:
        # rounding holds nothing
        held = squares > 1e-12 * jnp.max(jnp.abs(squares))
        w = jnp.sqrt(jnp.where(held, squares, 1.0))
        return jnp.where(held, 2 * zeta(w) * w, 0.0)

    return L @ _of_symmetric(0.5 * (S + S.T), ratio) @ L.T


def _of_symmetric(S: Float[Array, "n n"], f: Callable[[Array], Array]) -> Float[Array, "n n"]:
    """V f(l) V' of S = V diag(l) V'. Its slope by divided differences: Daleckii & Krein (1965)."""
    numbers = known(S)  # not by JAX where no trace asks for it: that would be a program to compile
    found: Any = jnp.linalg.eigh(S) if numbers is None else np.linalg.eigh(numbers)
    values, V = (jax.lax.stop_gradient(jnp.asarray(x)) for x in found)
    at = f(values)
    slope = jax.vmap(jax.grad(lambda x: f(jnp.append(values, x))[-1]))(values)
    gap = values[:, None] - values
    near = jnp.abs(gap) <= _ONE * jnp.max(jnp.abs(values))
    means = 0.5 * (slope[:, None] + slope)
    divided = jnp.where(near, means, (at[:, None] - at) / jnp.where(near, 1.0, gap))
    still = jax.lax.stop_gradient
    # zero, with the slope of what S does
    moved = V.T @ (S - still(S)) @ V
    return (V * at) @ V.T + V @ (still(divided) * moved) @ V.T
