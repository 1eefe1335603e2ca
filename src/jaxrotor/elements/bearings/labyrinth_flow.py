"""Leakage of a gas through a labyrinth, its swirl in the chambers between the teeth, and what they do to a
rotor that whirls in the middle: one control volume a chamber.

Per metre of circumference tooth i (from 1) lets through, of the pressures before and behind it,

    m_i = mu_i carry_i h sqrt((p_{i-1}² - p_i²)/(R T)),   at most what the throat lets through at Mach 1

(Neumann), with Chaplygin's flow coefficient `mu = pi/(pi + 2 - 5 s + 2 s²)`,
`s = (p_{i-1}/p_i)^((g - 1)/g) - 1`, and Vermes's carry-over of kinetic energy from the tooth before. At one
temperature, V the velocity around the seal and A = (B + h) L the area of a chamber:

    d(rho A)/dt + d(rho V A)/(r dtheta) + m_{i+1} - m_i = 0
    rho A (dV/dt + V dV/(r dtheta)) + m_i (V_i - V_{i-1})
        = -A dp/(r dtheta) + L (a_r tau_r - a_s tau_s),   tau = rho U |U|/2 · 0.079 (D |U|/nu)^-0.25

with U the velocity against the wall, D the hydraulic diameter and a the wall's length over that of the
chamber. A whirl of small amplitude, `x + i y = q exp(i f t)`, makes
`h = clearance - Re(q exp(i (f t - theta)))` and everything of first order as `Re(... exp(i (f t - theta)))`:
a linear system of the chambers, whose pressures give `-F/q = K + f c + i (f C - k)`.

Of Childs & Scharrer (after Iwatsubo) are both balances, Neumann's formula with Chaplygin's coefficient, and
the walls with Blasius's friction. Not of them: the carry-over, Vermes's, which in a whirl stays that of the
mean clearance; the limit at Mach 1, put to every tooth; the friction near rest; and that all laws are
differentiated automatically, for circular whirls of one frequency.

Sources: Childs & Scharrer, J. Eng. Gas Turbines Power 108 (1986) 325; Iwatsubo, NASA CP-2133 (1980) 139;
Vermes, J. Eng. Power 83 (1961) 161; Childs, Turbomachinery Rotordynamics (1993), ch. 5.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .bulk_flow import Coefficients
from .implicit import root

# Newton's steps for the pressures and for the swirl: 2400 seals of all kinds, turned at up to 1e7 rad/s, are
# there after six.
_PRESSURES, _SWIRL = 8, 8
# Of sqrt(R T), some 0.1 m/s: below such a velocity the friction is linear, as that of laminar flow is, so
# that its slopes are finite where a wall and the gas move alike, and curves meet it near rest.
# At 30 m/s it is 4e-6 of the friction.
_SLOW = 3e-4
# The least frequency of a whirl, over the part of a chamber's gas that leaves it in a second.
_LEAST = 1e-4


class Labyrinth(NamedTuple):
    """SI. `gas`: gas constant times temperature; `carry`: of each tooth; `rotor`, `stator`: length of the
    walls of a chamber over its own; `mu`: a flow coefficient in the place of Chaplygin's."""

    radius: Array
    clearance: Array
    pitch: Array
    height: Array
    supply: Array
    sump: Array
    gas: Array
    viscosity: Array
    heat_ratio: Array
    carry: Float[Array, " teeth"]
    rotor: Array
    stator: Array
    mu: Array | None


class Chambers(NamedTuple):
    """`flow`: kg/s per metre of circumference; `pressures`: Pa, of the chambers."""

    flow: Array
    pressures: Float[Array, " n"]


def vermes(clearance: Array, pitch: Array, tooth_width: Array) -> Array:
    """The carry-over of a tooth behind another."""
    carried = 8.52 / ((pitch - tooth_width) / clearance + 7.23)
    return (1 - carried) ** -0.5


def _sonic(seal: Labyrinth) -> tuple[Array, Array]:
    """Ratio of the pressures of a throat at Mach 1, and what it lets through over p h sqrt(1/(R T))."""
    g = seal.heat_ratio
    rise = 1 + (g - 1) / 2
    return rise ** (g / (g - 1)), g**0.5 * rise ** (-(g + 1) / (2 * (g - 1)))


def _mu(seal: Labyrinth, ratio: Array) -> Array:
    """Chaplygin's, or the one given."""
    if seal.mu is not None:
        return jnp.broadcast_to(seal.mu, ratio.shape)
    s = ratio ** (1 - 1 / seal.heat_ratio) - 1
    return jnp.pi / (jnp.pi + 2 - 5 * s + 2 * s**2)


def tooth(seal: Labyrinth, before: Array, behind: Array, gap: Array, carry: Array) -> Array:
    """kg/s per metre of circumference."""
    most, sonic = _sonic(seal)
    through = _mu(seal, jnp.clip(before / behind, 1.0, most)) * (before**2 - behind**2) ** 0.5
    return carry * gap / seal.gas**0.5 * jnp.minimum(through, _mu(seal, most) * sonic * before)


