"""The energy audit, on the paper's start-up and on machines whose balance is known."""

import jax.numpy as jnp
import numpy as np
import pytest
from apart import apart, spinning

import jaxrotor as jr


@pytest.mark.parametrize("twist", ["paper", "invariant"])
def test_balance_of_the_start_up(two_rotor, twist):
    """1e-6 of the energy exchanged over ten seconds, at the default step."""
    audit = jr.energy_audit(two_rotor(twist), 10.0, 1000.0, initial="undeformed")
    assert float(audit.relative) < 1e-6
    # the spinning rotors' own energy, by hand, and a start-up that loses as much in its friction
    assert float(audit.kinetic[-1]) == pytest.approx(
        0.5 * (0.01873 + 0.00485) * 1000.0**2, rel=1e-3
    )
    assert float(audit.lost[-1]) > 0.3 * float(audit.work_in[-1])
    assert np.all(np.diff(np.asarray(audit.lost)) >= 0)


def conservative(**shaft):
    """Two rotors free in space on a shaft without damping; unbalanced, tilted, imperfect."""
    return jr.Machine.in_line(
        {
            "a": jr.Rotor(
                2.0,
                0.012,
                0.008,
                unbalance=jr.Unbalance(1e-3, 0.4, 0.02, 1.0),
                imperfection=jr.Imperfection(offset=5e-4, angle=2.0, inclination=5e-3),
            ),
            "shaft": jr.Shaft(length=0.3, diameter=0.015, **shaft),
            "b": jr.Rotor(3.0, 0.010, 0.006, unbalance=jr.Unbalance(5e-4, -1.0, -0.01, 0.3)),
        },
        gravity=(0.3, -9.81, 0.0),
    )


@pytest.mark.parametrize("twist", ["paper", "invariant"])
def test_conservative_machine(twist):
    """No damping, no drive: kinetic, elastic and potential energy add up to 1e-10 of what they
    exchange, with imperfection and both twist laws."""
    audit = jr.energy_audit(
        conservative(twist=twist), 0.1, 2000.0, initial="undeformed", speed=80.0, step=2e-5
    )
    assert float(jnp.max(jnp.abs(audit.work_in))) == 0.0
    assert float(jnp.max(jnp.abs(audit.lost))) == 0.0
    assert float(jnp.ptp(audit.elastic)) > 1e-3  # it does exchange energy
    assert float(audit.relative) < 1e-10


def test_rotating_damping_balances_and_feeds_the_whirl():
    """Above its threshold internal damping feeds the whirl; spin pays for it, and the books close."""
    machine = jr.Machine.in_line(
        {
            "disc": jr.Rotor(2.0, 0.012, 0.008, unbalance=jr.Unbalance(1e-4)),
            "shaft": jr.Shaft(length=0.3, diameter=0.015, rayleigh=(0.0, 2e-4), damping="rotating"),
            "end": jr.PrescribedSpin(jr.ConstantSpeed(900.0)),
        }
    )
    audit = jr.energy_audit(machine, 0.2, 4000.0, initial="undeformed")
    assert float(audit.relative) < 1e-6
    grown = np.asarray(audit.elastic)
    assert grown[-100:].max() > 2 * grown[100:200].max()


def test_loads_are_work_put_in():
    """Torques on two free balanced rotors that know nothing of each other, and jump at one instant: all of
    their work becomes kinetic energy, (J w)²/(2 J). (In the field one jumps 1e-12 s after the other.)"""
    jump, inertia = 0.0333, (0.012, 0.02)
    machine = apart({k: jr.Torque(jr.Step(jump, 0.6, -0.2)) for k in ("a", "b")}, inertia)
    audit = jr.energy_audit(machine, 0.1, 1000.0, spinning([0.0, 3.0]), step=1e-3)
    t = np.asarray(audit.t)
    impulse = np.where(t < jump, -0.2 * t, -0.2 * jump + 0.6 * (t - jump))
    kinetic = sum((J * w + impulse) ** 2 / (2 * J) for J, w in zip(inertia, (0.0, 3.0)))
    np.testing.assert_allclose(audit.kinetic, kinetic, atol=1e-12)
    np.testing.assert_allclose(audit.work_in, kinetic - kinetic[0], atol=1e-12)


def test_an_element_without_accounts_is_refused(two_rotor):
    class Silent(jr.AbstractElastic):
        k: jnp.ndarray = jr.parameter("N/m")

        def forces(self, t, motions, state):
            (qa, _), (qb, _) = motions
            pull = self.k * (qb - qa)
            return pull, -pull

    machine = jr.Machine.in_line(
        {"a": jr.Rotor(1.0, 0.01, 0.01), "c": Silent(1e3), "b": jr.Rotor(1.0, 0.01, 0.01)}
    )
    with pytest.raises(jr.InputError, match="`c`: Silent keeps no account of its energy: let"):
        jr.energy_audit(machine, 0.1, 1000.0)
