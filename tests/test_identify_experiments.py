"""The records of experiments/data: made anew by their seed, and what the experiments find in them."""

import sys
from pathlib import Path

import numpy as np
import pytest

import jaxrotor as jr

sys.path.insert(0, str(Path(__file__).parent.parent / "experiments"))
import identify_coupling
import identify_unbalance
import synthetic

DATA = synthetic.HERE / "data"


def test_the_seed_makes_the_records_anew():
    """Digit by digit, but for the last of those that were written."""
    _, records = synthetic.coupling_runs(1.0, synthetic.SEED)
    for made, name in zip(records, ("coupling_start", "coupling_load_step")):
        kept = jr.read_record(DATA / f"{name}.toml")
        assert kept.name == made.name and set(kept.series) == set(made.series)
        for channel, one in kept.series.items():
            np.testing.assert_allclose(one.values, made[channel].values, rtol=1e-6, atol=1e-7)
            assert one.unit == made[channel].unit


def test_dynamic_stiffness():
    """Spring and damper, and beside them the Maxwell branch: compliances in series."""
    k1, _, c, k, d = synthetic.COUPLING.values()
    s = 2j * np.pi * identify_coupling.FREQUENCY
    by_hand = k1 + c * s + 1 / (1 / k + 1 / (d * s))
    got = identify_coupling.dynamic(list(synthetic.COUPLING.values()))
    np.testing.assert_allclose(got, by_hand, rtol=1e-12)


@pytest.mark.slow
def test_unbalance_of_the_two_rotor_machine():
    """From 20 % and half a radian wrong, over time alone: on the way the second rotor's eccentricity all but
    vanishes, and several steps in a row must be taken back."""
    truth = synthetic.UNBALANCE
    wrong = {p: v + 0.5 if "angle" in p else 1.2 * v for p, v in truth.items()}
    # experiments/data/README.md
    noise = dict.fromkeys(synthetic.HOUSINGS, 4.995) | {"tacho": 0.001159}
    noise |= dict.fromkeys(("right_across", "right_up"), 0.448)
    found = jr.identify(
        synthetic.two_rotors(wrong),
        identify_unbalance.unknowns(),
        synthetic.channels(synthetic.HOUSINGS, noise),
        jr.MeasuredRun(jr.read_record(DATA / "two_rotor_run_up.toml"), step=2e-4),
    )
    assert found.stopped and found.warnings == ()
    for path, value in truth.items():
        assert abs(found.values[path] - value) < 4 * found.std[path], path
    assert found.std["second.unbalance.eccentricity"] < 6e-7
