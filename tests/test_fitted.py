"""Exponentially fitted Adams: weights, exactness, order, start, and the change of linearisation."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from jaxrotor.core.block_matrix import independent
from jaxrotor.integrators import fitted
from jaxrotor.integrators.blocks import blocks_of
from jaxrotor.integrators.fitted import Method, run_through
from jaxrotor.integrators.fitted_weights import Parts, first_steps, fitted_weights, turn_of
from jaxrotor.integrators.ladder import RUNGS, chains_of, ladder_of
from jaxrotor.integrators.phi import phi_functions, turning_powers
from jaxrotor.simulation.known_chains import known_chains

OMEGA = 3.0  # rad/s


def integrals(Z, turn, count):
    """∫_0^1 e^((1-s) Z) u_n(s) ds, n < count, where u_n is s^n/n!, or for the last two its turning mate:
    all from one exponential, for the u_n follow linear equations themselves."""
    d = len(Z)
    J = np.eye(count, k=-1)
    J[count - 2, count - 1] = -(turn**2)
    whole = np.zeros((d + count, d + count))
    out = []
    for column in np.eye(d):
        for n in range(count):
            whole[:d, :d], whole[d:, d:] = Z, J
            whole[:d, d:] = np.outer(column, np.eye(count)[n])
            out.append(expm(whole)[:d, d])
    return np.array(out).reshape(d, count, d).transpose(1, 2, 0)


def matrix(kind):
    rng = np.random.default_rng(3)
    Z = rng.standard_normal((4, 4))
    if kind == "damped":
        return 8 * Z - 30 * np.eye(4)
    if kind == "critical":  # an undamped mode at the very speed, and one that stands still
        turning = np.array([[0.0, 1.3], [-1.3, 0.0]])
        return Z @ np.block([[turning, np.zeros((2, 2))], [np.zeros((2, 4))]]) @ np.linalg.inv(Z)
    return 0.01 * Z


@pytest.mark.parametrize("kind", ["damped", "critical", "slow"])
def test_integrals_that_turn(kind):
    """Against one matrix exponential each; (i θ - Z)^-1 does not exist where θ is an eigenvalue."""
    Z, turned = matrix(kind), jax.jit(phi_functions, static_argnums=1)
    for turn in (0.0, 1e-3, 1.3, 2.0):
        found = np.asarray(turned(jnp.asarray(Z), 7, jnp.asarray(turn)))
        for part, scale in zip(found, (0.5, 1.0)):
            want = integrals(scale * Z, scale * turn, 7)
            size = np.abs(want).max(axis=(1, 2), keepdims=True)
            np.testing.assert_allclose(part[1:] / size, want / size, atol=1e-12)
            np.testing.assert_allclose(part[0] + np.eye(4), expm(scale * Z), atol=1e-12)


def test_turning_powers_are_cosine_and_sine_less_their_first_terms():
    x, turn = np.linspace(-5, 1, 7), 1.5
    found = np.asarray(turning_powers(jnp.asarray(x), jnp.asarray(turn), 0, 4))
    a = turn * x
    want = [np.cos(a), np.sin(a) / turn, (1 - np.cos(a)) / turn**2, (a - np.sin(a)) / turn**3]
    np.testing.assert_allclose(found, want, atol=2e-12)


def test_integrals_have_derivatives_by_matrix_and_speed():
    Z = jnp.asarray(matrix("damped"))

    @jax.jit
    def f(x):
        return jnp.sum(phi_functions(Z * x, 4, 1.3 * x)[1] * jnp.arange(80.0).reshape(5, 4, 4))

    step = 1e-5
    central = (f(1 + step) - f(1 - step)) / (2 * step)
    np.testing.assert_allclose(jax.jit(jax.grad(f))(1.0), central, rtol=1e-8)
    ahead = jax.jit(lambda x: jax.jvp(f, (x,), (1.0,))[1])
    np.testing.assert_allclose(ahead(1.0), central, rtol=1e-8)


@pytest.mark.parametrize("order", [3, 6])
def test_exact_for_what_the_weights_are_fitted_to(order):
    """Prediction for 1, s, ..., s^(k-3) and the pair; correction for one power more."""
    rng = np.random.default_rng(order)
    A, h, turn = matrix("damped"), 0.05, 1.1
    w = fitted_weights(jnp.asarray(A), jnp.asarray(h), jnp.asarray(turn), order)
    s = np.arange(1.0, -order, -1)  # the step's end, then the past, newest first
    powers = np.stack([s**n for n in range(order - 1)])
    pair = np.stack([np.cos(turn * s), np.sin(turn * s)])
    # the same as linear equations of the powers and the pair
    J = np.zeros((order + 1, order + 1))
    J[np.arange(1, order - 1), np.arange(order - 2)] = np.arange(1, order - 1)
    J[-2:, -2:] = [[0, -turn], [turn, 0]]
    start = np.zeros(order + 1)
    start[[0, -2]] = 1.0
    factors = rng.standard_normal((4, order + 1))
    y = rng.standard_normal(4)
    for corrected in (False, True):
        if not corrected:
            factors[:, order - 2] = 0.0
        else:
            factors[:, order - 2] = rng.standard_normal(4)
        N = factors @ np.concatenate([powers, pair])
        whole = np.block([[h * A, h * factors], [np.zeros((order + 1, 4)), J]])
        want = (expm(whole) @ np.concatenate([y, start]))[:4]
        history = N[:, 1:].T
        gap = N[:, 0] - np.asarray(w.ahead) @ history
        found = np.asarray(w.predict) @ np.concatenate([y, history.ravel()])
        if corrected:
            assert np.abs(found - want).max() > 1e-4  # the power is not in the prediction
            found = found + np.asarray(w.correct) @ gap
        else:
            np.testing.assert_allclose(gap, 0.0, atol=1e-10)
        np.testing.assert_allclose(found, want, atol=1e-12)


def test_rows_without_N_are_left_out():
    A = np.eye(4, k=2) + np.diag([0, 0, -3.0, -40.0])
    args = jnp.asarray(A), jnp.asarray(0.1), jnp.asarray(0.7), 4
    whole, some = fitted_weights(*args), fitted_weights(*args, 2)
    columns = np.concatenate([np.arange(4), *(4 + 4 * j + np.arange(2, 4) for j in range(4))])
    np.testing.assert_allclose(some.predict, whole.predict[:, columns], atol=1e-15)
    np.testing.assert_allclose(some.correct, whole.correct[:, 2:], atol=1e-15)


# Three coordinates, the last stiff, with forces bent so that `motion` is what they do, whatever A is. Of the
# Jacobian a gyroscopic coupling goes with a speed that rises, as in a machine.
STIFF = -1e4


def motion(t):
    a = OMEGA * t
    y = jnp.stack([jnp.sin(a), 0.5 * jnp.cos(2 * a), jnp.sin(a) ** 2])
    return y, OMEGA * jnp.stack([jnp.cos(a), -jnp.sin(2 * a), jnp.sin(2 * a)])


def speed(t, y):
    return 4.0 * t


def linear(w):
    gyro = jnp.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    return jnp.diag(jnp.array([-1.0, -2.0, STIFF])) + w * gyro


def field(t, y):
    want, rate = motion(t)
    off = y - want
    bent = jnp.stack([off[0] * off[1], off[0] ** 2, off[0]])
    return rate + linear(speed(t, y)) @ off + bent + 0.3 * (jnp.sin(y) - jnp.sin(want))


def run(
    f,
    speeds,
    h,
    intervals,
    order,
    y0,
    substeps=1,
    jumps=(),
    ticks=None,
    length=10,
    method=None,
    **more,
):
    """`h`: s, of an interval."""
    blocks = blocks_of(h, intervals, substeps, order, jnp.asarray(jumps, float), ticks, length)
    A = jax.vmap(linear)(speeds)
    of_parts = 4.0 * blocks.starts
    ladder = ladder_of(speeds, A, jnp.asarray(h / substeps), order, 0, blocks, of_parts)
    return run_through(f, ladder, blocks, speed, y0, method or Method(), **more)


def largest_errors(order, evaluations=1):
    """At three steps, each half the one before, over two seconds and eleven linearisations."""

    def one(n):
        h = 2.0 / (10 * n)
        speeds = jnp.linspace(0.0, 8.0, 11)
        method = Method(evaluations)
        ys = run(field, speeds, h, 10 * n, order, motion(0.0)[0], method=method).kept
        t = h * jnp.arange(ys.shape[0])
        return jnp.max(jnp.abs(ys - jax.vmap(motion)(t)[0]))

    one = jax.jit(one, static_argnums=0)
    return np.array([one(n) for n in (5, 10, 20)])


@pytest.mark.parametrize("order, evaluations", [(4, 1), (6, 1), (6, 2)])
def test_order_over_changes_of_the_linearisation(order, evaluations):
    """The correction's, one above the number of past values, or a little less where steps are long."""
    found = largest_errors(order, evaluations)
    assert np.all(np.log2(found[:-1] / found[1:]) > order + 0.3), found
    assert found[-1] < {4: 1e-6, 6: 1e-9}[order]


