"""Uncertainty beyond the curvature, against linear algebra and sums over a grid. One slider on a spring."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest
import scipy.interpolate
import scipy.stats

import jaxrotor as jr

NOISE, RATE = 2.0, 250.0  # m/s^2, Hz
T = np.arange(50) / RATE
# the slider is linear: exponential methods are exact at any step; this one compiles the fastest
STEP, SOLVER = 1 / RATE, jr.ETD4RK()
STIFFNESS = "spring.stiffness[2]"


def slider(stiffness=2e4, gravity=-9.81):
    return jr.Machine(
        {
            "d": jr.Rotor(2.0, 0.02, 0.012),
            "spring": jr.LinearSupport([0, 0, stiffness, 0, 0, 0], [0, 0, 40.0, 0, 0, 0]),
        },
        {"spring": "d"},
        fixed={"d": ["x", "y", "psi", "theta", "phi"]},
        gravity=(0.0, 0.0, gravity),
    )


SENSOR = {
    "a": jr.Channel(
        jr.sensors.Accelerometer("d", (0, 0, 1)), bias=0.3, noise=jr.sensors.Noise(NOISE)
    )
}


def signal(machine):
    """Without bias and noise."""
    run = jr.simulate(machine, T[-1] + 2 / RATE, RATE, "undeformed", solver=SOLVER, step=STEP)
    return np.asarray(SENSOR["a"].measure(run, T)) - 0.3


@pytest.fixture(scope="module")
def measured():
    noise = np.asarray(NOISE * jax.random.normal(jax.random.key(3), T.shape))
    return signal(slider()) + 0.3 + noise


def trial(measured):
    record = jr.Record({"a": jr.sensors.Series(T, measured, "m/s^2")})
    return jr.MeasuredRun(record, initial="undeformed", solver=SOLVER, step=STEP)


@pytest.fixture(scope="module")
def linear(measured):
    """Gravity and the channel's bias: the record depends on both linearly."""
    unknowns = [jr.Unknown("gravity[2]"), jr.Unknown("a.bias")]
    return jr.identify(slider(), unknowns, SENSOR, trial(measured))


@pytest.fixture(scope="module")
def exact(measured):
    """Least squares of numpy: estimates and their covariance."""
    A = np.stack([signal(slider(gravity=1.0)), np.ones_like(T)], axis=1)
    values = np.linalg.lstsq(A, measured, rcond=None)[0]
    return values, NOISE**2 * np.linalg.inv(A.T @ A)


@pytest.fixture(scope="module")
def bent(measured):
    """Stiffness under noise so large that its interval is lopsided."""
    start = jr.Unknown(STIFFNESS, start=1.8e4, positive=True)
    return jr.identify(slider(), [start], SENSOR, trial(measured))


@pytest.fixture(scope="module")
def drawn(linear):
    return jr.identification.posterior(linear, 250, warmup=60, seed=1)


def misfit(measured, stiffness):
    """Sum of squares in standard deviations."""
    return float(np.sum((signal(slider(stiffness)) + 0.3 - measured) ** 2) / NOISE**2)


def test_linear_least_squares(linear, exact):
    values, covariance = exact
    for i, path in enumerate(linear.paths):
        std = np.sqrt(covariance[i, i])
        assert linear.values[path] == pytest.approx(values[i], abs=1e-4 * std)
        assert linear.std[path] == pytest.approx(std, rel=1e-8)
    correlation = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert linear.correlation[0, 1] == pytest.approx(correlation, abs=1e-8)


def test_profile_of_a_linear_model_is_straight(linear):
    for path, curve in jr.identification.likelihood_profiles(linear).items():
        away = (curve.values - linear.values[path]) / linear.std[path]
        np.testing.assert_allclose(away, [-3, -2, -1, 0, 1, 2, 3], atol=1e-7)
        np.testing.assert_allclose(curve.root, away, atol=1e-4)
        assert curve.interval(2.0) == pytest.approx(
            (
                linear.values[path] - 2 * linear.std[path],
                linear.values[path] + 2 * linear.std[path],
            ),
            rel=1e-5,
        )


