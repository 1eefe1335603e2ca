"""Control loops against transfer functions, exact discrete solutions, and older parts of the library."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.interpolate
from helpers import assert_derivatives_agree
from scipy.linalg import expm

import jaxrotor as jr
from jaxrotor.elements import PD, Actuator, RelativeStates, StateFeedback
from jaxrotor.elements.control.actuator import soft_clip

J, K, C = 0.02, 400.0, 0.01  # a disc on a torsion spring: 141 rad/s
SPRING = jr.Coupling((0, 0, 0, 0, 0, K), damping=(0, 0, 0, 0, 0, C))


def disc(loop, at=("disc", "end"), spring=SPRING, speed=0.0):
    return jr.Machine.in_line(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(speed)),
            "spring": spring,
            "disc": jr.Rotor(1.0, J, 0.02),
        },
        attachments={"loop": (loop, at)},
        fixed={"disc": ("x", "y", "z", "psi", "theta")},
    )


def turning(w=1.0):
    return jr.State(np.zeros((2, 6)), np.array([[0.0] * 6, [0.0] * 5 + [w]]))


# In continuous time: the closed loop's receptance from a transfer function written by hand.

S = 1j * np.array([3.0, 80.0, 141.0, 150.0, 600.0])
TAU, LAG, CUT = 0.004, 250.0, 500.0
WC, ZC = 120.0, 0.2


def butterworth(s):
    return CUT**2 / (s**2 + np.sqrt(2) * CUT * s + CUT**2)


def pade(s):
    """Numerator of degree 2 and denominator of degree 3 of exp(-s tau), by SciPy from the Taylor series."""
    series = np.cumprod([1.0, *(-1.0 / np.arange(1, 6))])
    p, q = scipy.interpolate.pade(series, 3, 2)
    return p(s * TAU) / q(s * TAU)


CONTROLLERS = {
    "PD": (jr.elements.PD(50.0, 0.4), lambda s: -(50.0 + 0.4 * s)),
    "resonant": (
        jr.elements.ResonantController(0.7, WC, ZC),
        lambda s: -0.7 * s * 2 * ZC * WC * s / (s**2 + 2 * ZC * WC * s + WC**2),
    ),
    "positive position": (
        jr.elements.PositivePositionFeedback(90.0, WC, ZC),
        lambda s: 90.0 * WC**2 / (s**2 + 2 * ZC * WC * s + WC**2),
    ),
    "state feedback": (jr.elements.StateFeedback([30.0, 0.2]), lambda s: -(30.0 + 0.2 * s)),
    "compensator": (
        jr.elements.Compensator(
            [[-50.0, 9.0], [2.0, -70.0]], [[3.0, 0.1], [-1.0, 0.2]], [40.0, 5.0]
        ),
        lambda s: np.array(
            [
                np.array([40.0, 5.0])
                @ np.linalg.solve(
                    x * np.eye(2) - np.array([[-50.0, 9.0], [2.0, -70.0]]),
                    np.array([[3.0, 0.1], [-1.0, 0.2]]) @ [1.0, x],
                )
                for x in s
            ]
        ),
    ),
}
CHAINS = {
    "ideal": ({}, lambda s: 1.0),
    "lag and filter": (
        dict(actuator=jr.elements.Actuator(bandwidth=LAG), cutoff=CUT / (2 * np.pi)),
        lambda s: butterworth(s) * LAG / (s + LAG),
    ),
    "delay and lag": (
        dict(actuator=jr.elements.Actuator(delay=TAU, bandwidth=LAG, limit=5.0)),
        lambda s: pade(s) * LAG / (s + LAG),
    ),
}


@pytest.mark.parametrize(
    "name, chain",
    [(name, "ideal") for name in CONTROLLERS] + [("PD", "lag and filter"), ("resonant", "delay and lag")],
)  # fmt: skip
def test_receptance_of_the_closed_loop(name, chain):
    controller, transfer = CONTROLLERS[name]
    parts, more = CHAINS[chain]
    machine = disc(jr.elements.ActiveTorque(controller, **parts))
    got = jr.frequency_response(machine, "disc.phi", "disc.phi", np.abs(S)).values[:, 0, 0]
    np.testing.assert_allclose(got, 1 / (J * S**2 + C * S + K - transfer(S) * more(S)), rtol=2e-7)


def test_the_approximant_of_a_delay_is_one():
    s = 1j * np.linspace(0, 1.0, 5)
    assert np.max(np.abs(pade(s / TAU) - np.exp(-s))) < 2e-4


def test_a_pd_loop_is_a_stiffer_spring():
    stiff = jr.Coupling((0, 0, 0, 0, 0, K + 50.0), damping=(0, 0, 0, 0, 0, C + 0.4))
    passive = disc(jr.elements.ActiveTorque(jr.elements.PD(0.0, 0.0)), spring=stiff)
    active = disc(jr.elements.ActiveTorque(jr.elements.PD(50.0, 0.4)))
    a, b = (jr.simulate(m, 0.1, 1000.0, turning(), step=1e-3) for m in (passive, active))
    np.testing.assert_allclose(b["disc"].phi, a["disc"].phi, atol=1e-12)
    twist, rate = b["disc"].phi, b["disc"].velocity[:, 5]
    np.testing.assert_allclose(b["loop"].torque, -(50.0 * twist + 0.4 * rate), atol=1e-12)
    np.testing.assert_allclose(b["loop"].power, b["loop"].torque * rate, atol=1e-12)


def test_a_torque_between_two_stations_has_its_reaction():
    line = {
        "a": jr.Rotor(1.0, 0.02, 0.02),
        "shaft": jr.Coupling((0, 0, 0, 0, 0, K)),
        "b": jr.Rotor(1.0, 0.05, 0.03),
    }
    loop = jr.elements.ActiveTorque(
        jr.elements.PD(damping=0.5), between=True, actuator=jr.elements.Actuator(limit=3.0)
    )
    machine = jr.Machine.in_line(line, attachments={"loop": (loop, ("a", "b"))})
    r = jr.simulate(machine, 0.1, 1000.0, turning(10.0), step=2e-4)
    spin = 0.02 * r["a"].velocity[:, 5] + 0.05 * r["b"].velocity[:, 5]
    np.testing.assert_allclose(spin, 0.5, rtol=1e-12)  # angular momentum
    assert np.max(np.abs(r["loop"].torque)) < 3.0 < np.max(np.abs(r["loop"].wanted))
    # what the loop takes out is missing afterwards
    audit = jr.energy_audit(machine, 0.1, 1000.0, turning(10.0), step=1e-4)
    assert audit.relative < 1e-8
    assert audit.work_in[-1] < -0.1 * audit.kinetic[0]


def test_limits_of_the_actuator():
    """Never above its limit, never faster than its rate; and where it is far from both, linear."""
    x = np.linspace(-3, 3, 1201)
    y = np.asarray(soft_clip(jnp.asarray(x), 0.1))
    assert np.all(np.abs(y) < 1 + 1e-14) and np.all(np.diff(y) > -1e-14)
    np.testing.assert_allclose(y[np.abs(x) < 0.2], x[np.abs(x) < 0.2], atol=1e-7)
    np.testing.assert_allclose(y, np.clip(x, -1, 1), atol=0.1 * np.log(2) / 2 + 1e-12)
    limits = jr.elements.Actuator(limit=0.5, bandwidth=900.0, rate_limit=60.0)
    r = jr.simulate(
        disc(jr.elements.ActiveTorque(jr.elements.PD(damping=2.0), actuator=limits)),
        0.2,
        10000.0,
        turning(),
        step=1e-5,
    )
    torque = np.asarray(r["loop"].torque)
    rate = np.diff(torque) * 10000
    assert 0.4 < np.max(np.abs(torque)) < 0.5 and 55 < np.max(np.abs(rate)) < 60.01


def test_pi_control_of_speed_is_the_older_governor():
    """The governor clips its torque where this one's limit is rounded: the less, the nearer."""
    fan = jr.FanLoad(0.002)
    rotor = {"rotor": jr.Rotor(1.0, 0.05, 0.03)}

    def machine(part):
        return jr.Machine.in_line(rotor, {"drive": (part, "rotor"), "fan": (fan, "rotor")})

    older = machine(jr.SpeedGovernor(30.0, 1.5, 6.0, torque_limit=8.0))
    speeds = np.asarray(jr.simulate(older, 1.0, 1000.0, "undeformed", rtol=1e-9)["rotor"].speed)
    off = []
    for softness in (0.1, 0.01):
        loop = jr.elements.ActiveTorque(
            jr.elements.PI(1.5, 6.0),
            jr.elements.SpeedError(30.0),
            jr.elements.Actuator(limit=8.0, softness=softness),
        )
        r = jr.simulate(
            machine(loop), 1.0, 1000.0, "undeformed", solver=diffrax.Dopri8(), rtol=1e-9
        )
        off.append(np.max(np.abs(r["rotor"].speed - speeds)))
    assert off[0] < 0.3 and off[1] < 0.03 and abs(speeds[-1] - 30) < 0.1


