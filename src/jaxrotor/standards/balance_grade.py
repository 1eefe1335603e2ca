"""Balance quality grades, tolerances in planes, and corrections in holes that are there."""

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..core.arguments import complex_number, number, numbers, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from ..core.result_text import shows
from ..elements.rotors.unbalance import Unbalance
from .finding import Assessment, Finding

SOURCE = "ISO 21940-11:2016 (e_per omega = G; rule as commonly restated, text not seen)"
_POSITIVE = number(above=0.0)
# Combinations of holes and masses that are tried.
_MOST = 2_000_000


@takes(
    mass=number("kg", above=0.0), speed=number("rad/s", above=0.0), grade=number("mm/s", above=0.0)
)
def permissible_unbalance(mass: Any, speed: Any, grade: Any = 2.5) -> Float[Array, ""]:
    """Permissible residual unbalance of a rotor, kg·m (1 g·mm is 1e-6): `grade` (mm/s, 2.5 for G 2.5) over
    the highest speed of service (rad/s), times its mass (kg). Raises `InputError` for what is not positive.
    Source: ISO 21940-11, e_per omega = G."""
    return mass * Unbalance.from_grade(grade, speed).eccentricity


@takes(unbalance=None, planes=numbers("m", size=2), centre=number("m"))
def in_two_planes(unbalance: Any, planes: Any, centre: Any) -> Float[Array, "2"]:
    """A permissible unbalance (kg·m) shared between two planes at `planes` (z, m) by the levers of the mass
    centre at `centre` (z, m): the nearer plane gets the more. With the centre outside the planes one share
    would be negative: then it is refused. Differentiable. Raises `InputError` for planes at one place and
    for such a centre."""
    a, b = jnp.asarray(planes, float)
    where = known(jnp.stack([a, b, jnp.asarray(centre, float)]))
    if where is not None:
        if where[0] == where[1]:
            raise InputError(f"planes: both lie at {where[0]:g} m: two different ones are needed")
        if not min(where[:2]) <= where[2] <= max(where[:2]):
            raise InputError(
                f"centre: {where[2]:g} m lies outside the planes at {where[0]:g} and {where[1]:g} m: levers "
                "share nothing there: give planes on both sides of the mass centre, or tolerances of your own"
            )
    second = (jnp.asarray(centre, float) - a) / (b - a)
    return jnp.asarray(unbalance, float) * jnp.stack([1 - second, second])


@takes(
    residual=None,
    mass=number("kg", above=0.0),
    speed=number("rad/s", above=0.0),
    grade=number("mm/s", above=0.0),
    planes=numbers("m", size=2),
    centre=number("m"),
)
def residual_unbalance(
    residual: Any,
    mass: Any,
    speed: Any,
    grade: Any = 2.5,
    *,
    planes: Any = None,
    centre: Any = None,
) -> Assessment:
    """The amounts (kg·m) of residual unbalance against the grade: one of the whole rotor, or two in `planes`
    (z, m) with the mass centre at `centre`. Raises `InputError` as `permissible_unbalance` and
    `in_two_planes` do, and for a number of amounts that does not fit."""
    amounts = jnp.atleast_1d(jnp.abs(jnp.asarray(residual)))
    whole_ = permissible_unbalance(mass, speed, grade)
    if (planes is None) != (centre is None):
        raise InputError("planes and centre belong together: give both, or neither")
    limits = whole_[None] if planes is None else in_two_planes(whole_, planes, centre)
    if amounts.shape != limits.shape:
        raise InputError(
            f"residual: {limits.size} amount{'s' * (limits.size > 1)} asked for, but {amounts.size} given"
        )
    word = known(grade)
    words = f"residual unbalance, G {float(word):g}" if word is not None else "residual unbalance"
    places = [""] if planes is None else ["plane 1", "plane 2"]
    return Assessment(
        tuple(
            Finding(words, place, 1e6 * value, 1e6 * limit, "at most", "g*mm", SOURCE)
            for place, value, limit in zip(places, amounts, limits)
        )
    )


