"""Foundations by their measured receptance. Oracles: known rational functions, a block's matrices, the bound
that noise sets on what can be known (Cramer and Rao)."""

import jax.numpy as jnp
import numpy as np
import pytest
from foundation_cases import (
    ARMS,
    MOUNT,
    MOUNT_C,
    ROTORS,
    arm,
    assembled,
    block,
    by_size,
    on,
)
from helpers import assert_derivatives_agree

import jaxrotor as jr

el = jr.elements
RNG = np.random.default_rng(5)

POLES = np.array([-1 + 10j, -1 - 10j, -3 + 47j, -3 - 47j, -0.5 + 100j, -0.5 - 100j])


def rational():
    """Known residues that sum to zero, of no symmetry."""
    r = RNG.normal(size=(3, 3, 3)) + 1j * RNG.normal(size=(3, 3, 3))
    r[..., 2] -= np.sum(r, axis=-1).real
    residues = np.stack([r, r.conj()], axis=-1).reshape(3, 3, 6)
    return residues, lambda s: np.moveaxis(residues @ (1 / (s - POLES[:, None])), -1, 0)


@pytest.mark.parametrize("relative", [False, True])
def test_a_known_rational_function_is_found(relative):
    residues, response = rational()
    f = np.linspace(0.2, 25.0, 150)
    found = jr.interop.fit_receptance(f, response(2j * np.pi * f), 6, relative=relative)
    np.testing.assert_allclose(found.poles, POLES, rtol=1e-10)
    np.testing.assert_allclose(found.residues, residues, rtol=1e-9, atol=1e-9)
    assert found.error < 1e-11
    between = np.linspace(0.3, 24.0, 7)
    np.testing.assert_allclose(found.at(between), response(2j * np.pi * between), rtol=1e-9)
    A, B, Cm = found.matrices()
    for s in 2j * np.pi * between:
        np.testing.assert_allclose(
            Cm @ np.linalg.solve(s * np.eye(len(A)) - A, B), response(np.array([s]))[0], rtol=1e-8
        )


def block_receptance(f):
    """Of both points of the block in all six coordinates, without its machines, m/N and alike."""
    Mb, (Kg, Cg) = np.asarray(block().mass_matrix()), map(np.asarray, block().ground_matrices())
    T = np.concatenate([arm(r) for r in ARMS])
    s = 2j * np.pi * f[:, None, None]
    return T @ np.linalg.solve(s**2 * Mb + s * Cg + Kg, np.broadcast_to(T.T, (len(f), 6, 12)))


def test_a_block_by_its_measured_receptance():
    f = np.linspace(1.0, 60.0, 400)
    found = jr.interop.fit_receptance(f, block_receptance(f), 12, axes=6)
    assert found.error < 1e-9
    foundation = found.foundation(MOUNT, MOUNT_C)
    assert foundation.A.shape == (12, 12)  # a mode is of rank one
    mine = by_size(np.linalg.eigvals(np.asarray(jr.linearize(on(foundation)).A)))
    Mg, Cg, Kg = assembled()
    A = np.block(
        [[np.zeros((18, 18)), np.eye(18)], [-np.linalg.solve(Mg, Kg), -np.linalg.solve(Mg, Cg)]]
    )
    np.testing.assert_allclose(mine, by_size(np.linalg.eigvals(A)), rtol=1e-6)
    # it answers to forces, and passes energy, as the block does
    motions = tuple((jnp.asarray(q), jnp.asarray(v)) for q, v in RNG.normal(size=(2, 2, 6)) * 1e-3)
    none, t = (jnp.zeros(6),) * 2, jnp.zeros(())
    for name in ("forces", "energy", "power_lost"):
        values = [getattr(e, name)(t, motions, jnp.zeros(12)) for e in (foundation, block())]
        np.testing.assert_allclose(*map(np.asarray, values), rtol=1e-12)
    state = jnp.asarray(RNG.normal(size=12))
    rates = foundation.rates(t, motions, none, state)
    pull = -np.stack(foundation.forces(t, motions, state))
    speeds = np.asarray(foundation.C @ rates)
    work = -np.sum(pull.ravel() * speeds)
    np.testing.assert_allclose(foundation.power_in(t, motions, state), work, rtol=1e-6)


# Noise


NATURAL, RATIOS = np.array([12.0, 19.0, 20.5, 33.0]), np.array([0.01, 0.02, 0.015, 0.03])
SHAPES = np.random.default_rng(1).normal(size=(6, 4)) / np.sqrt(500.0)  # 1/sqrt(kg)
MEASURED = np.linspace(5.0, 45.0, 300)  # Hz


