"""Periodic motions by harmonic balance: closed forms, other methods, derivatives."""

from typing import Any, cast

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import jaxrotor as jr
from jaxrotor.core.quick import quickly_compiled
from jaxrotor.machine.field import evaluate
from jaxrotor.machine.system import assemble
from jaxrotor.periodic import continuation, harmonic_balance, switch_branch

MASS, ECCENTRICITY, STIFFNESS, DAMPING = 2.0, 1e-4, 2e5, 20.0
GAP, CONTACT = 1.5e-3, 1e6


def rotor(friction=0.0, gap=GAP, stiffness=(STIFFNESS, STIFFNESS), contact=CONTACT):
    """A Jeffcott rotor in a ring."""
    spring = jr.LinearSupport([*stiffness, 0.0, 0.0, 0.0, 0.0], [DAMPING] * 2 + [0.0] * 4)
    rub = jr.Rub(gap=gap, stiffness=contact, radius=0.05, friction=friction)
    return jr.Machine.in_line(
        {"disc": jr.Rotor(MASS, 0.01, 0.006, unbalance=jr.Unbalance(ECCENTRICITY))},
        attachments={"spring": (spring, "disc"), "rub": (rub, "disc")},
        fixed={"disc": ("z", "psi", "theta")},
        prescribed={"disc": {"phi": jr.ConstantSpeed(330.0)}},
    )


class Rubbing:
    """Synchronous full annular rub, r the radius: in the turning frame the motion stands still, so that
    balance is a quadratic in r and stability that of a constant matrix. (Jiang & Ulbrich, Nonlinear
    Dynamics 24 (2001) 269; von Groll & Ewins, J. Sound Vib. 241 (2001) 223.)"""

    def __init__(self, friction):
        self.push = CONTACT * (1 + 1j * friction)

    def quadratic(self, w):
        own = STIFFNESS - MASS * w**2 + 1j * DAMPING * w + self.push
        force = MASS * ECCENTRICITY * w**2
        return (
            abs(own) ** 2,
            (own * np.conj(self.push)).real * GAP,
            abs(self.push) ** 2 * GAP**2 - force**2,
        )

    def fold(self, low, high):
        def discriminant(w):
            a, b, c = self.quadratic(w)
            return b**2 / (a * c) - 1

        return brentq(discriminant, low, high, xtol=1e-12)

    def onset(self, low, high):
        def growth(w):
            return abs(self.multipliers(w, self.radii(w)[0])).max() - 1

        return brentq(growth, low, high, xtol=1e-12)

    def radii(self, w):
        a, b, c = self.quadratic(w)
        return (b + np.sqrt(b**2 - a * c) * np.array([1, -1])) / a

    def multipliers(self, w, r):
        def matrix(z):  # of a factor of a deviation, on (real, imaginary)
            return np.array([[z.real, -z.imag], [z.imag, z.real]])

        touch = matrix(self.push + 0j) @ np.diag([1.0, 1 - GAP / r])
        K = matrix(STIFFNESS - MASS * w**2 + 1j * DAMPING * w) + touch
        C = matrix(DAMPING + 2j * MASS * w)
        A = np.block([[np.zeros((2, 2)), np.eye(2)], [-K / MASS, -C / MASS]])
        return np.exp(np.linalg.eigvals(A) * 2 * np.pi / w)


def by_size(values):
    values = np.asarray(values)
    return values[np.lexsort((np.round(np.imag(values), 9), np.round(abs(values), 9)))]


