"""Rotors of ROSS (petrobras/ross) as machines. Coordinates and signs are the same in both programs."""

import inspect
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..core.errors import InputError, MissingExtraError
from ..core.parameter import as_float64
from ..core.protocol import AbstractElement, AbstractStation
from ..elements.bearings.support import LinearSupport, SpeedDependentSupport
from ..elements.couplings.matrix import ElasticMatrix
from ..elements.rotors.added_inertia import AddedInertia
from ..elements.rotors.node import Node
from ..elements.rotors.rotor import Rotor
from ..elements.rotors.unbalance import Unbalance
from ..elements.shafts.finite import FiniteElementShaft
from ..elements.shafts.material import Material
from ..machine.machine import Machine
from ..profiles.motion import AbstractMotion
from .ross_magnetic import magnetic_bearing

# Names in a sentence.
_TOLD = 3
_TILTS = ("psi", "theta", "phi")


def from_ross(
    rotor: Any,
    unbalance: Iterable[tuple[int, float, float]] = (),
    gravity: Any = (0.0, 0.0, 0.0),
    fixed: Mapping[str, Sequence[str]] | None = None,
    prescribed: Mapping[str, Mapping[str, AbstractMotion]] | None = None,
    table_speeds: Any = None,
) -> Machine:
    """The machine that a `ross.Rotor` or `ross.CoAxialRotor` describes (tested with ROSS 2.3).

    Node k becomes the station `"node k"`: a `Rotor` where a disk is, a `Node` elsewhere. Shaft elements,
    couplings, bearings, seals and point masses keep their tags as names (without dots; a tag that is taken
    gets a number). Axial motion and spin stay free, as they are
    there; a run in time needs a drive, such as `prescribed={"node 0": {"phi": CosineRamp(...)}}`.

    - `unbalance`: (node, magnitude in kg·m, phase in rad) as for ROSS's `run_unbalance_response`, each on a
      node with a disk.
    - `gravity`, `fixed`, `prescribed`: those of `Machine`.
    - `table_speeds`: rad/s; where tables of bearing coefficients are taken from the rotor. By default at
      their own points. Between, a monotone cubic is drawn where ROSS draws a spline; beyond, the last value
      holds where ROSS extrapolates. A table under a mass that does not turn goes by the speed of the shaft
      above.

    A magnetic bearing becomes a `MagneticBearing` with its magnets and its controller, gains of amplifier and
    sensor in it: its coefficients over the frequency are those of ROSS, and modes are those of the closed
    loop, where ROSS takes the coefficients at the frequency of the speed. In time its magnets are those of
    `Electromagnets`, limited and nonlinear.

    In tapered elements the axial and torsional rows are integrals here, means of both ends in ROSS.

    Raises `InputError` for what it cannot carry, a sentence for each kind of it: gears, mass
    coefficients of bearings, tables over both frequency and speed or between two nodes, axial force
    or torque in a shaft, Hutchinson's shear coefficient, a tapered bore, gyroscopic moments without rotary
    inertia (or the reverse), point masses that differ by direction. Raises `MissingExtraError` where ROSS is
    not installed.
    """
    ross = _ross()
    if not isinstance(rotor, ross.Rotor) or type(rotor).__name__ == "MultiRotor":
        raise InputError(
            f"from_ross takes a ross.Rotor or ross.CoAxialRotor, but was given a {type(rotor).__name__}"
        )
    faults = _Faults()
    stations, loose = _stations(ross, rotor, list(unbalance), faults)
    named = _Names(stations)
    elements: dict[str, AbstractElement] = dict(stations)
    connections: dict[str, Any] = {}
    for shaft in rotor.shaft_elements:
        ends = f"node {shaft.n_l}", f"node {shaft.n_r}"
        if isinstance(shaft, ross.CouplingElement):
            name = named(shaft, "coupling")
            elements[name] = ElasticMatrix(as_float64(shaft.K()), as_float64(shaft.C()))
            connections[name] = ends
            for side, place in zip("lr", ends):
                half = named(None, f"{name} at {place}")
                own = (getattr(shaft, f"{what}_{side}") for what in ("m", "Ip", "Id"))
                elements[half] = AddedInertia(*map(as_float64, own))
                connections[half] = place
            continue
        name = named(shaft, "shaft")
        found = _shaft(ross, shaft, name, faults)
        if found is not None:
            elements[name] = found
            connections[name] = ends
    for disk in loose:
        name = named(disk, "disk")
        elements[name] = AddedInertia(*map(as_float64, (disk.m, disk.Ip, disk.Id)))
        connections[name] = f"node {disk.n}"
    for mass in rotor.point_mass_elements:
        name = named(mass, "point mass")
        if not mass.mx == mass.my == mass.mz:
            faults.add(name, "a mass that differs by direction cannot be carried")
        elements[name] = AddedInertia(as_float64(mass.mx))
        connections[name] = f"node {mass.n}"
    for bearing in rotor.bearing_elements:
        name = named(bearing, "bearing")
        if isinstance(bearing, ross.MagneticBearingElement):
            element = magnetic_bearing(bearing)
        else:
            element = _bearing(bearing, name, table_speeds, faults)
        if element is not None:
            elements[name] = element
            linked = bearing.n_link is not None
            place = f"node {bearing.n}"
            connections[name] = (place, f"node {bearing.n_link}") if linked else place
            above = f"node {_turning(rotor, bearing.n)}"
            if isinstance(element, SpeedDependentSupport) and above != place:
                connections[name] = (place, above)
    faults.tell()
    held = {name: tuple(given) for name, given in (fixed or {}).items()}
    for name in _supports(rotor):  # masses under bearings move, but do not tilt
        held[name] = (*held.get(name, ()), *(c for c in _TILTS if c not in held.get(name, ())))
    return Machine(elements, connections, gravity, held, prescribed)


