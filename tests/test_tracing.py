"""What recompiles, what does not, and what happens inside jit and vmap."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr

TRACES = []


class CountingSpring(jr.AbstractAttachment):
    """A spring that notes each time its law is traced (Python runs only then)."""

    stiffness: jax.Array = jr.parameter("N/m")

    def forces(self, t, motions, state):
        TRACES.append(1)
        ((q, _),) = motions
        return (-self.stiffness * q * jnp.array([1.0, 1, 1, 0, 0, 0]),)


@pytest.fixture(scope="module")
def machine():
    return jr.Machine.in_line(
        {
            "disc": jr.Rotor(2.0, 0.018, 0.01, unbalance=jr.Unbalance(1e-4)),
            "shaft": jr.Shaft(length=0.3, diameter=0.01, rayleigh=(0.0, 1e-4)),
            "end": jr.PrescribedSpin(jr.CosineRamp(speed=100.0, duration=0.02)),
        },
        attachments={"spring": (CountingSpring(1e4), "disc")},
        gravity=(0.0, -9.81, 0.0),
    )


def test_no_recompile_when_values_change(machine):
    plan = jr.plan(machine, 0.02, 1000.0)
    jr.simulate(machine, 0.02, 1000.0, step=plan)["disc"].acceleration
    before = len(TRACES)
    values = machine.parameters()
    assert len(values) > 15
    for path, value in values.items():
        other = machine.set({path: value * 1.01 + 1e-6})
        run = jr.simulate(other, 0.02, 1000.0, step=plan)
        run["disc"].acceleration
        jr.plan(other, 0.02, 1000.0)
    # another step of the same number, another sample rate of as many samples: no recompile either
    jr.simulate(machine, 0.01, 2000.0, step=plan)
    assert len(TRACES) == before


def test_inside_jit_a_plan_is_needed(machine):
    with pytest.raises(jr.InputError, match="call `plan = jr.plan"):
        jax.jit(lambda m: jr.simulate(m, 0.02, 1000.0)["disc"].x)(machine)


def test_batch_of_runs_and_its_members(machine):
    plan = jr.plan(machine, 0.02, 1000.0)

    def run(e):
        return jr.simulate(machine.set({"disc.unbalance.eccentricity": e}), 0.02, 1000.0, step=plan)

    batch = eqx.filter_vmap(run)(jnp.array([1e-4, 2e-4, 3e-4]))
    with pytest.raises(jr.InputError, match=r"response.member\(i\)"):
        batch["disc"]
    for i, e in enumerate((1e-4, 2e-4, 3e-4)):
        one = run(e)["disc"]
        np.testing.assert_allclose(batch.member(i)["disc"].position, one.position, atol=1e-13)


def test_a_member_that_fails_fails_alone(machine):
    """A linearised spring of the wrong sign and size blows up; its neighbours do not notice."""
    plan = jr.plan(machine, 0.02, 1000.0)

    def run(k):
        return jr.simulate(machine.set({"spring.stiffness": k}), 0.02, 1000.0, step=plan)["disc"].x

    x = jax.vmap(run)(jnp.array([1e4, -1e300, 2e4]))
    assert not np.isfinite(x[1]).all()
    assert np.isfinite(x[0]).all() and np.isfinite(x[2]).all()
    np.testing.assert_allclose(x[0], run(1e4), atol=1e-13)


def test_failure_says_when_and_keeps_what_it_had(two_rotor):
    """Steps far too long for the speed: the numbers run away in the middle of the run."""
    machine = two_rotor()
    with pytest.raises(jr.SimulationFailed, match="left the finite numbers between t = ") as error:
        jr.simulate(machine, 2.5, 200.0, step=2.5e-3, initial="undeformed")
    kept = error.value.response
    assert 3 < kept.t.shape[0] < 501
    assert np.isfinite(kept["main"].x).all()
