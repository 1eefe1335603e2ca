"""Sensors that no instrument shop sells: quantities of a run that a design is judged by."""

from typing import ClassVar, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.errors import InputError
from ..core.picked import picked
from ..core.protocol import AbstractAttachment, AbstractPrescribed
from ..core.quick import lightly_compiled
from ..elements.shafts.beam_element import AbstractBeamElement
from ..elements.shafts.section import Shaft
from ..elements.shafts.twist import damped_rates
from ..machine.field import Evaluation, unpack
from ..machine.lineup import structure_of
from ..machine.machine import Machine
from ..machine.speed_ratios import port_turns
from ..machine.system import System
from ..machine.wiring import FIXED, unknown
from ..simulation.named_parts import part_of, signals_of
from ..simulation.response import ConnectorResponse, Response
from .sensor import AbstractSensor, _station

# Lengths are smoothed by so much, or every gradient at rest would be NaN.
_METRE, _NEWTON, _NEWTON_METRE, _PASCAL = 1e-12, 1e-6, 1e-9, 1e-3


def _length(*parts: Array, smoothing: float) -> Array:
    """`sqrt(Σ p² + s²) - s`: smooth, zero at zero, short by s at most."""
    return jnp.sqrt(sum(p**2 for p in parts) + smoothing**2) - smoothing


class Twist(AbstractSensor):
    """How far the second station has turned ahead of the first, rad, their difference at the start
    included; measured as the twist of shafts is, by `chi = phi + psi theta/2`.

    Where gears stand between them, `chi_second * (w_first / w_second) - chi_first` as seen at the first: a
    line that turns as a whole has none, however fast and which way round each side turns. The ratio of
    speeds is the gears' own (`GearMesh.ratio`, of several meshes the product).

    From the state, which is measured from the drive: after thousands of turns nothing is lost to rounding.
    (In a line without a given spin the state itself holds whole angles.)
    """

    first: str = eqx.field(static=True)
    second: str = eqx.field(static=True)
    unit: ClassVar[str] = "rad"

    def signal(self, response: Response) -> Float[Array, " nt"]:
        for name in (self.first, self.second):
            _station(response, name)
        place = response.lineup.wiring.stations.index
        places = place(self.first), place(self.second)
        return _twist(response._system, response.t, response.y, places)


@lightly_compiled
def _twist(system: System, t: Array, y: Array, places: tuple[int, int]) -> Array:
    layout = system.layout
    a, b = (layout.internal[k] for k in places)
    # what both turn with the drive cancels: chi is `turned` and so many times the drive's angle
    turns = system.turns()
    ratio = 1.0 if system.turn is None else turns[places[0]] / turns[places[1]]

    def one(t, y):
        reference = system.reference(t)
        turned, given, following = unpack(t, y, system, reference)[0][5], [], []
        if layout.n_ground:
            turn = 1.0 if system.turn is None else system.turn[layout.n_nodes :][: layout.n_ground]
            given.append(system.given(t, reference)[0][5] - turn * reference[0])
        if system.condensed is not None:
            own = picked(turned, layout.node_station)
            for node, turns in port_turns(layout, system.stations).items():
                own = own.at[node].multiply(turns)
            at_nodes = [own, *given]
            following.append(system.condensed.turned(jnp.concatenate(at_nodes)))
        turned = jnp.concatenate([turned, *given, *following])
        return ratio * turned[b] - turned[a]

    return jax.vmap(one)(t, y)


class AngularAcceleration(AbstractSensor):
    """phi'' of a station, rad/s²."""

    station: str = eqx.field(static=True)
    unit: ClassVar[str] = "rad/s^2"

    def signal(self, response: Response) -> Float[Array, " nt"]:
        return _station(response, self.station).acceleration[:, 5]


class Radial(AbstractSensor):
    """How far the geometric centre of a station is from its design position across the axis, m:
    `sqrt(x² + y²)`, smoothed by 1e-12 m at zero."""

    station: str = eqx.field(static=True)
    unit: ClassVar[str] = "m"

    def signal(self, response: Response) -> Float[Array, " nt"]:
        at = _station(response, self.station)
        return _length(at.x, at.y, smoothing=_METRE)


class Signal(AbstractSensor):
    """Whatever one number an element offers as a signal of its own: `Signal("damper", "torque")`.

    `unit`: known to the element alone; where given here, the two must agree.
    """

    element: str = eqx.field(static=True)
    name: str = eqx.field(static=True)
    unit: str = eqx.field(static=True, default="")

    def in_machine(self, machine: Machine) -> "Signal":
        """The same with the element's own unit, where none was given and the machine has the signal."""
        wiring = structure_of(machine).wiring
        if self.unit or self.element not in (*wiring.stations, *wiring.connectors):
            return self
        return Signal(self.element, self.name, signals_of(machine, self.element).get(self.name, ""))

    def signal(self, response: Response) -> Float[Array, " nt"]:
        part = response[self.element]
        offered = part.signals()
        if self.name not in offered:
            raise InputError(f"`{self.element}`: {unknown('signal', self.name, offered)}")
        if self.unit and self.unit != offered[self.name]:
            raise InputError(
                f"`{self.element}`: {self.name} is in {offered[self.name]}, but unit says {self.unit}"
            )
        found = getattr(part, self.name)
        if found.ndim != 1:
            raise InputError(
                f"`{self.element}`: {self.name} has {found.shape[1]} components, not one: take a sensor "
                "that makes one number of them, such as BearingForce"
            )
        return found


