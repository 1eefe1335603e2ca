"""Steps that span several samples: what stands at the samples within a step is as good as at its end."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from jaxrotor.integrators.blocks import blocks_of
from jaxrotor.integrators.fitted import Method, run_through
from jaxrotor.integrators.fitted_weights import Parts, turn_of
from jaxrotor.integrators.ladder import chains_of, ladder_of

# s: from sample to sample
SAMPLE = 0.02


def of_speed(w):
    """Stiff, ringing at 90 rad/s, and coupled by a gyroscopic term."""
    turning = np.array([[0.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0] * 4, [0.0] * 4])
    ringing = np.array([[0.0] * 4, [0.0] * 4, [0.0, 0.0, -0.5, 90.0], [0.0, 0.0, -90.0, -0.5]])
    return ringing - np.diag([1.0, 1e4, 0.0, 0.0]) + w * turning


def force(t, y, xp=jnp):
    """What turns at 2 rad/s, and bends what it acts on."""
    a, b = xp.cos(2 * t), xp.sin(2 * t)
    return xp.stack([a - 0.1 * y[0] ** 3, 1e4 * b, a * y[0], b - 0.2 * y[0] ** 2])


def speed(t, y):
    return 1.0 + t


STILL, TURNING = of_speed(0.0), of_speed(1.0) - of_speed(0.0)


def field(t, y, xp=jnp):
    return STILL @ y + speed(t, y) * TURNING @ y + force(t, y, xp)


Y0 = np.array([0.5, 0.0, 1.0, -0.5])


def run(
    f,
    intervals,
    span,
    order=6,
    jumps=(),
    method=None,
    room=None,
    speed=speed,
    top=None,
    parts=None,
):
    """`top`: rad/s, of the linearisations."""
    rungs = np.linspace(1.0, top or 1.0 + SAMPLE * intervals, 3)
    jumps = jnp.asarray(jumps, float)
    blocks = blocks_of(SAMPLE, intervals, 1, order, jumps, None, 8, room, span)
    speeds, A = jnp.asarray(rungs), jnp.stack([of_speed(w) for w in rungs])
    h, chains = jnp.asarray(SAMPLE * span), None
    if parts is not None:
        near, every = turn_of(speeds, h), jnp.full(3, h)
        chains = [
            chains_of(A[:, np.array(r)[:, None], np.array(r)], every, near, order, 0)
            for r in parts.rows
        ]
    ladder = ladder_of(
        speeds,
        A,
        h,
        order,
        0,
        blocks,
        1.0 + blocks.starts,
        rungs[0],
        chains,
        parts=parts,
        span=span,
    )
    return run_through(f, ladder, blocks, speed, jnp.asarray(Y0), method or Method())


def through(f, begin, end, y, at):
    """The states at the instants and at the end, by SciPy's Radau. On a jump the force is that of the side
    that is gone through."""
    first, last = np.nextafter(begin, end), np.nextafter(end, begin)

    def rate(t, y):
        return f(min(max(t, first), last), y, np)

    way = solve_ivp(rate, (begin, end), y, "Radau", np.union1d(at, [end]), rtol=1e-10, atol=1e-12)
    return way.y.T[: at.size], way.y[:, -1]


def exactly(intervals, f=field, jumps=()):
    """From jump to jump."""
    t, y, found, begin = SAMPLE * np.arange(intervals + 1), Y0, [Y0], 0.0
    for end in (*sorted(jumps), t[-1]):
        inside = t[(t > begin) & ((t < end) | (t[-1] == end) & (t == end))]
        rows, y = through(f, begin, end, y, inside)
        found += [*rows, *([y] if end < t[-1] and np.any(t == end) else [])]
        begin = end
    return np.array(found)


@pytest.fixture(scope="module")
def smooth():
    return exactly(160)


@pytest.mark.parametrize("order", [3, 6])
def test_samples_within_a_step_are_as_good_as_its_end(order, smooth):
    """And have the method's order; of a mode too that turns by 29 rad in the longest of these steps."""
    largest = []
    for span in (1, 2, 4, 8, 16):
        found = np.asarray(jax.jit(lambda n=span: run(field, 160, n, order).kept)())
        off = np.abs(found - smooth).max(axis=1)
        assert off.max() < 1.1 * off[::span].max(), span
        largest.append(off.max())
    # the correction's order, one above the number of past values, or a little less where steps are long
    assert np.all(np.log2(np.divide(largest[1:4], largest[:3])) > order + 0.2), largest
    assert largest[0] < {3: 2e-6, 6: 1e-9}[order]


