"""The paper's ten seconds against an independent program (tests/data/README.md)."""

from pathlib import Path

import diffrax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr

DATA = np.load(Path(__file__).parent / "data" / "two_rotor_reference.npz")
SAMPLES, STATIONS = DATA["sample"], [str(s) for s in DATA["stations"]]
# Uncertainty of the reference by station (second, left, main, right) and coordinate.
UNCERTAINTY = np.array([[4.1e-10] * 2 + [9.6e-15] + [3.3e-9] * 2 + [1.1e-9]] * 4)
UNCERTAINTY[3] = [6.8e-12] * 2 + [9.6e-15] + [6.5e-10] * 2 + [1.1e-9]


def coordinates(response, samples=slice(None)):
    """(nt, 4, 6), phi measured from the drive."""
    drive = np.asarray(response["end"].phi)
    out = np.stack([np.asarray(response[name].position) for name in STATIONS], axis=1)
    out[:, :, 5] -= drive[:, None]
    return out[samples]


def error(response, last=None):
    """Largest error of each station's coordinates, (4, 6)."""
    keep = SAMPLES <= (SAMPLES[-1] if last is None else last)
    return np.abs(coordinates(response, SAMPLES[keep]) - DATA["position"][keep]).max(0)


def test_default_settings(two_rotor):
    response = jr.simulate(two_rotor(), 10.0, 1000.0, initial="undeformed")
    found = error(response)
    assert found[:, 2].max() < 1e-10
    others = [0, 1, 3, 4, 5]
    assert (found / DATA["peak"])[:, others].max() < 5e-5
    stats = response.stats
    assert stats["solver"] == "ExponentialAdams"
    assert 0 < stats["pilot_error"] <= stats["tolerance"]


@pytest.mark.parametrize(
    "solver, steps, order",
    [(jr.ExponentialAdams(6), (1, 2, 3), 6), (jr.ETD4RK(), (2, 4, 8), 3.5)],
    ids=["adams", "etd4rk"],
)
def test_converges_to_the_reference(two_rotor, solver, steps, order):
    """Order by three steps; the finest is as good as the reference itself, or 5e-6 of the peak."""
    found = []
    print()
    for n in steps:
        response = jr.simulate(
            two_rotor(), 10.0, 1000.0, initial="undeformed", solver=solver, step=1e-3 / n
        )
        found.append(error(response))
        relative = (found[-1] / DATA["peak"])[:, [0, 1, 3, 4, 5]].max(0)
        print(f"h = 1/{n} ms: x y psi theta phi {relative}, z {found[-1][:, 2].max():.1e} m")
    floor = np.maximum(UNCERTAINTY, 5e-6 * DATA["peak"])[:, [0, 1, 3, 4, 5]]
    assert np.all(found[-1][:, [0, 1, 3, 4, 5]] <= floor)
    # phi and z of the fine runs are at the reference's own uncertainty: the order shows laterally
    lateral = [e[:3, :2].max() for e in found]
    slope = np.log(lateral[0] / lateral[-1]) / np.log(steps[-1] / steps[0])
    print(f"observed order {slope:.2f}")
    assert slope > order - 0.5


def test_another_solver_agrees(two_rotor):
    """Kvaerno5 of diffrax on the same vector field, the first 0.3 s."""
    settings = dict(t_end=0.3, sample_rate=1000.0, initial="undeformed")
    other = jr.simulate(two_rotor(), **settings, solver=diffrax.Kvaerno5(), rtol=1e-7, atol=1e-10)
    ours = jr.simulate(two_rotor(), **settings, step=1e-4)
    a, b = coordinates(other), coordinates(ours)
    peak = np.abs(b).max(0)
    found = np.abs(a - b).max(0)
    assert (found / peak)[:, [0, 1, 3, 4, 5]].max() < 1e-6
    assert found[:, 2].max() < 1e-15  # m: z moves by less than atol itself
    assert jnp.isfinite(other["main"].acceleration).all()