def of_modes(f, natural=NATURAL, ratios=RATIOS, signs=(1, 1, 1, 1)):
    g = (natural**2 - f[:, None] ** 2 + 2j * ratios * natural * f[:, None]) * (2 * np.pi) ** 2
    return np.einsum("im,jm,fm->fij", SHAPES, SHAPES, np.array(signs) / g)


CLEAN = of_modes(MEASURED)
NOISE = 1e-3 * np.abs(CLEAN).max()  # of real and of imaginary parts


def noisy(seed):
    rng = np.random.default_rng(seed)
    return CLEAN + NOISE * (rng.normal(size=CLEAN.shape) + 1j * rng.normal(size=CLEAN.shape))


def least_deviations():
    """Standard deviations of frequencies (relative) and damping ratios by the bound of Cramer and Rao: poles
    and all residues unknown, from central differences of the model."""
    s, w = 2j * np.pi * MEASURED, 2 * np.pi * NATURAL
    upper = w * (-RATIOS + 1j * np.sqrt(1 - RATIOS**2))
    residues = np.einsum("im,jm,m->ijm", SHAPES, SHAPES, 1 / (2j * upper.imag)).reshape(36, 4)

    def model(x):
        w, z = 2 * np.pi * NATURAL * (1 + x[:4]), RATIOS + x[4:]
        p = w * (-z + 1j * np.sqrt(1 - z**2))
        found = sum(residues[:, k, None] / (s - p[k]) for k in range(4))
        found = found + sum(residues[:, k, None].conj() / (s - p[k].conj()) for k in range(4))
        return np.concatenate([found.real, found.imag], axis=1)

    one, other = (1 / (s - p) for p in (upper[:, None], upper.conj()[:, None]))
    columns = np.concatenate([one + other, 1j * (one - other)]).T
    # the sum of all residues, twice the first four factors', is zero
    free = np.vstack([np.eye(7)[:3], -np.ones(7) * (np.arange(7) < 3), np.eye(7)[3:]])
    columns = np.concatenate([columns.real, columns.imag]) @ free
    Q = np.linalg.qr(columns)[0]
    slopes = [(model(1e-7 * e) - model(-1e-7 * e)) / 2e-7 for e in np.eye(8)]
    J = np.stack([(x - (x @ Q) @ Q.T).ravel() for x in slopes], axis=1)
    return NOISE * np.sqrt(np.diag(np.linalg.inv(J.T @ J)))


def test_modes_come_back_out_of_noise():
    """How many there are, where and how damped, as well as any unbiased estimate can tell: the sum of 32
    squared normal numbers is below 62.5 in 999 of 1000 cases."""
    errors = []
    for seed in range(4):
        data = noisy(seed)
        found = jr.interop.fit_receptance(MEASURED, data, axes=6)
        assert len(found.poles) == 8
        errors += [*(found.frequencies / NATURAL - 1), *(found.damping_ratios - RATIOS)]
        # the error that is told is the noise
        noise = np.linalg.norm(data - CLEAN) / np.linalg.norm(data)
        np.testing.assert_allclose(found.error, noise, rtol=0.02)
        assert np.linalg.norm(found.at(MEASURED) - CLEAN) < 0.2 * np.linalg.norm(data - CLEAN)
        assert np.all(found.poles.real < 0)
    sizes = np.array(errors).reshape(4, 8) / least_deviations()
    assert np.sum(sizes**2) < 62.5
    assert not found.passive
    with pytest.warns(UserWarning, match=r"is not passive: at [\d.]+ Hz it feeds"):
        found.foundation(MOUNT[0])


def test_fitted_modes_are_passive_and_nearer():
    data = noisy(7)
    found = jr.interop.fit_modes(MEASURED, data, axes=6)
    assert found.shapes.shape == (1, 6, 4)  # each of rank one, and none above the range
    np.testing.assert_allclose(found.frequencies, NATURAL, rtol=2e-4)
    np.testing.assert_allclose(found.damping_ratios, RATIOS, rtol=2e-2)
    assert np.linalg.norm(found.at(MEASURED) - CLEAN) < 0.06 * np.linalg.norm(data - CLEAN)
    H = found.at(np.geomspace(0.1, 500.0, 400))
    power = np.linalg.eigvalsh(0.5j * (H - np.conj(np.swapaxes(H, 1, 2))))
    assert power.min() > -1e-12 * np.abs(H).max()
    np.testing.assert_array_equal(H, np.swapaxes(H, 1, 2))
    # as a part it is what it is as a formula
    part = found.foundation(MOUNT[0])
    np.testing.assert_array_equal(part.frequencies, found.frequencies)
    np.testing.assert_array_equal(part.shapes, found.shapes)


