"""What machines stand on: ground that moves, rigid blocks, modes. Oracles: SciPy's splines and integrator,
closed forms, and the same foundation put together from stations and matrices."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from foundation_cases import (
    ARMS,
    BASE,
    FEET,
    FOOT,
    MOUNT,
    MOUNT_C,
    ROTORS,
    TENSOR,
    assembled,
    block,
    by_size,
    on,
)
from helpers import TIGHT, assert_derivatives_agree
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline
from scipy.linalg import eigh

import jaxrotor as jr
from jaxrotor.elements.bearings.base_motion import carried

el, pr = jr.elements, jr.profiles
RNG = np.random.default_rng(5)


# The ground's motion


def test_a_record_is_integrated_exactly():
    times = np.cumsum(RNG.uniform(0.01, 0.05, 40))
    values = RNG.normal(size=40)
    record = pr.AccelerationRecord(times, values)
    exact = make_interp_spline(times, values, k=1)
    t = np.linspace(times[0], times[-1], 333)[1:-1]
    found = jax.jit(jax.vmap(lambda s: pr.motion.differentiate(record.position, s)))(t)
    whole = exact.antiderivative(2), exact.antiderivative(1), exact
    for mine, theirs in zip(found, whole):
        np.testing.assert_allclose(mine, theirs(t), rtol=1e-11, atol=1e-13)
    # before: at rest; behind: the last speed
    assert float(record.position(jnp.asarray(times[0] - 1.0))) == 0.0
    speed = exact.antiderivative(1)(times[-1])
    np.testing.assert_allclose(
        record.position(jnp.asarray(times[-1] + 2.0)), whole[0](times[-1]) + 2.0 * speed, rtol=1e-12
    )


@pytest.mark.parametrize("slip", [0.0, 0.03])
def test_a_record_without_drift_ends_at_rest(slip):
    times = np.cumsum(RNG.uniform(0.01, 0.05, 60))
    values = RNG.normal(size=60) + 0.3
    settled = pr.AccelerationRecord(times, values).at_rest(slip)
    exact = make_interp_spline(times, np.asarray(settled.accelerations), k=1)
    assert abs(exact.antiderivative(1)(times[-1])) < 1e-13
    assert abs(exact.antiderivative(2)(times[-1]) - slip) < 1e-13
    # what was taken off is straight
    off = values - np.asarray(settled.accelerations)
    np.testing.assert_allclose(np.polyval(np.polyfit(times, off, 1), times), off, atol=1e-12)


def test_derivatives_of_motions():
    times = np.linspace(0.0, 1.0, 6)

    def place(x):
        record = pr.AccelerationRecord(times, x[:6]).at_rest(0.01)
        waves = pr.HarmonicMotion(x[6:7], x[7:8], rise=x[8])
        return jnp.stack([record.position(jnp.asarray(0.47)), waves.position(jnp.asarray(0.3))])

    assert_derivatives_agree(place, [0.3, -1.0, 0.4, 0.9, -0.2, 0.1, 0.02, 3.0, 0.7])


def test_waves_grow_from_rest():
    waves = pr.HarmonicMotion([0.3, 0.1], [0.5, 2.0], [0.0, 0.2], rise=1.0)
    sizes = pr.motion.differentiate(waves.position, jnp.zeros(()))
    np.testing.assert_allclose(sizes, 0.0, atol=1e-15)
    t = 1.7
    w = 2 * np.pi * np.array([0.5, 2.0])
    wanted = np.sum([0.3, 0.1] * np.sin(w * t) + [0.0, 0.2] * np.cos(w * t))
    np.testing.assert_allclose(waves.position(jnp.asarray(t)), wanted, rtol=1e-13)


# A spinning rotor on a base that shakes and pitches


M, JP, JT, SPIN = 5.0, 0.05, 0.03, 300.0
K = np.array([2e5, 3e5, 4e5, 9e3, 8e3, 0.0])
C = np.array([90.0, 110.0, 70.0, 4.0, 3.0, 0.0])
ARM = (0.02, -0.3, 0.1)  # m
SHAKE, PITCH = (1e-6, 7.0), (2e-6, 11.0)  # m, rad; Hz: small, for the angles' squares stay out


def shaken():
    base = el.BaseMotion(
        x=pr.HarmonicMotion([SHAKE[0]], [SHAKE[1]], rise=0.1),
        psi=pr.HarmonicMotion([PITCH[0]], [PITCH[1]], rise=0.1),
    )
    return jr.Machine(
        {"disc": jr.Rotor(M, JP, JT), "floor": el.MovingBase(base, [ARM], K, C)}, {"floor": "disc"}
    )


@functools.cache
def shaken_run():
    return jr.simulate(shaken(), 0.4, 500.0, initial="undeformed", speed=SPIN, **TIGHT)


def ground(t):
    """The six coordinates of the floor under the rotor, and their rates and accelerations, by hand."""

    def wave(size, frequency):
        w, s = 2 * np.pi * frequency, min(t / 0.1, 1.0)
        g = np.array(
            [s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2 / 0.1,
             60 * s * (1 - s) * (1 - 2 * s) / 0.01]
        )  # fmt: skip
        u = size * np.array([np.sin(w * t), w * np.cos(w * t), -(w**2) * np.sin(w * t)])
        return g[0] * u[0], g[1] * u[0] + g[0] * u[1], g[2] * u[0] + 2 * g[1] * u[1] + g[0] * u[2]

    out = np.zeros((3, 6))
    out[:, 0] = wave(*SHAKE)
    psi = np.array(wave(*PITCH))
    out[:, 3], out[:, 1], out[:, 2] = psi, -ARM[2] * psi, ARM[1] * psi  # rotation x arm
    return out


def gyroscopic(v):
    """Moments of the spin's momentum on psi and theta, to first order."""
    return np.array([0, 0, 0, -JP * SPIN * v[4], JP * SPIN * v[3], 0])