# Sampled.


def sampled_exactly(period, delay, count, law, inner=None, noise=None):
    """Angle and speed at the samples: the matrix exponential from event to event."""
    M = np.zeros((3, 3))
    M[:2, :2], M[1, 2] = [[0, 1], [-K / J, -C / J]], 1 / J
    events = sorted(
        (k * period + late, which, k)
        for k in range(count + 1)
        for which, late in ((0, 0.0), (1, delay))
    )
    x, t, asked, seen = np.array([0.0, 1.0, 0.0]), 0.0, {}, []
    for at, which, k in events:
        x, t = expm(M * (at - t)) @ x, at
        if which == 0:
            seen.append(x[:2].copy())
            got = x[:2] + (0.0 if noise is None else noise[k])
            asked[k], inner = law(got, inner)
        else:
            x[2] = asked[k]
        if len(seen) == count + 1:
            return np.array(seen)


def pd(seen, inner):
    return -(50.0 * seen[0] + 0.3 * seen[1]), None


@pytest.mark.parametrize("delay", [0.0, 0.0015, 0.005])
def test_sampling_and_delay_are_exact(delay):
    """The delay within a period, and longer than two of them."""
    machine = disc(jr.elements.SampledTorque(jr.elements.PD(50.0, 0.3), period=0.002, delay=delay))
    r = jr.simulate(machine, 0.2, 1000.0, turning(), step=1e-3)
    got = np.stack([r["disc"].phi, r["disc"].velocity[:, 5]], axis=1)[::2]
    np.testing.assert_allclose(got, sampled_exactly(0.002, delay, 100, pd), atol=1e-12)
    held = np.asarray(r["loop"].torque)
    if delay == 0.0:  # what is held is that of the last sample
        np.testing.assert_allclose(held[::2], [pd(x, None)[0] for x in got], atol=1e-12)
        np.testing.assert_array_equal(held[1::2], held[:-1:2])
    else:
        assert np.all(held[: int(delay * 1000) + 1 - (delay == 0.005)] == 0)