def test_without_contact_it_is_the_linear_response_and_its_modes():
    machine = rotor(gap=1.0, stiffness=(STIFFNESS, 1.5 * STIFFNESS))
    motion = harmonic_balance(machine, 330.0)
    linear = jr.unbalance_response(machine, ["disc.x", "disc.y"], [330.0]).values[0]
    for place, value in zip(("disc.x", "disc.y"), linear):
        np.testing.assert_allclose(motion.harmonics(place)[1], value, rtol=1e-11)
        np.testing.assert_allclose(motion.amplitude(place), abs(value), rtol=1e-11)
    own = np.exp(np.asarray(jr.linearize(machine, 330.0).eigenvalues) * 2 * np.pi / 330.0)
    np.testing.assert_allclose(by_size(motion.multipliers), by_size(own), rtol=1e-11)
    assert motion.stable


@pytest.fixture(scope="module")
def smooth():
    return continuation(rotor(), (250.0, 800.0))


@pytest.fixture(scope="module")
def rough():
    return continuation(rotor(friction=0.02), (250.0, 800.0))


def test_folds_of_a_rubbing_rotor_are_where_the_closed_form_has_them(smooth, rough):
    upper, corner = smooth.special
    assert [p.kind for p in smooth.special] == ["fold", "fold"]
    assert upper.speed == pytest.approx(Rubbing(0.0).fold(600.0, 750.0), rel=1e-9)
    # where contact ends: the linear response, falling, is as wide as the gap
    touch = brentq(lambda w: linear_radius(w) - GAP, 318.0, 400.0, xtol=1e-12)
    assert corner.speed == pytest.approx(touch, rel=1e-6)
    folds = [p for p in rough.special if p.kind == "fold"]
    assert folds[0].speed == pytest.approx(Rubbing(0.02).fold(560.0, 650.0), rel=1e-9)
    onset, *_ = [p for p in rough.special if p.kind == "Neimark-Sacker"]
    assert onset.speed == pytest.approx(Rubbing(0.02).onset(480.0, 560.0), rel=1e-7)
    assert rough.speeds[-1] == smooth.speeds[-1] == 800.0


def linear_radius(w):
    return MASS * ECCENTRICITY * w**2 / abs(STIFFNESS - MASS * w**2 + 1j * DAMPING * w)


@pytest.mark.parametrize("friction", [0.0, 0.02])
def test_all_points_and_multipliers_meet_the_closed_form(friction, smooth, rough):
    branch, closed = (rough if friction else smooth), Rubbing(friction)
    touching = 0
    for i in range(0, len(branch), 7):
        w, r = branch.speeds[i], branch.amplitude("disc.x")[i]
        if r < GAP * (1 + 1e-6):
            continue
        touching += 1
        near = min(closed.radii(w), key=lambda own: abs(own - r))
        assert r == pytest.approx(near, rel=1e-7)
        found = by_size(branch.multipliers[i])
        np.testing.assert_allclose(found, by_size(closed.multipliers(w, near)), rtol=1e-6)
    assert touching > 10


class Oscillator(jr.AbstractAttachment):
    """x'' = force cos(phi) + bias - damping x' - (stiffness + ripple cos(2 phi)) x - cubic x^3 of a mass of
    1 kg."""

    force: jax.Array = jr.parameter("N", default=0.0)
    bias: jax.Array = jr.parameter("N", default=0.0)
    damping: jax.Array = jr.parameter("N*s/m", default=0.0)
    stiffness: jax.Array = jr.parameter("N/m", default=0.0)
    ripple: jax.Array = jr.parameter("N/m", default=0.0)
    cubic: jax.Array = jr.parameter("N/m^3", default=0.0)

    def forces(self, t, motions, state):
        ((q, v),) = motions
        x, phi = q[0], q[5]
        own = (self.stiffness + self.ripple * jnp.cos(2 * phi)) * x + self.cubic * x**3
        total = self.force * jnp.cos(phi) + self.bias - self.damping * v[0] - own
        return (total * jnp.array([1.0, 0, 0, 0, 0, 0]),)

    def shot(self, motion):
        """Over its period by another method (DOP853, 1e-12): what does not come back, and the multipliers."""
        w = float(motion.speed)
        names = ("force", "bias", "damping", "stiffness", "ripple", "cubic")
        force, bias, damping, stiffness, ripple, cubic = (float(getattr(self, n)) for n in names)

        def rates(t, y):
            k = stiffness + ripple * np.cos(2 * w * t)
            x, v, slopes = y[0], y[1], y[2:].reshape(2, 2)
            a = force * np.cos(w * t) + bias - damping * v - k * x - cubic * x**3
            J = np.array([[0, 1], [-k - 3 * cubic * x**2, -damping]])
            return np.concatenate([[v, a], (J @ slopes).ravel()])

        start = [float(motion.state.position[0, 0]), float(motion.state.velocity[0, 0])]
        end = solve_ivp(
            rates,
            (0, 2 * np.pi * motion.turns / w),
            [*start, 1, 0, 0, 1],
            "DOP853",
            rtol=1e-12,
            atol=1e-13,
        ).y[:, -1]
        return np.abs(end[:2] - start).max(), np.linalg.eigvals(end[2:].reshape(2, 2))


