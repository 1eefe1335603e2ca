"""What the benchmarks share: the paper's two-rotor machine, and the header of every table."""

import os
import platform
from importlib.metadata import version

import numpy as np

from jaxrotor.elements.bearings.self_aligning import SelfAligningBearing
from jaxrotor.elements.drives.prescribed import PrescribedSpin
from jaxrotor.elements.rotors.rotor import Rotor
from jaxrotor.elements.rotors.unbalance import Unbalance
from jaxrotor.elements.shafts.section import Shaft
from jaxrotor.machine.machine import Machine
from jaxrotor.profiles.motion import CosineRamp


def two_rotors():
    """The start-up of Matyja & Łazarz 2014 as docs/physics.md gives it."""

    def shaft(length):
        return Shaft(length=length, diameter=0.012, rayleigh=(0.002, 0.002), twist="paper")

    def bearing():
        return SelfAligningBearing(
            housing_mass=1.0, stiffness=1e6, damping=2e2, swing_damping=5.0, friction_arm=0.002
        )

    return Machine.in_line(
        {
            "second": Rotor(3.0935, 0.00485, 0.002837, unbalance=Unbalance(1e-5)),
            "shaft 1": shaft(0.060),
            "left": bearing(),
            "shaft 2": shaft(0.080),
            "main": Rotor(6.0788, 0.01873, 0.01018, unbalance=Unbalance(5e-4, 0.0, np.deg2rad(1))),
            "shaft 3": shaft(0.127),
            "right": bearing(),
            "shaft 4": shaft(0.020),
            "end": PrescribedSpin(CosineRamp(1000.0, 2.5)),
        },
        gravity=(0.0, -9.81, 0.0),
    )


def header(*packages):
    """One line: processor, cores and versions."""
    model = platform.processor() or platform.machine()
    if os.path.exists("/proc/cpuinfo"):
        with open("/proc/cpuinfo") as info:
            model = next(
                (x.split(":")[1].strip() for x in info if x.startswith("model name")), model
            )
    versions = ", ".join(f"{p} {version(p)}" for p in ("jax", *packages))
    return f"{model}, {os.cpu_count()} cores; Python {platform.python_version()}, {versions}"
