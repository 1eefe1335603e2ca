"""Equilibrium of a journal on pads that tilt.

A pad that turns about its pivot sees only how near the journal comes along the pivot's direction: whatever
the journal moves across it, the pad follows until its force passes through the pivot. So each pad has one
curve of force over nearness (the pad assembly method, Lund, ASLE Trans. 7 (1964) 342), and the journal's
place is the least of a convex function. A pad that no pressure can hold is unloaded: it bears nothing.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .implicit import tangent
from .pad_film import outward, rows
from .pads import Grid, Known, Pads, Place, centres, crossed, known_at, pad_forces, unknown

# Of the load: what the equilibrium may be off by; below which a pad is unloaded. Steps of Newton's method.
_MET, _UNLOADED, _STEPS = 1e-11, 1e-7, 80
# Of its force, what turns a pad; steps of its tilt; of the clearance, what a film keeps at least.
_LEVEL, _TILTS, _LEAST = 1e-12, 60, 1e-3
_THINNER = 0.6


class Tilted(NamedTuple):
    """`place`, what is known of the films, and which pads are loaded; `missed`: of the load, what is left."""

    place: Place
    known: Known
    loaded: Bool[Array, " p"]
    missed: Float[Array, ""]


class _At(NamedTuple):
    """Of each pad: `across`, where the journal stands across the pivot, from its centre of curvature over its
    clearance; the force along and across, N, and their slopes by nearness and across, (p, 2, 2)."""

    across: Float[Array, " p"]
    force: Float[Array, "p 2"]
    slope: Float[Array, "p 2 2"]
    known: Known


def _place(pads: Pads, e: Array, across: Array) -> Place:
    sideways = crossed(outward(pads.pivot)) @ e
    return Place(e, (across * pads.clearance - sideways) / pads.radius)


def _looked(pads: Pads, e: Array, across: Array, spin: Array, grid: Grid, free: Array) -> _At:
    known = known_at(pads, _place(pads, e, across), spin, grid, free)
    n = outward(pads.pivot)
    t = crossed(n)
    centre = centres(pads, _place(pads, e, across))

    def moved(by):
        shift = pads.clearance[:, None] * (by[0] * n + by[1] * t)
        f = pad_forces(pads, centre + shift, jnp.zeros_like(centre), spin, grid, known)
        both = jnp.stack([jnp.sum(f * n, axis=1), jnp.sum(f * t, axis=1)], axis=1)
        return both, both

    slope, f = jax.jacfwd(moved, has_aux=True)(jnp.zeros(2))
    return _At(across, f, slope, known)


def _bounds(pads: Pads, nearness: Array, grid: Grid) -> tuple[Array, Array]:
    """Least and greatest place across at which each pad's film is open."""
    at = jax.vmap(lambda pad: rows(pad, grid[0]))(pads.each) + (pads.middle - pads.pivot)[:, None]
    room = 1 - _LEAST - nearness[:, None] * jnp.cos(at)
    s = jnp.sin(at)
    ahead, behind = s > 1e-9, s < -1e-9
    high = jnp.min(jnp.where(ahead, room / jnp.where(ahead, s, 1.0), 1e3), axis=1)
    low = jnp.max(jnp.where(behind, room / jnp.where(behind, s, 1.0), -1e3), axis=1)
    return low, high


def _levelled(pads: Pads, e: Array, first: _At, spin: Array, load: Array, grid: Grid) -> _At:
    """Each pad where its force passes through its pivot, or where it begins to have one."""
    nearness = (outward(pads.pivot) @ e) / pads.clearance + pads.preload
    low, high = _bounds(pads, nearness, grid)
    high = jnp.maximum(high, low + 1e-9)
    sense, margin = jnp.sign(spin), 0.05 * (high - low)

    def step(carried):
        across, before, low, high, _, k = carried
        at = _looked(pads, e, across, spin, grid, before.known[0])
        turning, steep, pushed = at.force[:, 1], at.slope[:, 1, 1], jnp.abs(at.force[:, 0])
        bare = pushed < 1e-3 * _UNLOADED * load
        # what bears nothing is turned so that its trailing edge comes near
        up = jnp.where(bare, sense > 0, turning > 0)
        low, high = jnp.where(up, across, low), jnp.where(up, high, across)
        # where a film begins both force and slope vanish: a double root, met by double steps
        twice = jnp.where((pushed < 1e-2 * load) & (k % 2 == 1), 2.0, 1.0)
        by_slope = across - twice * turning / jnp.where(steep < 0, steep, -1.0)
        inside = (steep < 0) & (by_slope > low) & (by_slope < high) & ~bare
        after = jnp.where(inside, by_slope, 0.5 * (low + high))
        met = (jnp.abs(turning) <= _LEVEL * pushed) | (pushed < 0.1 * _UNLOADED * load)
        met = (met & ~bare) | (high - low < 1e-9)
        return jnp.where(met, across, after), at, low, high, jnp.all(met), k + 1

    start = jnp.clip(first.across, low + margin, high - margin)
    carried = (start, first, low, high, jnp.zeros((), bool), 0)
    return jax.lax.while_loop(lambda c: ~c[4] & (c[5] < _TILTS), step, carried)[1]


