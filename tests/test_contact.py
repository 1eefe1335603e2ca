"""Rubs, stops and loose pedestals, and the solver that runs them."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxrotor as jr
from jaxrotor.integrators.rosenbrock import Rosenbrock

MASS, STIFFNESS, DAMPING = 2.0, 2e5, 20.0


def jeffcott(speed, parts, eccentricity=1e-4, mass=MASS):
    """A disc that moves in x and y on a spring, turning at a constant speed, and more parts at it."""
    support = jr.LinearSupport([STIFFNESS] * 2 + [0.0] * 4, [DAMPING] * 2 + [0.0] * 4)
    return jr.Machine.in_line(
        {"disc": jr.Rotor(mass, 0.01, 0.006, unbalance=jr.Unbalance(eccentricity))},
        attachments={"support": (support, "disc")} | {k: (v, "disc") for k, v in parts.items()},
        fixed={"disc": ("z", "psi", "theta")},
        prescribed={"disc": {"phi": jr.ConstantSpeed(speed)}},
    )


def motion(e=(0.0, 0.0), e_t=(0.0, 0.0), spin=0.0):
    return np.array([*e, 0, 0, 0, 0.3], float), np.array([*e_t, 0, 0, 0, spin], float)


RUB = jr.Rub(gap=1e-4, stiffness=1e6, radius=0.05, friction=0.2, hysteresis=0.5)


@jax.jit
def rubbed(ends):
    """Forces on the ends, power lost, and by how much the energy grows."""
    still = tuple((v, jnp.zeros(6)) for _, v in ends)
    _, growth = jax.jvp(lambda m: RUB.energy(0.0, m, None), (ends,), (still,))
    return RUB.forces(0.0, ends, None), RUB.power_lost(0.0, ends, None), growth


@pytest.mark.parametrize("spin", [200.0, -200.0])
def test_friction_opposes_the_sliding_at_every_angle(spin):
    """At 16 angles of contact, also where the rotor whirls backwards faster than its surface runs
    forwards."""
    for at in 2 * np.pi * np.arange(16) / 16:
        n = np.array([np.cos(at), np.sin(at)])
        tangent = np.array([-n[1], n[0]])
        for whirl in (0.0, 3.0, -30.0, 30.0):
            ends = (motion(1.5e-4 * n, whirl * tangent, spin),)
            (f,), lost, _ = rubbed(ends)
            slip = whirl + 0.05 * spin
            along = float(f[:2] @ tangent)
            assert float(f[:2] @ n) == pytest.approx(-1e6 * 0.5e-4, rel=1e-12)
            assert along == pytest.approx(-0.2 * 50.0 * np.sign(slip), rel=1e-12)
            assert float(f[5]) == pytest.approx(0.05 * along, rel=1e-12)
            assert float(lost) == pytest.approx(-along * slip)


def test_rub_loses_energy_and_keeps_momentum():
    """For any motion of rotor and stator: what both lose is stored or lost, never won."""
    rng = np.random.default_rng(3)
    touched = 0
    for _ in range(200):
        ends = tuple(
            motion(rng.normal(size=2) * 1e-4, 3 * rng.normal(size=2), 100 * rng.normal())
            for _ in "ab"
        )
        on, lost, growth = rubbed(ends)
        assert lost >= 0
        on, ends = jax.tree.map(np.asarray, (on, ends))
        power = float(sum(f @ v for f, (_, v) in zip(on, ends)))
        assert power == pytest.approx(-float(growth) - float(lost), rel=1e-9, abs=1e-9)
        np.testing.assert_allclose(on[0][:2], -on[1][:2])
        e = ends[0][0][:2] - ends[1][0][:2]
        moment = on[0][5] + on[1][5] + e[0] * on[0][1] - e[1] * on[0][0]
        assert abs(float(moment)) < 1e-9 * (1 + abs(float(on[0][5])))
        touched += lost > 0
    assert touched > 50


def test_contact_spring_is_a_spring():
    """In contact always, a contact is its spring: as stiffness and as contact, each by its default solver
    and step."""
    spring = jr.LinearSupport([1e6, 1e6, 0, 0, 0, 0])
    runs = [
        jr.simulate(jeffcott(400.0, {"rub": part}), 0.1, 2000.0, "undeformed", progress=False)
        for part in (spring, jr.Rub(0.0, 1e6, 0.05))
    ]
    assert [run.info.solver for run in runs] == ["ExponentialAdams", "Rosenbrock"]
    one, two = (np.asarray(run["disc"].position[:, :2]) for run in runs)
    assert np.max(np.abs(one - two)) < 1e-6 * np.max(np.abs(one))


def equations(speed, eccentricity, rub, mass=MASS):
    """Written by hand, as SciPy takes them."""

    def field(t, y):
        e, v = y[:2], y[2:]
        f = -STIFFNESS * e - DAMPING * v
        f = f + mass * eccentricity * speed**2 * np.array([np.cos(speed * t), np.sin(speed * t)])
        size = np.hypot(*e)
        u = size - float(rub.gap)
        if u > 0:
            n = e / size
            tangent = np.array([-n[1], n[0]])
            normal = float(rub.stiffness) * u * max(1 + float(rub.hysteresis) * (v @ n), 0.0)
            slip = v @ tangent + float(rub.radius) * speed
            friction = float(rub.friction) * normal * np.tanh(slip / float(rub.slip_speed))
            f = f - normal * n - friction * tangent
        return np.concatenate([v, f / mass])

    return field


def test_rub_against_other_equations():
    """Bouncing contact with friction, against SciPy's Radau."""
    speed, e = 330.0, 1e-4
    rub = jr.Rub(gap=1.5e-4, stiffness=1e6, radius=0.05, friction=0.1, hysteresis=0.5)
    run = jr.simulate(
        jeffcott(speed, {"rub": rub}, e), 0.1, 2000.0, "undeformed", rtol=1e-9, progress=False
    )
    other = solve_ivp(
        equations(speed, e, rub), (0, 0.1), np.zeros(4), "Radau", np.asarray(run.t),
        rtol=1e-10, atol=1e-14,
    )  # fmt: skip
    ours = np.asarray(run["disc"].position[:, :2])
    overlap = np.asarray(run["rub"].overlap)
    assert np.sum((overlap[1:] > 0) & (overlap[:-1] <= 0)) >= 3  # it bounces
    assert np.max(np.abs(ours - other.y[:2].T)) < 1e-6 * np.max(np.abs(ours))
    assert np.min(run["rub"].normal_force) >= 0