# What all oscillators take, to share programs.
FINE: dict[str, Any] = {"harmonics": 15, "samples": 256}


def oscillator(**values):
    return jr.Machine.in_line(
        {"disc": jr.Rotor(1.0, 1.0, 1.0)},
        attachments={"law": (Oscillator(**values), "disc")},
        fixed={"disc": ("y", "z", "psi", "theta")},
        prescribed={"disc": {"phi": jr.ConstantSpeed(1.0)}},
    )


@pytest.mark.parametrize(
    "value", [-5.80004602, 7.44910974, 1.85818754, 25.54997175, -5.79008060, 2.09946045]
)
def test_floquet_meets_the_characteristic_values_of_mathieu(value):
    """Abramowitz & Stegun, Table 20.1, a_r and b_r for q = 5: there a solution of x'' + (a - 2 q cos 2t) x
    = 0 is periodic, so that the sum of both multipliers over a turn is 2."""
    motion = harmonic_balance(oscillator(stiffness=value, ripple=-10.0), 1.0, **FINE)
    change = harmonic_balance(oscillator(stiffness=value + 1e-4, ripple=-10.0), 1.0, **FINE)
    total, after = (np.sum(np.asarray(m.multipliers)).real for m in (motion, change))
    # within what the eight printed digits leave open
    assert abs(total - 2) < 1e-8 * abs(after - total) / 1e-4 + 1e-7


@pytest.fixture(scope="module")
def duffing():
    machine = oscillator(force=0.18, damping=0.05, stiffness=1.0, cubic=0.1)
    return machine, continuation(machine, (0.6, 1.6), step=0.05, **FINE)


def test_duffing_is_what_shooting_finds_at_folds_and_between(duffing):
    machine, branch = duffing
    law: Any = machine["law"]
    assert [p.kind for p in branch.special] == ["fold", "fold"]
    for point in branch.special:
        gap, multipliers = law.shot(point.motion)
        assert gap < 1e-7
        assert np.abs(multipliers - 1).min() < 1e-4
    middle = [i for i in range(len(branch)) if not branch.stable[i]][::10]
    for i in (0, *middle, -1):
        gap, multipliers = law.shot(branch.motion(i))
        assert gap < 1e-7
        np.testing.assert_allclose(by_size(multipliers), by_size(branch.multipliers[i]), atol=1e-7)


def test_period_doubling_and_the_branch_that_begins_there():
    machine = oscillator(force=1.0, bias=0.5, damping=0.1, cubic=1.0)
    law: Any = machine["law"]
    branch = continuation(machine, (3.2, 2.8), step=0.1, **FINE)
    doubling, *_ = branch.special
    assert doubling.kind == "period doubling"
    gap, multipliers = law.shot(doubling.motion)
    assert gap < 1e-9
    assert np.abs(multipliers + 1).min() < 1e-6
    motion = switch_branch(machine, doubling, samples=256)
    gap, multipliers = law.shot(motion)
    half = abs(motion.harmonics("disc.x")[motion.orders.index(0.5)])
    assert motion.turns == 2 and gap < 1e-9 and half > 1e-3
    np.testing.assert_allclose(by_size(multipliers), by_size(motion.multipliers), atol=1e-7)
    # beyond the doubling the single one has lost its stability to this one
    assert motion.stable and motion.speed < doubling.speed
    assert not branch.stable[doubling.after + 1] and branch.stable[doubling.after]


