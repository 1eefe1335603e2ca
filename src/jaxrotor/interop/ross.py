"""Rotors of ROSS (petrobras/ross) as machines. Coordinates and signs are the same in both programs."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..attach.inertia import AddedInertia
from ..attach.support import LinearSupport, SpeedDependentSupport
from ..drive.motion import AbstractMotion
from ..elastic.finite import FiniteElementShaft
from ..elastic.material import Material
from ..elastic.matrix import ElasticMatrix
from ..errors import InputError
from ..inertia.node import Node
from ..inertia.rotor import Rotor
from ..inertia.unbalance import Unbalance
from ..machine.machine import Machine
from ..parameter import as_float64
from ..protocol import AbstractElement, AbstractStation

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
    bearings, seals and point masses keep their tags as names. Axial motion and spin stay free, as they are
    there; a run in time needs a drive, such as `prescribed={"node 0": {"phi": CosineRamp(...)}}`.

    - `unbalance`: (node, magnitude in kg·m, phase in rad) as for ROSS's `run_unbalance_response`, each on a
      node with a disk.
    - `gravity`, `fixed`, `prescribed`: those of `Machine`.
    - `table_speeds`: rad/s; where tables of bearing coefficients are taken from the rotor. By default at
      their own points. Between, a monotone cubic is drawn where ROSS draws a spline; beyond, the last value
      holds where ROSS extrapolates.

    In tapered elements the axial and torsional rows are integrals here, means of both ends in ROSS.

    Raises `InputError` for what it cannot carry: magnetic bearings, gears and couplings, mass coefficients
    of bearings, axial force or torque in a shaft, Hutchinson's shear coefficient, a tapered bore,
    gyroscopic moments without rotary inertia (or the reverse), point masses that differ by direction.
    """
    ross = _ross()
    if not isinstance(rotor, ross.Rotor) or type(rotor).__name__ == "MultiRotor":
        raise InputError(
            f"from_ross takes a ross.Rotor or ross.CoAxialRotor, but was given a {type(rotor).__name__}"
        )
    faults: list[str] = []
    named = _Names()
    stations, loose = _stations(ross, rotor, list(unbalance), faults)
    elements: dict[str, AbstractElement] = dict(stations)
    connections: dict[str, Any] = {}
    for shaft in rotor.shaft_elements:
        name = named(shaft, "shaft")
        elements[name] = _shaft(ross, shaft, name, faults)
        connections[name] = (f"node {shaft.n_l}", f"node {shaft.n_r}")
    for disk in loose:
        name = named(disk, "disk")
        elements[name] = AddedInertia(*map(as_float64, (disk.m, disk.Ip, disk.Id)))
        connections[name] = f"node {disk.n}"
    for mass in rotor.point_mass_elements:
        name = named(mass, "point mass")
        if not mass.mx == mass.my == mass.mz:
            faults.append(f"`{name}`: a mass that differs by direction cannot be carried")
        elements[name] = AddedInertia(as_float64(mass.mx))
        connections[name] = f"node {mass.n}"
    for bearing in rotor.bearing_elements:
        name = named(bearing, "bearing")
        element = _bearing(ross, bearing, name, table_speeds, faults)
        if element is not None:
            elements[name] = element
            linked = bearing.n_link is not None
            place = f"node {bearing.n}"
            connections[name] = (place, f"node {bearing.n_link}") if linked else place
    if faults:
        raise InputError(*faults)
    held = {name: tuple(given) for name, given in (fixed or {}).items()}
    for name in _supports(rotor):  # masses under bearings move, but do not tilt
        held[name] = (*held.get(name, ()), *(c for c in _TILTS if c not in held.get(name, ())))
    return Machine(elements, connections, gravity, held, prescribed)


def _ross() -> Any:
    try:
        import ross  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise InputError(
            f"ROSS cannot be imported ({error}): pip install 'jaxrotor[interop]'"
        ) from None
    return ross


class _Names:
    """Tags as names: no dots, none twice."""

    def __init__(self):
        self.used: set[str] = set()

    def __call__(self, element: Any, kind: str) -> str:
        base = str(element.tag or kind).replace(".", "_")
        name, count = base, 1
        while name in self.used:
            count += 1
            name = f"{base} ({count})"
        self.used.add(name)
        return name