def _nearest(pads: Pads, load: Array, spin: Array, grid: Grid) -> tuple[Array, _At, Array]:
    n, size = outward(pads.pivot), jnp.sqrt(load @ load)

    def step(carried):
        e, at, _, k = carried
        at = _levelled(pads, e, at, spin, size, grid)
        loaded = jnp.abs(at.force[:, 0]) > _UNLOADED * size
        (nn, nt), (tn, tt) = jnp.moveaxis(at.slope, 0, -1)
        steep = nn - nt * tn / jnp.where(tt < 0, tt, -jnp.inf)
        steep = jnp.where(loaded, steep / pads.clearance, 0.0)
        rest = n.T @ jnp.where(loaded, at.force[:, 0], 0.0) + load
        soft = 1e-6 * size / pads.unit * jnp.eye(2)
        move = jnp.linalg.solve(soft - jnp.einsum("p,pi,pj->ij", steep, n, n), rest)
        gap = 1 - pads.preload - (n @ e) / pads.clearance
        taken = (n @ move) / pads.clearance
        part = jnp.min(jnp.where(taken > 0, _THINNER * gap / jnp.where(taken > 0, taken, 1.0), 1.0))
        missed = jnp.max(jnp.abs(rest)) / size
        met = missed <= _MET
        return jnp.where(met, e, e + jnp.minimum(part, 1.0) * move), at, missed, k + 1

    count = pads.arc.shape[0]
    start = _At(
        0.3 * jnp.sign(spin) * jnp.ones(count),
        jnp.zeros((count, 2)),
        jnp.zeros((count, 2, 2)),
        unknown(pads, grid),
    )
    carried = 0.3 * pads.unit * load / size, start, jnp.array(jnp.inf), 0
    return jax.lax.while_loop(lambda c: (c[2] > _MET) & (c[3] < _STEPS), step, carried)[:3]


def tilted(pads: Pads, load: Array, spin: Array, grid: Grid) -> Tilted:
    """Equilibrium; its derivatives are those of the equations that it solves."""
    still = jax.lax.stop_gradient((pads, load, spin))
    e, at, missed = _nearest(*still, grid)
    e, at = jax.lax.stop_gradient((e, at))
    size = jnp.sqrt(still[1] @ still[1])
    loaded = jnp.abs(at.force[:, 0]) > _UNLOADED * size
    place = _place(still[0], e, at.across)
    tilts = place.tilts * still[0].radius / still[0].unit
    across = crossed(outward(pads.pivot))

    def missing(x):
        place = Place(pads.unit * x[:2], pads.unit / pads.radius * x[2:])
        centre = centres(pads, place)
        f = pad_forces(pads, centre, jnp.zeros_like(centre), spin, grid, at.known)
        f = jnp.where(loaded[:, None], f, 0.0)
        turning = jnp.sum(f * across, axis=1) / size
        turning = jnp.where(loaded, turning, x[2:] - tilts)
        return jnp.concatenate([(jnp.sum(f, axis=0) + load) / size, turning])

    x = jnp.concatenate([e / still[0].unit, tilts])
    x = jax.lax.custom_root(missing, x, lambda _, x: x, tangent)
    place = Place(pads.unit * x[:2], pads.unit / pads.radius * x[2:])
    return Tilted(place, at.known, loaded, missed)
