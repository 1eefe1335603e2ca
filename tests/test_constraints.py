"""Held and prescribed coordinates of stations with mass, and what holding them takes.

The oracle is the textbook's partition, `M_ff a_f = Q_f - h_f - M_fp a_p`, with M and h of point
masses; the reaction is `M_pf a_f + M_pp a_p + h_p - Q_p`. All in the coordinates that are held: x, y, z, psi,
theta and chi = phi + psi theta/2, by `q = q(chi...)`, `v = T w`, `a = T b + T' w`.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import at_instants, newton, point_jacobian, unbalanced_cloud

import jaxrotor as jr

UNBALANCE = dict(e=0.3, angle=0.4, gamma=0.35, gamma_angle=-1.1)
ROTOR = jr.Rotor(1.3, 0.8, 0.5, jr.Unbalance(*UNBALANCE.values()))
POINTS = unbalanced_cloud(1.3, 0.8, 0.5, **UNBALANCE)
K, C = np.array([30.0, 40, 50, 6, 7, 8]), np.array([0.3, 0.4, 0.5, 0.06, 0.07, 0.08])
LOAD, GRAVITY = np.array([1.0, -2.0, 3.0]), np.array([0.5, -9.81, 0.2])
NAMES = ("x", "y", "z", "psi", "theta", "phi")


class Sway(jr.profiles.AbstractMotion):
    """A drift and a swing, with nothing zero at t = 0."""

    amplitude: jax.Array = jr.parameter()
    frequency: jax.Array = jr.parameter("rad/s")
    phase: jax.Array = jr.parameter("rad", default=0.7)

    def position(self, t):
        return self.amplitude * jnp.sin(self.frequency * t + self.phase) + 0.3 * t

    def jumps(self):
        return jnp.zeros(0)

    def at(self, t):
        s, c = np.sin(self.frequency * t + self.phase), np.cos(self.frequency * t + self.phase)
        w, a = self.frequency, self.amplitude
        return np.array([a * s + 0.3 * t, a * w * c + 0.3, -a * w**2 * s])


def machine(fixed=(), prescribed=()):
    return jr.Machine(
        {"rotor": ROTOR, "base": jr.LinearSupport(K, C), "load": jr.Force(1.0, LOAD)},
        {"base": "rotor", "load": "rotor"},
        gravity=GRAVITY,
        fixed={"rotor": fixed} if fixed else None,
        prescribed={"rotor": dict(prescribed)} if prescribed else None,
    )


def check_partition(response, given):
    """Every sample against the partitioned equations; `given`: coordinate -> (q, v, a) over time."""
    run = response["rotor"]
    held = [NAMES.index(name) for name in given]
    free = [i for i in range(6) if i not in held]
    for i, t in enumerate(np.asarray(response.t)):
        q, v, a = (np.asarray(x)[i] for x in (run.position, run.velocity, run.acceleration))
        T, T_t = np.eye(6), np.zeros((6, 6))
        T[5, 3:5], T_t[5, 3:5] = -0.5 * q[[4, 3]], -0.5 * v[[4, 3]]
        M, h = newton(q, v, *POINTS)
        masses, points = POINTS
        h = h - np.einsum("n,nai,a->i", masses, point_jacobian(q, points), GRAVITY)
        v = np.linalg.solve(T, v)
        a = np.linalg.solve(T, a - T_t @ v)
        M, h = T.T @ M @ T, T.T @ (h + M @ T_t @ v)
        q = np.append(q[:5], q[5] + 0.5 * q[3] * q[4])
        for name, motion in given.items():
            expected = motion(t)
            got = [x[NAMES.index(name)] for x in (q, v, a)]
            np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-13)
        Q = -K * q - C * v + np.append(LOAD, [0, 0, 0])
        a_f = np.linalg.solve(
            M[np.ix_(free, free)], Q[free] - h[free] - M[np.ix_(free, held)] @ a[held]
        )
        scale = np.max(np.abs(M) @ np.abs(a)) + np.max(np.abs(h)) + np.max(np.abs(Q))
        np.testing.assert_allclose(a[free], a_f, rtol=1e-11, atol=1e-12 * scale)
        reaction = np.zeros(6)
        reaction[held] = (M @ a + h - Q)[held]
        np.testing.assert_allclose(run.reaction[i], reaction, rtol=0, atol=1e-12 * scale)
        assert np.max(np.abs(M[np.ix_(held, free)])) > 0.01  # they are coupled
        np.testing.assert_allclose(run.power[i], reaction @ v, rtol=1e-10, atol=1e-11 * scale)


def states(m, count=4):
    """Random large motions at several times; what is held is the machine's own, not from here."""
    rng = np.random.default_rng(4)
    q = rng.uniform(-1, 1, (count, 1, 6)) * [0.3, 0.3, 0.3, 1.0, 1.0, 9.0]
    return at_instants(m, q, rng.uniform(-6, 6, (count, 1, 6)), np.linspace(0, 2, count))


STILL = lambda t: np.zeros(3)  # noqa: E731


@pytest.mark.parametrize(
    "fixed", [("z",), ("x", "z"), ("z", "psi", "theta"), ("phi",), ("x", "y", "z", "phi")]
)
def test_fixed_coordinates(fixed):
    check_partition(states(machine(fixed)), {name: STILL for name in fixed})


def test_zeroing_one_acceleration_would_be_wrong():
    """What the partition guards against: holding z of a tilted unbalanced rotor changes the rest."""
    held, unheld = (np.asarray(states(machine(f))["rotor"].acceleration) for f in (("z",), ()))
    assert np.all(held[:, 2] == 0.0) and np.all(np.abs(unheld[:, 2]) > 0.1)
    assert np.all(np.max(np.abs(np.delete(unheld - held, 2, axis=1)), axis=1) > 0.1)