def journal():
    film = jr.JournalBearing(diameter=0.1, length=0.03, clearance=1e-4, viscosity=0.1)
    return jr.Machine.in_line(
        {"journal": jr.Rotor(525 / 9.81, 0.1, 0.05, unbalance=jr.Unbalance(1e-9))},
        attachments={"film": (film, "journal")},
        gravity=(0.0, -9.81, 0.0),
        fixed={"journal": ("z", "psi", "theta")},
        prescribed={"journal": {"phi": jr.ConstantSpeed(600.0)}},
    )


@pytest.mark.parametrize("mass, speed", [(5.0, 30.0), (20.0, 30.0), (5.0, 100.0)])
def test_a_light_journal_in_a_stiff_film_has_the_multipliers_of_its_eigenvalues(mass, speed):
    """Forces decay within a thousandth of a turn, and vary a little with the whirl."""
    machine = journal().set({"journal.mass": mass, "journal.unbalance.eccentricity": 5e-6})
    rates = np.asarray(jr.linearize(machine, speed).eigenvalues)
    assert rates.real.min() < -25 * speed
    motion = harmonic_balance(machine, speed, harmonics=2)
    assert float(motion.amplitude("journal.x")) < 1e-7
    slowest = np.exp(2 * np.pi / speed * rates.real.max())
    assert float(motion.largest_multiplier) == pytest.approx(slowest, rel=3e-6)


def test_a_journal_starts_to_whirl_where_its_eigenvalues_say():
    """With next to no unbalance the pair of multipliers leaves the unit circle at the threshold of the linear
    model."""
    machine = journal()
    branch = continuation(machine, (700.0, 900.0), harmonics=2, step=0.1)
    (onset,) = branch.special
    threshold = brentq(lambda w: float(jr.linearize(machine, w).growth), 850.0, 880.0, xtol=1e-9)
    assert onset.kind == "Neimark-Sacker"
    assert onset.speed == pytest.approx(threshold, rel=1e-6)
    # it whirls at about half the speed
    assert abs(np.angle(onset.motion.multipliers[0])) == pytest.approx(np.pi, rel=0.1)


PARTLY = {"stiffness": (STIFFNESS, 1.6 * STIFFNESS), "friction": 0.05}


def test_derivatives_of_a_partial_rub_forward_reverse_and_by_differences():
    machine, at = rotor(**PARTLY), jnp.array([CONTACT, 1.0, 318.0])

    def seen(p):
        changed = machine.set(
            {"rub.stiffness": p[0], "disc.unbalance.eccentricity": ECCENTRICITY * p[1]}
        )
        motion = harmonic_balance(changed, p[2])
        wave = motion.harmonics("disc.y")[3]
        return jnp.stack([motion.amplitude("disc.x"), wave.imag, motion.largest_multiplier])

    forward = quickly_compiled(jax.jacfwd(seen))(at)
    reverse = quickly_compiled(jax.jacrev(lambda p: seen(p)[:2]))(at)
    steps = np.diag([100.0, 1e-5, 1e-4])
    differences = np.stack([(seen(at + s) - seen(at - s)) / (2 * s.max()) for s in steps], axis=1)
    np.testing.assert_allclose(reverse, forward[:2], rtol=1e-9)
    np.testing.assert_allclose(forward, differences, rtol=1e-5)


