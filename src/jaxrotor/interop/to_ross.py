"""Machines as rotors of ROSS."""

import inspect
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import InputError
from ..core.gate import takes
from ..core.kinematics import COORDINATES
from ..core.parameter import is_concrete
from ..elements.bearings.support import LinearSupport, SpeedDependentSupport
from ..elements.bearings.whirl_dependent import WhirlDependentSupport
from ..elements.couplings.gear import GearMesh
from ..elements.couplings.matrix import ElasticMatrix
from ..elements.drives.load import Force, Moment, Torque
from ..elements.laws.law import KelvinVoigt
from ..elements.rotors.added_inertia import AddedInertia
from ..elements.rotors.node import Node
from ..elements.rotors.point_unbalance import PointUnbalance
from ..elements.rotors.rotor import Rotor
from ..elements.shafts.finite import FiniteElementShaft
from ..machine.machine import Machine
from ..machine.wiring import FIXED
from .ross_common import Faults, imported
from .ross_line import NOTHING, Line, lines_of

_LOADS = (Torque, Force, Moment)
_TILTS = {"psi", "theta", "phi"}


class InRoss(NamedTuple):
    """What `to_ross` makes of a machine.

    - `rotor`: a `ross.Rotor`, or a `ross.MultiRotor` where there are gears. - `nodes`: station -> node.
    - `unbalance`: (node, kg·m, rad) of each, as `run_unbalance_response` takes it.
    - `left_out`: the names of loads, and of stations with given motions, which a rotor of ROSS does not have.
    """

    rotor: Any
    nodes: dict[str, int]
    unbalance: tuple[tuple[int, float, float], ...]
    left_out: tuple[str, ...]


@takes()
def to_ross(machine: Machine) -> InRoss:
    """The machine as a rotor of ROSS (2.3, or 3 where that installs), for what that program has, and as an
    independent check: eigenvalues are the same at any speed. The inverse of `from_ross`.

    Carried: lines of `FiniteElementShaft` (each element becomes one of ROSS) between `Rotor` and `Node`, with
    `AddedInertia`, unbalance (static), supports along x, y and z with their inertia and tables (over whirl
    frequency in ROSS 3), an `ElasticMatrix` between two shafts that is a spring and damper for each
    coordinate, or between a shaft and a mass that stands on supports, and spur gears. Values are taken as
    they are: nothing here is differentiable. Loads and given motions are left out and told; gravity is a
    matter of ROSS's analyses.

    Raises `InputError` for what ROSS has not, a sentence for each kind, and for a machine inside `jit`;
    `MissingExtraError` where ROSS is not installed.
    """
    ross = imported()
    if not isinstance(machine, Machine):
        raise InputError(f"to_ross takes a Machine, but was given a {type(machine).__name__}")
    if not is_concrete(machine):
        raise InputError(
            "to_ross takes a machine of plain numbers: call it outside jit, grad and vmap"
        )
    machine.check()
    return _Writer(ross, machine).written()


