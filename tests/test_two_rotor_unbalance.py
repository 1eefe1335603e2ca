"""The unbalance of the two-rotor machine, from its record in experiments/data."""

import numpy as np
import pytest

import jaxrotor as jr

# experiments/data/README.md
TRUTH = {
    "main.unbalance.eccentricity": 5e-4,
    "main.unbalance.angle": 0.6,
    "main.unbalance.inclination": np.deg2rad(1.0),
    "main.unbalance.inclination_angle": -1.1,
    "second.unbalance.eccentricity": 1e-5,
    "second.unbalance.angle": 2.2,
}
HOUSINGS = {
    f"{side}_{name}": jr.Channel(jr.Accelerometer(side, direction), noise=jr.Noise(std))
    for side, std in (("left", 4.995), ("right", 0.448))
    for name, direction in (("across", (1, 0, 0)), ("up", (0, 1, 0)))
}


@pytest.mark.slow
def test_from_the_record():
    """From 20 % and half a radian wrong, over time alone: on the way the second rotor's eccentricity all but
    vanishes, and several steps in a row must be taken back."""
    wrong = {p: v + 0.5 if "angle" in p else 1.2 * v for p, v in TRUTH.items()}
    machine = jr.load("configs/two_rotor_startup.toml").machine.set(wrong)
    record = jr.read_record("experiments/data/two_rotor_run_up.toml")
    sensors = {**HOUSINGS, "tacho": jr.Channel(jr.Tachometer("second"), noise=jr.Noise(0.001159))}
    unknowns = [
        jr.Unknown(p, circular=True) if "angle" in p else jr.Unknown(p, positive=True)
        for p in TRUTH
    ]
    found = jr.identify(machine, unknowns, sensors, jr.Trial(record, step=2e-4))
    assert found.stopped and found.warnings == ()
    for path, value in TRUTH.items():
        assert abs(found.values[path] - value) < 4 * found.std[path], path
    assert found.std["second.unbalance.eccentricity"] < 6e-7
