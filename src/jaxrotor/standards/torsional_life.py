"""Where the torsional separation is not met: the stress at the meeting, and how long the shaft stands it."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.arguments import number, positive, text, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from ..elements.shafts.section import Shaft
from ..linear.response import frequency_response
from ..linear.torsion import torque_carriers
from ..machine.machine import Machine
from ..machine.wiring import unknown
from .finding import Assessment, Finding
from .sn_curve import SNCurve
from .starts import shear_stress
from .torsional import TorsionalExcitation, excitation_bands, natural_torsion, speed_range

_SOURCE = "forced response of the linear machine, S-N curve as given"
_HOUR = 3600.0


@shows(frequency="rad/s as Hz", speed="rad/s", torque="N*m")
class Met(NamedTuple):
    """`frequency`: rad/s, at which an excitation is nearest to a mode; `speed`: of the driven shaft there,
    rad/s; `torque`: amplitude in the shaft, N·m."""

    frequency: Float[Array, ""]
    speed: Float[Array, ""]
    torque: Float[Array, ""]


@takes(torque=number("N*m"), station=text, shaft=text, mode=whole(1))
def torque_at_meeting(
    machine: Machine,
    excitation: TorsionalExcitation,
    torque: Any,
    station: str,
    shaft: str,
    speeds: tuple[float, float],
    mode: int = 1,
    at: Any = "undeformed",
) -> Met:
    """Amplitude of the torque in a shaft, coupling or gear where an excitation is nearest to a mode.

    - `torque`: amplitude of the exciting torque, N·m, on `station`. - `shaft`: whose torque is asked for; of
      a gear that upon its first wheel. - `mode`: 1 is the lowest.
    - `speeds`: (low, high) of the driven shaft, rad/s. Where the mode's frequency lies within what the
      excitation runs through, it is met there; else at the nearer end.

    The machine's own damping is all there is: without any the torque has no bound. Differentiable by every
    parameter. Raises `InputError` for names that the machine does not have, speeds that are no range, and a
    mode that is not there.
    """
    low, high = speed_range(speeds)
    carriers = torque_carriers(machine)
    if shaft not in carriers or "torque" not in carriers[shaft]:
        raise InputError(f"shaft: {unknown('shaft, coupling or gear', shaft, tuple(carriers))}")
    if station not in machine.wiring.stations:
        raise InputError(f"station: {unknown('station', station, machine.wiring.stations)}")
    band = excitation_bands(machine, (excitation,), (low, high))[0]
    found = natural_torsion(machine, 0.5 * (low + high), at)
    if mode > found.size:
        raise InputError(f"mode: there are {found.size} torsional motions, but mode is {mode}")
    w = jnp.clip(found[mode - 1], band[0], band[1])
    fixed = excitation.frequency > 0
    speed = jnp.asarray(0.5 * (low + high)) if fixed else low * w / band[0]
    output, factor = carriers[shaft]["torque"]
    there = frequency_response(machine, f"{station}.phi", output, w[None], speed, at=at)
    # a root of the squares, which has a derivative
    value = there.values[0, 0, 0] * factor * torque
    return Met(w, speed, jnp.abs(value))


@takes(
    hours=positive("h"),
    mode=whole(1),
    diameter=positive("m"),
    inner_diameter=number("m", least=0.0),
    concentration=positive(),
    mean_torque=number("N*m"),
)
def torsional_life(
    machine: Machine,
    excitation: TorsionalExcitation,
    torque: Any,
    station: str,
    shaft: str,
    speeds: tuple[float, float],
    curve: SNCurve,
    hours: float,
    mode: int = 1,
    diameter: Any = None,
    inner_diameter: Any = 0.0,
    concentration: Any = 1.0,
    mean_torque: Any = 0.0,
    at: Any = "undeformed",
) -> Assessment:
    """What a shaft bears that runs for `hours` where an excitation is nearest to a mode: amplitude against
    that which the curve allows for so many cycles, and the life, h.

    The first arguments are those of `torque_at_meeting`. `curve`: of stress (Pa) or of torque (N·m, as a
    coupling's maker gives it). For stress: `diameter`, `inner_diameter` (m; left out, those of a `Shaft`) and
    the notch's factor `concentration`. `mean_torque`: the steady one, which counts where the curve has an
    `ultimate`.

    Differentiable by every parameter. The formulas are those of textbooks: `16 T d/(pi (d⁴ - d_i⁴))`, the S-N
    line, Goodman. Raises `InputError` where the diameter is missing, and for what `torque_at_meeting`
    refuses.
    """
    met = torque_at_meeting(machine, excitation, torque, station, shaft, speeds, mode, at)
    per = stress_per_torque(machine, shaft, curve, diameter, inner_diameter, concentration)
    amplitude, mean = met.torque * per, jnp.abs(jnp.asarray(mean_torque) * per)
    cycles = hours * _HOUR * met.frequency / (2 * jnp.pi)
    allowed = curve.allowed(cycles)
    if curve.ultimate is not None:
        allowed = allowed * jnp.maximum(1 - mean / curve.ultimate, 0.0)
    damage = curve.damage(amplitude, mean)
    some = damage > 0
    rate = jnp.where(some, damage, 1.0) * met.frequency / (2 * jnp.pi)
    life = jnp.where(some, 1 / (rate * _HOUR), jnp.inf)
    place = f"{shaft}, torsional {mode} by {excitation.name}"
    kind = "shear stress amplitude" if curve.of == "stress" else "torque amplitude"
    return Assessment(
        (
            Finding(kind, place, amplitude, allowed, "at most", curve.unit, _SOURCE),
            Finding(
                "torsional life", place, life, jnp.asarray(float(hours)), "at least", "h", _SOURCE
            ),
        )
    )


def stress_per_torque(
    machine: Machine,
    shaft: str,
    curve: SNCurve,
    diameter: Any = None,
    inner_diameter: Any = 0.0,
    concentration: Any = 1.0,
) -> Any:
    """What of the curve's quantity a N·m in the shaft is: 1 for a curve of torque, Pa for one of stress.
    Raises `InputError` where the diameter is missing."""
    if curve.of == "torque":
        return jnp.asarray(concentration, float)
    if diameter is None:
        element = machine.elements().get(shaft)
        if not isinstance(element, Shaft):
            raise InputError(
                f"`{shaft}`: is no plain Shaft: give the diameter at which its stress is asked for, "
                'or a curve of="torque"'
            )
        diameter, inner_diameter = element.diameter, element.inner_diameter
    return shear_stress(1.0, diameter, inner_diameter, concentration)
