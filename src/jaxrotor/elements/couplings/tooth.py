"""The form of an involute tooth cut by a rack, and how far it yields where it is pressed.

All of a spur tooth, in a plane across the axis; for a helical one, the normal section. Loads and compliances
are per length of tooth. A place on the flank is told by `u`, the tangent of the pressure angle there: its
distance along the line of action from the base circle is `base u`.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
# Steps to where the load's line crosses the middle of the tooth; two of them are differentiated.
_STEPS = 6


class Tooth(NamedTuple):
    """A tooth by the rack that cuts it; lengths in m.

    `half`: half the angle that the tooth takes up on the base circle, rad. `depth`: of the middle of the
    rack's rounded corner below the rolling line; `aside`: of it from the middle of the rack's tooth.
    """

    base: Array
    reference: Array
    pitch: Array  # half of the angular pitch, rad
    half: Array
    pressure: Array
    corner: Array
    depth: Array
    aside: Array

    def flank(self, u: Array) -> tuple[Array, Array]:
        """Half thickness, and height over the axis of the gear, of the involute."""
        turn = u - self.half
        x = self.base * (u * jnp.cos(turn) - jnp.sin(turn))
        return x, self.base * (u * jnp.sin(turn) + jnp.cos(turn))

    def fillet(self, normal: Array) -> tuple[Array, Array]:
        """The same of the fillet, the trochoid of the rack's corner: `normal` is the angle between the normal
        of its surface and the rolling line, from the pressure angle to a right angle at the root circle."""
        across = self.depth / jnp.tan(normal)
        x = across + self.corner * jnp.cos(normal)
        y = self.reference - self.depth - self.corner * jnp.sin(normal)
        turn = self.pitch + (across - self.aside) / self.reference
        return y * jnp.sin(turn) - x * jnp.cos(turn), y * jnp.cos(turn) + x * jnp.sin(turn)

    @property
    def first(self) -> Array:
        """u where the involute begins, at the fillet; negative where the rack undercuts the tooth."""
        used = self.reference * jnp.sin(self.pressure)
        return (used - self.depth / jnp.sin(self.pressure) - self.corner) / self.base

    @property
    def root(self) -> tuple[Array, Array]:
        """Half thickness and height where the fillet meets the root circle."""
        turn = self.pitch - self.aside / self.reference
        radius = self.reference - self.depth - self.corner
        return radius * jnp.sin(turn), radius * jnp.cos(turn)


def cut(
    teeth: Array, module: Array, pressure: Array, shift: Array, dedendum: Array, corner: Array
) -> Tooth:
    """Pressure angle rad; profile shift, dedendum and corner radius of the rack in modules."""
    reference, tan = 0.5 * module * teeth, jnp.tan(pressure)
    half = (jnp.pi / 2 + 2 * shift * tan) / teeth + tan - pressure
    return Tooth(
        reference * jnp.cos(pressure),
        reference,
        jnp.pi / teeth,
        half,
        pressure,
        corner * module,
        (dedendum - corner - shift) * module,
        module * (jnp.pi / 4 - dedendum * tan)
        - module * corner * (1 - jnp.sin(pressure)) / jnp.cos(pressure),
    )


def crossing(tooth: Tooth, u: Array) -> Array:
    """u of where the flank is as high as where the normal from `u` crosses the middle of the tooth."""
    height = tooth.base / jnp.cos(u - tooth.half)

    def step(at: Array, tooth: Tooth, height: Array) -> Array:
        slope = tooth.base * at * jnp.cos(at - tooth.half)
        return at - (tooth.flank(at)[1] - height) / slope

    still, level = jax.lax.stop_gradient((tooth, height))
    at = jax.lax.stop_gradient(u)
    for _ in range(_STEPS):
        at = step(at, still, level)
    return step(step(at, tooth, height), tooth, height)


def bending_and_shear(tooth: Tooth, u: Array) -> tuple[Array, Array]:
    """`integral (h - y)²/(2x)³ dy` and `integral dy/(2x)` from the root to `h`, where the load's line crosses
    the middle of the tooth; x is the half thickness.

    Where that lies below the end of the involute (low contacts on large gears) the involute is followed down
    in place of the fillet, to which it is tangent.
    """
    turn = u - tooth.half
    height = tooth.base / jnp.cos(turn)
    to = crossing(tooth, u)

    def over(low: Array, high: Array, curve, slope) -> tuple[Array, Array]:
        middle, span = 0.5 * (low + high), 0.5 * (high - low)
        at = middle + span * _NODES
        x, y = curve(at)
        dy = slope(at) * span * _WEIGHTS / (2 * x)
        return jnp.sum(dy * ((height - y) / (2 * x)) ** 2), jnp.sum(dy)

    def rise(at: Array) -> Array:
        one = jnp.ones_like(at)
        return jax.jvp(lambda g: tooth.fillet(g)[1], (at,), (one,))[1]

    root = over(jnp.asarray(jnp.pi / 2), tooth.pressure, tooth.fillet, rise)
    flank = over(
        tooth.first, to, tooth.flank, lambda at: tooth.base * at * jnp.cos(at - tooth.half)
    )
    return root[0] + flank[0], root[1] + flank[1]


def tooth_compliance(tooth: Tooth, u: Array, poisson: Array, bore: Array | None) -> Array:
    """Deflection along the load's line by the load per length of tooth, times Young's modulus: bending, shear
    and compression of the tooth and what gives beneath it; without the flattening at the contact.

    `bore`: radius, m, of a gear that is a ring (Sainsot, Velex & Duverger, J. Mech. Des. 126 (2004) 748);
    `None`: a half-plane beneath the tooth (Weber & Banaschek, Schriftenreihe Antriebstechnik 11 (1953)).
    """
    turn = u - tooth.half
    bending, shear = bending_and_shear(tooth, u)
    tan2 = jnp.tan(turn) ** 2
    strain = 1 - poisson**2
    own = 12 * strain * bending + (2.4 * (1 + poisson) + strain * tan2) * shear
    x, y = tooth.root
    arm = (tooth.base / jnp.cos(turn) - y) / (2 * x)
    body = half_plane(arm, tan2, poisson) if bore is None else ring(tooth, arm, tan2, bore)
    return jnp.cos(turn) ** 2 * (own + body)


def half_plane(arm: Array, tan2: Array, poisson: Array) -> Array:
    """Weber & Banaschek's `5.2 a² + a + 1.4 (1 + 0.294 tan²)`, for any Poisson's ratio."""
    give = 18 / jnp.pi * arm**2 + 2 * (1 - 2 * poisson) / (1 - poisson) * arm
    give += 4.8 / jnp.pi * (1 + (1 - poisson) / 2.4 * tan2)
    return (1 - poisson**2) * give


# Rows L, M, P, Q of Sainsot, Velex & Duverger's table; of 1/t², h², h/t, 1/t, h, 1.
_RING = np.array(
    [
        [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
        [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
        [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
        [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904],
    ]
)


def ring(tooth: Tooth, arm: Array, tan2: Array, bore: Array) -> Array:
    """Of a ring between its bore and its root circle."""
    x, y = tooth.root
    t, h = jnp.arctan2(x, y), jnp.hypot(x, y) / bore
    L, M, P, Q = _RING @ jnp.stack([1 / t**2, h**2, h / t, 1 / t, h, jnp.ones_like(t)])
    # their tooth is as wide at its root as the arc there, ours as its chord: less than 1 in 1000 apart
    return L * arm**2 + M * arm + P * (1 + Q * tan2)


def flattening(teeth: tuple[Tooth, Tooth], u: tuple[Array, Array], load: Array, poisson: Array):
    """Hertz's approach of both teeth's middles by the load per length, times Young's modulus over that load.
    `load`: per length and over Young's modulus, m. Source: Weber & Banaschek (1953), after Föppl."""
    rho = [tooth.base * at for tooth, at in zip(teeth, u)]
    strain = 1 - poisson**2
    width = jnp.sqrt(8 / jnp.pi * strain * load * rho[0] * rho[1] / (rho[0] + rho[1]))
    inward = [r - tooth.base * jnp.tan(at - tooth.half) for tooth, at, r in zip(teeth, u, rho)]
    logs = sum(jnp.log(2 * t / width) for t in inward)
    return 2 / jnp.pi * strain * (logs - poisson / (1 - poisson))