def test_prescribed_coordinates_with_fixed_ones():
    spin, shake = Sway(0.5, 3.0), Sway(0.05, 7.0)
    m = machine(("z",), {"phi": spin, "x": shake})
    check_partition(states(m), {"z": STILL, "phi": spin.at, "x": shake.at})
    assert m.get("rotor.phi.amplitude") == 0.5
    other = m.set({"rotor.phi.amplitude": 0.25, "rotor.x.frequency": 9.0})
    check_partition(states(other), {"z": STILL, "phi": Sway(0.25, 3.0).at, "x": Sway(0.05, 9.0).at})


def test_stations_held_differently_stack_apart():
    """Three equal rotors, each held in its own way, move as three machines of one do."""
    ways = {"a": ("z",), "b": ("z", "theta"), "c": ()}
    alone = {
        name: states(jr.Machine({name: ROTOR}, {}, fixed={name: held} if held else None))[name]
        for name, held in ways.items()
    }
    nothing = jr.ElasticMatrix(np.zeros((12, 12)), np.zeros((12, 12)))
    line = jr.Machine.in_line(
        {"a": ROTOR, "1": nothing, "b": ROTOR, "2": nothing, "c": ROTOR},
        fixed={name: held for name, held in ways.items() if held},
    )
    one = alone["c"]
    q, v = (jnp.repeat(x[:, None], 3, axis=1) for x in (one.position, one.velocity))
    together = at_instants(line, q, v, np.linspace(0, 2, 4))
    for name, one in alone.items():
        for what in ("position", "velocity", "acceleration", "reaction"):
            np.testing.assert_allclose(
                getattr(together[name], what), getattr(one, what), rtol=1e-11, atol=1e-11
            )


def test_drive_torque_is_the_shafts_and_its_power_is_torque_times_speed(two_rotor):
    machine = two_rotor("paper")
    rng = np.random.default_rng(3)
    shape, t = (6, len(machine.wiring.stations), 6), np.linspace(0.2, 3.0, 6)
    angle = jax.vmap(machine["end"].profile.position)(t)
    q, v = rng.uniform(-1e-3, 1e-3, shape), rng.uniform(-1, 1, shape)
    q[..., 5] += np.asarray(angle)[:, None]
    response = at_instants(machine, q, v, t)
    end, shaft = response["end"], response["shaft 4"]
    forces = np.asarray(shaft.forces)
    scale = np.max(np.abs(forces), axis=(0, 1))
    assert np.all(np.abs(np.asarray(end.reaction) + forces[:, 1]) <= 1e-12 * scale)
    # the shaft's own torque leaves out what alpha M brakes against the ground
    np.testing.assert_allclose(end.reaction[:, 5], shaft.torque, rtol=0, atol=1e-6 * scale[5])
    speed = 500 * (1 - np.cos(np.pi * np.minimum(t, 2.5) / 2.5))
    np.testing.assert_allclose(end.speed, speed, rtol=1e-12)
    np.testing.assert_allclose(end.power, end.reaction[:, 5] * speed, rtol=1e-12)


def test_reactions_carry_the_weight_of_a_machine_at_rest():
    """Two held rotors on a shaft: the reactions along y sum to the weight, moments to zero."""
    machine = jr.Machine.in_line(
        {
            "a": jr.Rotor(2.0, 0.02, 0.012),
            "s": jr.Shaft(length=0.3, diameter=0.02),
            "b": jr.Rotor(3.0, 0.02, 0.012),
            "t": jr.Shaft(length=0.2, diameter=0.02),
            "c": jr.Rotor(1.0, 0.02, 0.012),
        },
        gravity=(0, -9.81, 0),
        fixed={"a": ("x", "y", "z", "phi"), "c": ("x", "y")},
    )
    rest = jr.static_equilibrium(machine)
    response = at_instants(machine, rest.position, rest.velocity)
    a, b, c = (np.asarray(response[n].reaction) for n in "abc")
    np.testing.assert_allclose(a[:, 1] + c[:, 1], 6 * 9.81, rtol=1e-9)
    np.testing.assert_allclose(c[:, 1] * 0.5, 9.81 * (3 * 0.3 + 1 * 0.5), rtol=1e-9)
    np.testing.assert_array_equal(b, 0.0)


@pytest.mark.parametrize("twist", ["paper", "invariant"])
def test_motion_without_a_look_at_the_forces(two_rotor, twist):
    """Positions and rates are those put in, the driven end's those given, and those of the whole field."""
    machine = two_rotor(twist)
    rng = np.random.default_rng(4)
    stations = machine.wiring.stations
    shape, t = (6, len(stations), 6), np.linspace(0.2, 3.0, 6)
    angle = np.asarray(jax.vmap(machine["end"].profile.position)(t))
    q, v = rng.uniform(-1e-3, 1e-3, shape), rng.uniform(-1, 1, shape)
    q[..., 5] += angle[:, None]
    response = at_instants(machine, q, v, t)
    for name in stations:
        if name != "end":
            i = stations.index(name)
            np.testing.assert_allclose(response[name].position, q[:, i], rtol=1e-12, atol=1e-15)
            # measured from 1000 rad/s, of which rounding is 1e-13
            np.testing.assert_allclose(response[name].velocity, v[:, i], rtol=1e-12, atol=2e-12)
    np.testing.assert_allclose(response["end"].phi, angle, rtol=1e-13)
    for own, whole in zip(response.motion, (response.evaluation.q, response.evaluation.v)):
        np.testing.assert_allclose(own, whole, rtol=1e-13, atol=1e-15)