def test_a_period_shorter_than_the_samples_and_an_adaptive_solver():
    machine = disc(jr.elements.SampledTorque(jr.elements.PD(50.0, 0.3), period=0.002, delay=0.0005))
    r = jr.simulate(machine, 0.2, 100.0, turning(), solver=diffrax.Dopri8(), rtol=1e-11, atol=1e-13)
    expected = sampled_exactly(0.002, 0.0005, 100, pd)[::5]
    np.testing.assert_allclose(r["disc"].phi, expected[:, 0], atol=1e-10)


def test_an_integrator_between_samples_and_noise():
    key = jax.random.PRNGKey(7)
    noise = [
        0.05 * np.asarray(jax.random.normal(jax.random.fold_in(key, k), (1,))) for k in range(51)
    ]

    def pi(seen, z):
        e = seen[1] - 0.2
        return z - 0.4 * e, z - 0.002 * 30.0 * e

    exact = sampled_exactly(0.002, 0.0, 50, pi, 0.0, [np.array([0.0, x[0]]) for x in noise])
    loop = jr.elements.SampledTorque(
        jr.elements.PI(0.4, 30.0),
        period=0.002,
        measured=jr.elements.SpeedError(0.2),
        noise=[0.05],
        seed=7,
    )
    r = jr.simulate(disc(loop, "disc"), 0.1, 500.0, turning(), step=1e-3)
    np.testing.assert_allclose(r["disc"].velocity[:, 5], exact[:, 1], atol=1e-12)
    coarse = eqx.tree_at(
        lambda l: (l.noise, l.resolution),
        loop,
        (None, jnp.array([0.01])),
        is_leaf=lambda x: x is None,
    )
    r = jr.simulate(disc(coarse, "disc"), 0.1, 500.0, turning(), step=1e-3)

    def stepped(seen, z):
        return pi(np.array([0, np.round((seen[1] - 0.2) / 0.01) * 0.01 + 0.2]), z)

    exact = sampled_exactly(0.002, 0.0, 50, stepped, 0.0)
    np.testing.assert_allclose(r["disc"].velocity[:, 5], exact[:, 1], atol=1e-12)


