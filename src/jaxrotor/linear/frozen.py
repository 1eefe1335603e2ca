"""The undamped machine with its matrices frozen at a speed, and the speeds at which it would be critical."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Complex, Float, Int

from ..core.quick import traced
from ..machine.machine import Machine
from .divergence import warn_of_divergence
from .linearise import LinearModel, linearize, linearize_checked, models_at
from .modes import shares_of, whirl_form, whirl_of
from .pencil import whirling

# Speeds, rad/s, at which stiffness is compared with that at rest: does it depend on the speed?
PROBES = np.geomspace(0.3, 1e5, 12)
# The one by whose G, less that at rest, the gyroscopic matrix per speed is told.
_PER_SPEED = 5
_SAME = 1e-7


class Frozen(eqx.Module):
    """`speeds`: (n,), rad/s, rising, inf where there is no further one; `shapes`: (n, n), columns; `M`:
    (n, n); `sense`: (n,), 1 or -1 by the spin of each coordinate's station. `varies`: the matrices depend
    on the speed otherwise than by gyroscopic moments. `complete`, `lost`: as for `Whirling`."""

    speeds: Float[Array, " n"]
    shapes: Complex[Array, "n n"]
    M: Float[Array, "n n"]
    sense: Float[Array, " n"]
    varies: Bool[Array, ""]
    complete: Int[Array, ""]
    lost: Int[Array, ""]
    coordinates: tuple[tuple[str, str], ...] = eqx.field(static=True)


class Matrices(eqx.Module):
    """`M`, `K` (n, n), symmetric, and `G`, skew, per speed; `sense` and `varies` as for `Frozen`."""

    M: Float[Array, "n n"]
    G: Float[Array, "n n"]
    K: Float[Array, "n n"]
    sense: Float[Array, " n"]
    varies: Bool[Array, ""]
    coordinates: tuple[tuple[str, str], ...] = eqx.field(static=True)

    def part(self, rows: np.ndarray) -> "Matrices":
        """With all other coordinates held."""
        grid = np.ix_(rows, rows)
        labels = tuple(self.coordinates[i] for i in rows)
        return Matrices(
            self.M[grid], self.G[grid], self.K[grid], self.sense[rows], self.varies, labels
        )


def matrices_at_rest(machine: Machine, at: Any) -> Matrices:
    """With the stiffness at rest, and the gyroscopic moments in proportion to the speed; with NumPy's arrays,
    where no derivative is asked."""
    speeds = np.append(0.0, PROBES)
    if traced(machine, at):
        return _derivable(machine, at)
    models = list(map(models_at(machine, at), speeds))
    warn_of_divergence(models[0])
    return _at_rest(jax.tree.map(lambda *x: np.stack(x), *models), np)


@eqx.filter_jit
def _derivable(machine: Machine, at: Any) -> Matrices:
    # one program for all speeds, one after the other: batched LAPACK calls side by side can deadlock
    # (docs/solving.md)
    speeds = jnp.asarray(np.append(0.0, PROBES))
    return _at_rest(jax.lax.map(lambda w: linearize(machine, w, at), speeds), jnp)


def _at_rest(models: LinearModel, xp: Any) -> Matrices:
    per_speed, varies = _gyroscopic(models, xp)
    return Matrices(
        models.M[0],
        per_speed,
        _symmetric(models.K[0]),
        _sense(models.spins[-1], xp),
        varies,
        models.coordinates,
    )


def at_rest(machine: Machine, order: Array, at: Any) -> Frozen:
    """The undamped machine with its matrices at rest."""
    return solved(matrices_at_rest(machine, at), order)


def at_speed(machine: Machine, speed: Array, order: Array, at: Any) -> Frozen:
    """With stiffness and skew damping as they are at `speed` (rad/s, positive)."""
    return solved(frozen_at(linearize_checked(machine, speed, at)), order)


def frozen_at(model: LinearModel) -> Matrices:
    """With stiffness and skew damping as they are in the model, whose speed is positive."""
    xp: Any = np if isinstance(model.M, np.ndarray) else jnp
    return Matrices(
        model.M,
        model.G / model.speed,
        _symmetric(model.K),
        _sense(model.spins, xp),
        xp.array(True),
        model.coordinates,
    )


def solved(rest: Matrices, order: Any) -> Frozen:
    """Whirl at `order` times the speed; with NumPy's arrays, where no derivative is asked."""
    if traced(rest, order):
        return _solved(jax.tree.map(jnp.asarray, rest), jnp.asarray(order), jnp)
    rest = jax.tree.map(np.asarray, rest)
    if not all(np.isfinite(x).all() for x in (rest.M, rest.G, rest.K)):
        n = len(rest.M)
        none: Any = np.full(n, np.inf), np.full((n, n), np.nan + 0j), np.array(0)
        speeds, shapes, count = none
        held = rest.M, rest.sense, rest.varies
        return Frozen(speeds, shapes, *held, count, count, rest.coordinates)
    with np.errstate(all="ignore"):  # what has no bound stays as it is
        return _solved(rest, np.asarray(order), np)


