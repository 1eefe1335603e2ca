"""Elements with states of their own: a user's Maxwell element, and a filter of an acceleration."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree
from scipy.linalg import expm

import jaxrotor as jr
from jaxrotor.machine.field import vector_field
from jaxrotor.machine.system import assemble


class Maxwell(jr.AbstractElastic, jr.protocols.Stateful, jr.protocols.Energetic):
    """A spring and a damper in series, twisting: the spring's torque relaxes by exp(-k t/c)."""

    stiffness: jax.Array = jr.parameter("N*m/rad", positive=True)
    damping: jax.Array = jr.parameter("N*m*s/rad", positive=True)

    def initial(self):
        return jnp.zeros(1)  # angle of the damper

    def rates(self, t, motions, accelerations, state):
        (a, _), (b, _) = motions
        return self.stiffness / self.damping * (b[5] - a[5] - state)

    def forces(self, t, motions, state):
        (a, _), (b, _) = motions
        pull = jnp.zeros(6).at[5].set(self.stiffness * (b[5] - a[5] - state[0]))
        return pull, -pull

    def energy(self, t, motions, state):
        (a, _), (b, _) = motions
        return 0.5 * self.stiffness * (b[5] - a[5] - state[0]) ** 2

    def power_lost(self, t, motions, state):
        return self.damping * self.rates(t, motions, None, state)[0] ** 2


K, C, J1, J2 = 300.0, 4.0, 0.02, 0.05


def line(element):
    return jr.Machine.in_line(
        {"a": jr.Rotor(1.0, J1, 0.02), "m": element, "b": jr.Rotor(1.0, J2, 0.03)}
    )


def exact(k, c, t):
    """Angles and speeds of a and b and the damper's angle, by the matrix exponential."""
    A = np.zeros((5, 5))
    A[0, 2] = A[1, 3] = 1
    A[2] = np.array([-k, k, 0, 0, -k]) / J1
    A[3] = np.array([k, -k, 0, 0, k]) / J2
    A[4] = np.array([-k, k, 0, 0, -k]) / c
    return expm(A * t) @ np.array([0, 0, 0, 1.0, 0])


def start():
    v = np.zeros((2, 6))
    v[1, 5] = 1.0
    return jr.State(np.zeros((2, 6)), v)


@pytest.mark.parametrize(
    "solver, step", [(diffrax.Dopri8(), 1e-3), (None, 1e-3)], ids=["dopri8", "default"]
)
def test_a_users_maxwell_element(solver, step):
    response = jr.simulate(line(Maxwell(K, C)), 0.1, 100.0, start(), solver=solver, step=step)
    expected = np.array([exact(K, C, t) for t in np.asarray(response.t)])
    a, b = response["a"], response["b"]
    got = np.stack([a.phi, b.phi, a.velocity[:, 5], b.velocity[:, 5], response.y[:, -1]], axis=1)
    np.testing.assert_allclose(got, expected, atol=1e-11)
    # the force that it reports is that of its state
    torque = K * (expected[:, 1] - expected[:, 0] - expected[:, 4])
    np.testing.assert_allclose(response["m"].forces[:, 0, 5], torque, atol=1e-8)
    assert np.ptp(torque) > 1.0


def test_relaxation_of_a_held_twist():
    """Ends held apart by 0.01 rad: the torque falls as exp(-k t/c)."""

    class Held(jr.profiles.AbstractMotion):
        angle: jax.Array = jr.parameter("rad")

        def position(self, t):
            return self.angle + 0.0 * t

        def jumps(self):
            return jnp.zeros(0)

    machine = jr.Machine.in_line(
        {
            "a": jr.PrescribedSpin(Held(0.0)),
            "m": Maxwell(K, C),
            "r": jr.Rotor(1.0, J1, 0.02),
        },
        prescribed={"r": {"phi": Held(0.01)}},
    )
    response = jr.simulate(
        machine, 0.1, 100.0, initial="undeformed", solver=diffrax.Dopri8(), step=1e-3
    )
    expected = K * 0.01 * np.exp(-K / C * np.asarray(response.t))
    np.testing.assert_allclose(response["a"].reaction[:, 5], -expected, rtol=1e-11)
    np.testing.assert_allclose(response["r"].reaction[:, 5], expected, rtol=1e-11)