def sampled(controller, limit):
    return jr.elements.SampledTorque(
        controller, 0.002, delay=0.001, actuator=jr.elements.Actuator(limit=limit)
    )


def test_a_sampled_loop_books_its_energy_and_keeps_the_order_of_the_solver():
    """With an unbalanced rotor everything that the ticks disturb is nonlinear."""
    machine = jr.Machine.in_line(
        {
            "disc": jr.Rotor(2.0, J, 0.015, unbalance=jr.Unbalance(2e-3)),
            "shaft": jr.Shaft(0.2, 0.012, rayleigh=(1.0, 1e-5)),
            "end": jr.PrescribedSpin(jr.CosineRamp(1200.0, 0.2)),
        },
        attachments={
            "loop": (sampled(jr.elements.PD(20.0, 0.3), 2.0), ("disc", "end")),
        },
        fixed={"disc": ("z",)},
    )  # fmt: skip
    runs = [
        np.asarray(jr.simulate(machine, 0.2, 1000.0, "undeformed", step=s)["disc"].position)[
            :, [0, 5]
        ]
        for s in (1e-3 / 2, 1e-3 / 4, 1e-3 / 32)
    ]
    errors = [np.max(np.abs(r - runs[-1])) for r in runs[:2]]
    assert errors[1] < 1e-8 and errors[0] / errors[1] > 2**3
    audit = jr.energy_audit(machine, 0.2, 1000.0, "undeformed", step=1e-3 / 16)
    assert audit.relative < 1e-7


