"""Influence coefficients from many runs: least squares where nothing drifts; drift and mistakes beside it."""

import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.identification import influence

RNG = np.random.default_rng(5)


def normal(*shape):
    return (RNG.normal(size=shape) + 1j * RNG.normal(size=shape)) / np.sqrt(2)


A = normal(6, 2)


def drift():
    """A common motion of all probes, stronger than what each does by itself."""
    common = normal(6)
    return lambda n: 0.3 * normal(n, 1) * common + 0.03 * normal(n, 6)


def test_exact_runs():
    """Without scatter the coefficients come back, missing vectors or not; one plane at a time as well."""
    U = normal(8, 2)
    Y = U @ A.T
    Y[2, 1] = np.nan
    found = influence(U, Y)
    np.testing.assert_allclose(found.coefficients, A, atol=1e-6)
    np.testing.assert_allclose(
        found.unbalance(A @ [2 - 1j, 0.5j]).unbalance, [2 - 1j, 0.5j], atol=1e-5
    )


def test_white_scatter_is_least_squares():
    """Equal probes without drift: the complex least squares, and its standard deviation by the formula."""
    U = normal(400, 2)
    Y = U @ A.T + 0.1 * normal(400, 6)
    found = influence(U, Y)
    ordinary = np.linalg.lstsq(U, Y, rcond=None)[0].T
    np.testing.assert_allclose(found.coefficients, ordinary, atol=0.3 * found.coefficient_std.min())
    std = 0.1 / np.sqrt(2) * np.sqrt(np.diag(np.linalg.inv(U.conj().T @ U)).real)
    np.testing.assert_allclose(found.coefficient_std, np.tile(std, (6, 1)), rtol=0.15)
    np.testing.assert_allclose(found.drift_std, 0.1 / np.sqrt(2), rtol=0.15)


def test_what_drifts_together_counts_together():
    """The unknown unbalance is found several times better than by pseudo-inverse, and the stated discs hold
    it as often as they say."""
    better, plain, covered = [], [], []
    moved = drift()
    for _ in range(150):
        U, u = 5 * normal(26, 2), 5 * normal(2)
        Y, y = U @ A.T + moved(26), A @ u + moved(1)[0]
        found = influence(U, Y)
        told = found.unbalance(y)
        better.append(np.abs(told.unbalance - u))
        plain.append(np.abs(np.linalg.pinv(np.linalg.lstsq(U, Y, rcond=None)[0].T) @ y - u))
        covered.append(told.covers(u))
    assert np.mean(better) < 0.6 * np.mean(plain)
    assert 0.90 <= np.mean(covered) <= 0.99


def test_a_mislabelled_run_is_named():
    U = 5 * normal(20, 2)
    Y = U @ A.T + 0.1 * normal(20, 6)
    Y[7] = A @ (U[7] * [1, 0]) + 0.1 * normal(6)  # the second mass was not there
    Y[3, 2] *= 3.0
    found = influence(U, Y)
    assert found.doubted == (7,) and found.left_out[3, 2] and found.left_out.sum() <= 10
    clean = influence(np.delete(U, 7, 0), np.delete(Y, 7, 0))
    np.testing.assert_allclose(
        found.coefficients, clean.coefficients, atol=4 * clean.coefficient_std.max()
    )


def test_something_else_is_the_matter():
    """Vectors that no unbalance in these planes makes are told as improbable."""
    U = 5 * normal(26, 2)
    found = influence(U, U @ A.T + 0.1 * normal(26, 6))
    u = 5 * normal(2)
    assert found.unbalance(A @ u + 0.1 * normal(6)).chance > 0.01
    assert found.unbalance(A @ u + 3.0 * normal(6)).chance < 1e-3


def test_prior():
    """A model beforehand: with a tight one its coefficients stay, with a loose one they go; between, one run
    and one probe more, by the textbook's weighed mean."""
    U = normal(30, 1)
    Y = U @ A[:1, :1].T + 0.2 * normal(30, 1)
    own = influence(U, Y)
    tight = influence(U, Y, prior=(A[:1, :1] + 1.0, 1e-6))
    np.testing.assert_allclose(tight.coefficients, A[:1, :1] + 1.0, atol=1e-5)
    loose = influence(U, Y, prior=(A[:1, :1] + 1.0, 1e3))
    np.testing.assert_allclose(loose.coefficients, own.coefficients, atol=1e-6)
    s = 0.05
    both = influence(U, Y, prior=(A[:1, :1] + 1.0, s))
    noise = both.drift_std[0] ** 2 / (U.conj().T @ U).real[0, 0]
    mean = own.coefficients[0, 0] * s**2 + (A[0, 0] + 1.0) * noise
    np.testing.assert_allclose(both.coefficients[0, 0], mean / (s**2 + noise), rtol=1e-3)
    u = np.array([1.0 + 2.0j])
    held = own.unbalance(own.coefficients @ u, prior=1e-6).unbalance
    np.testing.assert_allclose(held, 0, atol=1e-6)


