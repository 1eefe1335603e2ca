"""Ports, imperfections, and how the machine gathers: every element where it is wired, and no other."""

import jax
import jax.numpy as jnp
import numpy as np
from helpers import TIGHT, at_instants, pull
from scipy.spatial.transform import Rotation

import jaxrotor as jr
from jaxrotor.core.kinematics import to_turning

E_ANGLE, ECCENTRICITY = 0.4, 0.02


def test_a_machine_is_the_sum_of_its_elements():
    """Accelerations and reactions of a machine with every kind of part, mixed stations, ports, an
    imperfection and a branch, against a plain loop over elements."""
    rng = np.random.default_rng(5)
    shaft = jr.Shaft(length=0.3, diameter=0.02, rayleigh=(0.5, 1e-5))
    turning = jr.Shaft(length=0.2, diameter=0.03, rayleigh=(0.5, 1e-5), damping="rotating")
    bearing = jr.SelfAligningBearing(1.0, 1e6, 200.0, 5.0, 0.002)
    rotor = jr.Rotor(2.0, 0.02, 0.012, jr.Unbalance(ECCENTRICITY, E_ANGLE, 0.1, 0.2))
    bent = jr.Rotor(3.0, 0.02, 0.012, jr.Unbalance(0.01), jr.Imperfection(0.01, 0.5, 0.02, -0.3))
    K, C = rng.normal(size=(2, 12, 12)) * 1e3
    machine = jr.Machine(
        {
            "push": jr.Force(30.0, (0.3, -0.5, 0.2)),
            "one": rotor,
            "end": jr.PrescribedSpin(jr.ConstantSpeed(50.0), angle=0.3),
            "s1": shaft,
            "left": bearing,
            "matrix": jr.ElasticMatrix(K, C),
            "s2": turning,
            "body": jr.RigidBody(1.5, (0.01, 0.012, 0.015), (0.01, 0.02, -0.01)),
            "two": bent,
            "s3": shaft,
            "right": bearing,
            "s4": jr.Shaft(length=0.1, diameter=0.02, twist="paper"),
            "twist": jr.Torque(jr.Step(0.1, 5.0, 3.0)),
            "three": rotor,
            "s5": turning,
            "held": jr.LinearSupport(rng.normal(size=(6, 6)) * 1e3, (1.0,) * 6),
        },
        {
            "s1": ("one", "left"),
            "s2": ("left", "two"),
            "s3": ("two", "right"),
            "s4": ("right", "end"),
            "matrix": ("body", "two"),
            "s5": ("one", "three"),
            "push": "three.mass_centre",
            "twist": "two",
            "held": "body",
        },
        gravity=(0.1, -9.81, 0.3),
    ).filled()
    names = machine.wiring.stations
    q = rng.uniform(-1, 1, (len(names), 6)) * [0.01, 0.01, 0.01, 0.1, 0.1, 1.0]
    v = rng.uniform(-1, 1, (len(names), 6)) * 5.0
    response = at_instants(machine, q, v)
    q[names.index("end")] = [0, 0, 0, 0, 0, 0.3]
    v[names.index("end")] = [0, 0, 0, 0, 0, 50.0]
    motions = {name: (jnp.asarray(q[i]), jnp.asarray(v[i])) for i, name in enumerate(names)}

    def seen(place):
        """The motion of a place, and the matrix that takes forces there to the station."""
        station, _, port = place.partition(".")
        x, x_t = map(np.asarray, motions[station])
        d = np.zeros(6)
        J = np.eye(6)
        if place == "three.mass_centre":
            R = Rotation.from_euler("XYZ", x[3:]).as_matrix()
            arm = R @ [ECCENTRICITY * np.cos(E_ANGLE), ECCENTRICITY * np.sin(E_ANGLE), 0]
            rx = Rotation.from_euler("x", x[3]).as_matrix()
            rxy = rx @ Rotation.from_euler("y", x[4]).as_matrix()
            turning = [[1, 0, 0], rx[:, 1], rxy[:, 2]]
            d[:3] = arm
            J[:3, 3:] = np.stack([np.cross(axis, arm) for axis in turning], axis=1)
        if place == "two":
            # physics.md: the elastic parts feel the displacement from the turned shape
            s, c = np.sin, np.cos
            f, g = x[5] + 0.5, x[5] - 0.3
            d = -np.array([0.01 * c(f), 0.01 * s(f), 0, 0.02 * c(g), 0.02 * s(g), 0])
            J[:, 5] += -np.array([-0.01 * s(f), 0.01 * c(f), 0, -0.02 * s(g), 0.02 * c(g), 0])
        return (jnp.asarray(x + d), jnp.asarray(J @ x_t)), J

    total = {name: np.zeros(6) for name in names}
    for name, places in machine.connections().items():
        parts = [seen(place) for place in places]
        forces = pull(machine[name], *(m for m, _ in parts))
        np.testing.assert_allclose(response[name].forces[0], forces, rtol=1e-9, atol=1e-9)
        for place, (_, J), force in zip(places, parts, forces):
            total[place.partition(".")[0]] += J.T @ force
    for name in names:
        part, run = machine[name], response[name]
        if name == "end":
            np.testing.assert_allclose(run.reaction[0], -total[name], rtol=1e-11)
            continue
        Q = total[name] + np.asarray(part.weight(*motions[name][:1], machine.gravity))
        if isinstance(part, jr.SelfAligningBearing):
            Q = Q + pull(part, motions[name])[0]
        a = part.acceleration(*motions[name], jnp.asarray(Q))
        np.testing.assert_allclose(run.acceleration[0], a, rtol=1e-10, atol=1e-8)
        np.testing.assert_array_equal(run.reaction[0], 0.0)