def chambers(seal: Labyrinth) -> Chambers:
    """What flows, and the pressures: of the unknown squares of the pressures and of the flow."""
    most, sonic = _sonic(seal)
    choked = (_mu(seal, most) * sonic * seal.carry) ** -2
    end = (seal.sump / seal.supply) ** 2

    def both(x: Array) -> tuple[Array, Array]:
        squares = jnp.concatenate([jnp.ones(1), x[:-1], end[None]])
        return squares[:-1], squares[1:]

    def left(x: Array) -> Array:
        before, behind = both(x)
        # far from the root a square may be negative
        ratio = before / jnp.maximum(behind, 1e-3 * before)
        through = (_mu(seal, jnp.clip(ratio, 1.0, most**2) ** 0.5) * seal.carry) ** -2
        return before - jnp.maximum(behind + x[-1] * through, x[-1] * choked)

    # with one flow coefficient the squares fall by as much at each tooth
    falls = jnp.cumsum(seal.carry**-2)
    start = 1 - (1 - end) * falls / falls[-1]
    flow = (1 - end) / falls[-1] * (0.4 if seal.mu is None else seal.mu**2)
    x = root(left, start.at[-1].set(flow), _PRESSURES)
    # (Mach 1 in a tooth takes the pressures behind it for what they are)
    flow = x[-1] ** 0.5 * seal.clearance * seal.supply / seal.gas**0.5
    return Chambers(flow, x[:-1] ** 0.5 * seal.supply)


def _drag(seal: Labyrinth, pressure: Array, velocity: Array, speed: Array, gap: Array) -> Array:
    """L (a_s tau_s - a_r tau_r), N per metre of circumference, that slows the gas of a chamber down."""
    B = seal.height + gap
    D = 2 * B * seal.pitch / (B + seal.pitch)

    def at(against: Array) -> Array:
        square = against**2 + _SLOW**2 * seal.gas
        return square**0.375 * against

    factor = 0.0395 * (pressure / seal.gas) ** 0.75 * (seal.viscosity / D) ** 0.25 * seal.pitch
    return factor * (seal.stator * at(velocity) + seal.rotor * at(velocity - seal.radius * speed))


def swirl(seal: Labyrinth, at: Chambers, entry: Array, speed: Array) -> Float[Array, " n"]:
    """Velocity around the seal in each chamber, m/s; `entry`: before the first tooth."""
    # where friction alone counts
    share = (seal.rotor / seal.stator) ** (4 / 7)
    settled = seal.radius * speed * share / (1 + share)
    size = seal.gas**0.5

    def left(x: Array) -> Array:
        v = size * x
        come = jnp.concatenate([entry[None], v[:-1]])
        drag = _drag(seal, at.pressures, v, speed, seal.clearance)
        return (v - come + drag / at.flow) / size

    return size * root(left, jnp.full(at.pressures.shape, settled / size), _SWIRL)


def gas_coefficients(
    seal: Labyrinth, at: Chambers, velocity: Array, entry: Array, speed: Array, whirl: Array
) -> Coefficients:
    """Of whirls with and against the turning at one frequency, rad/s."""
    # the part of a chamber's gas that leaves it in a second, where that is least
    exchange = at.flow * seal.gas / (at.pressures[0] * (seal.height + seal.clearance) * seal.pitch)
    f = (whirl**2 + (_LEAST * exchange) ** 2) ** 0.5
    ahead, back = jax.vmap(lambda f: _impedance(seal, at, velocity, entry, speed, f))(
        f * np.array([1.0, -1.0])
    )
    mean, odd = (ahead + back) / 2, (ahead - back) / (2 * f)
    return Coefficients(mean.real, -mean.imag, odd.imag, odd.real)


def _impedance(
    seal: Labyrinth, at: Chambers, V: Array, entry: Array, speed: Array, whirl: Array
) -> Array:
    """`-F/q`; `whirl`, rad/s, positive towards +phi. Unknown are the chambers' pressures and velocities."""
    p, m, r, L, h = at.pressures, at.flow, seal.radius, seal.pitch, seal.clearance
    A, density = (seal.height + h) * L, p / seal.gas
    each = jnp.concatenate([seal.supply[None], p]), jnp.concatenate([p, seal.sump[None]])
    by_tooth = jax.vmap(jax.grad(tooth, argnums=(1, 2, 3)), in_axes=(None, 0, 0, None, 0))
    by_before, by_behind, by_gap = by_tooth(seal, *each, h, seal.carry)
    by_wall = jax.vmap(jax.grad(_drag, argnums=(1, 2, 4)), in_axes=(None, 0, 0, None, None))
    drag_p, drag_v, drag_h = by_wall(seal, p, V, speed, h)
    seen = 1j * (whirl - V / r)
    gained = V - jnp.concatenate([entry[None], V[:-1]])

    # what a tooth lets through by the pressures: rows of the tooth before each chamber, and of that behind
    n = len(p)
    flows = jnp.zeros((n + 1, n + 2)).at[np.arange(n + 1), np.arange(n + 1)].set(by_before)
    flows = flows.at[np.arange(n + 1), np.arange(1, n + 2)].set(by_behind)[:, 1:-1]
    into, out = flows[:-1], flows[1:]
    from_before = jnp.eye(n, k=-1)
    system = jnp.block(
        [
            [out - into + jnp.diag(A / seal.gas * seen), jnp.diag(-1j / r * density * A)],
            [
                gained[:, None] * into + jnp.diag(drag_p - 1j * A / r),
                jnp.diag(density * A * seen + m + drag_v) - m * from_before,
            ],
        ]
    )
    # the gap where the rotor has gone is narrower by q
    by_gaps = jnp.concatenate(
        [density * L * seen + by_gap[1:] - by_gap[:-1], gained * by_gap[:-1] + drag_h]
    )
    x = jnp.linalg.solve(system, by_gaps)
    return jnp.pi * r * L * jnp.sum(x[:n])