class _Writer:
    def __init__(self, ross: Any, machine: Machine):
        self.ross, self.machine, self.faults = ross, machine, Faults()
        self.elements, self.places = machine.elements(), machine.connections()
        self.lines = lines_of(ross, self.elements, self.places, self.faults)
        self.of = {s: line for line in self.lines for s in line.stations}
        self.left_out: list[str] = []
        self.meshes: list[tuple[str, str, str, GearMesh]] = []

    def written(self) -> InRoss:
        self._stand_masses()
        self._held()
        for name, element in self.elements.items():
            if name in self.places:
                self._attached(name, element, self.places[name])
            else:
                self._station(name, element)
        gears = self._gears()
        if not self.lines:
            self.faults.add("machine", "there is no FiniteElementShaft: ROSS needs one")
        self.faults.tell()
        rotor, first = self._joined(gears)
        nodes = {s: at + k for line, at in first.items() for s, k in line.numbers().items()}
        unbalance = [(nodes[s], *given) for line in first for s, given in line.unbalance]
        return InRoss(rotor, nodes, tuple(unbalance), tuple(self.left_out))

    def _stand_masses(self) -> None:
        """Nodes that a matrix joins to a shaft, or to another such node, belong to its line."""
        found = True
        while found:
            found = False
            for name, ends in self.places.items():
                if not isinstance(self.elements[name], ElasticMatrix):
                    continue
                for shaft, mass in (ends, ends[::-1]):
                    if shaft in self.of and mass not in self.of and "." not in mass:
                        self.of[mass] = self.of[shaft]
                        self.of[mass].below.append(mass)
                        found = True

    def _below(self, station: str) -> bool:
        return station in self.of and station in self.of[station].below

    def _held(self) -> None:
        for held in self.machine.wiring.held:
            station = self.machine.wiring.stations[held.station]
            coordinate = COORDINATES[held.coordinate]
            if held.motion != FIXED:
                self.left_out.append(station)
            elif not (self._below(station) and coordinate in _TILTS):
                self.faults.add(station, f"ROSS cannot hold {coordinate}: remove it from `fixed`")
        self.left_out = list(dict.fromkeys(self.left_out))

    def _station(self, name: str, element: Any) -> None:
        if name not in self.of:
            kind = type(element).__name__
            self.faults.add(
                name, f"a {kind} that no shaft with mass reaches has no counterpart in ROSS"
            )
        elif isinstance(element, Rotor) and not self._below(name):
            line, turned = self.of[name], element.unbalance
            mass = float(element.mass)
            line.on.append((name, "DiskElement", _disk(name, element, mass)))
            if float(turned.inclination):
                self.faults.add(name, "dynamic unbalance (inclination) has no counterpart in ROSS")
            if element.imperfection is not None:
                self.faults.add(name, "a rotor off its shaft has no counterpart in ROSS")
            if float(turned.eccentricity):
                given = (
                    mass * float(turned.eccentricity),
                    float(turned.angle) + float(element.angle),
                )
                line.unbalance.append((name, given))
        elif not isinstance(element, Node):
            self.faults.add(name, f"a {type(element).__name__} has no counterpart in ROSS here")

    def _attached(self, name: str, element: Any, ends: tuple[str, ...]) -> None:
        if isinstance(element, FiniteElementShaft):
            return
        if isinstance(element, _LOADS):
            self.left_out.append(name)
            return
        station = ends[0]
        if station not in self.of:
            self.faults.add(name, "it stands where ROSS has no node: at a port, or off the shafts")
            return
        line = self.of[station]
        if isinstance(element, GearMesh):
            self.meshes.append((name, ends[0], ends[1], element))
        elif isinstance(element, ElasticMatrix):
            if not set(ends) <= set(line.stations):
                self._link(name, element, ends)
        elif isinstance(element, PointUnbalance):
            line.unbalance.append((station, (float(element.amount), float(element.angle))))
        elif isinstance(element, AddedInertia):
            self._inertia(name, element, station)
        elif isinstance(element, (LinearSupport, SpeedDependentSupport, WhirlDependentSupport)):
            line.on.append((station, "BearingElement", self._support(name, element)))
        else:
            kind = type(element).__name__
            self.faults.add(name, f"a {kind} has no counterpart in ROSS")

    def _inertia(self, name: str, element: AddedInertia, station: str) -> None:
        if float(element.offset):
            self.faults.add(name, "inertia beside its station (offset) has no counterpart in ROSS")
        along = np.broadcast_to(np.asarray(element.mass), 3)
        line = self.of[station]
        if self._below(station):
            line.on.append((station, "PointMass", dict(zip(("mx", "my", "mz"), map(float, along)))))
            return
        if np.ptp(along):
            self.faults.add(name, "on a shaft a mass that differs by direction has no counterpart")
        line.on.append((station, "DiskElement", _disk(name, element, float(along[0]))))

    def _support(self, name: str, element: Any) -> dict[str, Any]:
        given: dict[str, Any] = dict(tag=name)
        if isinstance(element, LinearSupport):
            if element.offset is not None and np.any(element.offset):
                self.faults.add(name, "a support out of line (offset) has no counterpart in ROSS")
        else:
            speeds = np.asarray(element.speeds)
            whirls = isinstance(element, WhirlDependentSupport)
            later = "speed" in inspect.signature(self.ross.BearingElement.__init__).parameters
            if whirls and not later:
                self.faults.add(
                    name, "tables over whirl frequency are ROSS 3's: this is an older one"
                )
            given |= dict(frequency=np.asarray(element.frequencies), speed=speeds) if whirls else {}
            if not whirls:
                given["speed" if later else "frequency"] = speeds
        for letter, table in (
            ("k", element.stiffness),
            ("c", element.damping),
            ("m", element.mass),
        ):
            if table is None:
                continue
            full = np.asarray(table)
            square = full.ndim > 1 and full.shape[-2:] == (6, 6)
            full = full if square else full[..., :, None] * np.eye(6)
            given |= self._coefficients(name, letter, full)
        return given

    def _coefficients(self, name: str, letter: str, full: np.ndarray) -> dict[str, Any]:
        rest = full.copy()
        found = {}
        for a, b in ("xx", "xy", "yx", "yy", "zz"):
            place = (..., COORDINATES.index(a), COORDINATES.index(b))
            value, rest[place] = full[place].copy(), 0.0
            found[f"{letter}{a}{b}"] = float(value) if np.ndim(value) == 0 else value
        if np.abs(rest).max() > NOTHING * np.abs(full).max(initial=1e-300):
            self.faults.add(
                name,
                "a bearing of ROSS acts along x, y (with each other) and z, but this one elsewhere too",
            )
        return found

    def _link(self, name: str, element: ElasticMatrix, ends: tuple[str, ...]) -> None:
        """A bearing between a shaft, or a mass, and the mass below."""
        line = self.of[ends[0]]
        order = [*line.stations, *line.below]
        above, under = sorted(ends, key=order.index)
        given: dict[str, Any] = dict(tag=name)
        for letter, matrix in (("k", element.K), ("c", element.C)):
            whole = np.asarray(matrix)
            own = whole[:6, :6]
            if np.abs(whole - np.block([[own, -own], [-own, own]])).max() > NOTHING * np.abs(
                own
            ).max(initial=1.0):
                self.faults.add(
                    name, "a bearing between two nodes answers to their difference in ROSS"
                )
            given |= self._coefficients(name, letter, own)
        line.links.append((above, under, given))

    def _gears(self) -> list[tuple[Line, str, Line, str, float, float]]:
        """Of each mesh: line and station of both gears, stiffness, direction of the second from the first."""
        found = []
        for name, one, other, mesh in self.meshes:
            law = mesh.mesh
            if not isinstance(law, KelvinVoigt) or float(law.damping):
                self.faults.add(
                    name, "teeth of ROSS are a spring: give KelvinVoigt(stiffness) without damping"
                )
                continue
            if float(mesh.helix_angle) or mesh.error_amplitudes.size:
                self.faults.add(name, "helical gears and transmission errors cannot be carried")
            if mesh.stiffness_amplitudes.size or float(mesh.radii[1]) < 0:
                self.faults.add(
                    name, "varying stiffness and rings with inner teeth cannot be carried"
                )
                continue
            radii, teeth = np.asarray(mesh.radii), float(mesh.teeth)
            counts = np.array([teeth, teeth * radii[1] / radii[0]])
            if np.abs(counts - np.round(counts)).max() > 1e-6:
                self.faults.add(
                    name, f"ROSS needs whole teeth, but they are {counts[0]:g} and {counts[1]:g}"
                )
            for station, radius, count in zip((one, other), radii, counts):
                if station not in self.of:
                    self.faults.add(name, "a gear stands where ROSS has no node")
                    continue
                on = self.of[station].on
                kinds = ("DiskElement", "GearElement")
                at = [k for k, (s, kind, _) in enumerate(on) if s == station and kind in kinds]
                if not at:
                    self.faults.add(name, f"a gear of ROSS has mass: put a Rotor at `{station}`")
                    continue
                gear = dict(
                    pitch_diameter=2 * float(radius),
                    n_teeth=int(round(count)),
                    pr_angle=float(mesh.pressure_angle),
                )
                _, kind, given = on[at[0]]
                if kind == "GearElement" and any(given[key] != x for key, x in gear.items()):
                    self.faults.add(name, f"the gear at `{station}` is another in its other mesh")
                given = given | gear
                on[at[0]] = station, "GearElement", given
            if one in self.of and other in self.of:
                ends = self.of[one], one, self.of[other], other
                found.append((*ends, float(law.stiffness), float(mesh.orientation)))
        return found

    def _joined(self, gears: list) -> tuple[Any, dict[Line, int]]:
        """One rotor of all lines, and the first node of each."""
        first = {self.lines[0]: 0}
        rotor, rest = self.lines[0].rotor(self.ross), list(gears)
        while rest:
            known = [g for g in rest if (g[0] in first) != (g[2] in first)]
            if not known:
                raise InputError(
                    "meshes: ROSS joins each line by one mesh, but these make a circle"
                )
            a, one, b, other, stiffness, angle = known[0]
            rest.remove(known[0])
            if b in first:  # the normal turns round with the roles, and the matrix is the same
                a, one, b, other, angle = b, other, a, one, angle + np.pi
            made = b.rotor(self.ross)
            nodes = first[a] + a.numbers()[one], b.numbers()[other]
            first[b] = int(max([*rotor.nodes, *rotor.link_nodes])) + 1
            rotor = self.ross.MultiRotor(rotor, made, nodes, stiffness, orientation_angle=angle)
        apart = [line.stations[0] for line in self.lines if line not in first]
        if apart:
            raise InputError(
                f"`{apart[0]}`: its line has no gear to the first one: ROSS has one rotor"
            )
        return rotor, first


def _disk(name: str, element: Rotor | AddedInertia, mass: float) -> dict[str, Any]:
    return dict(
        m=mass,
        Id=float(element.transverse_inertia),
        Ip=float(element.polar_inertia),
        tag=name,
    )