def integrated(rates):
    t = np.linspace(0.0, 0.4, 201)
    return solve_ivp(rates, (0, 0.4), np.zeros(12), "DOP853", t, rtol=1e-11, atol=1e-18).y[:6].T


INERTIA = np.array([M, M, M, JT, JT, JP])


def test_a_rotor_on_a_base_that_moves():
    def rates(t, y):
        q, v, b = y[:6], y[6:], ground(t)
        return [*v, *((-K * (q - b[0]) - C * (v - b[1]) + gyroscopic(v)) / INERTIA)]

    wanted = integrated(rates)
    found = np.asarray(shaken_run()["disc"].position)
    for i in range(5):
        scale = np.abs(wanted[:, i]).max()
        np.testing.assert_allclose(found[:, i], wanted[:, i], atol=2e-7 * scale)


def test_base_and_moving_frame_agree():
    """Measured in the floor's own frame: inertia forces of the ground's acceleration, and the gyroscopic
    moment I_p Omega omega of the pitch."""

    def rates(t, y):
        d, d_t, b = y[:6], y[6:], ground(t)
        force = -INERTIA * b[2] + gyroscopic(d_t) + gyroscopic(b[1])
        return [*d_t, *((-K * d - C * d_t + force) / INERTIA)]

    frame = np.stack([ground(t)[0] for t in np.linspace(0.0, 0.4, 201)])
    wanted = integrated(rates) + frame
    found = np.asarray(shaken_run()["disc"].position)
    for i in range(5):
        scale = np.abs(wanted[:, i]).max()
        np.testing.assert_allclose(found[:, i], wanted[:, i], atol=2e-7 * scale)


def test_signals_and_forces_of_a_base():
    run = shaken_run()
    np.testing.assert_allclose(
        run["floor"].ground[:, 0], [ground(t)[0, 0] for t in run.t], atol=1e-12 * SHAKE[0]
    )
    q, v = (np.asarray(x) for x in (run["disc"].position, run["disc"].velocity))
    b = np.stack([ground(t) for t in run.t])
    wanted = -K * (q - b[:, 0]) - C * (v - b[:, 1])
    got = np.asarray(run["floor"].forces)[:, 0]
    np.testing.assert_allclose(got[:, :5], wanted[:, :5], atol=1e-9 * np.abs(wanted).max())


# A block, by itself and from stations


