"""Rest under torques: what each line must carry is carried, what nothing holds stays where it is."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr

LOAD, RATIO = 5.0, -0.5
DISC = dict(polar_inertia=0.02, transverse_inertia=0.012)
TWIST = 8.1e10 * np.pi * 0.03**4 / 32 / 0.2


def train(law, drive):
    """A pair of gears on bearings between a shaft and a coupling; a load on the far end."""
    bearings = jr.LinearSupport((1e6, 1e6, 1e6, 1e4, 1e4, 0.0))
    line = {
        "drive": drive,
        "shaft": jr.Shaft(0.2, 0.03),
        "pinion": jr.Rotor(1.0, **DISC),
        "mesh": jr.GearMesh((0.05, 0.1), jr.elements.KelvinVoigt(1e7, 500.0)),
        "wheel": jr.Rotor(3.0, **DISC),
        "coupling": jr.Coupling((1e6, 1e6, 1e6, 1e4, 1e4, 0.0), phi=law),
        "fan": jr.Rotor(2.0, **DISC),
    }
    about = {f"bearing {name}": (bearings, name) for name in ("pinion", "wheel", "fan")}
    about["load"] = (jr.Torque(-LOAD), "fan")
    if isinstance(drive, jr.Rotor):
        about |= {"bearing": (bearings, "drive"), "motor": (jr.Torque(8.0), "drive")}
    return jr.Machine.in_line(line, about)


def turned(machine):
    """How far each station has turned at rest: chi."""
    q = np.asarray(jr.static_equilibrium(machine).position)
    return q[:, 5] + 0.5 * q[:, 3] * q[:, 4]


DRIVEN = jr.PrescribedSpin(jr.CosineRamp(100.0, 1.0))


@pytest.mark.parametrize(
    "law, wound",
    [
        (jr.elements.KelvinVoigt(500.0), LOAD / 500),
        (jr.elements.Progressive([0.0, 9e4]), np.cbrt(LOAD / 9e4)),
        (jr.elements.Backlash(0.02, 500.0), 0.01 + LOAD / 500),
        (jr.elements.Backlash(0.5, 500.0), 0.25 + LOAD / 500),
    ],
)
def test_a_law_without_slope_at_rest_is_wound_up_to_its_load(law, wound):
    _, pinion, wheel, fan = turned(train(law, DRIVEN))
    np.testing.assert_allclose(pinion, LOAD * -RATIO / TWIST, rtol=1e-9)
    np.testing.assert_allclose(fan - wheel, -wound, rtol=1e-9)


def test_a_free_line_rests_wound_up_though_its_torques_drive_it():
    """Only the common torque may be left: it is shared out evenly along the common turning."""
    machine = train(jr.elements.Backlash(0.02, 500.0), jr.Rotor(1.0, **DISC))
    rest = turned(machine)
    common = np.array([1.0, 1.0, RATIO, RATIO])
    torques = np.array([8.0, 0.0, 0.0, -LOAD])
    left = torques - common * (common @ torques) / (common @ common)
    np.testing.assert_allclose(rest[0] - rest[1], left[0] / TWIST, rtol=1e-8)
    np.testing.assert_allclose(rest[3] - rest[2], -0.01 + left[3] / 500, rtol=1e-8)
    np.testing.assert_allclose(common @ rest, 0.0, atol=1e-12)


def test_what_a_clutch_parts_is_a_line_of_its_own():
    np.testing.assert_allclose(turned(train(jr.CoulombClutch(9.0), DRIVEN)), 0.0, atol=1e-12)


class Yielding(jr.elements.AbstractLaw):
    """Carries 3 N·m at most: no angle bears more."""

    def force(self, t, x, v, state):
        return 3.0 * jnp.tanh(x / 0.01)

    def energy(self, t, x, state):
        return 0.03 * jnp.log(jnp.cosh(x / 0.01))

    def power_lost(self, t, x, v, state):
        return jnp.zeros_like(v)


def test_a_law_that_cannot_carry_its_load_is_named():
    with pytest.raises(jr.InputError) as refused:
        jr.static_equilibrium(train(Yielding(), DRIVEN))
    words = str(refused.value)
    assert "N*m about the axis" in words and "`coupling`" in words and "`fan`" in words
