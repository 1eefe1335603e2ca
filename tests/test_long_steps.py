"""Runs of machines whose steps span several samples."""

import dataclasses

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

import jaxrotor as jr
from jaxrotor.simulation.step_search import longest_step

MASS, E, SPEED, RATE = 2.0, 1e-4, 250.0, 20e3
K, C = MASS * 400.0**2, 40.0  # N/m, N*s/m


def jeffcott(parts=()):
    support = jr.LinearSupport([K] * 2 + [0.0] * 4, [C] * 2 + [0.0] * 4)
    return jr.Machine.in_line(
        {"disc": jr.Rotor(MASS, 0.01, 0.006, unbalance=jr.Unbalance(E))},
        attachments={"support": (support, "disc")}
        | {k: (v, "disc") for k, v in dict(parts).items()},
        fixed={"disc": ("z", "psi", "theta")},
        prescribed={"disc": {"phi": jr.ConstantSpeed(SPEED)}},
    )


def spanning(plan, span):
    return dataclasses.replace(plan, span=span, substeps=1)


def closed_form(count):
    """x of the disc, shaken by its unbalance from rest: one exponential for each sample."""
    w = SPEED  # x, x', e cos(wt), e sin(wt)
    A = np.array(
        [[0, 1, 0, 0], [-K / MASS, -C / MASS, w**2, 0], [0, 0, 0, -w], [0, 0, w, 0]], float
    )
    flow, y, found = expm(A / RATE), np.array([0.0, 0.0, E, 0.0]), []
    for _ in range(count):
        found.append(y[0])
        y = flow @ y
    return np.array(found)


@pytest.fixture(scope="module")
def plan():
    return jr.plan(jeffcott(), 0.2, RATE)


def test_against_the_closed_form(plan):
    """The 4000 samples are no whole number of steps of 64, 0.8 rad each. For a run as short the plan takes
    32, of whose history less is to be filled."""
    assert plan.span == 32
    want = closed_form(4001)
    for span, steps, most in ((32, 125, 2e-8), (64, 63, 5e-6)):
        run = jr.simulate(jeffcott(), 0.2, RATE, "undeformed", step=spanning(plan, span))
        assert run.info.steps == steps
        off = np.abs(np.asarray(run["disc"].x) - want) / np.abs(want).max()
        assert off.max() < most and off.max() < 1.2 * off[::span].max()
        assert 0.5 < run.stats["error"] / off.max() < 2.0
        assert f"{span} samples a step" in str(run)


def test_a_step_in_seconds():
    """The longest that is no longer."""
    run = jr.simulate(jeffcott(), 0.2, RATE, "undeformed", step=1e-3)
    assert run.info.span == 16 and run.info.steps == 250
    want = closed_form(run.t.size)
    np.testing.assert_allclose(run["disc"].x, want, atol=2e-8 * np.abs(want).max())


def pushed(at):
    """A force that steps, on a disc that hardly rings off: in closed form, at rest before."""
    w, c = 400.0, C / MASS / 2
    nu = np.sqrt(w**2 - c**2)

    def exact(t):
        late = np.maximum(t - at, 0.0)
        swing = np.cos(nu * late) + c / nu * np.sin(nu * late)
        return 5.0 / K * (1 - np.exp(-c * late) * swing)

    return exact


@pytest.mark.parametrize("at", [0.04321, 0.05, 0.0001])
def test_a_jump_within_a_step(at):
    """Which ends there, wherever it is; its derivative too at every sample."""
    t = np.arange(2001) / RATE

    def moved(at):
        push = jr.Force(jr.Step(at, 5.0), (1.0, 0.0, 0.0))
        machine = jeffcott({"push": push})
        machine = machine.set({"disc.unbalance.eccentricity": 0.0})
        given = jr.Plan(1, 6, SPEED / 2, SPEED, 0.0, 5e-5, span=16)
        return jr.simulate(machine, 0.1, RATE, "undeformed", step=given)["disc"].x

    found, slope = jax.jit(lambda x: jax.jvp(moved, (x,), (1.0,)))(at)
    np.testing.assert_allclose(found, pushed(at)(t), atol=1e-8 * 5.0 / K)
    eps = 1e-7
    central = (pushed(at + eps)(t) - pushed(at - eps)(t)) / (2 * eps)
    off = np.abs(t - at) > 2e-7
    np.testing.assert_allclose(slope[off], central[off], atol=1e-5 * np.abs(central).max())