def modal(base=None):
    """The same block by its modes: FOOT_C is proportional to FOOT."""
    Kg, Cg = (np.asarray(x) for x in block().ground_matrices())
    Mb = np.asarray(block().mass_matrix())
    squares, F = eigh(Kg, Mb)
    w = np.sqrt(squares)
    T = np.stack([np.asarray(carried(jnp.asarray(a))) for a in ARMS])
    return el.ModalFoundation(
        w / (2 * np.pi), np.diag(F.T @ Cg @ F) / (2 * w), T @ F, MOUNT, MOUNT_C,
        base=base, places=ARMS, participation=F.T @ Mb,
    ), F  # fmt: skip


def test_two_machines_on_a_block_and_on_its_modes():
    Mg, Cg, Kg = assembled()
    A = np.block(
        [[np.zeros((18, 18)), np.eye(18)], [-np.linalg.solve(Mg, Kg), -np.linalg.solve(Mg, Cg)]]
    )
    wanted = by_size(np.linalg.eigvals(A))
    for foundation in (block(), modal()[0]):
        found = by_size(np.linalg.eigvals(np.asarray(jr.linearize(on(foundation)).A)))
        np.testing.assert_allclose(found, wanted, rtol=1e-9)


def test_block_and_modes_feel_the_ground_alike():
    by_modes, F = modal(BASE)
    a, a_t = RNG.normal(size=(2, 6)) * 1e-3
    motions = tuple((jnp.asarray(q), jnp.asarray(v)) for q, v in RNG.normal(size=(2, 2, 6)) * 1e-3)
    t, still = jnp.asarray(0.13), (jnp.zeros(6),) * 2
    one, other = block(BASE), by_modes
    given = jnp.concatenate([F @ a, F @ a_t]), jnp.concatenate([a, a_t])
    for mine, theirs in zip(one.forces(t, motions, given[0]), other.forces(t, motions, given[1])):
        np.testing.assert_allclose(mine, theirs, rtol=1e-10, atol=1e-9)
    rates = [e.rates(t, motions, still, s) for e, s in zip((one, other), given)]
    np.testing.assert_allclose(rates[0][6:], F @ rates[1][6:], rtol=1e-9, atol=1e-9)
    for name in ("energy", "power_lost", "power_in"):
        values = [getattr(e, name)(t, motions, s) for e, s in zip((one, other), given)]
        np.testing.assert_allclose(*values, rtol=1e-10)


def test_a_block_rests_under_the_weight_of_its_machines():
    gravity = np.array([0.5, -9.81, 1.0])
    rest = jr.static_equilibrium(on(block(), gravity))
    load = np.concatenate([40.0 * gravity, np.zeros(3), 25.0 * gravity, np.zeros(3), np.zeros(6)])
    wanted = np.linalg.solve(assembled()[2], load)
    for k, name in enumerate(ROTORS):
        found = np.asarray(rest.position)[k]
        np.testing.assert_allclose(found[:5], wanted[6 * k : 6 * k + 5], rtol=2e-4, err_msg=name)
    np.testing.assert_allclose(np.asarray(rest.internal)[:6], wanted[12:], rtol=2e-4)


def test_energy_of_block_and_ground_closes():
    audit = jr.energy_audit(on(block(BASE)), 0.2, 1000.0, initial="undeformed", step=1.25e-4)
    assert audit.relative < 1e-8
    assert np.abs(audit.work_in).max() > 0.1 * audit.exchanged


def test_derivatives_of_foundations():
    t = jnp.asarray(0.13)
    q, v = RNG.normal(size=(2, 6)) * 1e-3
    state = jnp.asarray(RNG.normal(size=4) * 1e-3)
    shape = RNG.normal(size=(1, 6, 2))

    def push(x):
        base = el.BaseMotion(y=pr.HarmonicMotion(x[:1] * 1e-3, x[1:2]))
        e = el.ModalFoundation(
            x[2:4], x[4], shape * x[5], MOUNT[0] * x[6], MOUNT_C[0] * x[6], jnp.stack([x[7], x[7]]),
            base, ((0.1, x[8], 0.3),), jnp.ones((2, 6)) * x[9],
        )  # fmt: skip
        motions = ((jnp.asarray(q), jnp.asarray(v)),)
        rates = e.rates(t, motions, (jnp.zeros(6),), state)
        return jnp.concatenate([e.forces(t, motions, state)[0], rates])

    def block_push(x):
        e = el.FoundationBlock(
            x[0], jnp.asarray(TENSOR) * x[1], ARMS[:1] * x[2], MOUNT[0], FEET * x[3], FOOT * x[4]
        )
        motions = ((jnp.asarray(q), jnp.asarray(v)),)
        return e.rates(t, motions, (jnp.zeros(6),), jnp.tile(state, 3))[6:]

    assert_derivatives_agree(push, [1.1, 9.0, 20.0, 31.0, 0.05, 1.2, 0.9, 3.0, 0.2, 0.7])
    assert_derivatives_agree(block_push, [400.0, 1.1, 0.9, 1.2, 0.8])


