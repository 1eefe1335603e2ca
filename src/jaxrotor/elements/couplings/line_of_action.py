"""Where the teeth of two involute gears touch. Source: ISO 21771."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array

# Newton's steps to the working pressure angle; the last two are differentiated.
_STEPS = 8


class Contact(NamedTuple):
    """How two gears meet, in the transverse plane: angles rad, lengths m. Places on the line of action are
    told from the pitch point, positive toward the tip of gear a: from `first` to `last` teeth touch."""

    pressure: Array
    base_helix: Array
    bases: Array
    base_pitch: Array
    first: Array
    last: Array

    @property
    def ratio(self) -> Array:
        """Transverse contact ratio."""
        return (self.last - self.first) / self.base_pitch

    def reach(self, at: Array) -> Array:
        """From where the line of action leaves the base circle of each gear, (2, ...)."""
        a, b = self.bases * jnp.tan(self.pressure)
        return jnp.stack([a + at, b - at])


def contact(
    teeth: Array,
    module: Array,
    pressure_angle: Array,
    helix_angle: Array,
    shifts: Array,
    addenda: Array,
    distance: Array | None,
) -> Contact:
    """Module and pressure angle of the normal section; shifts and addenda in modules."""
    helix = jnp.cos(helix_angle)
    pressure = jnp.arctan(jnp.tan(pressure_angle) / helix)
    radii = 0.5 * module / helix * teeth
    if distance is None:
        shifted = 2 * jnp.sum(shifts) / jnp.sum(teeth)
        involute = jnp.tan(pressure) - pressure + shifted * jnp.tan(pressure_angle)
        working = _angle_of(involute, pressure)
    else:
        working = jnp.arccos(jnp.sum(radii) / distance * jnp.cos(pressure))
    bases = radii * jnp.cos(pressure)
    tips = radii + (addenda + shifts) * module
    ends = jnp.sqrt(tips**2 - bases**2) - bases * jnp.tan(working)
    return Contact(
        working,
        jnp.arctan(jnp.tan(helix_angle) * jnp.cos(pressure)),
        bases,
        jnp.pi * module / helix * jnp.cos(pressure),
        -ends[1],
        ends[0],
    )


def _angle_of(involute: Array, start: Array) -> Array:
    """The angle a whose `tan a - a` it is."""
    at, still = jax.lax.stop_gradient((start, involute))
    for k in range(_STEPS):
        value = involute if k >= _STEPS - 2 else still
        at = at - (jnp.tan(at) - at - value) / jnp.tan(at) ** 2
    return at