def test_derivatives_and_batches(plan):
    """By what is in A and what is not: forward, reverse and by differences; at a sample within
    a step."""
    used, rate = spanning(plan, 16), 20e3

    def seen(x):
        machine = jeffcott().set(
            {"disc.unbalance.eccentricity": x[0] * E, "disc.mass": x[1] * MASS}
        )
        run = jr.simulate(machine, 0.05, rate, "undeformed", step=used)
        return 1e4 * jnp.stack([run["disc"].x[531], run["disc"].y[1000], run["disc"].x[3]])

    at, eps = jnp.ones(2), 1e-5
    ahead, back = jax.jit(jax.jacfwd(seen))(at), jax.jit(jax.jacrev(seen))(at)
    np.testing.assert_allclose(back, ahead, rtol=1e-8, atol=1e-12)
    batch = at + eps * np.array([[1.0, 0], [-1, 0], [0, 1], [0, -1]])
    found = np.asarray(jax.jit(jax.vmap(seen))(batch))
    central = ((found[::2] - found[1::2]) / (2 * eps)).T
    np.testing.assert_allclose(ahead, central, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(found[2], jax.jit(seen)(batch[2]), rtol=1e-10, atol=1e-13)


def test_energy_balances(plan):
    audit = jr.energy_audit(jeffcott(), 0.2, RATE, "undeformed", step=spanning(plan, 8))
    assert audit.relative < 1e-6


@pytest.mark.parametrize("scale", [1e-6, 1e-9, 3e-12, 1e-14, 1e-17, 1e-20])
@pytest.mark.parametrize("unstable", [8, 1000])
def test_the_longest_span_is_found_from_the_shortest_on(scale, unstable):
    """Of errors that grow with the order's power and are no numbers beyond some step: what all spans, tried
    one by one, give; a machine that leaves no room is tried from sample to sample alone."""
    tried = []

    def seen(steps, evaluations):
        tried.append(1 / steps)
        return np.nan if 1 / steps > unstable else scale * (1 / steps) ** 7

    found = longest_step(seen, 1 / 64, 6, 5e-5, 1e-3)
    good = [n for n in (4, 8, 16, 32, 64) if n <= unstable and scale * n**7 <= 5e-8]
    assert found == (1 / max(good, default=1), 1, scale * max(good, default=1) ** 7)
    assert tried[0] == 1 and len(tried) <= 6
    if scale > 5e-8:
        assert tried == [1]
    # of a tolerance that was asked for a fifth is enough
    asked = longest_step(seen, 1 / 64, 6, 5e-5, 0.2)
    good = [n for n in (4, 8, 16, 32, 64) if n <= unstable and scale * n**7 <= 1e-5]
    assert asked[0] == 1 / max(good, default=1)


def test_where_steps_go_by_samples(plan):
    """Other exponential methods know no samples within."""
    run = jr.simulate(jeffcott(), 0.05, RATE, "undeformed", step=plan, solver=jr.ETD4RK())
    assert run.info.span == 1 and run.info.steps == 1000
    assert jr.plan(jeffcott(), jr.Simulation(0.05, RATE, solver=jr.ETD4RK())).span == 1
    short = jr.plan(jeffcott(), 0.002, RATE)  # all that its history would have been filled for
    assert short.span < plan.span


def test_forward_mode_alone(plan):
    """Tangents in turn see the same samples."""
    used = spanning(plan, 8)

    def seen(mass, adjoint=None):
        machine = jeffcott().set({"disc.mass": mass})
        run = jr.simulate(machine, 0.05, RATE, "undeformed", step=used, adjoint=adjoint)
        return run["disc"].x

    one = jax.jit(jax.jacfwd(seen))(MASS)
    other = jax.jit(jax.jacfwd(lambda m: seen(m, diffrax.ForwardMode())))(MASS)
    np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize("wrong", [dict(substeps=2, span=4), dict(substeps=1, span=3)])
def test_refused(plan, wrong):
    with pytest.raises(jr.InputError, match="span"):
        dataclasses.replace(plan, **wrong)


def test_a_sweep_keeps_to_the_plan_it_is_given(plan):
    """Its members see every sample; one that plans for itself goes from sample to sample."""
    outputs = {"x": jr.sweeps.TimeSeries(jr.sensors.ProximityProbe("disc", 0.0))}
    cases = {"disc.unbalance.eccentricity": np.array([E, 2 * E])}
    run = jr.Simulation(0.2, RATE, "undeformed", step=spanning(plan, 16))
    found = jr.sweep(jeffcott(), cases, outputs, run)["x"].values
    want = closed_form(4001)
    for row, times in zip(found, (1, 2)):
        np.testing.assert_allclose(row, times * want, atol=1e-8 * np.abs(want).max())
    own = jr.sweep(jeffcott(), cases, outputs, dataclasses.replace(run, step=None))
    np.testing.assert_allclose(own["x"].values, found, atol=1e-8 * np.abs(want).max())
    assert set(own["steps_a_sample"].values) == {1}