def test_force_on_the_mass_centre_has_its_moment():
    """A push through the mass centre does not turn a body; one through the geometric centre does."""
    rotor = jr.Rotor(2.0, 0.02, 0.012, jr.Unbalance(ECCENTRICITY, E_ANGLE))
    q, v = np.array([[0, 0, 0, 0.2, -0.3, 0.5]]), np.zeros((1, 6))
    F = np.array([30.0, -10.0, 20.0])

    def accelerations(place):
        machine = jr.Machine({"r": rotor, "push": jr.Force(1.0, F)}, {"push": place})
        response = at_instants(machine, q, v)
        return np.asarray(response["r"].acceleration)[0], response

    a, response = accelerations("r.mass_centre")
    np.testing.assert_allclose(a[:3], F / 2.0, rtol=1e-12)
    np.testing.assert_allclose(a[3:], 0, atol=1e-10)
    R = Rotation.from_euler("XYZ", q[0, 3:]).as_matrix()
    arm = R @ [ECCENTRICITY * np.cos(E_ANGLE), ECCENTRICITY * np.sin(E_ANGLE), 0]
    np.testing.assert_allclose(response["r"].mass_centre[0], arm, rtol=1e-12)
    a, _ = accelerations("r")
    assert np.max(np.abs(a[3:])) > 1.0


# Imperfection

IMPERFECT = jr.Imperfection(offset=2e-3, angle=0.6, inclination=0.02, inclination_angle=-0.9)


def line(imperfection=IMPERFECT, unbalance=0.0, **options):
    """Everything elastic and nothing damped, free to spin."""
    rotor = jr.Rotor(2.0, 0.02, 0.012, jr.Unbalance(unbalance, 0.3, unbalance), imperfection)
    stiff = np.array([2e5, 2e5, 1e5, 40.0, 40.0, 0.0])
    return jr.Machine.in_line(
        {
            "a": jr.Rotor(1.0, 0.01, 0.006),
            "s": jr.Shaft(length=0.3, diameter=0.012, **options),
            "r": rotor,
            "t": jr.Shaft(length=0.2, diameter=0.012, **options),
            "b": jr.Rotor(1.0, 0.01, 0.006),
        },
        attachments={n: (jr.LinearSupport(stiff), n[1]) for n in ("ka", "kb")},
    )


def shape(phi):
    """The rotor where its imperfection puts it."""
    d = IMPERFECT
    at, about = phi + d.angle, phi + d.inclination_angle
    o, i = d.offset, d.inclination
    return np.array([o * np.cos(at), o * np.sin(at), 0, i * np.cos(about), i * np.sin(about), phi])