def _solved(rest: Matrices, order: Any, xp: Any) -> Frozen:
    squares, found = whirling(rest.M, rest.G / order, rest.K, _marks(rest.coordinates, rest.sense))
    there = xp.isfinite(squares)
    speeds = xp.where(there, xp.sqrt(xp.where(there, squares, 1.0)) / order, xp.inf)
    return Frozen(
        speeds,
        found.shapes,
        rest.M,
        rest.sense,
        rest.varies,
        found.complete,
        found.lost,
        rest.coordinates,
    )


def _symmetric(K: Array) -> Array:
    return 0.5 * (K + jnp.swapaxes(K, -1, -2))


def _sense(spins: Any, xp: Any) -> Any:
    return xp.where(spins < 0, -1.0, 1.0)


def _gyroscopic(models: LinearModel, xp: Any) -> tuple[Float[Array, "n n"], Bool[Array, ""]]:
    """Of models at rest and at the PROBES: G per speed, and whether M, K or G depends on the speed
    otherwise."""
    w = PROBES[:, None, None]
    per_speed = (models.G[1 + _PER_SPEED] - models.G[0]) / PROBES[_PER_SPEED]
    K = _symmetric(models.K)

    def size(x):
        rows = xp.sqrt(xp.max(xp.abs(x), axis=(0, 2)))
        return rows[:, None] * rows

    m = xp.sqrt(xp.diagonal(models.M[0]))
    tolerance = _SAME * (size(models.C) + w * size(per_speed[None])) + 1e-9 * w * m[:, None] * m
    changed = xp.stack(
        [
            xp.any(~(xp.abs(K[1:] - K[0]) <= _SAME * size(K))),
            xp.any(~(xp.abs(models.M[1:] - models.M[0]) <= _SAME * size(models.M))),
            xp.any(~(xp.abs(models.G[1:] - w * per_speed) <= tolerance)),
        ]
    )
    return per_speed, xp.any(changed)


def _marks(labels: tuple[tuple[str, str], ...], sense: Any) -> tuple[Any, Any]:
    """What differs between axial, torsional, forward and backward motion (see `whirling`)."""
    kinds = np.array([{"z": 3.0, "phi": -3.0}.get(c, 0.0) for _, c in labels])
    form = whirl_form(labels, np.ones(len(labels)), np.ones(len(labels)))
    return kinds, form * sense[:, None]


def shares_and_whirl(frozen: Frozen) -> tuple[dict[str, Any], Any]:
    """Of each shape, where there is one: shares of kinetic energy, and the whirl, -1 to 1; of NumPy's or
    JAX's arrays."""
    xp = np if isinstance(frozen.M, np.ndarray) else jnp
    shapes = xp.where(xp.isfinite(frozen.speeds), frozen.shapes, 1.0)
    weight = abs(xp.diagonal(frozen.M))
    whirl = whirl_of(frozen.coordinates, weight, shapes, frozen.sense)  # pyright: ignore
    return shares_of(frozen.coordinates, frozen.M, shapes), whirl
