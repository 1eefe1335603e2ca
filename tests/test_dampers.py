"""The torsional vibration damper against Den Hartog's closed forms and the matrix exponential."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree
from scipy.linalg import expm
from scipy.optimize import minimize_scalar

import jaxrotor as jr
from jaxrotor.machine.field import jacobian, vector_field
from jaxrotor.machine.system import assemble

J, K = 0.04, 900.0  # the primary system: 150 rad/s
WN = np.sqrt(K / J)


def machine(damper, **more):
    """A rotor on a torsion spring whose other end spins at 80 rad/s."""
    return jr.Machine.in_line(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(80.0)),
            "spring": jr.Coupling([0.0, 0, 0, 0, 0, K]),
            "rotor": jr.Rotor(1.0, J, 0.03),
        },
        attachments={"damper": (damper, "rotor"), **more},
        fixed={"rotor": ("x", "y", "z", "psi", "theta")},
    )


@jax.jit
def amplitude(damper, w):
    """Twist by a torque of 1 N·m at w (rad/s), as part of the static one; from the linearisation."""
    A = jacobian(assemble(machine(damper)), jnp.asarray(80.0))
    torque = jnp.zeros(4).at[1].set(1 / J)  # (phi, phi', the ring's angle, its speed)
    torque = torque.at[3].set(-1 / J)  # what accelerates the hub leaves the ring behind
    y = jnp.linalg.solve(1j * w * jnp.eye(4) - A, torque.astype(complex))
    return jnp.abs(y[0]) * K


def den_hartog(mu, f, zeta, g):
    """Mechanical Vibrations, eq. 3.23: mass ratio, tuning, c/(2 m w_n), forcing w/w_n."""
    top = (2 * zeta * g) ** 2 + (g**2 - f**2) ** 2
    bottom = (2 * zeta * g) ** 2 * (g**2 - 1 + mu * g**2) ** 2
    bottom += (mu * f**2 * g**2 - (g**2 - 1) * (g**2 - f**2)) ** 2
    return np.sqrt(top / bottom)


@pytest.mark.parametrize("mu, f, zeta", [(0.05, 0.95, 0.1), (0.2, 0.8, 0.3), (0.1, 0.0, 0.2)])
def test_den_hartogs_receptance(mu, f, zeta):
    own = mu * J
    damper = jr.TorsionalDamper(own, 2 * own * WN * zeta, own * (f * WN) ** 2)
    for g in (0.3, 0.9, 1.0, 1.07, 2.0):
        np.testing.assert_allclose(
            amplitude(damper, g * WN), den_hartog(mu, f, zeta, g), rtol=1e-10
        )


def test_lanchesters_optimum():
    """The best viscous damper: no peak above 1 + 2/mu, at w_n sqrt(2/(2 + mu))."""
    mu = 0.1
    zeta = 1 / np.sqrt(2 * (1 + mu) * (2 + mu))
    damper = jr.TorsionalDamper(mu * J, 2 * mu * J * WN * zeta)
    peak = minimize_scalar(
        lambda g: -float(amplitude(damper, g * WN)), bounds=(0.8, 1.2), options=dict(xatol=1e-9)
    )
    assert -peak.fun == pytest.approx(21.0, rel=1e-9)
    assert peak.x == pytest.approx(np.sqrt(2 / (2 + mu)), rel=1e-6)


def test_ring_of_a_spinning_rotor_against_the_matrix_exponential():
    """A torque thrown on the spinning line; in absolute angles, which know no relative states."""
    own, c, k, torque = 0.01, 0.3, 150.0, 5.0
    parts = machine(
        jr.TorsionalDamper(own, c, k), push=(jr.Torque(jr.Step(0.0205, torque)), "rotor")
    )
    response = jr.simulate(
        parts, 0.2, 500.0, initial="undeformed", solver=diffrax.Dopri8(), step=5e-4
    )
    # angles of rotor and ring beyond the drive's, their rates, and a constant 1
    A = np.zeros((5, 5))
    A[0, 2] = A[1, 3] = 1
    A[2] = np.array([-K - k, k, -c, c, torque]) / J
    A[3] = np.array([k, -k, c, -c, 0.0]) / own
    t = np.asarray(response.t)
    y = np.array([expm(A * max(0.0, s - 0.0205)) @ [0, 0, 0, 0, 1] for s in t])
    np.testing.assert_allclose(response["rotor"].phi - 80 * t, y[:, 0], atol=1e-10)
    damper = response["damper"]
    np.testing.assert_allclose(damper.ring_angle, y[:, 1] - y[:, 0], atol=1e-10)
    want = k * (y[:, 1] - y[:, 0]) + c * (y[:, 3] - y[:, 2])
    np.testing.assert_allclose(damper.torque, want, atol=1e-7)
    assert np.ptp(want) > 1.0


def test_energy_of_a_damped_run_up():
    """The default solver; a ring dragged from 80 rad/s to and fro by a torque that is thrown on."""
    parts = machine(
        jr.TorsionalDamper(0.01, 1.0, 20.0), push=(jr.Torque(jr.Step(0.0205, 50.0)), "rotor")
    )
    audit = jr.energy_audit(parts, 0.2, 1000.0, initial="undeformed", step=2e-4)
    assert float(jnp.max(jnp.abs(audit.residual))) < 1e-6 * float(audit.lost[-1])
    # at the start the ring already turns with its hub
    assert float(audit.elastic[0]) == pytest.approx(0.5 * 0.01 * 80.0**2, rel=1e-12)


def test_derivatives():
    y = jnp.array([0.3, -2.0, 0.1, 5.0])

    def rates(p):
        return vector_field(0.0, y, assemble(machine(jr.TorsionalDamper(p[0], p[1], p[2]))))

    assert_derivatives_agree(rates, [0.004, 0.2, 70.0], step=1e-3)


@pytest.mark.parametrize(
    "numbers, sentence",
    [
        ((0.0, 1.0), "inertia must be positive, but is 0 kg*m^2"),
        ((1.0, -1.0), "damping must be zero or positive, but is -1 N*m*s/rad"),
        ((1.0, 1.0, -2.0), "stiffness must be zero or positive, but is -2 N*m/rad"),
    ],
)
def test_wrong_numbers_are_refused(numbers, sentence):
    with pytest.raises(jr.InputError, match="`damper`: ") as caught:
        machine(jr.TorsionalDamper(*numbers))
    assert sentence in str(caught.value)
