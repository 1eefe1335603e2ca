"""Journal bearings made of pads: where the journal runs under a load, and what it feels there."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from .implicit import tangent
from .masked_solve import Factors
from .pad_film import Film, Pad, film, force, heights, leakage, outward, shear, whole

Known = tuple[Bool[Array, "p n m"], Factors]
Grid = tuple[int, int]

# Of the load, what the equilibrium may be off by; Newton's steps until it is given up.
_MET, _STEPS = 1e-11, 80
# Of its height, what a step may take from the film.
_THINNER = 0.6


class Pads(NamedTuple):
    """(p,) of each pad: `middle` and `pivot` (where the preload brings it nearest), angles from x towards y,
    `arc`, all rad; `clearance`, its own (m), and `preload`. Of all: `radius` and `length`, m, `viscosity`,
    Pa·s; `unit`, m, the clearance of the whole bearing."""

    middle: Float[Array, " p"]
    pivot: Float[Array, " p"]
    arc: Float[Array, " p"]
    clearance: Float[Array, " p"]
    preload: Float[Array, " p"]
    radius: Float[Array, ""]
    length: Float[Array, ""]
    viscosity: Float[Array, ""]
    unit: Float[Array, ""]

    @property
    def each(self) -> Pad:
        return Pad(self.arc, jnp.broadcast_to(self.length / (2 * self.radius), self.arc.shape))


class Place(NamedTuple):
    """Of the journal, (2,) m, and of the pads, (p,) rad, positive in the sense of phi."""

    journal: Float[Array, "2"]
    tilts: Float[Array, " p"]


class Balance(NamedTuple):
    """`place` under the load and what is known of the film there; `missed`: of the load, what is left."""

    place: Place
    known: Known
    missed: Float[Array, ""]


def crossed(e: Array) -> Array:
    """z × e, along the last axis."""
    return jnp.stack([-e[..., 1], e[..., 0]], axis=-1)


def _turned(vector: Float[Array, "p 2"], angle: Float[Array, " p"]) -> Float[Array, "p 2"]:
    c, s = jnp.cos(angle)[:, None], jnp.sin(angle)[:, None]
    return c * vector + s * crossed(vector)


def centres(pads: Pads, place: Place) -> Float[Array, "p 2"]:
    """Of the journal, m, as seen from each pad's centre of curvature."""
    towards = outward(pads.pivot)
    drawn = (pads.preload * pads.clearance)[:, None] * towards
    return place.journal + drawn + (pads.radius * place.tilts)[:, None] * crossed(towards)


def local(pads: Pads, centre: Array, rate: Array, spin: Array) -> tuple[Array, Array]:
    """eps and w of each pad, seen from its middle."""
    eps = _turned(centre / pads.clearance[:, None], -pads.middle)
    return eps, _turned(rate - 0.5 * spin * crossed(centre), -pads.middle)


def unknown(pads: Pads, grid: Grid) -> Known:
    """Before any film was looked at: whole everywhere."""
    count, (n, m) = pads.arc.shape[0], (grid[0] - 1, grid[1])
    nothing = Factors(*(jnp.zeros((count, n, *k)) for k in ((m, m), (m,), (m,))))
    return jnp.ones((count, n, m), bool), nothing


def known_at(
    pads: Pads, place: Place, spin: Array, grid: Grid, first: Bool[Array, "p n m"]
) -> Known:
    """Where the films are whole, of a journal and pads that rest."""
    centre = centres(pads, place)
    eps, w = local(pads, centre, jnp.zeros_like(centre), spin)
    return jax.vmap(lambda pad, e, w, f: whole(pad, e, w, grid, f))(pads.each, eps, w, first)


def pad_forces(
    pads: Pads, centre: Array, rate: Array, spin: Array, grid: Grid, known: Known
) -> Float[Array, "p 2"]:
    """On the journal, N, of each pad; `centre` and `rate` (p, 2) of the journal seen from each, m and m/s."""
    eps, w = local(pads, centre, rate, spin)
    return _pushed(pads, _films(pads, eps, w, grid, known), grid)


def _films(pads: Pads, eps: Array, w: Array, grid: Grid, known: Known) -> Film:
    return jax.vmap(lambda pad, e, w, k: film(pad, e, w, grid, k))(pads.each, eps, w, known)


def _pushed(pads: Pads, found: Film, grid: Grid) -> Float[Array, "p 2"]:
    """On the journal, N, of each pad."""
    each = jax.vmap(lambda pad, f: force(pad, f, grid))(pads.each, found)
    scale = 12 * pads.viscosity * pads.radius**3 * pads.length / pads.clearance**3
    return scale[:, None] * _turned(each, pads.middle)


def _placed(pads: Pads, x: Array) -> Place:
    return Place(pads.unit * x, jnp.zeros_like(pads.arc))


def _missing(
    pads: Pads, x: Array, load: Array, spin: Array, grid: Grid, known: Known
) -> Float[Array, "2"]:
    """What the film does not bear, over the load."""
    centre = centres(pads, _placed(pads, x))
    f = pad_forces(pads, centre, jnp.zeros_like(centre), spin, grid, known)
    return (jnp.sum(f, axis=0) + load) / jnp.sqrt(load @ load)


