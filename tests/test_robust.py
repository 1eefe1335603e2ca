"""Losses that let no spike decide: against closed forms, and on many records of a tone."""

from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.integrate
import scipy.optimize
import scipy.stats
from jaxtyping import Array

import jaxrotor as jr
from jaxrotor.identification.domain import Compared
from jaxrotor.identification.estimated import known_from_each
from jaxrotor.identification.fit import search
from jaxrotor.identification.loss import LOSSES, loss_number, shaped, slope_and_square
from jaxrotor.identification.problem import Problem, Signal, with_loss
from jaxrotor.identification.simulated import AbstractRun, Simulated, records_and_slopes
from jaxrotor.search.instrumented import Instrumented
from jaxrotor.search.space import Space

COUNT = 400
T = np.linspace(0.0, 1.0, 200)
TRUTH = {"a.sensitivity": 2.0, "a.bias": 0.3, "b.sensitivity": 5.0, "b.bias": -1.0}
STD = {"a": 0.1, "b": 0.2}


class Tone(AbstractRun):
    """Channels that see a tone."""

    times: tuple[Array, ...]
    channels: tuple[str, ...] = ("a", "b")
    one_by_one: ClassVar[bool] = False

    def records(self, bench):
        return tuple(
            bench.get(f"{name}.bias") + bench.get(f"{name}.sensitivity") * jnp.sin(12 * t + k)
            for k, (name, t) in enumerate(zip(self.channels, self.times))
        )


@pytest.fixture(scope="module")
def problem():
    probe = jr.sensors.ProximityProbe("d", 0.0)
    machine = jr.Machine({"d": jr.Rotor(2.0, 0.02, 0.012)}, {})
    channels = {n: jr.Channel(probe, noise=jr.sensors.Noise(std)) for n, std in STD.items()}
    bench = Instrumented(machine, channels)  # pyright: ignore[reportArgumentType]
    unknowns = tuple(jr.Unknown(path, start=x, scale=1.0) for path, x in TRUTH.items())
    t = jnp.asarray(T)
    every = Compared(None, jnp.ones(len(T)), t)
    signals = tuple(
        Signal(jnp.zeros(len(T)), jnp.ones(len(T)), jnp.asarray(std), every, name, "run")
        for name, std in STD.items()
    )
    simulated = Simulated(bench, (Tone((t, t)),), Space.of(bench, unknowns))
    return Problem(simulated, signals, loss_number("squares"))


def data(problem, spikes, seed=0):
    """`COUNT` records with noise; of channel a this part of the values off by some ten standard
    deviations, all to one side, so that squares are led astray."""
    rng = np.random.default_rng(seed)
    clean = problem.simulated.records(jnp.zeros(4))
    found = []
    for (name, std), record in zip(STD.items(), clean):
        noisy = np.asarray(record) + std * rng.standard_normal((COUNT, len(T)))
        if name == "a":
            out = rng.random(noisy.shape) < spikes
            noisy += out * std * rng.uniform(8, 20, noisy.shape)
        found.append(jnp.asarray(noisy))
    return tuple(found)


def estimated(problem, loss, given):
    """(COUNT, 4): how far from the truth, and the standard deviations stated."""
    posed = with_loss(problem, loss)
    fits = search(posed, jnp.zeros((COUNT, 4)), 20, data=given)
    assert all(fit.stopped for fit in fits)
    u = jnp.stack([fit.u for fit in fits])
    known = known_from_each(posed, given, u, *records_and_slopes(posed.simulated, u))
    return np.asarray(u), np.array([k.std for k in known]), known[0].quantile(0.95)


