"""What the pairs of teeth that touch at once do together: stiffness and transmission error over a mesh."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.result_text import shows
from .line_of_action import Contact

# Pairs that may touch beside the one nearest to the pitch point, and slices of the face width.
_BESIDE, _SLICES = 3, 64
# Newton's steps to the approach under a load: each lets go of teeth that do not touch, and none comes back.
_STEPS = 12

# Stiffness of one pair per length of contact, N/m², at a place on the line of action.
Line = Callable[[Array], Array]


@shows(mean="N/m", amplitudes="", phases="rad")
class MeshStiffness(NamedTuple):
    """Stiffness along the flanks' normal, N/m, over the mesh angle, teeth times the angle of gear a:
    `mean (1 + sum amplitudes_k cos(k angle + phases_k))`. At angle zero a pair touches at the pitch point."""

    mean: Float[Array, ""]
    amplitudes: Float[Array, " n"]
    phases: Float[Array, " n"]


@shows(angles="rad", stiffness="N/m", error="m", transmission_error="m")
class LoadedMesh(NamedTuple):
    """Gears under a steady tooth force, at mesh angles (rad, teeth times the angle of gear a).

    `stiffness`, N/m, of the teeth that touch; `error`, m: how far relieved flanks let the gears come together
    before these touch, in their mean by stiffness; `transmission_error`, m: how far gear a leads, measured
    along the flanks' normal, `force/stiffness + error`.
    """

    angles: Float[Array, " n"]
    stiffness: Float[Array, " n"]
    error: Float[Array, " n"]
    transmission_error: Float[Array, " n"]


def touching(meet: Contact, width: Array, line: Line, angle: Array) -> tuple[Array, Array]:
    """Stiffness (N/m, zero beyond the path) and place (m) of each pair in each slice of the face."""
    slices = (jnp.arange(_SLICES) + 0.5) / _SLICES - 0.5
    shift = slices * width * jnp.tan(meet.base_helix)
    at = (angle / (2 * jnp.pi) * meet.base_pitch + shift)[:, None]
    at = at - meet.base_pitch * jnp.round(at / meet.base_pitch)
    at = jnp.ravel(at + meet.base_pitch * jnp.arange(-_BESIDE, _BESIDE + 1))
    inside = jnp.clip(at, meet.first, meet.last)
    length = width / jnp.cos(meet.base_helix) / _SLICES
    each = length * jax.vmap(line)(inside)
    # a slice of a helical tooth comes and goes bit by bit, a spur tooth at once
    span = width * jnp.abs(jnp.tan(meet.base_helix)) / _SLICES
    within = jnp.minimum(at + 0.5 * span, meet.last) - jnp.maximum(at - 0.5 * span, meet.first)
    part = jnp.clip(within / jnp.where(span > 0, span, 1.0), 0.0, 1.0)
    part = jnp.where(span > 0, part, (at >= meet.first) & (at <= meet.last))
    return each * part, inside


def over_angles(meet: Contact, width: Array, line: Line, angles: Array) -> Array:
    """Stiffness of all that touch, flanks without relief."""
    one = lambda angle: jnp.sum(touching(meet, width, line, angle)[0])  # noqa: E731
    return jax.lax.map(one, angles)


def loaded(
    meet: Contact,
    width: Array,
    line: Line,
    gap: Callable[[Array], Array],
    force: Array,
    angles: Array,
) -> LoadedMesh:
    """`gap`: what relief takes off both flanks at a place, m."""

    def one(angle: Array) -> tuple[Array, ...]:
        k, at = touching(meet, width, line, angle)
        g = gap(at)
        still, open_ = jax.lax.stop_gradient((k, g))

        def closer(_, found: Array) -> Array:
            on = jnp.where(found > open_, still, 0.0)
            return (jax.lax.stop_gradient(force) + on @ open_) / jnp.sum(on)

        # from where all touch: the force over the approach is convex, so each step ends beyond the root
        start = jax.lax.stop_gradient(force) / jnp.sum(still) + jnp.max(
            jnp.where(still > 0, open_, 0.0)
        )
        found = jax.lax.fori_loop(0, _STEPS, closer, start)
        on = jnp.where(found > open_, k, 0.0)
        stiffness = jnp.sum(on)
        error = on @ g / stiffness
        return stiffness, error, force / stiffness + error

    return LoadedMesh(angles, *jax.lax.map(one, angles))


def harmonics(values: Array, count: int) -> tuple[Array, Array, Array]:
    """Mean, amplitudes and phases of what is given at evenly spaced angles from zero."""
    found = jnp.fft.rfft(values) / values.shape[0]
    waves = 2 * found[1 : count + 1]
    # a wave that is nothing has a phase of no slope
    none = jnp.abs(waves.real) + jnp.abs(waves.imag) == 0
    real = jnp.where(none, 1.0, waves.real)
    imaginary = jnp.where(none, 0.0, waves.imag)
    size = jnp.where(none, 0.0, jnp.hypot(real, imaginary))
    return found[0].real, size, jnp.arctan2(imaginary, real)


def added(a: tuple[Array, Array], b: tuple[Array, Array]) -> tuple[Array, Array]:
    """Amplitudes and phases of the sum of two sets of harmonics."""
    count = max(a[0].shape[0], b[0].shape[0])
    if not min(a[0].shape[0], b[0].shape[0]):
        return a if a[0].shape[0] else b
    real, imaginary = (
        sum(jnp.pad(size * f(phase), (0, count - size.shape[0])) for size, phase in (a, b))
        for f in (jnp.cos, jnp.sin)
    )
    none = jnp.abs(real) + jnp.abs(imaginary) == 0
    real = jnp.where(none, 1.0, real)
    size = jnp.where(none, 0.0, jnp.hypot(real, imaginary))
    return size, jnp.arctan2(imaginary, real)
