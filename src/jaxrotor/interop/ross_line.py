"""One rotor of ROSS in the making: its nodes in a row and what stands on them, in ROSS's words."""

import dataclasses
from typing import Any

import numpy as np

from ..core.protocol import AbstractElement
from ..elements.couplings.matrix import ElasticMatrix
from ..elements.shafts.finite import FiniteElementShaft
from ..elements.shafts.stepped import by_piece, sections
from .ross_common import Faults

# Of the largest entry of a matrix, what counts as nothing.
NOTHING = 1e-12


@dataclasses.dataclass(eq=False)
class Line:
    """`stations` in a row, `pieces` between them: (class of ROSS, its arguments) of each. Masses under
    bearings, `below`, get the nodes behind. `on`: (station, class of ROSS, arguments) of what stands there;
    `links`: bearings to a mass, (station, mass, arguments). `unbalance`: (station, (kg·m, rad))."""

    stations: list[str]
    pieces: list[tuple[str, dict[str, Any]]]
    below: list[str] = dataclasses.field(default_factory=list)
    on: list[tuple[str, str, dict[str, Any]]] = dataclasses.field(default_factory=list)
    links: list[tuple[str, str, dict[str, Any]]] = dataclasses.field(default_factory=list)
    unbalance: list[tuple[str, tuple[float, float]]] = dataclasses.field(default_factory=list)

    def numbers(self) -> dict[str, int]:
        return {station: k for k, station in enumerate([*self.stations, *self.below])}

    def rotor(self, ross: Any) -> Any:
        node = self.numbers()
        shafts = [getattr(ross, kind)(n=k, **given) for k, (kind, given) in enumerate(self.pieces)]
        disks, bearings, masses = [], [], []
        for station, kind, given in self.on:
            into = masses if kind == "PointMass" else bearings if "Bearing" in kind else disks
            into.append(getattr(ross, kind)(n=node[station], **given))
        for station, mass, given in self.links:
            bearings.append(ross.BearingElement(n=node[station], n_link=node[mass], **given))
        # what stands under a bearing comes behind it
        bearings.sort(key=lambda b: b.n)
        return ross.Rotor(shafts, disks, bearings, masses)


def lines_of(
    ross: Any,
    elements: dict[str, AbstractElement],
    places: dict[str, tuple[str, ...]],
    faults: Faults,
) -> list[Line]:
    """The rows that shafts and couplings make, each from its left end to its right one."""
    joins = [n for n in places if isinstance(elements[n], FiniteElementShaft)]
    on_shafts = {station for name in joins for station in places[name]}
    joins += [
        name
        for name, ends in places.items()
        if isinstance(elements[name], ElasticMatrix) and set(ends) <= on_shafts
    ]
    behind: dict[str, str] = {}
    before: dict[str, str] = {}
    for name in joins:
        left, right = places[name]
        for station in (left, right):
            if "." in station and station.rpartition(".")[0] in elements:
                faults.add(
                    name, "a shaft must end at a station, not at a port or inside another shaft"
                )
        if left in behind or right in before:
            faults.add(
                name, "shafts must stand in a row, each from left to right: they branch here"
            )
            continue
        behind[left], before[right] = name, name
    found = []
    for start in dict.fromkeys(station for name in joins for station in places[name]):
        if start in before:
            continue
        line, station = Line([start], []), start
        while station in behind:
            name = behind[station]
            inner, pieces = _pieces(ross, name, elements[name], faults)
            station = places[name][1]
            line.stations += [*inner, station]
            line.pieces += pieces
        found.append(line)
    return found


def _pieces(
    ross: Any, name: str, element: Any, faults: Faults
) -> tuple[list[str], list[tuple[str, dict[str, Any]]]]:
    """Inner stations, and what stands between."""
    if isinstance(element, ElasticMatrix):
        return [], [("CouplingElement", _coupling(name, element, faults))]
    if element.damping != "fixed":
        faults.add(name, "damping that turns with the shaft has no counterpart in ROSS")
    if element.twist == "paper":
        faults.add(name, 'twist="paper" has no counterpart in ROSS')
    if element.torque is not None and element.torque_kind != "axial":
        faults.add(
            name, f'a {element.torque_kind} torque is none of ROSS: give torque_kind="axial"'
        )
    cut, count = element.segments(), element.inner + 1
    force, torque = (
        np.zeros(count)
        if x is None
        else np.asarray(by_piece(x, sections(element), element.elements))
        for x in (element.axial_force, element.torque)
    )
    outer, inner = np.asarray(cut.diameters), np.asarray(cut.inner_diameters)
    E, G, rho = (np.asarray(x) for x in (cut.youngs_modulus, cut.shear_modulus, cut.density))
    alpha, beta = map(float, element.rayleigh)
    pieces = []
    for k in range(count):
        material = ross.Material(
            f"{name}_{k + 1}".replace(" ", "_"), rho=float(rho[k]), E=float(E[k]), G_s=float(G[k])
        )
        given = dict(
            L=float(np.asarray(cut.length)[k]),
            idl=float(inner[0, k]),
            odl=float(outer[0, k]),
            idr=float(inner[1, k]),
            odr=float(outer[1, k]),
            material=material,
            axial_force=float(force[k]),
            torque=float(torque[k]),
            shear_effects=cut.shear,
            rotary_inertia=cut.rotary_inertia,
            gyroscopic=cut.gyroscopic,
            alpha=alpha,
            beta=beta,
        )
        pieces.append(("ShaftElement", given))
    return [f"{name}.{k}" for k in range(1, count)], pieces


def _coupling(name: str, element: ElasticMatrix, faults: Faults) -> dict[str, float]:
    given: dict[str, float] = dict(m_l=0.0, m_r=0.0, Ip_l=0.0, Ip_r=0.0, tag=name)  # pyright: ignore
    for letter, matrix in (("k", element.K), ("c", element.C)):
        whole = np.asarray(matrix)
        k = np.diag(whole)[:6]
        plain = np.block([[np.diag(k), -np.diag(k)], [-np.diag(k), np.diag(k)]])
        if np.abs(whole - plain).max() > NOTHING * np.abs(whole).max(initial=1.0):
            faults.add(
                name,
                "a coupling of ROSS is a spring and a damper between like coordinates, but this matrix "
                "couples others",
            )
        names = [f"{letter}{kind}_{axis}" for kind in "tr" for axis in "xyz"]
        given |= dict(zip(names, map(float, k)))
    return given