def test_smoothing_does_not_matter():
    """The sharp contact is the limit: a width of a hundredth of the gap moves the run by less than that, a
    tenth of it by ten times less or so."""
    runs = [
        jr.simulate(
            jeffcott(330.0, {"rub": jr.Rub(1.5e-4, 1e6, 0.05, 0.1, 0.5, smoothing=w)}),
            0.1, 2000.0, "undeformed", rtol=1e-9, progress=False,
        )["disc"].x[:101]
        for w in (0.0, 1.5e-6, 1.5e-7)
    ]  # fmt: skip
    size = np.max(np.abs(runs[0]))
    off = [float(np.max(np.abs(x - runs[0]))) / size for x in runs[1:]]
    assert off[0] < 1e-2 and off[1] < 0.2 * off[0]


def test_energy_of_a_rub():
    """A disc turning freely is braked by its rub; the books close."""
    rub = jr.Rub(gap=1e-4, stiffness=1e6, radius=0.05, friction=0.3, hysteresis=0.5)
    support = jr.LinearSupport([STIFFNESS] * 2 + [0.0] * 4, [DAMPING] * 2 + [0.0] * 4)
    machine = jr.Machine.in_line(
        {"disc": jr.Rotor(MASS, 0.001, 0.006, unbalance=jr.Unbalance(1e-4))},
        attachments={"support": (support, "disc"), "rub": (rub, "disc")},
        fixed={"disc": ("z", "psi", "theta")},
    )
    state = jr.State(jnp.zeros((1, 6)), jnp.zeros((1, 6)).at[0, 5].set(330.0))
    audit = jr.energy_audit(machine, 0.05, 2000.0, state, rtol=1e-10)
    assert audit.relative < 1e-8
    assert audit.kinetic[-1] < 0.9 * audit.kinetic[0]


