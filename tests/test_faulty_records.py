"""Twenty records with something wrong: what is said of each."""

import jax
import numpy as np
import pytest

import jaxrotor as jr

END, RATE = 1.0, 1000.0
REST = (1e5, 1e3, 1e3, 0.0)  # along the shaft, about x, y and it
NOISE = {"right": 0.03, "top": 0.03, "housing": 0.1, "speed": 1.0, "vector": 0.3}
KNOWN = [
    jr.Unknown("d.unbalance.eccentricity", positive=True),
    jr.Unknown("d.unbalance.angle", circular=True),
    jr.Unknown("bearing.stiffness[0]", positive=True, also={"bearing.stiffness[1]": 1.0}),
    jr.Unknown("bearing.damping[0]", bounds=(1.0, 1e3), also={"bearing.damping[1]": 1.0}),
]


def machine(e=2e-5, angle=0.7, k=1.2e5, c=60.0):
    """A disc on two springs, run up through its resonance at 39 Hz by its drive."""
    return jr.Machine(
        {
            "d": jr.Rotor(2.0, 0.02, 0.012, unbalance=jr.Unbalance(e, angle)),
            "bearing": jr.LinearSupport([k, k, *REST], [c, c, 1.0, 1.0, 1.0, 0.0]),
        },
        {"bearing": "d"},
        prescribed={"d": {"phi": jr.CosineRamp(speed=400.0, duration=END)}},
    )


def sensors():
    right, top = (jr.sensors.ProximityProbe("d", angle) for angle in (0.3, 0.3 + np.pi / 2))
    chains = {
        "right": (right, "V", 8000.0),
        "top": (top, "V", 8000.0),
        "housing": (jr.sensors.Accelerometer("d", (0, 1, 0)), "", 1.0),
        "speed": (jr.sensors.Tachometer("d"), "", 1.0),
    }
    found = {
        name: jr.Channel(sensor, unit, size, noise=jr.sensors.Noise(NOISE[name]))
        for name, (sensor, unit, size) in chains.items()
    }
    noise = jr.sensors.Noise(NOISE["vector"])
    found["vector"] = jr.sensors.TrackingFilter(top, "d", unit="um", noise=noise)
    return found


SENSORS = sensors()


@pytest.fixture(scope="module")
def good():
    """name -> instants and values, with noise."""
    run = jr.simulate(machine(), END + 2 / RATE, RATE, "undeformed")
    t = np.arange(int(END * RATE) + 1) / RATE
    found = {}
    for key, (name, channel) in zip(jax.random.split(jax.random.key(3), 5), SENSORS.items()):
        at = t[200:1000:20] if name == "vector" else t
        found[name] = (at, np.array(channel.recorded(run, key, at)))
    return found


def identified(good, **changes):
    """With another (t, values) in some channels."""
    series = {
        name: jr.sensors.Series(*(good | changes)[name], channel.recorded_in)
        for name, channel in SENSORS.items()
    }
    data = jr.MeasuredRun(jr.Record(series), initial="undeformed")
    return jr.identify(machine(2.2e-5, 0.5, 1.15e5, 70.0), KNOWN, SENSORS, data)
