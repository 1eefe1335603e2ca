"""The oil film of a short bearing in closed form, cavitated or not.

Reynolds' equation for a film much shorter than its circumference, `d/dz (h³ dp/dz) = 12 mu h'`, where h' is
what the film's height changes by as seen from a frame that turns at the mean speed of the two surfaces: so
the journal's motion counts by `w = e' - (spin/2) z × e` alone. With `p = 0` at both ends and everything
integrated along the bearing, the force on the journal is

    F = -(mu R L³ / c³) int (w·n) n / (1 - eps·n)³ dtheta,     eps = e/c, n = (cos theta, sin theta),

over all angles (full film) or where `w·n > 0`, that is where the pressure is above ambient (half
Sommerfeld's or Guembel's condition, cavitated). Sommerfeld's substitution makes all of it elementary.
Sources: Ocvirk, NACA TN 2808 (1952); Booker, J. Basic Eng. 87 (1965) 537; Szeri, Fluid Film Lubrication,
2nd ed. (2011), ch. 3.
"""

import functools
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

# Where the journal is nearer to the centre (as part of the clearance) it is moved this far below it: there
# the direction towards it has no derivative, though the force does.
_CENTRE = 1e-8


def short_film(eps: Float[Array, "2"], w: Float[Array, "2"], cavitated: bool) -> Float[Array, "2"]:
    """Force on the journal over `mu R L³/c³`, in the unit of `w` (any); NaN from `|eps| = 1` on."""
    square = eps @ eps
    central = square < _CENTRE**2
    eps = jnp.where(central, jnp.array([0.0, -_CENTRE]), eps) + jnp.where(central, eps, 0.0)
    e = jnp.sqrt(eps @ eps)
    radial = eps / e
    along = jnp.stack([-radial[1], radial[0]])
    wr, wt = w @ radial, w @ along
    narrow = 1 - e**2
    rr, rt, tt = _cavitated(e, narrow, wr, wt) if cavitated else _full(e)
    fr = rr / narrow**2.5 * wr + rt / narrow**2 * wt
    ft = rt / narrow**2 * wr + tt / narrow**1.5 * wt
    return -(fr * radial + ft * along)


def _full(e: Array) -> tuple[Array, Array, Array]:
    return jnp.pi * (1 + 2 * e**2), jnp.zeros_like(e), jnp.pi * jnp.ones_like(e)


def _cavitated(e: Array, narrow: Array, wr: Array, wt: Array) -> tuple[Array, Array, Array]:
    """Over the half circle about the direction of w, from the angle x1 to x2 of Sommerfeld's."""
    square = wr**2 + wt**2
    moving = square > 0
    size = jnp.sqrt(jnp.where(moving, square, 1.0))
    cosine, sine = jnp.where(moving, wr / size, 1.0), jnp.where(moving, wt / size, 0.0)
    # theta1 = angle of w - pi/2, theta2 = + pi/2; (c1, s1) and (c2, s2) are the cosine and sine of x1 and x2
    c1, s1 = _substituted(sine, -cosine, e, narrow)
    c2, s2 = _substituted(-sine, cosine, e, narrow)
    # the arc's length, between 0 and 2 pi
    arc = jnp.arctan2(-(s2 * c1 - c2 * s1), -(c2 * c1 + s2 * s1)) + jnp.pi
    half = 0.5 * (s2 * c2 - s1 * c1)  # of sin 2x / 4
    rr = (0.5 + e**2) * arc + half + 2 * e * (s2 - s1)
    rt = 0.5 * (s2**2 - s1**2) - e * (c2 - c1)
    tt = 0.5 * arc - half
    return rr, rt, tt


def _substituted(cosine: Array, sine: Array, e: Array, narrow: Array) -> tuple[Array, Array]:
    """Sommerfeld's angle x for theta: `1 - e cos theta = (1 - e²)/(1 + e cos x)`."""
    thickness = 1 - e * cosine
    return (cosine - e) / thickness, jnp.sqrt(narrow) * sine / thickness


# The film of finite length, fitted by experiments/finite_film.py: degrees of the polynomials in s and in
# the length, and harmonics of the direction; for ratios of eccentricity up to this one and lengths (over
# the diameter) between.
DEGREES = (8, 5, 8)
LARGEST_RATIO = 0.95
LENGTHS = (0.1, 1.25)
_TABLE = Path(__file__).with_name("finite_film.npz")


@functools.cache
def _coefficients() -> tuple[np.ndarray, np.ndarray]:
    with np.load(_TABLE) as table:
        return table["even"], table["odd"]


def finite_film(
    eps: Float[Array, "2"], w: Float[Array, "2"], slenderness: Float[Array, ""]
) -> Float[Array, "2"]:
    """Force on the journal over `mu R L³/c³` for a length of `slenderness` diameters, cavitated: the short
    film's, less what leaves a pressure spread around the journal, turned a little. Fitted to solutions of
    Reynolds' equation within 4 %; beyond an eccentricity ratio of 0.95 with the factor there."""
    even, odd = _coefficients()
    e2, w2 = eps @ eps, w @ w
    far = e2 > LARGEST_RATIO**2
    inside = jnp.where(far, LARGEST_RATIO / jnp.sqrt(jnp.where(far, e2, 1.0)), 1.0) * eps
    moving = w2 > 0
    direction = jnp.where(moving, w, eps) / jnp.sqrt(jnp.where(moving, w2, 1.0))
    along, across = inside @ direction, inside[0] * direction[1] - inside[1] * direction[0]
    on_even, on_odd = finite_basis(inside @ inside, slenderness, along, across)
    factor = jnp.exp(jnp.sum(on_even * even))
    turn = jnp.sum(on_odd * odd)
    f = factor * short_film(eps, w, True)
    c, s = jnp.cos(turn), jnp.sin(turn)
    return jnp.stack([c * f[0] - s * f[1], s * f[0] + c * f[1]])


def finite_basis(e2: Array, slenderness: Array, along: Array, across: Array) -> tuple[Array, Array]:
    """What the logarithm of the force ratio is made of: (s, length, k) for `eps^k cos k alpha`, k from 0,
    and for `eps^k sin k alpha`, k from 1. `e2` is eps², `along` eps cos alpha and `across` eps sin alpha:
    smooth where the journal is in the middle."""
    first, second, harmonics = DEGREES
    least = np.sqrt(1 - LARGEST_RATIO**2)
    s = _polynomials((2 * jnp.sqrt(1 - e2) - 1 - least) / (1 - least), first)
    length = _polynomials((2 * slenderness - sum(LENGTHS)) / (LENGTHS[1] - LENGTHS[0]), second)
    x, y = [jnp.ones_like(e2)], [jnp.zeros_like(e2)]
    for _ in range(harmonics):
        x, y = (
            [*x, x[-1] * along - y[-1] * across],
            [*y, x[-1] * across + y[-1] * along],
        )
    both = s[:, None, None] * length[None, :, None]
    return both * jnp.stack(x), both * jnp.stack(y[1:])


def _polynomials(x: Array, degree: int) -> Array:
    """Chebyshev's, from 0 to `degree`."""
    found = [jnp.ones_like(x), x]
    for _ in range(degree - 1):
        found.append(2 * x * found[-1] - found[-2])
    return jnp.stack(found)