def test_profile_of_one_parameter_is_its_misfit(bent, measured):
    """... whatever its shape."""
    curve = jr.identification.likelihood_profiles(bent, points=4, reach=4.0)[STIFFNESS]
    least = misfit(measured, bent.values[STIFFNESS])
    for value, root in zip(curve.values, curve.root):
        assert root**2 == pytest.approx(misfit(measured, value) - least, rel=1e-6, abs=1e-8)
    low, high = curve.interval(1.96)
    assert low < bent.values[STIFFNESS] < high
    assert curve.interval(20.0) == (-np.inf, np.inf)


def test_posterior_of_a_linear_model(linear, exact, drawn):
    """Normal, about the estimate; the scatter of the draws is within four of its standard deviations."""
    values, covariance = exact
    assert drawn.divergent == 0
    for i, path in enumerate(linear.paths):
        std, count = np.sqrt(covariance[i, i]), drawn.effective[path]
        assert drawn.r_hat[path] < 1.02 and count > 250
        assert abs(drawn.mean[path] - values[i]) < 4 * std / np.sqrt(count)
        assert abs(drawn.std[path] / std - 1) < 4 / np.sqrt(2 * count)
    assert "r_hat" in str(drawn) and "!" not in str(drawn)


def test_posterior_that_is_bent(measured, caplog):
    """Against sums over a grid: even between its bounds, with a prior beside the data."""
    few = jr.Record({"a": jr.sensors.Series(T[:6], measured[:6], "m/s^2")})
    unknown = jr.Unknown(STIFFNESS, bounds=(1.6e4, 6e4), prior=(3e4, 1.5e4))
    run = jr.MeasuredRun(few, initial="undeformed", solver=SOLVER, step=STEP)
    found = jr.identify(slider(), [unknown], SENSOR, run)
    with jax.log_compiles():
        drawn = jr.identification.posterior(found, 220, warmup=60, seed=2)
    assert caplog.text.count("XLA compilation of jit(_advance)") == 1
    grid = np.linspace(1.6e4, 6e4, 801)[1:-1]
    prior = -0.5 * ((grid - 3e4) / 1.5e4) ** 2
    one = lambda k: signal(slider(k))[:6]  # noqa: E731
    # the record is smooth in the stiffness: 81 runs, and a cubic between them
    nodes = np.linspace(1.6e4, 6e4, 81)
    seen = scipy.interpolate.CubicSpline(nodes, np.stack([one(k) for k in nodes]))(grid)
    log = prior - 0.5 * np.sum((seen + 0.3 - measured[:6]) ** 2, axis=1) / NOISE**2
    density = np.exp(log - log.max())
    below = np.cumsum(density) / density.sum()
    x, count = drawn.draws[STIFFNESS].ravel(), drawn.effective[STIFFNESS]
    assert drawn.r_hat[STIFFNESS] < 1.02 and count > 120
    for part in (0.05, 0.25, 0.5, 0.75, 0.95):
        at = np.interp(part, below, grid)
        assert abs(np.mean(x < at) - part) < 4 * np.sqrt(part * (1 - part) / count)
    # which the bell of the estimate and its standard deviation would not pass
    bell = scipy.stats.norm(found.values[STIFFNESS], found.std[STIFFNESS])
    off = [abs(bell.cdf(np.interp(p, below, grid)) - p) for p in (0.05, 0.25, 0.5, 0.75, 0.95)]
    assert max(off) > 5 * np.sqrt(0.05 * 0.95 / count)


# its zooming line search, and the default solver's restarts within it, would take minutes to compile
LBFGS = optax.lbfgs(linesearch=optax.scale_by_backtracking_linesearch(15, store_grad=True))


