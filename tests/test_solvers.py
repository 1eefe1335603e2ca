"""The exponential solvers as solvers of diffrax: order, stiffness, restarts, refusals."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.integrators.march import march
from jaxrotor.integrators.step_times import knots

STIFF = 1e6


def stiff_field(t, y, args):
    """y1' = -1e6 (y1 - cos t) - sin t, whose smooth solution is cos t; y2' = -y2² y1, y2(0) = 1,
    whose solution beside it is 1/(1 + sin t)."""
    return jnp.stack([-STIFF * (y[0] - jnp.cos(t)) - jnp.sin(t), -(y[1] ** 2) * y[0]])


def solve(solver, steps, t1=2.0, **kwargs):
    return diffrax.diffeqsolve(
        diffrax.ODETerm(stiff_field),
        solver,
        0.0,
        t1,
        t1 / steps,
        jnp.array([1.0, 1.0]),
        max_steps=4096,
        **kwargs,
    )


def exact(t):
    return np.array([np.cos(t), 1 / (1 + np.sin(t))])


@pytest.mark.parametrize(
    "solver, order, largest",
    [(jr.ETD4RK(), 2, 1e-5), (jr.ExponentialAdams(4), 4, 5e-8), (jr.ExponentialAdams(6), 4, 1e-8)],
    ids=["etd4rk", "adams4", "adams6"],
)
def test_order_through_diffeqsolve(solver, order, largest):
    """Under stiff forcing that changes within a step: ETD4RK keeps order two (its stages see the
    forcing of the step's start; four without it, see test_reference), Adams keeps its own, down to
    the error of its start (order four here)."""
    errors = []
    for steps in (20, 40, 80):
        y = np.asarray(solve(solver, steps).ys[-1])
        errors.append(np.abs(y - exact(2.0)).max())
    assert errors[-1] < largest  # where an explicit method would need 2e6 steps a second
    assert np.log2(errors[0] / errors[1]) > order - 0.2
    assert np.log2(errors[1] / errors[2]) > order - 0.2


def test_interpolates_to_third_order_between_steps():
    t = jnp.linspace(0.0, 2.0, 37)
    y = solve(jr.ExponentialAdams(6), 40, saveat=diffrax.SaveAt(ts=t)).ys
    np.testing.assert_allclose(np.asarray(y)[:, 1], exact(np.asarray(t))[1], atol=2e-6)


def test_a_step_of_another_length_is_an_error_not_a_wrong_result():
    for solver in (jr.ETD4RK(), jr.ExponentialAdams(4)):
        solution = diffrax.diffeqsolve(
            diffrax.ODETerm(stiff_field),
            solver,
            0.0,
            1.0,
            None,
            jnp.ones(2),
            stepsize_controller=diffrax.StepTo(jnp.array([0.0, 0.1, 0.2, 0.35, 1.0])),
            throw=False,
        )
        assert solution.result != diffrax.RESULTS.successful


def test_prepared_lengths_are_taken():
    ts = jnp.array([0.0, 0.1, 0.2, 0.25, 0.35, 0.45])
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(stiff_field),
        jr.ETD4RK(substeps=4, lengths=jnp.array([0.05])),
        0.0,
        0.45,
        None,
        jnp.ones(2),
        stepsize_controller=diffrax.StepTo(ts),
    )
    np.testing.assert_allclose(solution.ys[-1], exact(0.45), rtol=1e-5)


def test_adaptive_stepping_is_refused():
    with pytest.raises(RuntimeError, match="error estimates"):
        solve(jr.ExponentialAdams(4), 10, stepsize_controller=diffrax.PIDController(1e-6, 1e-6))


def test_order_out_of_range_is_refused():
    with pytest.raises(ValueError, match="order must be a whole number from 2 to 7, but is 9"):
        jr.ExponentialAdams(9)


@pytest.mark.parametrize("solver", [jr.ETD4RK(3), jr.ExponentialAdams(5, 3)], ids=["rk", "adams"])
def test_march_is_diffeqsolve(solver):
    """Our scan and diffrax's loop make the same steps."""
    ts = jnp.linspace(0.0, 2.0, 41)
    terms, y0 = diffrax.ODETerm(stiff_field), jnp.array([1.0, 1.0])
    state = solver.init(terms, ts[0], ts[1], y0, None)
    ours = march(solver, terms, knots(ts, jnp.zeros(0)), y0, None, state)
    theirs = solve(solver, 40, saveat=diffrax.SaveAt(t0=True, steps=True)).ys[:41]
    np.testing.assert_allclose(ours, theirs, rtol=1e-12)


@pytest.mark.parametrize("order", [4, 6])
def test_jump_off_the_grid_keeps_the_order(order):
    """y' = y0 + s(t), where s jumps at an instant that no sample hits."""
    jump = 1 / np.sqrt(2)

    def field(t, y, args):
        return -y + jnp.where(t < jump, 0.0, jnp.cos(t))

    def exactly(t):
        after = (np.cos(t) + np.sin(t)) / 2
        start = (np.cos(jump) + np.sin(jump)) / 2
        return np.exp(-t) + (after - start * np.exp(jump - t)) * (t > jump)

    def run(n, aware):
        samples = jnp.linspace(0.0, 2.0, n + 1)
        at = knots(samples, jnp.array([jump] if aware else []))
        solver = jr.ExponentialAdams(order, 1, jnp.array([[-0.5]]), at.lengths)
        terms, y0 = diffrax.ODETerm(field), jnp.ones(1)
        state = solver.init(terms, samples[0], samples[1], y0, None)
        y = march(solver, terms, at, y0, None, state)[at.samples]
        return np.abs(np.asarray(y)[:, 0] - exactly(np.asarray(samples))).max()

    coarse, fine = run(40, True), run(80, True)
    assert fine < 1e-8 and np.log2(coarse / fine) > order - 1.2
    assert run(80, False) > 1e-4  # what happens to a solver that is not told


def test_knots_with_several_jumps_in_one_interval_and_outside():
    samples = jnp.arange(5) * 0.1
    at = knots(samples, jnp.array([0.21, 0.2, 0.25, -1.0, 7.0]))
    times = np.asarray(at.times)
    assert np.all(np.diff(times) >= 0)
    np.testing.assert_array_equal(times[np.asarray(at.samples)], samples)
    assert times[0] == 0.0 and times[-1] == samples[-1]
    pieces, jumps = np.asarray(at.piece), np.sort([0.2, 0.21, 0.25])
    np.testing.assert_array_equal(times[np.asarray(at.jumps)], [0.0, *jumps, times[-1]])
    own = np.asarray(at.which) > 0
    for i, (start, end) in enumerate(zip(times[:-1], times[1:])):
        # no interval sees both sides of a jump, nor the jump, though it end on it
        first, last = pieces[i]
        assert not np.any((first <= jumps) & (jumps <= last))
        if start < end:
            assert first <= max(
                np.nextafter(start, 1), np.finfo(float).tiny
            ) and last >= np.nextafter(end, 0)
        # and what touches one has weights of its own
        assert own[i] == (at.jumps[i] or at.jumps[i + 1])
        if own[i]:
            assert at.lengths[at.which[i] - 1] == end - start


def test_both_modes_of_differentiation():
    """d y(T)/d(initial value) of a nonlinear stiff system, forward, reverse and exact."""

    def final(c):
        solver = jr.ExponentialAdams(6, 2, jnp.diag(jnp.array([-STIFF, -1.0])))
        terms = diffrax.ODETerm(stiff_field)
        ts, y0 = jnp.linspace(0.0, 1.0, 81), jnp.stack([jnp.ones(()), c])
        state = solver.init(terms, ts[0], ts[1], y0, None)
        return march(solver, terms, knots(ts, jnp.zeros(0)), y0, None, state)[-1, 1]

    # y2 = 1/(1/c + sin t)
    want = 1 / (1 / 0.7 + np.sin(1.0)) ** 2 / 0.7**2
    forward, reverse = (jax.jit(way(final))(0.7) for way in (jax.jacfwd, jax.grad))
    np.testing.assert_allclose(forward, want, rtol=1e-7)
    np.testing.assert_allclose(reverse, forward, rtol=1e-12)