def turned_by(q):
    """Six coordinates whose last is chi, with phi in its place."""
    return np.append(q[:5], q[5] - 0.5 * q[3] * q[4])


def test_imperfection_alone_causes_no_force():
    phi = 0.8
    q = np.zeros((3, 6))
    q[:, 5] = phi
    # a rotor that sits askew is tilted, but not turned: its chi is the shaft's, phi less by psi theta/2
    q[1] = turned_by(shape(phi))
    response = at_instants(line(), q, np.zeros((3, 6)))
    for name in ("a", "r", "b"):
        np.testing.assert_allclose(response[name].acceleration[0], 0, atol=1e-9)
    for name in ("s", "t"):
        np.testing.assert_allclose(response[name].forces[0], 0, atol=1e-9)
    # and it is where the line comes to rest
    rest = jr.static_equilibrium(line())
    np.testing.assert_allclose(rest.position[1], turned_by(shape(0.0)), atol=1e-11)
    np.testing.assert_allclose(rest.position[0], 0, atol=1e-11)
    # while the same rotor in the middle bends the shaft
    q[1] = [0, 0, 0, 0, 0, phi]
    response = at_instants(line(), q, np.zeros((3, 6)))
    assert np.max(np.abs(response["s"].forces[0])) > 10.0


def test_angle_of_a_rotor_turns_unbalance_and_imperfection():
    turned = jr.Rotor(2.0, 0.02, 0.012, jr.Unbalance(0.01, 0.3, 0.1, 0.2), IMPERFECT, angle=0.7)
    other = jr.Rotor(
        2.0,
        0.02,
        0.012,
        jr.Unbalance(0.01, 1.0, 0.1, 0.9),
        jr.Imperfection(2e-3, 0.6 + 0.7, 0.02, -0.9 + 0.7),
    )
    q, v, Q = np.random.default_rng(0).normal(size=(3, 6))
    q = jnp.asarray(q)
    np.testing.assert_allclose(
        turned.acceleration(q, v, Q), other.acceleration(q, v, Q), rtol=1e-11
    )
    for port in ("", "mass_centre"):
        np.testing.assert_allclose(turned.shift(port, q), other.shift(port, q), rtol=1e-12)


def test_a_free_line_with_imperfection_keeps_its_energy_and_spins_freely():
    """What turns with phi also acts on phi: leave that out and energy comes from nothing."""
    machine = line(unbalance=1e-3)
    q, v = np.zeros((3, 6)), np.zeros((3, 6))
    v[:, 5] = 150.0
    response = jr.simulate(machine, 0.1, 2000.0, jr.State(q, v), **TIGHT)

    def energy(motions):
        total = sum(machine[n].kinetic_energy(*motions[n]) for n in "arb")
        for name, places in machine.connections().items():
            ends = []
            for place in places:
                x, x_t = to_turning(*motions[place])
                d = -shape_of(x[5]) if place == "r" else jnp.zeros(6)
                ends.append((x + d, x_t))
            total += machine[name].energy(0.0, tuple(ends), None)
        return total

    def shape_of(phi):
        d = IMPERFECT
        at, about = phi + d.angle, phi + d.inclination_angle
        parts = [d.offset * jnp.cos(at), d.offset * jnp.sin(at), 0.0 * at]
        parts += [d.inclination * jnp.cos(about), d.inclination * jnp.sin(about), 0.0 * at]
        return jnp.stack(parts)

    motions = {n: (response[n].position, response[n].velocity) for n in "arb"}
    E = jax.jit(jax.vmap(energy))(motions)
    spin = np.asarray(response["r"].velocity)[:, 5]
    kinetic = 0.5 * 0.02 * spin**2
    assert np.ptp(kinetic) > 1e-3  # the spin does take part
    assert np.max(np.abs(response["r"].position[:, 0])) > 1e-3
    assert np.ptp(E) < 1e-10 * np.ptp(kinetic) + 1e-13 * np.max(E)