def test_derivatives_and_batches_of_sampled_and_neural_loops():
    neural = jr.elements.NeuralController.start([0.01, 1.0], 2.0, jax.random.PRNGKey(1), width=3)
    weights = neural.weights

    @jax.jit
    def final(x):
        nets = eqx.tree_at(
            lambda n: n.weights, neural, weights + x[2] * jnp.arange(1.0, 1 + weights.size)
        )
        machine = jr.Machine.in_line(
            {
                "end": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
                "spring": SPRING,
                "disc": jr.Rotor(1.0, J, 0.02),
            },
            attachments={
                "sampled": (sampled(jr.elements.PD(50.0 * x[0], 0.3 * x[1]), 0.2), ("disc", "end")),
                "net": (jr.elements.ActiveTorque(nets), ("disc", "end")),
            },
            fixed={"disc": ("x", "y", "z", "psi", "theta")},
        )  # fmt: skip
        r = jr.simulate(machine, 0.03, 1000.0, turning(), solver=jr.ETD4RK(), step=5e-4)
        return r["disc"].position[-1, 5] * 1e3 + jnp.sum(r["net"].torque)

    x = jnp.array([1.0, 1.2, 0.1])
    slopes = assert_derivatives_agree(final, x, rtol=1e-6, step=1e-4)
    assert np.all(np.abs(slopes) > 1e-4)
    batch = jnp.stack([x, 1.1 * x, 0.7 * x])
    np.testing.assert_allclose(jax.vmap(final)(batch), [final(b) for b in batch], rtol=1e-10)


def test_a_network_asks_for_nothing_at_rest():
    net = jr.elements.NeuralController.start(
        [0.01, 1.0], 2.0, jax.random.PRNGKey(0), width=5, depth=2
    )
    assert net.torque(jnp.zeros(2), jnp.zeros(0)) == 0
    assert net.torque(jnp.array([0.01, -1.0]), jnp.zeros(0)) != 0
    assert "loop.controller.weights" in disc(jr.elements.ActiveTorque(net)).parameters()


def test_relative_states_are_those_of_the_twisting_line():
    seen = jr.elements.RelativeStates(3)
    motions = tuple(
        (jnp.full(6, a), jnp.full(6, b)) for a, b in ((1.0, 10.0), (2.0, 30.0), (5.0, 80.0))
    )
    np.testing.assert_array_equal(seen.values(0.0, motions), [-4.0, -3.0, -70.0, -50.0])
    geared = jr.elements.RelativeStates(3, ratios=(-2.0, 0.5))
    np.testing.assert_array_equal(geared.values(0.0, motions), [11.0, -0.5, 170.0, -10.0])


# Switched damping.


def suspension(lowest, highest):
    """A disc carried by a spring whose foot is shaken: the torque in spring and damper over that of the
    spring alone at rest."""
    damper = jr.elements.SwitchedDamper(lowest, highest, width=1e-5, rate_width=1e-3)
    return jr.Machine.in_line(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
            "spring": jr.Coupling((0, 0, 0, 0, 0, K)),
            "disc": jr.Rotor(1.0, J, 0.02),
        },
        attachments={
            "damper": (damper, ("disc", "end")),
            "shaker": (jr.Torque(jr.Harmonic(0.0, [1.0], [300.0])), "disc"),
        },
        fixed={"disc": ("x", "y", "z", "psi", "theta")},
    )


def test_switched_damping_transmits_less_than_either_damper():
    """Above the resonance much damping transmits much; at it little damping does. Both are avoided."""
    w, highest, lowest = np.sqrt(K / J), 2.0, 0.05

    @jax.jit
    def torque(frequency, switched):
        lo, hi = (
            jnp.where(switched == 1, highest - 1e-9, lowest),
            jnp.where(switched == 0, lowest + 1e-9, highest),
        )
        machine = suspension(lo, hi).set({"shaker.value.frequencies": frequency[None]})
        r = jr.simulate(machine, 1.5, 1000.0, "undeformed", step=5e-4)
        carried = K * r["disc"].phi - r["damper"].torque
        return jnp.max(jnp.abs(carried[-400:]))

    (low_at, high_at, switched_at), (low_above, high_above, switched_above) = (
        [float(torque(jnp.asarray(f * w), jnp.asarray(which))) for which in (0, 1, 2)]
        for f in (1.0, 4.0)
    )
    assert switched_at < 0.1 * low_at and switched_above < 0.9 * high_above
    assert high_at < low_at and low_above < high_above


