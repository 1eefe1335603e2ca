"""Laws of couplings, one by one: forces and energies against closed forms, SciPy and balances."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree
from scipy.integrate import quad, solve_ivp
from scipy.interpolate import PchipInterpolator

import jaxrotor as jr
from jaxrotor.core.protocol import NonSmooth

NONE = jnp.zeros(0)
X = [0.0, 0.01, 0.025, 0.03, 0.05]
F = [0.0, 4.0, 7.0, 20.0, 26.0]

CONTACTS = {"Backlash", "Backlash, smooth", "Backlash, hysteresis", "Bilinear"}

# Each with a state in which nothing vanishes.
LAWS = {
    "KelvinVoigt": (jr.elements.KelvinVoigt(300.0, 2.0), NONE),
    "Progressive": (jr.elements.Progressive([300.0, -2e4, 5e7], 2.0), NONE),
    "TabulatedLaw": (jr.elements.TabulatedLaw(X, F, 2.0), NONE),
    "Backlash": (jr.elements.Backlash(0.02, 300.0, 2.0), NONE),
    "Backlash, smooth": (jr.elements.Backlash(0.02, 300.0, 2.0, smoothing=0.015), NONE),
    "Backlash, hysteresis": (jr.elements.Backlash(0.02, 300.0, 0.5, 0.015, 0.7), NONE),
    "Bilinear": (jr.elements.Bilinear(300.0, 90.0, 2.0, 1.0, 0.01, 0.3), NONE),
    "Maxwell": (jr.elements.Maxwell(300.0, 4.0), jnp.array([0.02])),
    "BoucWen": (jr.elements.BoucWen(300.0, 0.2, 0.02, 1.7, 0.7, -0.2), jnp.array([0.6])),
    "CoulombClutch": (jr.CoulombClutch(8.0, jr.Ramp(0.0, 2.0, 1.0), 0.5), NONE),
    "StickSlipClutch": (
        jr.StickSlipClutch(8.0, 0.02, jr.Ramp(0.0, 2.0, 1.0), 0.3),
        jnp.array([0.019]),
    ),
    "Parallel": (
        jr.elements.Parallel(
            [
                jr.elements.BoucWen(90.0, 0.0, 0.01),
                jr.elements.KelvinVoigt(5.0),
                jr.elements.Maxwell(300.0, 4.0),
            ]
        ),
        jnp.array([0.4, -0.01]),
    ),
}


@pytest.mark.parametrize("name", LAWS)
def test_force_times_rate_is_stored_or_lost(name):
    """`F v = dE/dt + lost`, wherever the law is: E by the chain rule along x' = v and the rates."""
    law, state = LAWS[name]

    @jax.jit
    def books(t, x, v, state):
        rates = law.rates(t, x, v, state)
        _, growth = jax.jvp(law.energy, (t, x, state), (jnp.ones(()), v, rates))
        return law.force(t, x, v, state) * v, growth, law.power_lost(t, x, v, state)

    lost = []
    for x in (-0.07, -0.026, -0.008, 0.012, 0.024, 0.041):
        for v in (-3.0, -0.2, 0.4, 2.0):
            for scale in (1.0, -1.0):
                power, growth, heat = books(jnp.asarray(0.7), jnp.asarray(x), v, scale * state)
                np.testing.assert_allclose(power, growth + heat, rtol=1e-12, atol=1e-13)
                lost.append(float(heat))
    # heat is never negative; what presses on bent bristles is work (see StickSlipClutch)
    assert max(lost) > 0 and (min(lost) >= 0 or name == "StickSlipClutch")


@pytest.mark.parametrize("name", [n for n in LAWS if LAWS[n][1].size == 0])
def test_energy_is_the_integral_of_the_force_at_rest(name):
    law, _ = LAWS[name]
    force = jax.jit(lambda x: law.force(0.7, x, 0.0, NONE))
    points = [p for p in (0.0025, 0.01, 0.025, 0.03, 0.05)]
    for x in (-0.06, 0.028):
        inside = [np.sign(x) * p for p in points if p < abs(x)]
        work, _ = quad(lambda u: float(force(u)), 0.0, x, points=inside, epsabs=1e-13)
        gained = law.energy(0.7, x, NONE) - law.energy(0.7, 0.0, NONE)
        np.testing.assert_allclose(gained, work, rtol=1e-10, atol=1e-13)