@shows(masses="kg")
class HoleCorrection(NamedTuple):
    """`masses`: kg in each hole. `left`: what remains, kg·m, complex: wanted less given."""

    masses: Float[Array, " holes"]
    left: Complex[Array, ""]


def _holes(angles: Any, radius: Any) -> Array:
    angles = jnp.asarray(numbers("rad", fewest=2)(angles, "angles"), float)
    radius = jnp.asarray(numbers("m", above=0.0)(radius, "radius"), float)
    if radius.size not in (1, angles.size):
        raise InputError(
            f"radius: one for all holes or one for each of the {angles.size}, but has {radius.size}"
        )
    return radius * jnp.exp(1j * angles)


@takes(correction=complex_number, angles=None, radius=None)
def split_correction(correction: Any, angles: Any, radius: Any) -> HoleCorrection:
    """A correction (kg·m, amount times e^(i angle)) as masses in the two holes that lie next to its
    direction: exact. `angles` (n,): of the holes, rad; `radius`: m, of all or of each.

    Differentiable while it stays between these two. Raises `InputError` where no two holes less than half a
    turn apart enclose the direction."""
    arms = _holes(angles, radius)
    correction = jnp.asarray(correction, complex)
    wanted = known(correction)
    if wanted is None:
        raise InputError("correction: which holes are next is not known under jit and vmap")
    where, direction = np.angle(np.asarray(known(arms))), np.angle(wanted)
    away = np.mod(where - direction + 1e-12, 2 * np.pi)
    k, j = int(np.argmin(away)), int(np.argmax(away))
    if not 1e-9 < (away[k] - away[j]) % (2 * np.pi) < np.pi - 1e-9:
        raise InputError(
            f"angles: no two holes less than half a turn apart enclose {np.rad2deg(direction):.4g} deg: "
            "split another way, or drill there"
        )
    pair = jnp.stack([arms[k], arms[j]])
    matrix = jnp.stack([pair.real, pair.imag])
    found = jnp.linalg.solve(matrix, jnp.stack([correction.real, correction.imag]))
    masses = jnp.zeros(arms.size).at[jnp.array([k, j])].set(jnp.maximum(found, 0.0))
    return HoleCorrection(masses, correction - jnp.sum(masses * arms))


@takes(
    correction=complex_number,
    angles=None,
    radius=None,
    masses=numbers("kg", above=0.0),
    most=whole(1, 4),
)
def fill_holes(
    correction: Any, angles: Any, radius: Any, masses: Sequence[float], most: int = 2
) -> HoleCorrection:
    """The same with pieces of given `masses` (kg), each as often as wanted, one in a hole, in `most` holes at
    most: the combination that leaves least, of all of them; of equal ones that with fewer holes. Numbers, not
    differentiable. Raises `InputError` for so many combinations that they cannot be tried."""
    arms = np.asarray(_holes(angles, radius))
    pieces = np.unique(np.asarray(masses, float))
    wanted = complex(correction)
    best = (abs(wanted), (), ())
    sizes = [
        len(list(itertools.islice(itertools.combinations(range(arms.size), n), _MOST)))
        * pieces.size**n
        for n in range(1, most + 1)
    ]
    if sum(sizes) > _MOST:
        raise InputError(
            f"most: {sum(sizes)} combinations of holes and masses are too many to try: take fewer holes or "
            "masses"
        )
    for n in range(1, min(most, arms.size) + 1):
        chosen = np.array(list(itertools.combinations(range(arms.size), n)))
        filled = np.array(list(itertools.product(pieces, repeat=n)))
        made = np.einsum("hn,mn->hm", arms[chosen], filled)
        away = np.abs(wanted - made)
        h, m = np.unravel_index(np.argmin(away), away.shape)
        if away[h, m] < best[0] * (1 - 1e-9):
            best = (away[h, m], tuple(chosen[h]), tuple(filled[m]))
    found = np.zeros(arms.size)
    found[list(best[1])] = best[2]
    return HoleCorrection(jnp.asarray(found), jnp.asarray(wanted - np.sum(found * arms)))