def _ross() -> Any:
    try:
        import ross  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise MissingExtraError(
            f"ROSS cannot be imported ({error}): pip install 'jaxrotor[interop]'"
        ) from None
    return ross


class _Faults:
    """What cannot be carried: one sentence for each kind, with the elements that it is about."""

    def __init__(self):
        self.found: dict[str, list[str]] = {}

    def add(self, name: str, words: str) -> None:
        self.found.setdefault(words, []).append(f"`{name}`")

    def tell(self) -> None:
        sentences = []
        for words, names in self.found.items():
            more = f" and {len(names) - _TOLD} more" if len(names) > _TOLD else ""
            sentences.append(f"{', '.join(names[:_TOLD])}{more}: {words}")
        if sentences:
            raise InputError(*sentences)


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


def _stations(
    ross: Any, rotor: Any, unbalance: list[tuple[int, float, float]], faults: _Faults
) -> tuple[dict[str, AbstractStation], list[Any]]:
    """The stations in order, and the disks that are too small for a `Rotor`."""
    disks: dict[int, list[Any]] = {}
    loose = []
    for disk in rotor.disk_elements:
        if type(disk) is not ross.DiskElement:
            faults.add(str(disk.tag), f"a {type(disk).__name__} cannot be carried, only disks can")
        elif disk.Id > 0 and disk.Ip > 0 and disk.m > 0:
            disks.setdefault(int(disk.n), []).append(disk)
        else:
            loose.append(disk)
    moments: dict[int, complex] = {}
    for node, magnitude, phase in unbalance:
        moments[int(node)] = moments.get(int(node), 0) + magnitude * np.exp(1j * phase)
        if int(node) not in disks:
            where = ", ".join(map(str, sorted(disks))) or "none"
            faults.add(
                f"unbalance at node {node}",
                f"there is no disk to carry it: put it at one of {where}",
            )
    on_shafts = {int(n) for shaft in rotor.shaft_elements for n in (shaft.n_l, shaft.n_r)}
    supports = {int(name.split()[1]) for name in _supports(rotor)}
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


def _shaft(ross: Any, shaft: Any, name: str, faults: _Faults) -> FiniteElementShaft | None:
    if type(shaft) is not ross.ShaftElement:
        faults.add(
            name,
            f"a {type(shaft).__name__} cannot be carried, only shaft elements and couplings can",
        )
        return None
    if shaft.axial_force or shaft.torque:
        faults.add(name, "axial_force and torque within a shaft cannot be carried")
    if shaft.shear_effects and shaft.shear_method_calc != "cowper":
        faults.add(
            name,
            f"the shear coefficient must be Cowper's, but is {shaft.shear_method_calc}'s: "
            'build the element with shear_method_calc="cowper"',
        )
    if shaft.idl != shaft.idr:
        faults.add(name, "a bore that tapers cannot be carried (idl must equal idr)")
    if bool(shaft.gyroscopic) != bool(shaft.rotary_inertia):
        faults.add(
            name,
            f"gyroscopic moments go with rotary inertia, but gyroscopic={shaft.gyroscopic} and "
            f"rotary_inertia={shaft.rotary_inertia}: set both alike",
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
    )


def _bearing(bearing: Any, name: str, table_speeds: Any, faults: _Faults) -> AbstractElement | None:
    # over the frequency, which is the speed's in synchronous whirl; in ROSS 3 also over the speed
    tables = [getattr(bearing, axis, None) for axis in ("frequency", "speed")]
    tables = [x for x in tables if x is not None and np.size(x) > 1]
    words = None
    if any(np.any(getattr(bearing, m)) for m in ("mxx", "mxy", "myx", "myy", "mzz")):
        words = "mass coefficients of a bearing or seal cannot be carried"
    elif len(tables) > 1:
        words = "a table over both frequency and speed cannot be carried"
    elif tables and bearing.n_link is not None:
        words = "a table of coefficients between two nodes cannot be carried"
    if words is not None:
        faults.add(name, words)
        return None

    def at(matrix: Any, speed: float) -> np.ndarray:
        over_speed = "speed" in inspect.signature(matrix).parameters
        return _six(matrix(speed, speed=speed) if over_speed else matrix(speed))

    if tables:
        speeds = np.asarray(tables[0] if table_speeds is None else table_speeds, float)
        stiffness, damping = (
            np.stack([at(f, float(w)) for w in speeds]) for f in (bearing.K, bearing.C)
        )
        return SpeedDependentSupport(*map(as_float64, (speeds, stiffness, damping)))
    stiffness, damping = at(bearing.K, 0.0), at(bearing.C, 0.0)
    if bearing.n_link is None:
        return LinearSupport(as_float64(stiffness), as_float64(damping))
    return ElasticMatrix(as_float64(stiffness), as_float64(damping))


def _six(given: np.ndarray) -> np.ndarray:
    """A bearing's rows along x, y, z (of one node, or of two) among six coordinates of each."""
    nodes = len(given) // 3
    out = np.zeros((nodes, 6, nodes, 6))
    out[:, :3, :, :3] = np.reshape(given, (nodes, 3, nodes, 3))
    return out.reshape(6 * nodes, 6 * nodes)