def balanced(pads: Pads, load: Array, spin: Array, grid: Grid) -> Balance:
    """Equilibrium, by Newton's method; its derivatives are those of the equations that it solves."""
    towards = load / jnp.sqrt(load @ load)
    start = 0.2 * (towards + jnp.sign(spin) * crossed(towards))
    x, known, missed = _found(*jax.lax.stop_gradient((pads, load, spin)), grid, start)

    x = jax.lax.custom_root(
        lambda x: _missing(pads, x, load, spin, grid, known), x, lambda _, x: x, tangent
    )
    return Balance(_placed(pads, x), known, missed)


def _found(pads: Pads, load: Array, spin: Array, grid: Grid, start: Array):
    """In units of the clearance; where the films are whole; how much of the load is missed."""

    def height(x):
        centre = centres(pads, _placed(pads, x))
        eps, _ = local(pads, centre, jnp.zeros_like(centre), spin)
        each = jax.vmap(lambda pad, e: heights(pad, e, grid[0]))(pads.each, eps)
        return each * pads.clearance[:, None]

    def step(carried):
        x, (free, _), _, k = carried
        known = known_at(pads, _placed(pads, x), spin, grid, free)

        def missing(x):
            g = _missing(pads, x, load, spin, grid, known)
            return g, g

        slope, g = jax.jacfwd(missing, has_aux=True)(x)
        move = -jnp.linalg.solve(slope, g)
        h = height(x)
        taken = h - height(x + move)
        most = jnp.min(jnp.where(taken > 0, _THINNER * h / jnp.where(taken > 0, taken, 1.0), 1.0))
        missed = jnp.max(jnp.abs(g))
        met = missed <= _MET
        return jnp.where(met, x, x + jnp.minimum(most, 1.0) * move), known, missed, k + 1

    known = unknown(pads, grid)
    x, known, missed, _ = jax.lax.while_loop(
        lambda c: (c[2] > _MET) & (c[3] < _STEPS), step, (start, known, jnp.array(jnp.inf), 0)
    )
    return x, known, missed


class Slopes(NamedTuple):
    """How the films' forces change with the journal and the pads, (k, k), first the journal's x and y (m),
    then the tilts (rad): the generalized force is `-stiffness d - damping d'`."""

    stiffness: Float[Array, "k k"]
    damping: Float[Array, "k k"]


class Flow(NamedTuple):
    """Of the bearing at rest under its load: `leakage` out of both ends, m³/s; `power` that it takes, W;
    `pressures` (p, n + 1) in the middle of its length, Pa, and `films` (p, n + 1), m, at `angles` (p, n + 1),
    rad from x towards y; `forces` (p, 2) of each pad on the journal, N."""

    leakage: Array
    power: Array
    pressures: Array
    films: Array
    angles: Array
    forces: Array


def looked_at(
    pads: Pads, place: Place, known: Known, loaded: Array, spin: Array, grid: Grid
) -> tuple[Slopes, Flow]:
    """What is felt of small motions of the pads that are `loaded`, (p,), exact there; and the flow."""
    centre = centres(pads, place)

    def moved(by):
        # each pad answers to its own centre alone
        eps, w = local(pads, centre + by[:2], jnp.zeros_like(centre) + by[2:], spin)
        found = _films(pads, eps, w, grid, known)
        f = _pushed(pads, found, grid)
        return f, (eps, w, found, f)

    both, aux = jax.jacfwd(moved, has_aux=True)(jnp.zeros(4))  # (p, 2, 4)
    both = jnp.where(loaded[:, None, None], both, 0.0)
    across = pads.radius * crossed(outward(pads.pivot))

    def gathered(k):
        turned = jnp.einsum("pij,pj->pi", k, across)
        moment = jnp.einsum("pi,pij->pj", across, k)
        own = jnp.einsum("pi,pi->p", across, turned)
        return jnp.block([[jnp.sum(k, axis=0), turned.T], [moment, jnp.diag(own)]])

    found = Slopes(gathered(-both[..., :2]), gathered(-both[..., 2:]))
    return found, _flow(pads, centre, spin, grid, *aux)


def _flow(pads: Pads, centre, spin, grid: Grid, eps, w, found: Film, f) -> Flow:
    out = jax.vmap(lambda pad, f, e, w: leakage(pad, f, e, w, grid))(pads.each, found, eps, w)
    sheared = jax.vmap(lambda pad, f, e: shear(pad, f, e, jnp.sign(spin), grid))(
        pads.each, found, eps
    )
    R, c = pads.radius, pads.clearance
    torque = jnp.sum(pads.viscosity * spin * R**3 * pads.length / c * sheared)
    torque += 0.5 * jnp.sum(f * crossed(centre))
    high = (12 * pads.viscosity * R**2 / c**3)[:, None] * found.pressure[:, :, 0]
    h = jax.vmap(lambda pad, e: heights(pad, e, grid[0]))(pads.each, eps) * c[:, None]
    steps = jnp.arange(grid[0] + 1) / grid[0] - 0.5
    angles = pads.middle[:, None] + pads.arc[:, None] * steps
    return Flow(4 * R**3 / pads.length * jnp.sum(out), torque * spin, high, h, angles, f)