@pytest.mark.parametrize("relative", [False, True])
def test_exact_modes_come_back(relative):
    found = jr.interop.fit_modes(MEASURED, CLEAN, 8, axes=3, relative=relative, beyond=False)
    np.testing.assert_allclose(found.frequencies, NATURAL, rtol=1e-9)
    np.testing.assert_allclose(found.damping_ratios, RATIOS, rtol=1e-7)
    mine = found.shapes.reshape(6, 4)
    np.testing.assert_allclose(mine * np.sign(mine[0] * SHAPES[0]), SHAPES, rtol=1e-6)
    assert found.error < 1e-8


def test_what_lies_above_the_range():
    """Half of the modes are measured, the others yield statically: with poles beyond the range the fit is
    better than the noise, which it had been fifteen times as far from."""
    f = np.linspace(5.0, 19.8, 200)
    clean = of_modes(f)
    rng = np.random.default_rng(2)
    data = clean + NOISE * (rng.normal(size=clean.shape) + 1j * rng.normal(size=clean.shape))
    found = jr.interop.fit_receptance(f, data, axes=6)
    assert np.linalg.norm(found.at(f) - clean) < 0.3 * np.linalg.norm(data - clean)
    np.testing.assert_allclose(found.frequencies[:2], NATURAL[:2], rtol=2e-4)
    np.testing.assert_allclose(found.damping_ratios[:2], RATIOS[:2], rtol=2e-2)


def test_passivity():
    assert jr.interop.fit_receptance(MEASURED, CLEAN, 8, axes=6).passive
    # the third mode of negative mass feeds most where it resonates
    feeding = jr.interop.fit_receptance(
        MEASURED, of_modes(MEASURED, signs=(1, 1, -1, 1)), 8, axes=6
    )
    assert not feeding.passive
    with pytest.warns(UserWarning, match="at 20.5 Hz it feeds"):
        feeding.foundation(MOUNT[0])


def test_a_poor_fit_is_told():
    with pytest.warns(UserWarning, match=r"fit_receptance: \d+ % of the response are left"):
        jr.interop.fit_receptance(MEASURED, CLEAN, 4, axes=6)


def test_derivatives_of_a_measured_foundation():
    residues, response = rational()
    f = np.linspace(0.2, 25.0, 150)
    A, B, Cm = jr.interop.fit_receptance(f, response(2j * np.pi * f), 6).matrices()
    state = jnp.asarray(RNG.normal(size=len(A)))
    motions = ((jnp.asarray(RNG.normal(size=6)), jnp.asarray(RNG.normal(size=6))),)

    def push(x):
        e = el.MeasuredFoundation(A * x[0], B * x[1], Cm * x[2], MOUNT[0] * x[3], MOUNT_C[0] * x[4])
        t = jnp.zeros(())
        rates = e.rates(t, motions, (jnp.zeros(6),), state)
        return jnp.concatenate([e.forces(t, motions, state)[0], rates])

    assert_derivatives_agree(push, [1.1, 0.9, 1.2, 0.8, 1.3])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (dict(receptance=np.ones((5, 3, 2))), "must have the shape"),
        (dict(receptance=np.full((5, 3, 3), np.nan)), "must be finite"),
        (dict(axes=4), "axes must be 2, 3 or 6"),
        (dict(order=9), "9 poles need 9 frequencies"),
        (dict(receptance=np.zeros((5, 3, 3))), "is zero throughout"),
        (dict(order=None), "a search for poles needs 7 frequencies"),
    ],
)
def test_what_no_fit_takes(change, words):
    given = dict(frequencies=np.arange(1.0, 6.0), receptance=np.ones((5, 3, 3)), order=4) | change
    for fit in (jr.interop.fit_receptance, jr.interop.fit_modes):
        with pytest.raises(jr.InputError, match=f"{fit.__name__}: .*{words}"):
            fit(**given)


def test_measured_foundations_that_are_refused():
    A = np.array([[0.0, 1.0], [-4.0, -0.1]])
    B, Cm = np.array([[0.0, 0.0], [1.0, 0.5]]), np.array([[1.0, 0.0], [0.5, 0.0]])
    fan = {"fan": ROTORS["fan"]}
    for words, e in {
        "A must be stable": el.MeasuredFoundation(-A, B, Cm, MOUNT[0], axes=2),
        "C B must be zero": el.MeasuredFoundation(A, B, Cm[:, ::-1], MOUNT[0], axes=2),
        "axes must be 2": el.MeasuredFoundation(A, B, Cm, MOUNT[0], axes=3),
        "must belong together": el.MeasuredFoundation(A, B[:1], Cm, MOUNT[0], axes=2),
    }.items():
        with pytest.raises(jr.InputError, match=words):
            jr.Machine({**fan, "base": e}, {"base": "fan"})
