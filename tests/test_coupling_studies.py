"""Couplings of a user: their own kind, names of parameters, study files, wrong numbers."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import at_instants, pull

import jaxrotor as jr

ASIDE = jr.Misalignment(2e-3, 0.5, 0.02, -0.4)
BORE = jr.Imperfection(1e-3, 0.7, 0.01, 1.1)


def random_motions(seed):
    rng = np.random.default_rng(seed)
    size = np.array([0.01, 0.01, 0.01, 0.1, 0.1, 1.0])
    return tuple(
        (jnp.asarray(size * rng.normal(size=6)), jnp.asarray(rng.normal(size=6))) for _ in "ab"
    )


class Membrane(jr.elements.AbstractCoupling):
    """A user's own: stretched by twist, as a pack of laces is."""

    stiffness: jax.Array = jr.parameter("N/m", positive=True)
    radius: jax.Array = jr.parameter("m", positive=True)

    def law(self, t, d, d_t, state):
        stretch = d[2] + 0.5 * self.radius * d[5] ** 2
        return self.stiffness * stretch * jnp.zeros(6).at[2].set(1).at[5].set(self.radius * d[5])

    def stored(self, t, d, state):
        return 0.5 * self.stiffness * (d[2] + 0.5 * self.radius * d[5] ** 2) ** 2

    def lost(self, t, d, d_t, state):
        return jnp.zeros(())


def test_a_users_own_coupling():
    """Its forces are its potential's, misalignment and bore included."""
    own = Membrane(1e5, 0.05, misalignment=ASIDE, imperfection=BORE)
    motions = random_motions(4)

    @jax.jit
    def potential(qa, qb):
        return own.energy(0.0, ((qa, motions[0][1]), (qb, motions[1][1])), None)

    slopes = jax.grad(potential, argnums=(0, 1))(motions[0][0], motions[1][0])
    np.testing.assert_allclose(pull(own, *motions), -np.stack(slopes), rtol=1e-11, atol=1e-9)
    assert np.abs(slopes[0][5]) > 1.0
    # and a machine takes it as it is: with hubs held along z it twists by its hardening alone
    rotor = jr.Rotor(1.0, 0.01, 0.01)
    machine = jr.Machine.in_line(
        {"a": rotor, "joint": Membrane(1e5, 0.05), "b": rotor}, fixed={"a": ("z",), "b": ("z",)}
    )
    q = np.zeros((2, 6))
    q[1, 5] = 0.3
    response = at_instants(machine, q, np.zeros((2, 6)))
    want = 1e5 * 0.05**2 / 2 * 0.3**3 / 0.01
    np.testing.assert_allclose(response["a"].acceleration[0, 5], want, rtol=1e-12)
    np.testing.assert_allclose(response["joint"].torque[0], want * 0.01, rtol=1e-12)


def test_names_reach_into_a_parallel():
    rotor = jr.Rotor(1.0, 0.01, 0.01)
    law = jr.elements.Parallel([jr.elements.KelvinVoigt(5.0), jr.elements.Maxwell(7.0, 1.0)])
    machine = jr.Machine.in_line({"a": rotor, "joint": jr.Coupling(phi=law), "b": rotor})
    assert float(machine.parameters()["joint.phi.parts.1.stiffness"]) == 7.0
    changed = machine.set({"joint.phi.parts.1.stiffness": 9.0})
    assert float(changed.get("joint.phi.parts.1.stiffness")) == 9.0
    assert float(changed["joint"].phi.parts[0].stiffness) == 5.0
    changed = machine.set({"joint.phi.parts.0": jr.elements.KelvinVoigt(6.0)})
    assert float(changed["joint"].phi.parts[0].stiffness) == 6.0
    with pytest.raises(jr.InputError, match="phi.parts.1.stiffness must be positive"):
        machine.set({"joint.phi.parts.1.stiffness": -1.0})
    with pytest.raises(jr.InputError, match="no parameter `2`"):
        machine.get("joint.phi.parts.2.stiffness")