@pytest.mark.parametrize(
    "optimiser, iterations", [(optax.adam(0.05), 300), (LBFGS, 12)], ids=["adam", "lbfgs"]
)
def test_descent_ends_where_least_squares_do(measured, exact, optimiser, iterations, caplog):
    values, covariance = exact
    unknowns = [jr.Unknown("gravity[2]", start=-5.0), jr.Unknown("a.bias", start=1.0)]
    stage = jr.Stage(jr.identification.Time(), iterations, optimiser)
    with jax.log_compiles():
        found = jr.identify(slider(), unknowns, SENSOR, trial(measured), stages=[stage])
    assert caplog.text.count("XLA compilation of jit(_step_all)") == 1
    for i, path in enumerate(found.paths):
        assert abs(found.values[path] - values[i]) < 1e-3 * np.sqrt(covariance[i, i])
        assert found.std[path] == pytest.approx(np.sqrt(covariance[i, i]), rel=1e-6)
    assert found.stopped and len(found.histories["1: time"]) == iterations


def test_promise_of_a_step():
    """What a search rests upon: the gain of numpy's least squares, a blind direction among the columns."""
    from jaxrotor.identification.fit import _promised

    rng = np.random.default_rng(0)
    J, r = rng.standard_normal((30, 4)) * [1.0, 1e-6, 1e3, 0.0], rng.standard_normal(30)
    J[:, 3] = J[:, 0] - J[:, 2]
    step = np.linalg.lstsq(J / np.linalg.norm(J, axis=0), -r, rcond=1e-7)[0]
    left = r + J / np.linalg.norm(J, axis=0) @ step
    promised = _promised((r @ J)[None], (J.T @ J)[None])
    assert promised[0] == pytest.approx(0.5 * (r @ r - left @ left), rel=1e-9)


def test_an_adaptive_solver_goes_both_ways(measured):
    """Forward for least squares, reverse for descent: the same slope of the cost."""
    from jaxrotor.identification.problem import in_reverse, pose, residual_and_slopes
    from jaxrotor.identification.simulated import records_and_slopes
    from jaxrotor.search.instrumented import Instrumented
    from jaxrotor.search.space import Space

    few = jr.Record({"a": jr.sensors.Series(T[:8], measured[:8], "m/s^2")})
    adaptive = jr.MeasuredRun(few, initial="undeformed", solver=diffrax.Tsit5())
    bench = Instrumented(slider(), SENSOR)
    space = Space.of(bench, (jr.Unknown(STIFFNESS, start=1.8e4, positive=True),))
    problem = pose(bench, space, [adaptive.planned(bench.machine)], jr.identification.Time(), None)
    u = np.array([0.1])
    x, dx = jax.tree.map(lambda x: x[0], records_and_slopes(problem.simulated, u[None]))
    r, J = residual_and_slopes(problem, u, x, dx)
    reverse = in_reverse(problem)
    slope = jax.jit(jax.grad(lambda u: 0.5 * jnp.sum(reverse.residual(u) ** 2)))(u)
    np.testing.assert_allclose(slope, r @ J, rtol=1e-9)


def test_refused(linear, bent, measured):
    with pytest.raises(jr.InputError, match="`d.mass`: is not looked for: name one of gravity"):
        jr.identification.likelihood_profiles(linear, ["d.mass"])
    with pytest.raises(jr.InputError, match="chains must be 2 or more, but is 1"):
        jr.identification.posterior(bent, 10, chains=1)
    twice = [jr.Unknown("gravity[2]"), jr.Unknown("a.sensitivity")]
    still = {"a": jr.Channel(SENSOR["a"].sensor, noise=jr.sensors.Noise(NOISE))}
    blind = jr.identify(slider(), twice, still, trial(measured))
    with pytest.raises(jr.InputError, match="the data cannot see .* no profile|cannot see it"):
        jr.identification.likelihood_profiles(blind, ["gravity[2]"])
    with pytest.raises(jr.InputError, match="its posterior has no end"):
        jr.identification.posterior(blind)


def test_figures(linear, drawn):
    picture = linear.plot.profiles(jr.identification.likelihood_profiles(linear))
    assert [ax.get_xlabel() for ax in picture] == ["gravity[2], m/s^2", "a.bias, m/s^2"]
    with pytest.raises(jr.InputError, match="level must be between 0 and 1"):
        drawn.intervals(95)
    picture = linear.plot.posteriors(drawn)
    assert [ax.get_xlabel() for ax in picture] == ["gravity[2], m/s^2", "a.bias, m/s^2"]