def _supports(rotor: Any) -> list[str]:
    on_shafts = {n for shaft in rotor.shaft_elements for n in (shaft.n_l, shaft.n_r)}
    linked = {b.n_link for b in rotor.bearing_elements if b.n_link is not None}
    masses = {p.n for p in rotor.point_mass_elements}
    return [f"node {n}" for n in sorted((linked | masses) - on_shafts)]


def _stations(
    ross: Any, rotor: Any, unbalance: list[tuple[int, float, float]], faults: list[str]
) -> tuple[dict[str, AbstractStation], list[Any]]:
    """The stations in order, and the disks that are too small for a `Rotor`."""
    disks: dict[int, list[Any]] = {}
    loose = []
    for disk in rotor.disk_elements:
        if type(disk) is not ross.DiskElement:
            faults.append(
                f"`{disk.tag}`: a {type(disk).__name__} cannot be carried, only disks can"
            )
        elif disk.Id > 0 and disk.Ip > 0 and disk.m > 0:
            disks.setdefault(int(disk.n), []).append(disk)
        else:
            loose.append(disk)
    moments: dict[int, complex] = {}
    for node, magnitude, phase in unbalance:
        moments[int(node)] = moments.get(int(node), 0) + magnitude * np.exp(1j * phase)
        if int(node) not in disks:
            where = ", ".join(map(str, sorted(disks))) or "none"
            faults.append(
                f"unbalance at node {node}: there is no disk to carry it: put it at one of {where}"
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


def _shaft(ross: Any, shaft: Any, name: str, faults: list[str]) -> FiniteElementShaft:
    if type(shaft) is not ross.ShaftElement:
        faults.append(
            f"`{name}`: a {type(shaft).__name__} cannot be carried, only shaft elements can"
        )
    if shaft.axial_force or shaft.torque:
        faults.append(f"`{name}`: axial_force and torque within a shaft cannot be carried")
    if shaft.shear_effects and shaft.shear_method_calc != "cowper":
        faults.append(
            f"`{name}`: the shear coefficient must be Cowper's, but is {shaft.shear_method_calc}'s: "
            'build the element with shear_method_calc="cowper"'
        )
    if shaft.idl != shaft.idr:
        faults.append(f"`{name}`: a bore that tapers cannot be carried (idl must equal idr)")
    if bool(shaft.gyroscopic) != bool(shaft.rotary_inertia):
        faults.append(
            f"`{name}`: gyroscopic moments go with rotary inertia, but gyroscopic={shaft.gyroscopic} and "
            f"rotary_inertia={shaft.rotary_inertia}: set both alike"
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


def _bearing(
    ross: Any, bearing: Any, name: str, table_speeds: Any, faults: list[str]
) -> AbstractElement | None:
    found = len(faults)
    if isinstance(bearing, ross.MagneticBearingElement):
        faults.append(f"`{name}`: magnetic bearings with their controllers cannot be carried")
    elif any(np.any(getattr(bearing, m)) for m in ("mxx", "mxy", "myx", "myy", "mzz")):
        faults.append(f"`{name}`: mass coefficients of a bearing or seal cannot be carried")
    table = bearing.frequency is not None and np.size(bearing.frequency) > 1
    if table and bearing.n_link is not None:
        faults.append(f"`{name}`: a table of coefficients between two nodes cannot be carried")
    if len(faults) > found:
        return None
    if table:
        speeds = bearing.frequency if table_speeds is None else table_speeds
        speeds = np.asarray(speeds, float)
        stiffness, damping = (
            np.stack([_six(f(float(w))) for w in speeds]) for f in (bearing.K, bearing.C)
        )
        return SpeedDependentSupport(*map(as_float64, (speeds, stiffness, damping)))
    stiffness, damping = _six(bearing.K(0.0)), _six(bearing.C(0.0))
    if bearing.n_link is None:
        return LinearSupport(as_float64(stiffness), as_float64(damping))
    return ElasticMatrix(as_float64(stiffness), as_float64(damping))


def _six(given: np.ndarray) -> np.ndarray:
    """A bearing's rows along x, y, z (of one node, or of two) among six coordinates of each."""
    nodes = len(given) // 3
    out = np.zeros((nodes, 6, nodes, 6))
    out[:, :3, :, :3] = np.reshape(given, (nodes, 3, nodes, 3))
    return out.reshape(6 * nodes, 6 * nodes)