@pytest.mark.parametrize("loss, rho", [
    ("squares", lambda r: 0.5 * r**2),
    ("huber", lambda r: np.where(abs(r) < 1.345, 0.5 * r**2, 1.345 * abs(r) - 0.5 * 1.345**2)),
    ("student", lambda r: 2 * np.log1p(r**2 / 4)),
])  # fmt: skip
def test_the_squares_are_the_loss(loss, rho):
    r = np.array([-1e3, -3.0, -1.345, -0.7, -1e-6, 0.0, 1e-3, 1.3, 1.4, 50.0])
    s, slope = shaped(loss_number(loss), jnp.asarray(r))
    np.testing.assert_allclose(0.5 * np.asarray(s) ** 2, rho(r), rtol=1e-9)
    own = jax.vmap(jax.grad(lambda x: shaped(loss_number(loss), x)[0]))(jnp.asarray(r))
    np.testing.assert_allclose(slope, own, rtol=1e-7)
    if loss != "squares":  # psi, its slope: central differences of the loss
        x = r[np.abs(np.abs(r) - 1.345) > 0.01]
        h = 1e-4
        psi = (rho(x + h) - rho(x - h)) / (2 * h)
        bent = (rho(x + h) - 2 * rho(x) + rho(x - h)) / h**2
        slope, square = slope_and_square(loss, x, 0.0)
        assert slope == pytest.approx(np.mean(bent), rel=1e-3)
        assert square == pytest.approx(np.mean(psi**2), rel=1e-6)


@pytest.mark.parametrize("loss, efficiency", [("huber", 0.95), ("student", 0.926)])
def test_without_spikes_little_is_lost(problem, loss, efficiency):
    """Huber's 95 % is from his book; Student's by quadrature: (E psi')^2 / E psi^2 under the normal law."""
    weight = scipy.stats.norm.pdf
    if loss == "student":
        slope, square = (
            scipy.integrate.quad(lambda r, f=f: f(r) * weight(r), -12, 12)[0]
            for f in (lambda r: (1 - r**2 / 4) / (1 + r**2 / 4) ** 2, lambda r: (r / (1 + r**2 / 4)) ** 2)
        )  # fmt: skip
        assert slope**2 / square == pytest.approx(efficiency, abs=1e-3)
    given = data(problem, 0.0)
    plain, stated, _ = estimated(problem, "squares", given)
    off, std, reach = estimated(problem, loss, given)
    # correlated by sqrt(efficiency), the difference has the variance that is lost
    assert np.std((off - plain) / stated) < 1.3 * np.sqrt(1 / efficiency - 1)
    assert np.mean(std / stated) == pytest.approx(efficiency**-0.5, rel=0.03)
    covered = np.mean(np.abs(off) <= reach * std, axis=0)
    assert (covered >= 0.9).all() and (covered <= 0.99).all(), covered


@pytest.mark.parametrize("loss", ["huber", "student"])
def test_with_spikes(problem, loss):
    """5 % of spikes to one side: the bias of squares is many standard deviations off; robust estimates stay
    at the truth, and their stated standard deviations are those that the records show."""
    given = data(problem, 0.05, seed=1)
    plain, stated, _ = estimated(problem, "squares", given)
    off, std, reach = estimated(problem, loss, given)
    assert np.median(np.abs(plain[:, 1]) / stated[:, 1]) > 6
    assert np.median(np.abs(off[:, 1]) / std[:, 1]) < 1.5
    real = off.std(axis=0, ddof=1)
    assert (np.abs(real / np.sqrt((std**2).mean(axis=0)) - 1) < 0.12).all()
    covered = np.mean(np.abs(off) <= reach * std, axis=0)
    assert (covered[[0, 2, 3]] >= 0.9).all() and (covered[[0, 2, 3]] <= 0.99).all(), covered


def test_the_least_is_found(problem):
    """Scipy's minimum of the same loss, found without slopes."""
    given = data(problem, 0.05, seed=2)
    t, y = T, np.asarray(given[0][0])
    for loss, rho in (
        ("huber", lambda r: np.where(abs(r) < 1.345, 0.5 * r**2, 1.345 * abs(r) - 0.5 * 1.345**2)),
        ("student", lambda r: 2 * np.log1p(r**2 / 4)),
    ):
        cost = lambda p, rho=rho: np.sum(rho((p[0] * np.sin(12 * t) + p[1] - y) / STD["a"]))  # noqa: E731
        best = scipy.optimize.minimize(
            cost, [2.0, 0.3], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12}
        )
        off, _, _ = estimated(problem, loss, given)
        np.testing.assert_allclose(off[0, :2] + [2.0, 0.3], best.x, atol=1e-5)
    assert LOSSES == ("squares", "huber", "student")