def force_on_base(response: Response, element: str) -> Float[Array, "nt 3"] | None:
    """What a bearing, or an attachment at its first station, puts upon the ground, N; `None` of all else."""
    part = response[element]
    if "bearing_force" in part.signals():
        return part.bearing_force  # pyright: ignore[reportAttributeAccessIssue]
    if isinstance(part, ConnectorResponse) and isinstance(part._element, AbstractAttachment):
        return -part.forces[:, 0, :3]
    return None


class BearingForce(AbstractSensor):
    """Magnitude of the force across the axis that a bearing or a support carries, N, smoothed by 1e-6 N
    at zero.

    `element`: a `SelfAligningBearing` (its `bearing_force`, on the base), or any attachment: what it exerts
    on its (first) station.
    """

    element: str = eqx.field(static=True)
    unit: ClassVar[str] = "N"

    def signal(self, response: Response) -> Float[Array, " nt"]:
        force = force_on_base(response, self.element)
        if force is None:
            raise InputError(
                f"`{self.element}`: is no bearing: name a SelfAligningBearing or a support"
            )
        return _length(force[:, 0], force[:, 1], smoothing=_NEWTON)


class DriveTorque(AbstractSensor):
    """Torque of the drive at a station whose phi is given, N·m: positive where it drives towards +phi."""

    station: str = eqx.field(static=True)
    unit: ClassVar[str] = "N*m"

    def signal(self, response: Response) -> Float[Array, " nt"]:
        return _driven(response, self.station).reaction[:, 5]


class DrivePower(AbstractSensor):
    """Power that the drive of a station whose phi is given puts in, W; all its given coordinates count."""

    station: str = eqx.field(static=True)
    unit: ClassVar[str] = "W"

    def signal(self, response: Response) -> Float[Array, " nt"]:
        return _driven(response, self.station).power


def _driven(response: Response, name: str):
    """A free station's reaction is 0: a design would be judged by nothing."""
    found = _station(response, name)
    machine = response.machine
    wiring = machine.wiring
    driven = name in wiring.stations and (
        isinstance(machine[name], AbstractPrescribed)
        or any(
            wiring.stations[h.station] == name and h.coordinate == 5 and h.motion != FIXED
            for h in wiring.held
        )
    )
    if not driven:
        raise InputError(f"`{name}`: is not driven: name a station whose phi is given")
    return found


class ShaftStress(AbstractSensor):
    """Stress at the surface of a shaft section, Pa, where it is highest: at one of its ends.

    **Arguments:**

    - `shaft`: a `Shaft`, an element of a `FiniteElementShaft` (`"shaft.element 3"`) or a spring of a
      `RigidElementShaft`.
    - `stress`: `"shear"`, of the torque T alone, `16 T d/(pi (d⁴ - d_i⁴))`, with T's sign; or `"mises"`,
      `sqrt(s² + 3 tau²)` with s of bending and tension, `32 |M| d/(pi (d⁴ - d_i⁴)) + |N|/A`, the larger of
      both ends, never negative.

    T is the section's signal `torque`; M and N are its own end loads: elastic, and `beta K` of its damping
    (what `alpha M` and gyroscopics add acts from outside). No stress concentration, no shear force.
    """

    shaft: str = eqx.field(static=True)
    stress: Literal["mises", "shear"] = eqx.field(static=True, default="mises")
    unit: ClassVar[str] = "Pa"

    def signal(self, response: Response) -> Float[Array, " nt"]:
        part = response[self.shaft]
        if not isinstance(part, ConnectorResponse) or not isinstance(
            part._element, (Shaft, AbstractBeamElement)
        ):
            raise InputError(f"`{self.shaft}`: is no shaft section: name a Shaft")
        return _stress(
            response.machine,
            response._system,
            response.t,
            response.evaluation,
            self.shaft,
            self.stress == "mises",
        )


@lightly_compiled
def _stress(
    machine: Machine, system: System, t: Array, ev: Evaluation, name: str, mises: bool
) -> Array:
    element, nodes, _ = part_of(machine, system, name)
    if isinstance(element, AbstractBeamElement):
        outer, inner, K = element.segment.diameters, element.segment.inner_diameters, element.K
    else:
        outer, inner = (jnp.stack([d, d]) for d in (element.diameter, element.inner_diameter))
        K = element.matrices()[0]
    polar = jnp.pi / 32 * (outer**4 - inner**4)
    area = jnp.pi / 4 * (outer**2 - inner**2)
    beta = element.rayleigh[1]

    def one(t, q, v):
        motions = tuple((q[:, i], v[:, i]) for i in nodes)
        torque = element.torque(t, motions, None)
        if not mises:
            return torque * jnp.max(outer / (2 * polar))
        deflected = jnp.concatenate([q for q, _ in motions])
        moving = jnp.concatenate(damped_rates(motions, element.damping))
        loads = (K @ (deflected + beta * moving)).reshape(2, 6)
        bending = _length(loads[:, 3], loads[:, 4], smoothing=_NEWTON_METRE)
        normal = bending * outer / polar + jnp.abs(loads[:, 2]) / area
        shear = torque * outer / (2 * polar)
        return jnp.max(_length(normal, jnp.sqrt(3.0) * shear, smoothing=_PASCAL))

    return jax.vmap(one)(t, *ev.nodes)
