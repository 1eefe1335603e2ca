"""The paper's machine, shared by all tests. (64-bit floats and the cache: conftest.py above.)"""

import numpy as np
import pytest

import jaxrotor as jr


@pytest.fixture(scope="session")
def two_rotor():
    """`two_rotor(twist="paper")`: the machine of Matyja & Łazarz (2014), built in Python."""

    def build(twist: str = "paper") -> jr.Machine:
        def shaft(length):
            return jr.Shaft(length=length, diameter=0.012, rayleigh=(0.002, 0.002), twist=twist)

        def bearing():
            return jr.SelfAligningBearing(
                housing_mass=1.0,
                stiffness=1e6,
                damping=200.0,
                swing_damping=5.0,
                friction_arm=0.002,
            )

        return jr.Machine.in_line(
            {
                "second": jr.Rotor(3.0935, 0.00485, 0.002837, unbalance=jr.Unbalance(1e-5)),
                "shaft 1": shaft(0.060),
                "left": bearing(),
                "shaft 2": shaft(0.080),
                "main": jr.Rotor(
                    mass=6.0788,
                    polar_inertia=0.01873,
                    transverse_inertia=0.01018,
                    unbalance=jr.Unbalance(eccentricity=5e-4, inclination=np.deg2rad(1.0)),
                ),
                "shaft 3": shaft(0.127),
                "right": bearing(),
                "shaft 4": shaft(0.020),
                "end": jr.PrescribedSpin(jr.CosineRamp(speed=1000.0, duration=2.5)),
            },
            gravity=(0.0, -9.81, 0.0),
        )

    return build