def test_a_study_keeps_foundations(tmp_path):
    for foundation in (block(BASE), modal(BASE)[0], el.MovingBase(BASE, ARMS, MOUNT)):
        machine = on(foundation)
        path = tmp_path / "kept.toml"
        path.write_text(machine.to_toml(), encoding="utf-8")
        back = jr.load(path, run=False).machine
        assert jax.tree.structure(machine) == jax.tree.structure(back)
        for name, value in machine.parameters().items():
            np.testing.assert_array_equal(value, back.get(name), err_msg=name)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: el.MovingBase(BASE, ARMS, MOUNT[:1]), "stiffness must be six numbers or a row"),
        (lambda: el.MovingBase(el.BaseMotion(), ARMS, MOUNT), "a motion must be given for one of"),
        (
            lambda: block(BASE).__class__(1.0, -TENSOR, ARMS, MOUNT, FEET, FOOT),
            "inertia must be positive",
        ),
        (
            lambda: el.ModalFoundation([3.0], 0.1, np.ones((2, 3, 2)), MOUNT),
            "shapes must be given for",
        ),
        (
            lambda: el.ModalFoundation([3.0], 0.1, np.ones((2, 3, 1)), MOUNT, base=BASE),
            "places and participation are missing",
        ),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(jr.InputError, match=f"`base`: .*{words}"):
        on(make())


def test_a_foundation_names_its_stations():
    with pytest.raises(jr.InputError, match="acts at 2 stations, but 1 are given"):
        jr.Machine({"fan": ROTORS["fan"], "base": block()}, {"base": "fan"})


# Records from files


def test_a_record_is_read(tmp_path):
    table = tmp_path / "quake.csv"
    table.write_text("time [ms],north [g],up [cm/s2]\n0,0.1,5\n10,-0.2,6\n25,0.3,-7\n")
    record = jr.interop.read_accelerations(table, "north")
    np.testing.assert_allclose(record.times, [0.0, 0.01, 0.025], rtol=1e-15)
    np.testing.assert_allclose(record.accelerations, np.array([0.1, -0.2, 0.3]) * 9.80665)
    up = jr.interop.read_accelerations(table, column="up")
    np.testing.assert_allclose(up.accelerations, [0.05, 0.06, -0.07])
    peer = tmp_path / "quake.AT2"
    peer.write_text(
        "PEER DATABASE\nSomewhere, 1/1/40\nACCELERATION IN UNITS OF G\n"
        "NPTS=   7, DT=   .0050 SEC,\n  .1E-02 -.2E-02 .3E-02 .4E-02 .5E-02\n .6E-02 -.7E-02\n"
    )
    record = jr.interop.read_accelerations(peer)
    np.testing.assert_allclose(record.times, 0.005 * np.arange(7))
    np.testing.assert_allclose(record.accelerations[-1], -0.007 * 9.80665)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time [s],a [m/s^2],b [g]\n0,1,2\n1,2,3\n", "say which column"),
        ("time [s],a\n0,1\n1,2\n", "has no unit"),
        ("time [s],a [m]\n0,1\n1,2\n", "must be in m/s"),
        ("when [s],a [g]\n0,1\n1,2\n", "has no column `time`"),
        ("time [s],a [g]\n0,1\n0,2\n", "whose times increase"),
        ("time [m],a [g]\n0,1\n1,2\n", "must be in s"),
    ],
)
def test_a_record_that_cannot_be_read(tmp_path, text, words):
    file = tmp_path / "quake.csv"
    file.write_text(text)
    with pytest.raises(jr.InputError, match=words):
        jr.interop.read_accelerations(file)