def test_what_fills_the_history_goes_from_sample_to_sample(smooth):
    found = jax.jit(lambda: run(field, 160, 64).kept)()
    np.testing.assert_allclose(found, smooth, atol=1e-6)


def test_a_linear_system_is_exact_at_every_sample():
    """What rings, against an exponential of each instant; no force, so nothing is taken for a mix."""
    A = of_speed(1.0)
    found = jax.jit(lambda: run(lambda t, y: A @ y, 75, 16, speed=lambda t, y: 1.0 + 0.0 * t).kept)
    want = [expm(SAMPLE * i * A) @ Y0 for i in range(76)]
    np.testing.assert_allclose(found(), want, atol=2e-11)


def jumping(jumps):
    def f(t, y, xp=jnp):
        push = sum((-1.0) ** i * (t >= at) for i, at in enumerate(jumps))
        return field(t, y, xp) + push * np.array([1.0, 0.0, 5.0, 0.0])

    return f


# in one step, in one sample, on a sample, on a step's end, at the very end and outside
HISTORIES = {
    "one": [0.507],
    "in a step": [0.507, 0.55],
    "in a sample": [0.507, 0.511, 0.52],
    "on a sample": [0.5],
    "on an end": [0.48],
    "in the first sample": [0.003],
    "about the end": [0.985, 1.0, 2.0],
}


@jax.jit
def behind_jumps(at):
    """With 4 samples a step, and with one."""
    return [run(jumping(at), 50, span, jumps=at).kept for span in (4, 1)]


@pytest.mark.parametrize("jumps", list(HISTORIES.values()), ids=list(HISTORIES))
def test_jumps_within_steps(jumps):
    """Fifty samples of 4 a step are no whole number of steps either."""
    want = exactly(50, jumping(jumps), [at for at in jumps if at < 1.0])
    found, one = behind_jumps(np.array([*jumps, 3.0, 4.0])[:3])  # those behind the end are none
    np.testing.assert_allclose(found, want, atol=5e-6)
    np.testing.assert_allclose(one, want, atol=5e-9)


def test_derivative_by_the_instant_of_a_jump_at_the_samples_behind_it():
    """Forward, reverse and by differences."""

    def sizes(at):
        def f(t, y):
            return field(t, y) + jnp.where(t < at, 0.0, 3.0) * jnp.array([1.0, 0.0, 2.0, 0.0])

        return jnp.sum(run(f, 30, 8, jumps=at[None]).kept[1:] ** 2, axis=1)

    at = jnp.asarray(0.217)
    ahead = jax.jit(jax.jacfwd(sizes))(at)
    back = jax.jit(jax.jacrev(sizes))(at)
    np.testing.assert_allclose(back, ahead, rtol=1e-9, atol=1e-10)
    plain, step = jax.jit(sizes), 1e-5
    central = (plain(at + step) - plain(at - step)) / (2 * step)
    np.testing.assert_allclose(ahead, central, rtol=1e-5, atol=1e-6)
    assert np.all(np.abs(ahead[11:]) > 1e-2)


@pytest.mark.parametrize("jumps", [(), (0.507, 0.55)], ids=["smooth", "jumps"])
def test_one_program_for_any_length(jumps):
    """Whose number of samples is traced, with room for more; as the programs of their own."""
    programs = []
    f = jumping(jumps) if jumps else field

    @jax.jit
    def of_any(intervals):
        programs.append(1)
        method = Method(probe=True, lasting=True)
        course = run(f, intervals, 4, 5, jumps, method, (90, 30, 1), top=2.0)
        return course.kept, course.gaps

    for intervals in (50, 43):
        kept, gaps = of_any(intervals)
        own = jax.jit(lambda n=intervals: run(f, n, 4, 5, jumps, Method(probe=True), top=2.0))()
        np.testing.assert_allclose(kept[: intervals + 1], own.kept, rtol=1e-11, atol=1e-12)
        ends = intervals // 4 + 1
        np.testing.assert_allclose(gaps[:ends], own.gaps[:ends], rtol=1e-9, atol=1e-11)
        rest = np.tile(kept[intervals], (91 - intervals, 1))
        np.testing.assert_array_equal(kept[intervals:], rest)
    assert len(programs) == 1


def test_parts_that_do_not_mix():
    """As all at once."""
    parts = Parts(((2, 3), (0, 1)), 0)
    whole = jax.jit(lambda: run(field, 50, 8, 5).kept)()
    own = jax.jit(lambda: run(field, 50, 8, 5, parts=parts).kept)()
    np.testing.assert_allclose(own, whole, atol=1e-12)