STUDY = """
[[machine.line]]
name = "a"
kind = "Rotor"
mass = "1 kg"
polar_inertia = "0.01 kg*m^2"
transverse_inertia = "0.01 kg*m^2"

[[machine.line]]
name = "joint"
kind = "Coupling"
stiffness = ["20 N/mm", "20 N/mm", "0 N/m", "0 N*m/rad", "0 N*m/rad", "0 N*m/rad"]
x = { kind = "Progressive", coefficients = [1000, 1e9], damping = "3 N*s/mm" }
y = { kind = "Parallel", parts = [{ kind = "Backlash", gap = "0.1 mm", stiffness = "5 N/mm" }] }
misalignment = { offset = "0.2 mm", angle = "90 deg" }

[machine.line.theta]
kind = "StickSlipClutch"
capacity = "8 N*m"
slip_angle = "1 deg"
engagement = { kind = "Step", time = "1 s", after = 0.5 }

[machine.line.phi]
kind = "Parallel"
parts = [
    { kind = "BoucWen", stiffness = "300 N*m/rad", ratio = 0.2, yield_displacement = "1 mrad" },
    { kind = "Maxwell", stiffness = "3 kN*m/rad", damping = "4 N*m*s/rad" },
]

[[machine.line]]
name = "b"
kind = "Rotor"
mass = "1 kg"
polar_inertia = "0.01 kg*m^2"
transverse_inertia = "0.01 kg*m^2"

[simulation]
t_end = "1 s"
sample_rate = "1 kHz"
"""


def test_a_coupling_in_a_study_file(tmp_path):
    path = tmp_path / "line.toml"
    path.write_text(STUDY)
    read = jr.load(path).machine["joint"]
    built = jr.Coupling(
        [2e4, 2e4, 0, 0, 0, 0],
        x=jr.elements.Progressive([1000, 1e9], 3000.0),
        y=jr.elements.Parallel([jr.elements.Backlash(1e-4, 5000.0)]),
        theta=jr.StickSlipClutch(8.0, np.deg2rad(1.0), jr.Step(1.0, 0.5)),
        phi=jr.elements.Parallel(
            [jr.elements.BoucWen(300.0, 0.2, 1e-3), jr.elements.Maxwell(3000.0, 4.0)]
        ),
        misalignment=jr.Misalignment(2e-4, np.pi / 2),
    )
    assert eqx.tree_equal(read, built, rtol=1e-12)


@pytest.mark.parametrize(
    "right, wrong, sentence",
    [
        ('"3 N*s/mm"', '"3 N*m*s/rad"', 'x.damping must be in N*s/m, but "3 N*m*s/rad"'),
        ('"5 N/mm"', '"-5 N/mm"', "y.parts.0.stiffness must be positive, but is -5000 N/m"),
        ('kind = "Maxwell"', 'kind = "Maxwel"', 'phi.parts.1.kind "Maxwel" is unknown: did you'),
        ("ratio = 0.2", "ratio = 1.2", "ratio must be at most 1, but is 1.2"),
        ("parts = [{", "parts = { x = [{", ""),
        ("after = 0.5", 'after = "1 N"', "theta.engagement.after must be a number without a unit"),
    ],
)
def test_a_wrong_coupling_in_a_study_file(tmp_path, right, wrong, sentence):
    path = tmp_path / "line.toml"
    text = STUDY.replace(right, wrong)
    if not sentence:
        text, sentence = text.replace('"5 N/mm" }] }', '"5 N/mm" }] } }'), "y.parts must be a list"
    path.write_text(text)
    with pytest.raises(jr.InputError) as caught:
        jr.load(path)
    (found,) = caught.value.problems
    assert sentence in found and '`line "joint"`' in found


@pytest.mark.parametrize(
    "options, sentence",
    [
        (dict(stiffness=[1.0] * 5), "stiffness must be 6 numbers or 6 x 6 numbers, but has"),
        (dict(damping=np.full(6, np.nan)), "damping must be finite, but is nan"),
        (
            dict(x=jr.elements.KelvinVoigt(-3.0)),
            "x.stiffness must be zero or positive, but is -3 N/m",
        ),
        (dict(x=jr.elements.Backlash(-3.0, 1.0)), "x.gap must be zero or positive, but is -3 m"),
        (
            dict(misalignment=jr.Misalignment(-1e-3)),
            "misalignment.offset must be zero or positive, but is -0.001 m",
        ),
        (dict(misalignment=BORE), "misalignment must be made by Misalignment, but is"),
        (dict(imperfection=ASIDE), "imperfection must be made by Imperfection, but is"),
    ],
)
def test_wrong_numbers_are_refused(options, sentence):
    rotor = jr.Rotor(1.0, 0.01, 0.01)
    with pytest.raises(jr.InputError) as caught:
        jr.Machine.in_line({"a": rotor, "joint": jr.Coupling(**options), "b": rotor})
    (found,) = caught.value.problems
    assert found.startswith("`joint`: ") and sentence in found
