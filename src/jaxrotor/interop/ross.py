"""Rotors of ROSS (petrobras/ross) as machines. Coordinates and signs are the same in both programs."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.parameter import as_float64
from ..core.protocol import AbstractElement, AbstractStation
from ..elements.bearings.support import LinearSupport, SpeedDependentSupport
from ..elements.bearings.whirl_dependent import WhirlDependentSupport
from ..elements.couplings.matrix import ElasticMatrix
from ..elements.rotors.added_inertia import AddedInertia
from ..elements.rotors.node import Node
from ..elements.rotors.point_unbalance import PointUnbalance
from ..elements.rotors.rotor import Rotor
from ..elements.rotors.unbalance import Unbalance
from ..elements.shafts.finite import FiniteElementShaft
from ..elements.shafts.material import Material
from ..machine.machine import Machine
from ..profiles.motion import AbstractMotion
from .ross_bearing import coefficients
from .ross_common import Faults, imported
from .ross_gears import gear_mesh, is_gear, meshes
from .ross_magnetic import magnetic_bearing

_TILTS = ("psi", "theta", "phi")
_TABLES = (SpeedDependentSupport, WhirlDependentSupport)


def from_ross(
    rotor: Any,
    unbalance: Iterable[tuple[int, float, float]] = (),
    gravity: Any = (0.0, 0.0, 0.0),
    fixed: Mapping[str, Sequence[str]] | None = None,
    prescribed: Mapping[str, Mapping[str, AbstractMotion]] | None = None,
    table_speeds: Any = None,
) -> Machine:
    """The machine that a `ross.Rotor`, `ross.CoAxialRotor` or `ross.MultiRotor` describes (tested with ROSS
    2.3 and 3.1).

    Node k becomes the station `"node k"`: a `Rotor` where a disk is, a `Node` elsewhere. Shaft elements,
    couplings, bearings, seals and point masses keep their tags as names (without dots; a tag that is taken
    gets a number). Axial motion and spin stay free, as they are
    there; a run in time needs a drive, such as `prescribed={"node 0": {"phi": CosineRamp(...)}}`.

    - `unbalance`: (node, magnitude in kg·m, phase in rad) as for ROSS's `run_unbalance_response`: of the
      `Rotor` where there is a disk, a `PointUnbalance` elsewhere.
    - `gravity`, `fixed`, `prescribed`: those of `Machine`.
    - `table_speeds`: rad/s; where tables of bearing coefficients are taken from the rotor. By default at
      their own points. Between, a monotone cubic is drawn where ROSS draws a spline; beyond, the last value
      holds where ROSS extrapolates. A table under a mass that does not turn goes by the speed of the shaft
      above.

    Spur gears of a `MultiRotor` become a `GearMesh`, `"mesh"`, with ROSS's stiffness; the driven shaft turns
    the other way, by the ratio of pitch radii (in ROSS of teeth: the same where both have one module). Tables
    over frequency and speed become a `WhirlDependentSupport`.

    A magnetic bearing becomes a `MagneticBearing` with its magnets and its controller, gains of amplifier and
    sensor in it: its coefficients over the frequency are those of ROSS, and modes are those of the closed
    loop, where ROSS takes the coefficients at the frequency of the speed. In time its magnets are those of
    `Electromagnets`, limited and nonlinear.

    Where they differ: in tapered elements the axial and torsional rows are integrals here, means of both ends
    in ROSS, and the shear coefficient is that of every section, of the middle one in ROSS (a bore that tapers
    alone: under 1 % of the element's stiffness). With shear, a torque acts about the axis of the sections
    here, about the centre line's in ROSS: under a hundredth of what it does to a slender shaft. Internal
    damping (`beta K`) is of the elastic stiffness here, of what axial force and torque add to it too in ROSS.

    Raises `InputError` for what it cannot carry, a sentence for each kind of it: helical gears (the direction
    of their force is no unit vector in ROSS), a mesh that varies or has play, tables or mass coefficients
    between two nodes, Hutchinson's shear coefficient, a motor, modal damping of the whole rotor. Raises
    `MissingExtraError` where ROSS is not installed.
    """
    ross = imported()
    if not isinstance(rotor, ross.Rotor):
        raise InputError(
            "from_ross takes a ross.Rotor, CoAxialRotor or MultiRotor, but was given a "
            f"{type(rotor).__name__}"
        )
    faults = Faults()
    if getattr(rotor, "motor_element", None) is not None:
        faults.add("motor", "a motor cannot be carried: give the machine one of jaxrotor's")
    if getattr(rotor, "modal_damping_ratio", None) is not None:
        faults.add(
            "rotor", "modal damping of the whole rotor cannot be carried: see with_modal_damping"
        )
    # of ROSS 3: of all but the bearings, in place of the elements' own
    whole = float(getattr(rotor, "alpha", 0.0)), float(getattr(rotor, "beta", 0.0))
    moments = _moments(unbalance)
    stations, loose = _stations(ross, rotor, moments, faults)
    named = _Names(stations)
    elements: dict[str, AbstractElement] = dict(stations)
    connections: dict[str, Any] = {}
    for shaft in rotor.shaft_elements:
        ends = f"node {shaft.n_l}", f"node {shaft.n_r}"
        if isinstance(shaft, ross.CouplingElement):
            name = named(shaft, "coupling")
            damping = whole[1] * shaft.K() if any(whole) else shaft.C()
            elements[name] = ElasticMatrix(as_float64(shaft.K()), as_float64(damping))
            connections[name] = ends
            for side, place in zip("lr", ends):
                half = named(None, f"{name} at {place}")
                own = (getattr(shaft, f"{what}_{side}") for what in ("m", "Ip", "Id"))
                elements[half] = AddedInertia(*map(as_float64, own))
                connections[half] = place
            continue
        name = named(shaft, "shaft")
        found = _shaft(ross, shaft, name, faults)
        if found is not None and any(whole):
            found = dataclasses.replace(found, rayleigh=as_float64(whole))
        if found is not None:
            elements[name] = found
            connections[name] = ends
    for disk in loose:
        name = named(disk, "disk")
        elements[name] = AddedInertia(*map(as_float64, (disk.m, disk.Ip, disk.Id)))
        connections[name] = f"node {disk.n}"
    for mass in rotor.point_mass_elements:
        name = named(mass, "point mass")
        along = (mass.mx, mass.my, mass.mz)
        elements[name] = AddedInertia(as_float64(mass.mx if len(set(along)) == 1 else along))
        connections[name] = f"node {mass.n}"
    for node, moment in moments.items():
        if isinstance(stations.get(f"node {node}"), Node):
            name = named(None, f"unbalance at node {node}")
            elements[name] = PointUnbalance(as_float64(abs(moment)), as_float64(np.angle(moment)))
            connections[name] = f"node {node}"
    for node, inertia in _inertias(ross, rotor).items() if whole[0] else ():
        name = named(None, f"damping at node {node}")
        elements[name] = LinearSupport(as_float64(np.zeros(6)), as_float64(whole[0] * inertia))
        connections[name] = f"node {node}"
    for mesh in meshes(rotor):
        name = named(None, "mesh")
        elements[name], connections[name] = gear_mesh(mesh, name, faults)
    for bearing in rotor.bearing_elements:
        name = named(bearing, "bearing")
        if isinstance(bearing, ross.MagneticBearingElement):
            element = magnetic_bearing(bearing)
        else:
            element = coefficients(bearing, name, table_speeds, faults)
        if element is not None:
            elements[name] = element
            linked = bearing.n_link is not None
            place = f"node {bearing.n}"
            connections[name] = (place, f"node {bearing.n_link}") if linked else place
            above = f"node {_turning(rotor, bearing.n)}"
            if isinstance(element, _TABLES) and above != place:
                connections[name] = (place, above)
    faults.tell()
    held = {name: tuple(given) for name, given in (fixed or {}).items()}
    for name in _supports(rotor):  # masses under bearings move, but do not tilt
        held[name] = (*held.get(name, ()), *(c for c in _TILTS if c not in held.get(name, ())))
    return Machine(elements, connections, gravity, held, prescribed)


class _Names:
    """Tags as names: no dots, none twice, none of a station."""

    def __init__(self, stations: Iterable[str]):
        self.used = set(stations)

    def __call__(self, element: Any, kind: str) -> str:
        tag = "" if element is None or element.tag is None else str(element.tag).strip()
        base = (tag or kind).replace(".", "_")
        name, count = base, 1
        while name in self.used:
            count += 1
            name = f"{base} ({count})"
        self.used.add(name)
        return name


def _turning(rotor: Any, node: int) -> int:
    """The node of the shaft whose speed counts at `node`: up from a mass under a bearing to what stands on
    it."""
    on_shafts = {n for shaft in rotor.shaft_elements for n in (shaft.n_l, shaft.n_r)}
    below = {b.n_link: b.n for b in rotor.bearing_elements if b.n_link is not None}
    seen = {node}
    while node not in on_shafts and node in below and below[node] not in seen:
        node = below[node]
        seen.add(node)
    return int(node)


def _supports(rotor: Any) -> list[str]:
    on_shafts = {n for shaft in rotor.shaft_elements for n in (shaft.n_l, shaft.n_r)}
    linked = {b.n_link for b in rotor.bearing_elements if b.n_link is not None}
    masses = {p.n for p in rotor.point_mass_elements}
    return [f"node {n}" for n in sorted((linked | masses) - on_shafts)]


def _moments(unbalance: Iterable[tuple[int, float, float]]) -> dict[int, complex]:
    """Node -> kg·m, with its phase."""
    found: dict[int, complex] = {}
    for node, magnitude, phase in unbalance:
        found[int(node)] = found.get(int(node), 0) + magnitude * np.exp(1j * phase)
    return found


def _inertias(ross: Any, rotor: Any) -> dict[int, np.ndarray]:
    """Node -> what is put on it beside shafts, (6,), kg and kg·m²."""
    found: dict[int, np.ndarray] = {}

    def add(node: Any, mass: Any, Id: float = 0.0, Ip: float = 0.0) -> None:
        one = np.concatenate([np.broadcast_to(mass, 3), [Id, Id, Ip]])
        found[int(node)] = found.get(int(node), np.zeros(6)) + one

    for disk in rotor.disk_elements:
        add(disk.n, disk.m, disk.Id, disk.Ip)
    for mass in rotor.point_mass_elements:
        add(mass.n, (mass.mx, mass.my, mass.mz))
    for shaft in rotor.shaft_elements:
        if isinstance(shaft, ross.CouplingElement):
            add(shaft.n_l, shaft.m_l, shaft.Id_l, shaft.Ip_l)
            add(shaft.n_r, shaft.m_r, shaft.Id_r, shaft.Ip_r)
    return found


def _stations(
    ross: Any, rotor: Any, moments: dict[int, complex], faults: Faults
) -> tuple[dict[str, AbstractStation], list[Any]]:
    """The stations in order, and the disks that are too small for a `Rotor`."""
    disks: dict[int, list[Any]] = {}
    loose = []
    for disk in rotor.disk_elements:
        if type(disk) is not ross.DiskElement and not is_gear(disk):
            faults.add(str(disk.tag), f"a {type(disk).__name__} cannot be carried, only disks can")
        elif disk.Id > 0 and disk.Ip > 0 and disk.m > 0:
            disks.setdefault(int(disk.n), []).append(disk)
        else:
            loose.append(disk)
    on_shafts = {int(n) for shaft in rotor.shaft_elements for n in (shaft.n_l, shaft.n_r)}
    supports = {int(name.split()[1]) for name in _supports(rotor)}
    for node in moments:
        if node not in on_shafts:
            where = f"0 to {max(on_shafts, default=0)}"
            faults.add(
                f"unbalance at node {node}", f"there is no such node of a shaft: {where} are"
            )
    out: dict[str, AbstractStation] = {}
    for node in sorted(on_shafts | supports):
        if node not in disks:
            out[f"node {node}"] = Node()
            continue
        mass = sum(float(d.m) for d in disks[node])
        moment = moments.get(node, 0j)
        out[f"node {node}"] = Rotor(
            as_float64(mass),
            as_float64(sum(d.Ip for d in disks[node])),
            as_float64(sum(d.Id for d in disks[node])),
            Unbalance(as_float64(abs(moment) / mass), as_float64(np.angle(moment))),
        )
    return out, loose


def _shaft(ross: Any, shaft: Any, name: str, faults: Faults) -> FiniteElementShaft | None:
    if type(shaft) is not ross.ShaftElement:
        faults.add(
            name,
            f"a {type(shaft).__name__} cannot be carried, only shaft elements and couplings can",
        )
        return None
    if shaft.shear_effects and shaft.shear_method_calc != "cowper":
        faults.add(
            name,
            f"the shear coefficient must be Cowper's, but is {shaft.shear_method_calc}'s: "
            'build the element with shear_method_calc="cowper"',
        )
    m = shaft.material
    return FiniteElementShaft(
        as_float64(shaft.L),
        as_float64(shaft.odl),
        as_float64(shaft.idl),
        None if shaft.odl == shaft.odr else as_float64(shaft.odr),
        material=Material(float(m.E), float(m.G_s), float(m.rho)),
        rayleigh=as_float64((shaft.alpha, shaft.beta)),
        elements=1,
        shear=bool(shaft.shear_effects),
        rotary_inertia=bool(shaft.rotary_inertia),
        end_inner_diameter=None if shaft.idl == shaft.idr else as_float64(shaft.idr),
        axial_force=as_float64(shaft.axial_force) if shaft.axial_force else None,
        torque=as_float64(shaft.torque) if shaft.torque else None,
        torque_kind="axial",
        gyroscopic=bool(shaft.gyroscopic),
    )