def test_days():
    """A day's vector is the best linear predictor of a random effect (Henderson): the mean of what its runs
    have left, shrunk by n kappa/(n kappa + 1). kappa is that of many days."""
    U, u = normal(300, 1), np.array([2.0 - 1.0j])
    days = [None] * 60 + [k for k in range(24) for _ in range(10)]
    vectors = 0.6 * normal(24, 2)
    moved = np.concatenate([np.zeros((60, 2)), np.repeat(vectors, 10, axis=0)])
    found = influence(U, U @ A[:2, :1].T + moved + 0.2 * normal(300, 2), days=days)
    assert found.unrest == pytest.approx(9.0, rel=0.4)
    Y = U @ A[:2, :1].T + moved
    again = influence(U, Y + 0.2 * normal(300, 2), days=days)
    for k in (0, 7, 23):
        off = np.abs(again.days[k] - vectors[k])
        assert (off < 5 * 0.2 / np.sqrt(10)).all()
    there = influence(
        U, Y, days=days, prior=(A[:2, :1], 1e-9)
    )  # what runs add beside is next to nothing
    np.testing.assert_allclose([there.days[k] for k in range(24)], vectors, atol=1e-3)
    y = A[:2, :1] @ u + vectors[3]
    told = found.unbalance(y, day=3)
    assert abs(told.unbalance[0] - u[0]) < 4 * told.std[0]
    other = found.unbalance(y, day="another")
    assert other.std[0] > 2 * told.std[0]
    assert found.predicted(u, day="another")[1] == pytest.approx(
        np.sqrt(found.unrest + 1) * found.drift_std, rel=0.02
    )


def test_days_shrink():
    """Few runs of a day: its vector by the textbook's factor."""
    U = normal(200, 1)
    days = [None] * 196 + ["late"] * 4
    Y = U @ A[:1, :1].T + 0.2 * normal(200, 1)
    Y[196:] += 0.3 - 0.15j
    found = influence(U, Y, days=days)
    left = (Y - U @ found.coefficients.T)[196:]
    n = 4 * found.unrest
    assert not found.left_out[196:].any()
    np.testing.assert_allclose(found.days["late"], left.mean(axis=0) * n / (n + 1), rtol=0.05)


def test_an_unknown_day_is_covered():
    """Unbalances measured on another day, whose vector nobody knows."""
    covered, ignorant = [], []
    for _ in range(60):
        U, u = 5 * normal(36, 2), 5 * normal(2)
        vectors = 0.8 * normal(6, 6)
        moved = np.concatenate([np.zeros((6, 6)), np.repeat(vectors[:5], 6, axis=0)])
        days = [None] * 6 + [k for k in range(5) for _ in range(6)]
        Y = U @ A.T + moved + 0.2 * normal(36, 6)
        y = A @ u + vectors[5] + 0.2 * normal(6)
        found = influence(U, Y, days=days)
        covered.append(found.unbalance(y, day="today").covers(u))
        ignorant.append(found.unbalance(y).covers(u))
    assert 0.88 <= np.mean(covered) <= 0.995
    assert np.mean(ignorant) < 0.8


def test_intervals():
    found = influence(5 * normal(20, 2), 5 * normal(20, 6))
    told = found.unbalance(normal(6), unit="g*mm")
    size, angle = told.intervals(0.95)
    assert (size > 0).all() and ((angle > 0) & (angle <= np.pi)).all()
    assert "g*mm" in repr(told)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: influence(normal(2, 2), normal(2, 6)), "2 runs cannot tell 2 planes"),
        (lambda: influence(normal(5, 2), normal(4, 6)), "vectors must be 5 rows"),
        (
            lambda: influence(normal(9, 2), normal(9, 6), days=["a", None]),
            "days must be 9, a label for each run, but are 2",
        ),
        (lambda: influence(normal(5, 2) * np.nan, normal(5, 6)), "unbalances must be finite"),
        (
            lambda: influence(normal(9, 2), normal(9, 6), prior=(A[:3], 1.0)),
            "coefficients must be 6",
        ),
        (lambda: influence(normal(9, 2), normal(9, 6), prior=(A, -1.0)), "must be positive"),
        (lambda: influence(normal(9, 2), normal(9, 6)).unbalance(normal(5)), "vectors must be 6"),
        (lambda: influence(normal(9, 2), normal(9, 6)).predicted(normal(3)), "unbalance must be 2"),
        (
            lambda: influence(normal(9, 2), normal(9, 6)).unbalance([1.0] + [np.nan] * 5),
            "1 vectors cannot tell 2 unbalances",
        ),
    ],
)
def test_refused(make, words):
    with pytest.raises(jr.InputError, match=words):
        make()