def test_power_of_the_drive_is_what_is_lost_over_a_turn():
    """Instant by instant at the samples of the balance: what the drive gives, the means of the elements' own
    losses and of the growth of what they store, which are written without their forces."""
    machine, w = rotor(**PARTLY), 318.0
    motion = harmonic_balance(machine, w)
    system, parts = assemble(machine), [cast(Any, machine[name]) for name in ("spring", "rub")]
    count = 64
    angles = 2 * np.pi * np.arange(count) / count
    place, rate = np.zeros((2, 6, count))
    orders = np.asarray(motion.orders)
    for i, name in enumerate("xy"):
        c = np.asarray(motion.harmonics(f"disc.{name}"))
        waves = np.exp(1j * orders[:, None] * angles)
        place[i], rate[i] = np.real(c @ waves), np.real((1j * w * orders * c) @ waves)
    place[5], rate[5] = angles, w
    zero = jnp.zeros(())

    @jax.jit
    def powers(angle, q, v):
        y = jnp.concatenate([q[:2], v[:2]])
        ev = evaluate(zero, y, system, (angle, jnp.array(w), zero))
        lost = sum(part.power_lost(zero, ((q, v),), None) for part in parts)

        def stored(q):
            return sum(part.energy(zero, ((q, v),), None) for part in parts)

        return ev.reaction[5, 0] * w, lost, jax.jvp(stored, (q,), (v,))[1]

    drive, lost, growth = (float(np.mean(x)) for x in jax.vmap(powers)(angles, place.T, rate.T))
    touching = np.hypot(*place[:2]) > GAP
    assert 0.1 < np.mean(touching) < 0.9
    assert drive == pytest.approx(lost + growth, rel=1e-9)
    assert drive > 1.0 and abs(growth) < 1e-2 * lost  # sharp edges between the samples


def driven(extra, **kwargs):
    return jr.Machine.in_line(
        {"disc": jr.Rotor(MASS, 0.01, 0.006)},
        attachments={"spring": (jr.LinearSupport([1e5] * 6), "disc"), "extra": (extra, "disc")},
        fixed={"disc": ("z", "psi", "theta")},
        **kwargs,
    )


SPIN = {"prescribed": {"disc": {"phi": jr.ConstantSpeed(330.0)}}}


def test_machines_whose_motion_does_not_repeat_are_refused_in_words():
    pull = jr.Force(jr.Harmonic(0.0, [1.0], [10.0]), direction=(1.0, 0.0, 0.0))
    with pytest.raises(jr.InputError, match="clock"):
        harmonic_balance(driven(pull, **SPIN), 330.0)
    rub = jr.Rub(gap=1e-3, stiffness=1e6, radius=0.05)
    with pytest.raises(jr.InputError, match="holds its speed"):
        harmonic_balance(driven(rub), 330.0)
    balls = jr.RollingBearing(1e9, 0.008, 0.04, balls=9)
    with pytest.raises(jr.InputError, match="do not repeat after a turn"):
        harmonic_balance(driven(balls, **SPIN), 330.0)


def test_branches_refuse_what_they_cannot_follow(smooth):
    machine = rotor()
    with pytest.raises(jr.InputError, match="apart"):
        continuation(machine, (300.0, 300.0))
    with pytest.raises(jr.InputError, match="29 at least"):
        continuation(machine, (300.0, 400.0), samples=16)
    with pytest.raises(jr.InputError, match="fold"):
        switch_branch(machine, smooth.special[0])
    with pytest.raises(jr.InputError, match="no derivative"):
        jax.grad(
            lambda k: continuation(machine.set({"rub.stiffness": k}), (300.0, 400.0)).speeds[0]
        )(1e6)
    with pytest.raises(jr.InputError, match="station"):
        smooth.amplitude("disk.x")
    with pytest.raises(jr.InputError, match="from -"):
        smooth.motion(len(smooth))
    assert "2 of SpecialPoint" in repr(smooth) and float(smooth.motion(-1).speed) == 800.0