def test_table_is_scipys_monotone_cubic_of_the_odd_table():
    law = jr.elements.TabulatedLaw(X, F)
    both = np.concatenate([-np.array(X[:0:-1]), X])
    scipys = PchipInterpolator(both, np.concatenate([-np.array(F[:0:-1]), F]))
    force = jax.jit(jax.vmap(lambda x: law.force(0.0, x, 0.0, NONE)))
    x = np.linspace(-0.05, 0.05, 301)
    np.testing.assert_allclose(force(x), scipys(x), rtol=1e-12, atol=1e-13)
    energy = jax.jit(jax.vmap(lambda x: law.energy(0.0, x, NONE)))(x)
    area = scipys.antiderivative()
    np.testing.assert_allclose(energy, area(x) - area(0.0), rtol=1e-11, atol=1e-14)
    # beyond, straight on
    slope = float(scipys.derivative()(0.05))
    np.testing.assert_allclose(force(jnp.array([0.07]))[0], 26.0 + 0.02 * slope, rtol=1e-12)
    # the stiffness at rest, of which a machine is linearised: the first secant
    stiffness = jax.jit(jax.grad(lambda x: law.force(0.0, x, 0.0, NONE)))
    np.testing.assert_allclose([stiffness(0.0), stiffness(0.01)], [400.0, scipys(0.01, 1)])


def test_progressive_is_its_polynomial():
    law, x = jr.elements.Progressive([300.0, -2e4, 5e7]), np.linspace(-0.03, 0.03, 7)
    force = jax.vmap(lambda x: law.force(0.0, x, 0.0, NONE))(x)
    np.testing.assert_allclose(force, 300 * x - 2e4 * x**3 + 5e7 * x**5, rtol=1e-13)


def driven(law, x, t, state=None):
    """States of a law whose twist x(t) is given, integrated by diffrax; then its forces."""

    def rates(t, state, args):
        at, v = jax.jvp(x, (t,), (jnp.ones_like(t),))
        return law.rates(t, at, v, state)

    def force(t, state):
        at, v = jax.jvp(x, (t,), (jnp.ones_like(t),))
        return law.force(t, at, v, state)

    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(rates),
        diffrax.Dopri8(),
        t[0],
        t[-1],
        None,
        law.initial() if state is None else state,
        saveat=diffrax.SaveAt(ts=t),
        # it steps onto the instants, for between its steps it is less exact
        stepsize_controller=diffrax.ClipStepSizeController(
            diffrax.PIDController(rtol=1e-11, atol=1e-13), step_ts=t
        ),
        max_steps=2**18,
    )
    return solution.ys, jax.vmap(force)(t, solution.ys)


def test_maxwell_relaxes_and_has_its_dynamic_stiffness():
    k, c, w, amplitude = 300.0, 4.0, 60.0, 0.02
    tau = c / k
    law = jr.elements.Maxwell(k, c)
    t = jnp.linspace(0.0, 0.1, 21)
    _, force = driven(law, lambda t: 0.0 * t, t, jnp.array([amplitude]))
    np.testing.assert_allclose(force, k * amplitude * np.exp(-t / tau), rtol=1e-9)
    # from rest: the harmonic part and the decay that makes it start at zero
    _, force = driven(law, lambda t: amplitude * jnp.sin(w * t), t)
    K = k * 1j * w * tau / (1 + 1j * w * tau)
    steady = (amplitude * K * np.exp(1j * w * t)).imag
    np.testing.assert_allclose(force, steady - steady[0] * np.exp(-t / tau), atol=1e-9)