def test_derivatives_through_contact_and_film():
    """By friction, gap and damping of a rub and clearance and viscosity of a film, in one machine."""
    rub = jr.Rub(1.5e-4, 1e6, 0.05, 0.1, 0.5, smoothing=1e-5)
    film = jr.JournalBearing(0.1, 0.02, 4e-4, 0.02)
    machine = jeffcott(330.0, {"rub": rub, "film": film})

    def own(m):
        return (
            m["rub"].friction,
            m["rub"].gap,
            m["rub"].hysteresis,
            m["film"].clearance,
            m["film"].viscosity,
        )

    def scalar(values, adjoint=None):
        changed = eqx.tree_at(own, machine, tuple(values))
        run = jr.simulate(
            changed, 0.02, 2000.0, "undeformed", step=5e-5, adjoint=adjoint, progress=False
        )
        return 1e8 * jnp.sum(run["disc"].x ** 2)

    at = jnp.stack(own(machine))
    value, reverse = jax.jit(jax.value_and_grad(scalar))(at)

    @jax.jit
    def ahead(values, along):
        """Value and slope: one direction at a time, values alone being asked for time and again."""
        mode = diffrax.ForwardMode()
        return jax.jvp(lambda v: scalar(v, mode), (values,), (along,))

    eye = np.eye(at.size)
    forward = [ahead(at, d)[1] for d in eye]
    assert ahead(at, eye[0])[0] == pytest.approx(float(value), rel=1e-12)
    steps = 1e-5 * np.diag(at)
    central = [(ahead(at + d, eye[0])[0] - ahead(at - d, eye[0])[0]) / (2 * d.sum()) for d in steps]
    np.testing.assert_allclose(forward, reverse, rtol=1e-11)
    np.testing.assert_allclose(reverse, central, rtol=1e-6)


def test_loose_pedestal_against_other_equations():
    """Pressed down firm, lifted loose: under unbalance beyond its weight the pedestal lifts, once in several
    turns or each; against SciPy."""
    firm, loose, speed, e = 8e5, 5e4, 260.0, 2e-4
    law = jr.elements.Bilinear(
        stiffness=loose, other_stiffness=firm, damping=40.0, other_damping=40.0
    )
    machine = jr.Machine.in_line(
        {"disc": jr.Rotor(MASS, 0.01, 0.006, unbalance=jr.Unbalance(e))},
        attachments={"pedestal": (jr.LawSupport(y=law), "disc")},
        gravity=(0.0, -9.81, 0.0),
        fixed={"disc": ("x", "z", "psi", "theta")},
        prescribed={"disc": {"phi": jr.ConstantSpeed(speed)}},
    )
    run = jr.simulate(machine, 0.2, 2000.0, "undeformed", rtol=1e-9, progress=False)

    def field(t, y):
        # either side pushes back, or lets go
        if y[0] > 0:
            f = -max(loose * y[0] + 40.0 * y[1], 0.0)
        else:
            f = max(-firm * y[0] - 40.0 * y[1], 0.0)
        return [y[1], (f - MASS * 9.81 + MASS * e * speed**2 * np.sin(speed * t)) / MASS]

    other = solve_ivp(field, (0, 0.2), [0, 0], "RK45", run.t, rtol=1e-11, atol=1e-15, max_step=2e-4)
    y = np.asarray(run["disc"].y)
    assert y.max() > 0 > y.min()
    assert np.max(np.abs(y - other.y[0])) < 1e-6 * np.max(np.abs(y))


