"""Starts: the damage of one, how many a shaft stands, and where a synchronous motor meets a mode."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.arguments import number, numbers, positive, text
from ..core.errors import InputError
from ..core.gate import takes
from ..objectives.fatigue import rainflow
from ..simulation.response import Response
from .finding import Assessment, Finding
from .sn_curve import SNCurve

MINER = "Miner's rule over rainflow cycles (ASTM E1049-85), S-N curve as given"


@takes(natural=numbers("rad/s"), synchronous_speed=positive("rad/s"), frequency=positive("Hz"))
def start_resonance(
    natural: float | Float[Array, "..."], synchronous_speed: float, frequency: float
) -> Float[Array, "..."]:
    """The speed (rad/s) at which the pulsating torque of a synchronous motor, `2 frequency (1 - N/Ns)`, meets
    a natural frequency (`natural`, rad/s): `Ns (1 - natural/(4 pi frequency))`. Negative where it never
    does. `frequency`: of the line, Hz. Raises `InputError` for what is not positive."""
    return synchronous_speed * (1 - jnp.asarray(natural) / (4 * jnp.pi * frequency))


@takes(
    torque=numbers("N*m"),
    diameter=positive("m"),
    inner_diameter=number("m", least=0.0),
    concentration=positive(),
)
def shear_stress(
    torque: Float[Array, "..."] | float,
    diameter: Any,
    inner_diameter: Any = 0.0,
    concentration: Any = 1.0,
) -> Float[Array, "..."]:
    """Of a torque (N·m), Pa, at the surface of a round shaft: `16 K T d/(pi (d⁴ - d_i⁴))`. `concentration`:
    the notch's factor K. Raises `InputError` for what is no number."""
    modulus = jnp.pi * (diameter**4 - inner_diameter**4) / (16 * diameter)
    return jnp.asarray(torque) * concentration / modulus


@takes(torque=numbers(), per_torque=number())
def cycle_damage(torque: Any, curve: SNCurve, per_torque: Any = 1.0) -> Float[Array, ""]:
    """Miner's sum over the rainflow cycles of a history, a pure number; 1 is failure.

    `torque`: (n,) samples, 20 a period or more (ranges are 1.2 % short then). `per_torque`: what of the
    curve's quantity a N·m is: `shear_stress(1.0, ...)` for a curve of stress, 1 for one of torque.
    Differentiable by all three: the counting itself is exact but where it changes, where the sum has a kink
    and no jump. Half cycles of what is left count as halves. Raises `InputError` for a history that is no
    row of numbers.
    """
    seen = jnp.asarray(torque) * per_torque
    cycles = rainflow(seen)
    first, last = seen[cycles.first], seen[cycles.last]
    counted = cycles.count > 0
    # powers of 0 have no derivative
    amplitude = 0.5 * jnp.where(counted, jnp.abs(first - last), curve.amplitudes[-1])
    each = curve.damage(amplitude, 0.5 * (first + last))
    return jnp.sum(jnp.where(counted, cycles.count * each, 0.0))


@takes(starts=positive(), per_torque=number())
def starts_allowed(
    torque: Any,
    curve: SNCurve,
    starts: float,
    place: str = "start",
    per_torque: Any = 1.0,
) -> Assessment:
    """How many starts a shaft stands, of `starts` that are asked for.

    `torque`: the history (n,) of one start, N·m, or a pair of a `Response` and the name of a shaft, coupling
    or gear. `curve`, `per_torque`: as for `cycle_damage`. `place`: what the findings call it.

    Findings: the peak torque (for information), the damage of a start (for information), and the starts to
    failure, at least `starts`; infinite where nothing counts. Differentiable (best by the logarithm of the
    starts, which are a power of the torque). Source: Miner, J. Appl. Mech. 12 (1945) 159; ASTM E1049-85.
    Raises `InputError` for a history that is none, and for a part that has no torque.
    """
    if isinstance(torque, tuple) and len(torque) == 2 and isinstance(torque[0], Response):
        response, name = torque
        place = name if place == "start" else place
        torque = shaft_torque(response, name)
    history = jnp.atleast_1d(jnp.asarray(numbers()(torque, "`starts_allowed`: torque"), float))
    damage = cycle_damage(history, curve, per_torque)
    none = damage <= 0
    lasts = jnp.where(none, jnp.inf, 1 / jnp.where(none, 1.0, damage))
    nothing = jnp.asarray(jnp.nan)
    return Assessment(
        (
            Finding(
                "peak torque",
                place,
                jnp.max(jnp.abs(history)),
                nothing,
                "for information",
                "N*m",
                "",
            ),
            Finding("damage of a start", place, damage, nothing, "for information", "", MINER),
            Finding(
                "starts to failure", place, lasts, jnp.asarray(float(starts)), "at least", "", MINER
            ),
        )
    )


@takes(name=text)
def shaft_torque(response: Response, name: str) -> Float[Array, " nt"]:
    """Torque in a shaft, coupling or gear over a run, N·m; of a gear that upon its first wheel. Raises
    `InputError` for a part that has none."""
    part = response[name]
    if "torque" in part.signals():
        return part.torque
    if "tooth_force" in part.signals():
        # the force ON the first wheel brakes it where it drives
        return -part.forces[:, 0, 5]
    raise InputError(f"`{name}`: has no torque in it: name a shaft, a coupling or a gear")
