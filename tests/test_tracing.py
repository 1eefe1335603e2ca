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
    jr.simulate(machine, 0.02, 1000.0, step=5e-4)  # a step that no plan chose has its own
    before = len(TRACES)
    values = machine.parameters()
    assert len(values) > 15
    for path, value in values.items():
        other = machine.set({path: value * 1.01 + 1e-6})
        run = jr.simulate(other, 0.02, 1000.0, step=plan)
        run["disc"].acceleration
        jr.plan(other, 0.02, 1000.0)
    # another step, sample rate, or length of the run: no recompile either
    jr.simulate(machine, 0.01, 2000.0, step=plan)
    for t_end, step in ((0.035, 1e-3), (0.01, 2e-4)):
        run = jr.simulate(machine, t_end, 1000.0, step=step)
        assert run.t.size == run.y.shape[0] == round(t_end * 1000) + 1
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


def test_failure_says_when_and_keeps_what_it_had(machine):
    """What is pushed away from its place runs away, until numbers end."""
    machine = machine.set({"spring.stiffness": -1e5})
    with pytest.raises(jr.SimulationFailed, match="left the finite numbers between t = ") as error:
        jr.simulate(machine, 2.5, 200.0, step=5e-3, initial="undeformed")
    kept = error.value.response
    assert 3 < kept.t.shape[0] < 501
    assert np.isfinite(kept["disc"].x).all()
    with pytest.raises(jr.SimulationFailed, match="energy_audit: the run left .* t = ") as error:
        jr.energy_audit(machine, 2.5, 200.0, "undeformed", step=5e-3)
    audit = error.value.response
    assert 3 < audit.t.shape[0] < 501 and np.isfinite(audit.lost).all()


def test_a_free_line_is_planned_for_the_speed_that_it_reaches():
    """A torque takes an unbalanced rotor from rest to 500 rad/s; nobody said so beforehand."""
    machine = jr.Machine(
        {
            "rotor": jr.Rotor(2.0, 0.018, 0.010, unbalance=jr.Unbalance(1e-4, inclination=0.01)),
            "springs": jr.LinearSupport(
                [4e4, 4e4, 4e4, 90.0, 90.0, 0], [40.0, 40, 40, 0.1, 0.1, 0]
            ),
            "torque": jr.Torque(18.0),
        },
        {"springs": "rotor", "torque": "rotor"},
    )
    run = jr.simulate(machine, 0.5, 200.0, initial="undeformed")
    assert run.stats["planned_top_speed"] == pytest.approx(500.0, rel=0.15)
    fine = jr.simulate(machine, 0.5, 200.0, initial="undeformed", step=1e-4)
    for name in ("x", "y", "psi", "theta", "speed"):
        a, b = getattr(run["rotor"], name), getattr(fine["rotor"], name)
        assert float(jnp.max(jnp.abs(a - b))) < 1e-4 * float(jnp.max(jnp.abs(b)))
    # a state brings its speed too
    start = jr.State(run["rotor"].position[-1:], run["rotor"].velocity[-1:])
    assert jr.simulate(machine, 0.1, 200.0, initial=start).stats["planned_top_speed"] > 450.0