def test_switched_damping_only_takes_energy():
    machine = suspension(0.05, 2.0)
    audit = jr.energy_audit(machine, 0.3, 2000.0, "undeformed", step=5e-5)
    assert np.all(np.diff(audit.lost) >= 0) and audit.lost[-1] > 0.1 * audit.exchanged
    assert audit.relative < 1e-5


# Bad input.


LOOP, SAMPLED = jr.elements.ActiveTorque, jr.elements.SampledTorque


@pytest.mark.parametrize(
    "build, words",
    [
        (lambda: LOOP(jr.elements.PD(), cutoff=-1.0), "`loop`: cutoff must be positive, but is -1"),
        (lambda: LOOP(PD(), actuator=Actuator(rate_limit=3.0)), "bandwidth is missing"),
        (lambda: LOOP(PD(), actuator=Actuator(limit=0.0)), "actuator.limit must be positive"),
        (lambda: LOOP(PD(), actuator=Actuator(pade=1)), "pade must be a whole number"),
        (lambda: LOOP(jr.elements.PD(damping=np.nan)), "controller.damping must be finite"),
        (lambda: LOOP(jr.elements.PD(), jr.elements.TwistOf(0, 0)), "first and second must be two stations"),
        (lambda: LOOP(jr.elements.PD(), jr.elements.TwistOf(0, 2)), "acts at 3 stations, but 2 are given"),
        (lambda: LOOP(PD(), jr.elements.TwistOf(0, 1, 0.0)), "ratio must not be zero"),
        (lambda: LOOP(StateFeedback([1.0] * 2), RelativeStates(2, [1.0, 2.0])), "ratios must have 1 entries"),
        (lambda: LOOP(jr.elements.StateFeedback([1.0, 2.0, 3.0])), "controller must make one torque of 2"),
        (lambda: LOOP(StateFeedback([1.0] * 4), RelativeStates(3)), "acts at 3 stations"),
        (lambda: LOOP(0.5), "controller must be made by"),
        (lambda: SAMPLED(jr.elements.PD(), period=0.0), "period must be a positive plain number"),
        (lambda: SAMPLED(jr.elements.PD(), 0.001, delay=-1.0), "delay must be a zero or positive"),
        (lambda: SAMPLED(jr.elements.PD(), 0.001, noise=[1.0]), "noise must have an entry"),
        (lambda: jr.elements.SwitchedDamper(2.0, 1.0, 1e-3, 0.1), "lowest must be less than highest"),
        (lambda: LOOP(jr.elements.NeuralController([1.0], [1.0, 1.0], 1.0)), "weights must be 32 numbers"),
        (lambda: LOOP(jr.elements.Compensator([[1.0]], [[1.0, 2.0]], [1.0, 2.0])), "A, B and C must belong"),
    ],
)  # fmt: skip
def test_what_is_refused(build, words):
    with pytest.raises(jr.InputError, match=words.replace("(", r"\(")):
        disc(build())


def test_a_loop_between_needs_two_stations():
    with pytest.raises(jr.InputError, match="acts at 2 stations, but 1 are given"):
        disc(jr.elements.ActiveTorque(jr.elements.PD()), at="disc")
    with pytest.raises(jr.InputError, match="acts at 2 stations, but 1 are given"):
        disc(
            jr.elements.ActiveTorque(
                jr.elements.PI(1.0, 1.0), jr.elements.SpeedError(0.0), between=True
            ),
            at="disc",
        )


def test_clocks_without_a_common_grid_are_refused():
    machine = disc(jr.elements.SampledTorque(jr.elements.PD(), period=0.001234567))
    with pytest.raises(
        jr.InputError, match="`loop`: period must be a simple fraction of the sample"
    ):
        jr.simulate(machine, 0.1, 1000.0, turning())
    with pytest.raises(jr.InputError, match="steady"):
        jr.simulate(
            disc(jr.elements.SampledTorque(jr.elements.PD(), 0.001), speed=10.0),
            0.1,
            1000.0,
            "steady",
        )