def test_a_history_of_another_linearisation_would_spoil_it(monkeypatch):
    """That the test above sees whether a history is rebased."""
    monkeypatch.setattr(fitted, "_rebased", lambda N, states, change: N)
    found = largest_errors(4)
    assert np.all(np.log2(found[:-1] / found[1:]) < 2), found


def test_parts_that_do_not_mix_go_by_weights_of_their_own():
    """Two oscillators, one with a third coordinate, that a force bends: as by weights of all at once,
    over two linearisations and a jump. What A has between them besides is left to N."""
    n, order, h = 3, 5, 0.02
    K = jnp.array([[40.0, 0.0, -5.0], [0.0, 90.0, 0.0], [-5.0, 0.0, 60.0]])
    turning = jnp.zeros((n, n)).at[0, 2].set(-1.0).at[2, 0].set(1.0)
    speeds = jnp.array([1.0, 3.0])

    def of(w):
        lower = jnp.concatenate([-K, -0.3 * jnp.eye(n) + w * turning], axis=1)
        return jnp.concatenate([jnp.eye(n, 2 * n, n), lower])

    def field(t, y):
        bent = jnp.where(t > 0.507, 3.0, 1.0) * jnp.sin(y[0] * y[1] + t)
        force = bent * jnp.array([1.0, -0.5, 0.2])
        return of(2.0 * t) @ y + jnp.concatenate([jnp.zeros(n), force])

    blocks = blocks_of(h, 60, 1, order, jnp.array([0.507]), length=8)
    of_parts = 2.0 * blocks.starts
    A, rows = jax.vmap(of)(speeds), ((1, 4), (0, 2, 3, 5))
    mixed = A.at[:, 4, 0].add(1e-3)

    def run(A, parts):
        def chains(A, h, w):
            each = parts.rows if parts else [range(2 * n)]
            own = [A[:, np.array(r)[:, None], np.array(r)] for r in each]
            return [chains_of(a, h, turn_of(w, h), order, a.shape[1] // 2) for a in own]

        at = jnp.abs(speeds[:, None] - of_parts).argmin(0)
        known = chains(A, jnp.full(2, h), speeds), chains(A[at], blocks.lengths, of_parts)
        ladder = ladder_of(
            speeds, A, jnp.asarray(h), order, n, blocks, of_parts, 0.0, *known, parts=parts
        )
        begin = jnp.arange(2.0 * n) / 10
        course = run_through(field, ladder, blocks, lambda t, y: 2.0 * t, begin, Method(probe=True))
        return course.kept, course.gaps, ladder.flow(0)

    found = [jax.jit(run, static_argnums=1)(a, p) for a, p in ((A, None), (A, Parts(rows, n)))]
    for whole, own in zip(jax.tree.leaves(found[0]), jax.tree.leaves(found[1]), strict=True):
        np.testing.assert_allclose(own, whole, rtol=0, atol=1e-12)
    assert independent(np.asarray(A), 1) == rows[::-1]
    assert independent(np.asarray(mixed), 1) == (tuple(range(2 * n)),)
    left_out = jax.jit(run, static_argnums=1)(mixed, Parts(rows, n))[0]
    np.testing.assert_allclose(left_out, found[0][0], rtol=0, atol=1e-11)


def test_what_is_remembered_is_N_at_the_corrected_state():
    """Where the field is linear and A goes with the speed evenly, one evaluation in a step is as good as
    many: a second one finds no gap more."""
    speeds = jnp.array([2.0, 6.0])
    ladder = ladder_of(speeds, jax.vmap(linear)(speeds), jnp.asarray(0.05), 4, 0)
    weights = ladder.weights(0, -1, -2, jnp.asarray(4.2))
    follow = ladder.follow(0, 0, -1, jnp.asarray(4.2), weights)
    gap = jnp.array([0.4, -0.1, 0.2])
    moved = weights.correct @ (gap + follow @ gap)
    grown = (linear(4.2) - linear(2.0)) @ moved
    np.testing.assert_allclose(follow @ gap, grown, atol=1e-4 * np.abs(grown).max())
    assert np.abs(grown).max() > 1e-3


def test_weights_for_many_speeds_are_mixed_from_those_of_one():
    """On one linearisation: those for a speed beside its own are nearly what that speed's own would be."""
    A, h = linear(2.0)[None], jnp.asarray(0.1)
    ladder = ladder_of(jnp.array([5.0]), A, h, 5, 0)
    off = fitted_weights(A[0], h, jnp.asarray(0.5), 5)
    turns = np.asarray(ladder.turns[0])
    for turn in (turns[4], turns[11]):
        own = fitted_weights(A[0], h, jnp.asarray(turn), 5)
        mixed = ladder.weights(0, -1, -2, jnp.asarray(turn / 0.1))
        apart = np.abs(mixed.predict - own.predict).max()
        assert apart < 0.1 * np.abs(off.predict - own.predict).max()


def test_first_steps_end_where_regular_steps_know_regular_points():
    for order in (3, 6):
        steps = first_steps(order)
        np.testing.assert_array_equal(steps.ends[steps.regular], np.arange(1, order))
        assert all(abs(length * points[-1]) <= order for length, points in steps.kinds)


def test_turn_is_bounded():
    found = turn_of(jnp.array([-100.0, 1e5]), jnp.asarray(1e-3))
    np.testing.assert_allclose(found, [0.1, 2.0], rtol=1e-15)


def test_gradients_by_blocks():
    """Of the state at the end by start and stiffness, through the linearisations too, against central
    differences."""

    def end(x, lasting=False):
        def f(t, y):
            return field(t, y) + (x - 1) * linear(speed(t, y)) @ y

        speeds = jnp.linspace(0.0, 8.0, 3)
        blocks = blocks_of(0.02, 28, 1, 4, jnp.zeros(0), None, 8)
        A = jax.vmap(linear)(speeds) * x
        ladder = ladder_of(speeds, A, jnp.asarray(0.02), 4, 0, blocks)
        y0 = x * jnp.array([0.1, 0.5, 0.0])
        method = Method(lasting=lasting)
        return run_through(f, ladder, blocks, speed, y0, method).kept[-1] @ jnp.arange(1.0, 4.0)

    plain, step = jax.jit(end), 1e-5
    central = (plain(1 + step) - plain(1 - step)) / (2 * step)
    np.testing.assert_allclose(jax.jit(jax.grad(end))(1.0), central, rtol=1e-6)
    for lasting in (False, True):  # reverse mode knows the first alone
        forward = jax.jit(lambda x, own=lasting: jax.jvp(lambda x: end(x, own), (x,), (1.0,))[1])
        np.testing.assert_allclose(forward(1.0), central, rtol=1e-6)


JUMP = 1 / np.sqrt(2)
HISTORIES = {
    "one": [JUMP],
    "many": [0.08, JUMP, 0.05, -1.0, 0.5, 7.0, 0.0, 2.0],
}


def forced(t, y):
    """y' = -y + s(t), where s jumps at an instant that no sample hits; beside it something stiff."""
    return jnp.stack([-y[0] + jnp.where(t < JUMP, 0.0, jnp.cos(t)), -y[1], STIFF * (y[2] - y[0])])


def exactly_forced(t):
    after, start = (np.cos(t) + np.sin(t)) / 2, (np.cos(JUMP) + np.sin(JUMP)) / 2
    return np.exp(-t) + (after - start * np.exp(JUMP - t)) * (t > JUMP)


@pytest.mark.parametrize("order", [4, 6])
def test_jump_off_the_grid_keeps_the_order(order):
    """Several in one interval, outside, and at the ends too."""
    t, y0, rest = np.linspace(0.0, 2.0, 21), jnp.array([1.0, 1.0, 1.0]), jnp.zeros(1)

    def error(n, jumps):
        found = jax.jit(lambda at: run(forced, rest, 0.1, 20, order, y0, n, at).kept)(
            jnp.array(jumps)
        )
        assert np.isfinite(found).all()
        return np.abs(np.asarray(found)[:, 0] - exactly_forced(t)).max()

    for jumps in HISTORIES.values():
        coarse, fine = error(2, jumps), error(4, jumps)
        assert fine < 1e-8 and np.log2(coarse / fine) > min(order, 4) - 1.2
    assert error(4, [0.3]) > 1e-4  # what happens to a run that is not told


def test_derivative_by_the_instant_of_a_jump():
    """y(2) by it: what acts there, decayed until then."""

    def end(at):
        def f(t, y):
            return jnp.where(t < at, 0.0, 1.0) - y

        speeds = jnp.zeros(1)
        blocks = blocks_of(0.1, 20, 2, 6, at[None])
        ladder = ladder_of(
            speeds, -0.5 * jnp.eye(1)[None], jnp.asarray(0.05), 6, 0, blocks, blocks.starts
        )
        return run_through(f, ladder, blocks, speed, jnp.ones(1)).kept[-1, 0]

    at = jnp.asarray(JUMP)
    for found in (jax.jit(jax.grad(end))(at), jax.jit(jax.jacfwd(end))(at)):
        np.testing.assert_allclose(found, -np.exp(JUMP - 2), rtol=1e-8)


def test_ticks_change_the_state_and_it_starts_afresh():
    """A held force is set every third interval to what the state is there."""
    due = np.zeros((21, 1), bool)
    due[::3] = True

    def f(t, y):
        return jnp.stack([-2.0 * y[0] + y[1], 0.0 * y[1], -y[2]])

    def tick(t, y, now):
        return y.at[1].set(jnp.where(now[0], jnp.sin(3 * t) - y[0], y[1]))

    y0 = jnp.array([1.0, 0.0, 1.0])
    found = jax.jit(lambda: run(f, jnp.zeros(1), 0.1, 20, 6, y0, 2, (), due, tick=tick).kept)()
    want, held = 1.0, 0.0
    for i, row in enumerate(np.asarray(found)):
        if due[i, 0]:
            held = np.sin(0.3 * i) - want
        np.testing.assert_allclose(row[:2], [want, held], atol=1e-7)
        want = held / 2 + (want - held / 2) * np.exp(-0.2)


@pytest.mark.parametrize("jumps", [(), (JUMP,)], ids=["smooth", "jump"])
def test_one_program_for_any_length_and_step(jumps):
    """Where numbers of intervals and steps are traced, beside the programs of their own; with room to
    spare."""
    y0, speeds, programs = jnp.array([1.0, 1.0, 1.0]), jnp.linspace(0.0, 8.0, 3), []

    @jax.jit
    def of_any(intervals, substeps):
        programs.append(1)
        at = jnp.asarray(jumps, float)
        blocks = blocks_of(0.1, intervals, substeps, 4, at, None, 6, (30, 150, 8))
        A = jax.vmap(linear)(speeds)
        ladder = ladder_of(speeds, A, 0.1 / substeps, 4, 0, blocks, 4 * blocks.starts)
        return run_through(forced, ladder, blocks, speed, y0, Method(lasting=True)).kept

    for intervals, substeps in ((20, 2), (25, 5), (9, 1)):
        found = np.asarray(of_any(intervals, substeps))
        own = jax.jit(
            lambda n=intervals, m=substeps: (
                run(forced, speeds, 0.1, n, 4, y0, m, jumps, length=6).kept
            )
        )()
        np.testing.assert_allclose(found[: intervals + 1], own, rtol=1e-12, atol=1e-13)
        np.testing.assert_array_equal(
            found[intervals:], found[[intervals]].repeat(31 - intervals, 0)
        )
    assert len(programs) == 1


def test_a_batch_at_one_speed_shares_its_weights():
    """Each member is what it is alone; of the weights none has a batch where the speed has none."""
    starts = jnp.array([[0.1, 0.5, 0.0], [0.0, 0.4, 0.1], [0.2, 0.5, 0.3]])

    def one(y0, rate):
        def f(t, y):
            return linear(rate * t) @ y + jnp.stack([y[0] * y[1], y[0] ** 2, y[0]])

        speeds = jnp.linspace(0.0, 8.0, 5)
        blocks = blocks_of(0.02, 100, 1, 5, jnp.zeros(0))
        ladder = ladder_of(speeds, jax.vmap(linear)(speeds), jnp.asarray(0.02), 5, 0, blocks)
        return run_through(f, ladder, blocks, lambda t, y: rate * t, y0).kept

    alone, shared = jax.jit(one), jax.jit(jax.vmap(one, in_axes=(0, None)))
    own, rates = jax.jit(jax.vmap(one)), jnp.array([3.6, 4.0, 4.4])
    np.testing.assert_allclose(
        shared(starts, 4.0), np.stack([alone(y, 4.0) for y in starts]), rtol=1e-12, atol=1e-13
    )
    np.testing.assert_allclose(
        own(starts, rates),
        np.stack([alone(*x) for x in zip(starts, rates)]),
        rtol=1e-12,
        atol=1e-13,
    )
    weights = "tensor<3x3x18xf64>"
    assert weights in own.lower(starts, rates).as_text()
    assert weights not in shared.lower(starts, 4.0).as_text()


def test_rows_of_zeros_fill_small_machines_up_and_change_nothing():
    """So that machines of many sizes have their weights by one program."""
    rng = np.random.default_rng(4)
    n, inside = 2, 1
    A = np.zeros((RUNGS, 2 * n + inside, 2 * n + inside))
    A[:, :n, n : 2 * n] = np.eye(n)
    A[:, n:] = rng.normal(size=(RUNGS, n + inside, 2 * n + inside)) * 1e3
    h, speeds = np.full(RUNGS, 1e-3), np.array([0.0, 100.0, 200.0, 300.0])
    alone = jax.jit(chains_of, static_argnums=(3, 4))(A, h, turn_of(speeds, h), 5, n)
    for one, own in zip(
        jax.tree.leaves(
            known_chains(A, h, speeds, np.zeros(()), 5, Parts.whole(2 * n + inside, n))
        ),
        jax.tree.leaves(alone),
    ):
        np.testing.assert_allclose(one, own, rtol=0, atol=1e-14 * np.abs(own).max())