def test_states_of_stacked_elements_are_kept_apart():
    """Three of a kind, of two states each, with different numbers and starts: each its own line."""

    class Double(jr.AbstractElastic, jr.protocols.Stateful):
        """Two Maxwell elements side by side, the second with half the damping."""

        stiffness: jax.Array = jr.parameter("N*m/rad")
        damping: jax.Array = jr.parameter("N*m*s/rad")
        start: jax.Array = jr.parameter("rad", shapes=((2,),))

        def initial(self):
            return self.start

        def rates(self, t, motions, accelerations, state):
            (a, _), (b, _) = motions
            damping = self.damping * jnp.array([1.0, 0.5])
            return self.stiffness / damping * (b[5] - a[5] - state)

        def forces(self, t, motions, state):
            (a, _), (b, _) = motions
            torque = jnp.sum(self.stiffness * (b[5] - a[5] - state))
            pull = jnp.zeros(6).at[5].set(torque)
            return pull, -pull

    numbers = [(300.0, 4.0, (0.1, 0.3)), (200.0, 1.0, (-0.2, 0.5)), (500.0, 2.0, (0.3, -0.1))]
    wall, rotor = jr.PrescribedSpin(jr.ConstantSpeed(0.0)), jr.Rotor(1.0, J1, 0.02)
    elements = {}
    for i, n in enumerate(numbers):
        elements |= {f"m{i}": Double(*n), f"r{i}": rotor}
    places = {f"m{i}": ("wall", f"r{i}") for i in range(3)}
    together = jr.simulate(
        jr.Machine({"wall": wall, **elements}, places),
        0.05,
        100.0,
        initial="undeformed",
        solver=diffrax.Dopri8(),
        step=1e-3,
    )
    for i, (k, c, at) in enumerate(numbers):
        # phi'' = -k (2 phi - s1 - s2)/J, s1' = k (phi - s1)/c, s2' = 2 k (phi - s2)/c
        A = np.zeros((4, 4))
        A[0, 1] = 1
        A[1] = np.array([-2 * k, 0, k, k]) / J1
        A[2] = np.array([k, 0, -k, 0]) / c
        A[3] = np.array([k, 0, 0, -k]) / c * 2
        expected = np.array([expm(A * t) @ [0, 0, *at] for t in np.asarray(together.t)])
        np.testing.assert_allclose(together[f"r{i}"].phi, expected[:, 0], atol=1e-11)
        torque = k * (2 * expected[:, 0] - expected[:, 2] - expected[:, 3])
        np.testing.assert_allclose(together[f"m{i}"].forces[:, 0, 5], torque, atol=1e-8)


class Accelerometer(jr.AbstractAttachment, jr.protocols.Stateful):
    """A low-pass filter of the acceleration along x, without a force."""

    time_constant: jax.Array = jr.parameter("s", positive=True)

    def initial(self):
        return jnp.zeros(1)

    def rates(self, t, motions, accelerations, state):
        return (accelerations[0][0] - state) / self.time_constant

    def forces(self, t, motions, state):
        return None


@pytest.mark.parametrize("place", ["r", "r.mass_centre"])
def test_a_state_that_measures_an_acceleration(place):
    """Free spin at W about the mass centre: the geometric centre circles it at radius e."""
    e, W, tau = 0.02, 40.0, 0.01
    machine = jr.Machine(
        {"r": jr.Rotor(2.0, 0.02, 0.03, jr.Unbalance(e)), "filter": Accelerometer(tau)},
        {"filter": place},
    )
    q, v = np.zeros((1, 6)), np.zeros((1, 6))
    v[0, 5], v[0, 1] = W, -e * W  # the mass centre at rest at (e, 0)
    response = jr.simulate(machine, 0.1, 100.0, jr.State(q, v), solver=diffrax.Dopri8(), step=1e-3)
    t = np.asarray(response.t)
    # a_x = e W² cos(W t) of C, nothing of P
    gain = e * W**2 / (1 + 1j * W * tau)
    expected = (gain * (np.exp(1j * W * t) - np.exp(-t / tau))).real
    np.testing.assert_allclose(response.y[:, -1], expected if place == "r" else 0.0, atol=1e-10)


def test_derivatives_reach_an_elements_own_numbers():
    machine = line(Maxwell(K, C))
    y = jnp.linspace(-1.0, 1.0, 25)

    def rates(x):
        return vector_field(0.0, y, assemble(machine.set({"m.stiffness": x[0], "m.damping": x[1]})))

    assert_derivatives_agree(rates, [K, C], rtol=1e-8, step=1e-3)
