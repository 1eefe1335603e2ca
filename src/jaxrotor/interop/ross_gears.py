"""Gears of a `ross.MultiRotor`."""

from typing import Any

from ..core.parameter import as_float64
from ..elements.couplings.gear import GearMesh
from ..elements.laws.law import KelvinVoigt
from .ross_common import Faults


def is_gear(disk: Any) -> bool:
    return type(disk).__name__ in ("GearElement", "GearElementTVMS")


def meshes(rotor: Any) -> list[Any]:
    """A `MultiRotor`, after those that it is made of: each has one mesh."""
    if type(rotor).__name__ != "MultiRotor":
        return []
    inner = [found for part in rotor.rotors.values() for found in meshes(part)]
    return [*inner, rotor]


def gear_mesh(rotor: Any, name: str, faults: Faults) -> tuple[GearMesh, tuple[str, str]]:
    mesh = rotor.mesh
    gears = mesh.driving_gear, mesh.driven_gear
    varying = getattr(rotor, "square_varying_stiffness", False)  # of ROSS 2
    varying = varying or getattr(rotor, "_square_varying_stiffness", {}).get("enable", False)
    if varying or getattr(rotor, "update_mesh_stiffness", False):
        faults.add(name, "mesh stiffness that varies with the teeth cannot be carried")
    if getattr(mesh, "backlash", None) is not None:
        faults.add(name, "play between teeth cannot be carried: give the GearMesh a Backlash law")
    if getattr(mesh, "damping_ratio", 0.0):
        faults.add(
            name, "a damping ratio of the mesh cannot be carried: give the GearMesh one, N*s/m"
        )
    if mesh.helix_angle:
        faults.add(
            name,
            "helical gears cannot be carried: in ROSS the direction of the tooth force is no unit vector",
        )
    element = GearMesh(
        as_float64([gear.pitch_diameter / 2 for gear in gears]),
        KelvinVoigt(as_float64(mesh.stiffness), as_float64(0.0)),
        pressure_angle=as_float64(mesh.pressure_angle),
        orientation=as_float64(mesh.orientation_angle),
        teeth=as_float64(gears[0].n_teeth),
    )
    return element, (f"node {gears[0].n}", f"node {gears[1].n}")