def test_universal_joint_runs_unevenly():
    """A stiff joint between a steady drive and a light rotor: `w cos b/(1 - sin² b cos² a)`, a from where the
    driving yoke stands across the plane of the shafts; and the work of both torques balances."""
    w, bend = 100.0, np.deg2rad(30)
    machine = jr.Machine.in_line(
        {
            "driven": jr.PrescribedSpin(jr.ConstantSpeed(w)),
            "joint": jr.UniversalJoint(1e6, 100.0, bend, plane=0.3),
            "rotor": jr.Rotor(1.0, 1e-3, 1e-3),
        },
        fixed={"rotor": ("x", "y", "z", "psi", "theta")},
    )
    run = jr.simulate(machine, 0.2, 2000.0, "static", step=2e-5, progress=False)
    a = w * np.asarray(run.t) - 0.3
    # g = atan(cos b tan a): its derivative
    exact = w * np.cos(bend) / (np.cos(a) ** 2 + np.cos(bend) ** 2 * np.sin(a) ** 2)
    speed = np.asarray(run["rotor"].speed)
    late = slice(200, None)
    np.testing.assert_allclose(speed[late], exact[late], rtol=3e-4)
    assert exact.max() / exact.min() == pytest.approx(1 / np.cos(bend) ** 2, rel=1e-3)
    # the rotor starts a seventh too fast: a burst of microseconds, which the books need small steps for
    assert jr.energy_audit(machine, 0.01, 2000.0, "static", step=1e-6).relative < 1e-7
    with pytest.raises(jr.InputError, match="angle must be below 80 degrees"):
        machine.set({"joint.angle": 1.5})


def test_clearance_stops_hold():
    """Stops of a law to each side, and what a stop keeps of energy."""
    stops = jr.LawSupport(x=jr.elements.Backlash(2e-4, 1e7), y=jr.elements.Backlash(2e-4, 1e7))
    machine = jeffcott(330.0, {"stops": stops}, 2e-4)
    run = jr.simulate(machine, 0.05, 2000.0, "undeformed", progress=False)
    assert np.max(np.abs(run["disc"].position[:, :2])) < 1.4e-4
    assert jr.energy_audit(machine, 0.02, 2000.0, "undeformed", rtol=1e-10).relative < 1e-7
    with pytest.raises(jr.InputError, match="a law must be given"):
        jeffcott(1.0, {"stops": jr.LawSupport()})
    with pytest.raises(jr.InputError, match="smoothing must not exceed the gap"):
        jeffcott(1.0, {"rub": jr.Rub(1e-4, 1e6, 0.05, smoothing=2e-4)})


def test_rosenbrock_is_of_fifth_order_and_its_inside_of_fourth():
    """With a fixed step on a stiff smooth machine; samples between the steps come from inside them."""
    cubic = jr.LawSupport(
        x=jr.elements.Progressive([1e6, 1e14], 30.0), y=jr.elements.Progressive([1e6, 1e14])
    )
    machine = jeffcott(200.0, {"cubic": cubic}, 1e-3)

    def run(step):
        found = jr.simulate(
            machine, 0.02, 8000.0, "undeformed", solver=Rosenbrock(), step=step, progress=False
        )
        return np.asarray(found["disc"].position[:, :2])

    exact = run(1e-5)
    off = [np.abs(run(h) - exact) for h in (1e-3, 5e-4, 2.5e-4)]
    errors = [np.max(x[::8]) for x in off]  # where steps end
    assert errors[0] / errors[1] > 2**4.5 and errors[1] / errors[2] > 2**4.5
    between = [np.max(x) for x in off[:2]]
    assert between[0] / between[1] > 2**3.6


def test_rosenbrock_with_internal_states_and_a_batch():
    """Against Kvaerno5 where states of elements count too; a batch gives what single runs give."""
    maxwell = jr.LawSupport(x=jr.elements.Maxwell(3e5, 200.0), y=jr.elements.Bilinear(1e5, 3e5))
    machine = jeffcott(250.0, {"part": maxwell})
    settings = dict(progress=False, rtol=1e-10, atol=1e-14)
    one = jr.simulate(machine, 0.05, 1000.0, "undeformed", **settings)["disc"].x
    other = jr.simulate(machine, 0.05, 1000.0, "undeformed", solver=diffrax.Kvaerno5(), **settings)[
        "disc"
    ].x
    assert np.max(np.abs(one - other)) < 1e-8 * np.max(np.abs(one))

    def peak(e):
        own = eqx.tree_at(lambda m: m["disc"].unbalance.eccentricity, machine, e)
        return jr.simulate(own, 0.05, 1000.0, "undeformed", **settings)["disc"].x

    batch = jax.jit(jax.vmap(peak))(jnp.array([1e-4, 3e-4]))
    np.testing.assert_allclose(batch[0], one, rtol=0, atol=1e-9 * np.max(np.abs(one)))