def test_bouc_wen_against_scipy_and_its_loop():
    """The force of an independent integration; what a steady loop encloses is what is lost."""
    k, a, xy, n, beta, gamma = 300.0, 0.2, 0.02, 1.7, 0.7, 0.3
    law = jr.elements.BoucWen(k, a, xy, n, beta, gamma)
    amplitude, w = 0.07, 10.0

    def rates(t, y):
        x, v, z = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t), y[0]
        # the textbook form, per unit of x_y
        z_t = (v - beta * abs(v) * abs(z) ** (n - 1) * z - gamma * v * abs(z) ** n) / xy
        force = a * k * x + (1 - a) * k * xy * z
        return [z_t, force * v]

    turn = 2 * np.pi / w
    # stop at every reversal, where the rate has a kink
    edges = np.concatenate([[0.0], turn * (np.arange(8) / 2 + 0.25)])
    y, work, ends = np.zeros(2), [], []
    for a0, a1 in zip(edges[:-1], edges[1:]):
        y = solve_ivp(rates, (a0, a1), y, rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
        ends.append(y[0])
        work.append(y[1])
    z, _ = driven(law, lambda t: amplitude * jnp.sin(w * t), jnp.asarray(edges))
    np.testing.assert_allclose(z[1:, 0], ends, rtol=1e-7)
    assert 0.9 < max(ends) < 1.0
    # loss over the last loop, from the law's own power
    t = jnp.linspace(edges[-3], edges[-1], 4001)
    state, force = driven(law, lambda t: amplitude * jnp.sin(w * t), t, z[-3])
    x, v = amplitude * jnp.sin(w * t), amplitude * w * jnp.cos(w * t)
    heat = jax.vmap(law.power_lost)(t, x, v, state)
    assert float(jnp.min(heat)) >= 0
    np.testing.assert_allclose(jnp.trapezoid(heat, t), work[-1] - work[-3], rtol=1e-6)
    np.testing.assert_allclose(jnp.trapezoid(force, x), work[-1] - work[-3], rtol=1e-6)


def test_bouc_wen_stiffness_before_and_after_yielding():
    law = jr.elements.BoucWen(300.0, 0.2, 0.02, 2.0)
    t = jnp.array([0.0, 1e-6, 0.19, 0.2])  # twisted at 1 rad/s
    _, force = driven(law, lambda t: t, t)
    np.testing.assert_allclose(force[1] / 1e-6, 300.0, rtol=1e-6)
    np.testing.assert_allclose((force[3] - force[2]) / 0.01, 0.2 * 300.0, rtol=1e-5)
    np.testing.assert_allclose(force[3] - 0.2 * 300 * 0.2, 0.8 * 300 * 0.02, rtol=1e-6)


def test_parallel_adds_forces_and_keeps_states_apart():
    parts = [
        jr.elements.BoucWen(90.0, 0.0, 0.01),
        jr.elements.KelvinVoigt(5.0, 0.1),
        jr.elements.Maxwell(300.0, 4.0),
    ]
    together, state = jr.elements.Parallel(parts), jnp.array([0.4, -0.01])
    own = [state[:1], NONE, state[1:]]
    want = sum(p.force(0.0, 0.01, 2.0, s) for p, s in zip(parts, own))
    np.testing.assert_allclose(together.force(0.0, 0.01, 2.0, state), want, rtol=1e-14)
    rates = [parts[0].rates(0.0, 0.01, 2.0, own[0])[0], parts[2].rates(0.0, 0.01, 2.0, own[2])[0]]
    np.testing.assert_allclose(together.rates(0.0, 0.01, 2.0, state), rates, rtol=1e-14)
    assert together.initial().shape == (2,)


def test_backlash_is_free_within_its_gap():
    law = jr.elements.Backlash(0.02, 300.0, 2.0)
    assert float(law.force(0.0, 0.0099, 5.0, NONE)) == 0.0
    assert float(law.force(0.0, -0.0099, 5.0, NONE)) == 0.0
    np.testing.assert_allclose(law.force(0.0, 0.013, 0.5, NONE), 300 * 0.003 + 2 * 0.5)
    np.testing.assert_allclose(law.force(0.0, -0.013, 0.2, NONE), -300 * 0.003 + 2 * 0.2)
    np.testing.assert_allclose(law.force(0.0, -0.013, -0.5, NONE), -300 * 0.003 - 2 * 0.5)
    # smoothed, it is the same beyond the rounding, and half in contact at the touch
    law = jr.elements.Backlash(0.02, 300.0, 2.0, smoothing=1e-3)
    np.testing.assert_allclose(law.force(0.0, 0.013, 0.5, NONE), 300 * 0.003 + 2 * 0.5)
    np.testing.assert_allclose(law.force(0.0, 0.01, 0.5, NONE), 300 * 1e-3 / 4 + 0.5)
    assert float(law.force(0.0, 0.0089, 0.5, NONE)) == 0.0


@pytest.mark.parametrize(
    "law",
    [
        jr.elements.Backlash(0.02, 300.0, 2.0),
        jr.elements.Backlash(0.02, 300.0, 2.0, smoothing=1e-3),
        jr.elements.Backlash(0.02, 300.0, 0.0, hysteresis=5.0),
        jr.elements.Bilinear(300.0, 0.0, 2.0),
        jr.elements.Bilinear(300.0, 100.0, 2.0, 9.0, hysteresis=5.0),
    ],
)
def test_a_contact_pushes_or_does_nothing(law):
    x, v = np.meshgrid(np.linspace(-0.03, 0.03, 61), np.linspace(-9.0, 9.0, 37))
    f = np.asarray(jax.vmap(lambda x, v: law.force(0.0, x, v, NONE))(x.ravel(), v.ravel()))
    apart = f[np.abs(x.ravel()) < 1e-12]
    if isinstance(law, jr.elements.Backlash):
        assert np.all(apart == 0.0)
    assert np.all(f * np.sign(x.ravel()) >= 0.0)
    assert np.max(np.abs(f)) > 3.0


def test_a_face_that_is_left_quickly_lets_go():
    """2 kg leave a face that is pressed in by 1 mm, at 1 m/s, damped with 200 N·s/m: the damper held on with
    97 N at most; now the body flies off at the speed it has. Against the closed form of the motion."""
    law = jr.elements.Backlash(gap=0.1, stiffness=1e5, damping=200.0)
    assert float(law.force(0.0, 0.05 + 1e-3, -1.0, NONE)) == 0.0
    # pressed more than the damper takes away, it is the damped spring: let go where k x + c x' = 0
    w, d = np.sqrt(1e5 / 2.0), 200.0 / 4.0
    damped = np.sqrt(w**2 - d**2)
    after = (
        np.pi - np.arctan2(2 * d * damped, w**2 - 2 * d**2)
    ) / damped  # from x = 0, inwards at 1 m/s
    x = np.exp(-d * after) * np.sin(damped * after) / damped
    v = np.exp(-d * after) * (np.cos(damped * after) - d / damped * np.sin(damped * after))
    np.testing.assert_allclose(1e5 * x + 200.0 * v, 0.0, atol=1e-8)
    machine = jr.Machine(
        {"body": jr.Rotor(2.0, 0.01, 0.01), "face": jr.LawSupport(x=law)},
        {"face": "body"},
        fixed={"body": ("y", "z", "psi", "theta", "phi")},
    )
    q, u = np.zeros((2, 1, 6))
    q[0, 0], u[0, 0] = 0.05, 1.0
    gone = 1.5 * after
    run = jr.simulate(machine, gone, 4 / gone, jr.State(q, u), rtol=1e-10, progress=False)["body"]
    np.testing.assert_allclose(run.velocity[-1, 0], v, rtol=1e-6)
    np.testing.assert_allclose(run.x[-1], 0.05 + x + v * (gone - after), rtol=1e-6)


def test_restitution_of_hunt_and_crossley():
    """Speed after over speed before, by the exact first integral of `m u'' = -k u (1 + h u')`:
    `h v - log(1 + h v)` is the same for the speed in and minus the speed out."""
    h, v = 0.4, 0.8
    law = jr.elements.Backlash(gap=1.0, stiffness=1e6, hysteresis=h)
    out = solve_ivp(
        lambda t, y: [y[1], -float(law.force(0.0, 0.5 + y[0], y[1], NONE)) / 2.0],
        (0, 0.01), [0.0, v], rtol=1e-10, atol=1e-13, events=_left,
    ).y[1, -1]  # fmt: skip
    np.testing.assert_allclose(h * out - np.log1p(h * out), h * v - np.log1p(h * v), rtol=1e-6)


def _left(t, y):
    return y[0] + 1e-15


_left.terminal, _left.direction = True, -1


def test_clutch_below_its_capacity_holds_and_does_not_creep():
    """Bristles pushed by a vibration below the elastic share spring back to where they were; pushed
    beyond capacity they slip at it."""
    law = jr.StickSlipClutch(8.0, 0.02)
    t = jnp.linspace(0.0, 5.0, 11) * 2 * jnp.pi
    # 50 swings between 0.7 and 0.89 of capacity
    z, force = driven(
        law, lambda t: 0.02 * (0.795 + 0.095 * jnp.sin(10 * t)), t, jnp.array([0.0159])
    )
    np.testing.assert_allclose(force, 8.0 * 0.795, rtol=1e-9)
    # and slid by a hundred radians the torque is the capacity, whatever the way
    _, force = driven(law, lambda t: 100.0 * t, jnp.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(force[1:], 8.0, rtol=1e-10)
    _, force = driven(law, lambda t: -100.0 * t, jnp.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(force[1:], -8.0, rtol=1e-10)


@pytest.mark.parametrize("name", ["CoulombClutch", "StickSlipClutch", "Maxwell"])
def test_what_slips_does_not_lose_digits_in_many_turns(name):
    law, state = LAWS[name]
    far, near = (law.force(0.7, x, 0.3, state) for x in (1e9, 0.0))
    assert float(far) == float(near) != 0.0
    assert np.all(law.rates(0.7, 1e9, 0.3, state) == law.rates(0.7, 0.0, 0.3, state))


# Derivatives: what a user would fit, and what the solver linearises.
FITTED = {
    "KelvinVoigt": (lambda p: jr.elements.KelvinVoigt(p[0], p[1]), [300.0, 2.0]),
    "Progressive": (lambda p: jr.elements.Progressive(p[:2], p[2]), [300.0, 4e4, 2.0]),
    "TabulatedLaw": (
        lambda p: jr.elements.TabulatedLaw(jnp.concatenate([jnp.zeros(1), p[:3]]), [0, *p[3:]]),
        [0.01, 0.03, 0.05, 4.0, 7.0, 26.0],
    ),
    "Backlash": (lambda p: jr.elements.Backlash(*p, smoothing=3e-3), [0.02, 300.0, 2.0]),
    "Maxwell": (lambda p: jr.elements.Maxwell(*p), [300.0, 4.0]),
    "BoucWen": (lambda p: jr.elements.BoucWen(*p), [300.0, 0.2, 0.02, 1.7, 0.7, 0.2]),
    "CoulombClutch": (lambda p: jr.CoulombClutch(p[0], p[1], p[2]), [8.0, 0.7, 0.5]),
    "StickSlipClutch": (lambda p: jr.StickSlipClutch(*p), [8.0, 0.02, 0.7, 0.3, 0.8]),
}


@pytest.mark.parametrize("name", FITTED)
def test_derivatives(name):
    make, numbers = FITTED[name]
    states = make(jnp.asarray(numbers)).initial().shape[0]

    def everything(p):
        law = make(p[:-2])
        out = []
        for x, v, z in ((0.011, 0.3, 0.6), (-0.028, 0.2, -0.3), (0.041, -1.0, 0.7)):
            z = jnp.full(states, z) * (0.02 if name == "StickSlipClutch" else 1.0)
            x, v = x * p[-2], v * p[-1]
            out += [law.force(0.1, x, v, z), law.energy(0.1, x, z), law.power_lost(0.1, x, v, z)]
            out += [*law.rates(0.1, x, v, z)]
        return jnp.stack(out)

    assert_derivatives_agree(everything, [*numbers, 1.0, 1.0], step=1e-4)


@pytest.mark.parametrize("name", LAWS)
def test_derivatives_at_rest_are_finite(name):
    """A machine at rest is linearised there."""
    law, state = LAWS[name]

    def everything(y, law):
        x, v, z = y[0], y[1], y[2:]
        out = [law.force(0.7, x, v, z), law.power_lost(0.7, x, v, z), law.energy(0.7, x, z)]
        return jnp.concatenate([jnp.stack(out), law.rates(0.7, x, v, z)])

    rest = jnp.zeros(2 + state.size)
    for derivative in (jax.jacfwd, jax.jacrev):
        for leaf in jax.tree.leaves(jax.jit(derivative(everything, argnums=(0, 1)))(rest, law)):
            assert np.all(np.isfinite(leaf))


def test_which_laws_are_marked():
    marked = {name for name, (law, _) in LAWS.items() if isinstance(law, NonSmooth)}
    assert marked == {*CONTACTS, "BoucWen", "CoulombClutch", "StickSlipClutch"}


@pytest.mark.parametrize(
    "law, sentence",
    [
        (
            lambda: jr.elements.KelvinVoigt(-3.0),
            "phi.stiffness must be zero or positive, but is -3 N*m/rad",
        ),
        (lambda: jr.elements.Maxwell(3.0, 0.0), "phi.damping must be positive, but is 0 N*m*s/rad"),
        (lambda: jr.elements.Progressive([]), "coefficients must hold k1 at least"),
        (
            lambda: jr.elements.TabulatedLaw([0.0, 2.0, 1.0], [0.0, 1, 2]),
            "displacements must increase",
        ),
        (
            lambda: jr.elements.TabulatedLaw([1.0, 2.0], [0.0, 1]),
            "must begin at 0, but begin at 1 and 0",
        ),
        (lambda: jr.elements.TabulatedLaw([0.0, 2.0], [0.0, 1, 2]), "must be equally long"),
        (lambda: jr.elements.BoucWen(3.0, 1.2, 1.0), "ratio must be at most 1, but is 1.2"),
        (lambda: jr.elements.BoucWen(3.0, 0.2, 1.0, 0.5), "n must be at least 1, but is 0.5"),
        (
            lambda: jr.elements.BoucWen(3.0, 0.2, 1.0, gamma=0.7),
            "gamma must lie between -beta and beta",
        ),
        (
            lambda: jr.elements.Backlash(-1e-3, 3.0),
            "phi.gap must be zero or positive, but is -0.001 rad",
        ),
        (lambda: jr.CoulombClutch(3.0, slip_speed=0.0), "phi.slip_speed must be positive"),
        (lambda: jr.StickSlipClutch(3.0, 1e-3, elastic_share=1.0), "elastic_share must be below 1"),
        (lambda: jr.CoulombClutch(3.0, "soon"), "phi.engagement.level must be a number"),
        (lambda: jr.elements.Parallel(()), "parts must hold one law at least"),
        (
            lambda: jr.elements.Parallel(
                [jr.elements.KelvinVoigt(1.0), jr.elements.Maxwell(-3.0, 1.0)]
            ),
            "phi.parts.1.stiffness must be positive, but is -3 N*m/rad",
        ),
        (
            lambda: jr.elements.Parallel([jr.elements.KelvinVoigt(1.0), 3.0]),
            "phi.parts.1 must be made by",
        ),
        (lambda: 3.0, "phi must be made by"),
    ],
)
def test_wrong_numbers_are_refused(law, sentence):
    rotor = jr.Rotor(1.0, 0.01, 0.01)
    with pytest.raises(jr.InputError) as caught:
        jr.Machine.in_line({"a": rotor, "joint": jr.Coupling(phi=law()), "b": rotor})
    (found,) = caught.value.problems
    assert found.startswith("`joint`: ") and sentence in found
