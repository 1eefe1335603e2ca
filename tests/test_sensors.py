"""Sensors and their chains: against closed forms and SciPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.integrate
import scipy.signal

import jaxrotor as jr
from jaxrotor.sensors.filters import between, low_pass

# a Jeffcott rotor in its steady whirl: Re(X e^(i w t))
M, K, C, E, LEAN, W = 2.0, 1e5, 30.0, 1e-5, 0.5, 150.0
X = M * E * W**2 * np.exp(1j * LEAN) / (K - M * W**2 + 1j * W * C)


@pytest.fixture(scope="module")
def whirl():
    machine = jr.Machine.in_line(
        {"d": jr.Rotor(M, 0.02, 0.012, unbalance=jr.Unbalance(E, LEAN))},
        attachments={"bearing": (jr.LinearSupport([K, K, 0, 0, 0, 0], [C, C, 0, 0, 0, 0]), "d")},
        fixed={"d": ("z", "psi", "theta")},
        prescribed={"d": {"phi": jr.ConstantSpeed(W)}},
    )
    return jr.simulate(machine, 0.2, 4000.0, initial="steady")


def test_what_each_sensor_sees(whirl):
    t = np.asarray(whirl.t)
    angle = 0.3
    seen = jr.sensors.ProximityProbe("d", angle).signal(whirl)
    turning = np.exp(1j * W * t)  # y lags x by a quarter turn: along `angle` by that much
    np.testing.assert_allclose(seen, (X * turning * np.exp(-1j * angle)).real, atol=1e-6 * abs(X))
    acceleration = jr.sensors.Accelerometer("d", (0, 2, 0)).signal(whirl)
    np.testing.assert_allclose(
        acceleration, -(W**2) * (X * turning).imag, atol=1e-6 * W**2 * abs(X)
    )
    np.testing.assert_allclose(jr.sensors.Tachometer("d").signal(whirl), W, rtol=1e-9)
    np.testing.assert_allclose(jr.sensors.Encoder("d").signal(whirl), W * t, rtol=1e-9, atol=1e-9)


def test_runout_turns_with_the_shaft(whirl):
    """A scratch of known shape passes under the probe, whose angle shifts it in time."""
    t = np.asarray(whirl.t)
    runout = [[3e-6, 1e-6], [0.0, 2e-6]]
    found = jr.sensors.ProximityProbe("d", 0.7, runout).signal(whirl) - jr.sensors.ProximityProbe(
        "d", 0.7
    ).signal(whirl)
    a = W * t - 0.7
    expected = 3e-6 * np.cos(a) + 1e-6 * np.sin(a) + 2e-6 * np.sin(2 * a)
    np.testing.assert_allclose(found, expected, atol=1e-13)


def test_chain(whirl):
    """Sensitivity, bias and delay; values between the samples; NaN where the run does not reach."""
    channel = jr.Channel(
        jr.sensors.ProximityProbe("d", 0.0), unit="V", sensitivity=8e3, bias=-9.0, delay=1.3e-3
    )
    times = np.array([0.0512, 0.1037, 0.1999])
    expected = -9.0 + 8e3 * (X * np.exp(1j * W * (times - 1.3e-3))).real
    np.testing.assert_allclose(channel.measure(whirl, times), expected, atol=1e-6 * 8e3 * abs(X))
    assert channel.recorded_in == "V"
    beyond = channel.measure(whirl, np.array([0.0, 0.21]))
    assert np.isnan(beyond).all()


def test_between_samples_is_exact_for_polynomials():
    t = np.arange(40) * 0.1
    power = np.random.default_rng(0).normal(size=8)
    times = np.array([0.0, 0.01, 1.234, 2.0, 3.89, 3.9])
    found = between(jnp.polyval(power, t), 0.0, 0.1, jnp.asarray(times))
    np.testing.assert_allclose(found, np.polyval(power, times), rtol=1e-9)
    wave = between(jnp.sin(2 * np.pi * t), 0.0, 0.1, jnp.asarray(times))  # 10 samples a period
    np.testing.assert_allclose(wave[2:4], np.sin(2 * np.pi * times[2:4]), atol=1e-4)
    slope = jax.jvp(
        lambda d: between(jnp.polyval(power, t), 0.0, 0.1, 1.234 - d[None]), (0.0,), (1.0,)
    )
    np.testing.assert_allclose(slope[1][0], -np.polyval(np.polyder(power), 1.234), rtol=1e-9)


@pytest.mark.parametrize("order", [1, 2, 5])
def test_low_pass(order):
    """SciPy's first-order-hold simulation of the analog Butterworth filter; its -3 dB are at the cutoff."""
    h, cutoff = 1e-3, 40.0
    t = np.arange(2000) * h
    u = np.random.default_rng(1).normal(size=t.size)
    system = scipy.signal.lti(*scipy.signal.butter(order, 2 * np.pi * cutoff, analog=True))
    u[0] = 0.0
    _, expected, _ = scipy.signal.lsim(system, u, t)
    np.testing.assert_allclose(low_pass(jnp.asarray(u), h, cutoff, order), expected, atol=1e-9)
    fine = np.arange(20000) * 1e-4
    through = low_pass(jnp.sin(2 * np.pi * cutoff * fine), 1e-4, cutoff, order)[10000:]
    assert np.sqrt(2 * np.mean(np.asarray(through) ** 2)) == pytest.approx(1 / np.sqrt(2), rel=1e-3)


def test_noise():
    """Size, correlation, converter steps; the same key gives the same noise."""
    key = jax.random.key(3)
    clean = jnp.zeros(200_000)
    white = np.asarray(jr.sensors.Noise(0.2).added(key, clean, 1e-3))
    assert white.std() == pytest.approx(0.2, rel=0.01)
    assert abs(white[1:] @ white[:-1] / (white @ white)) < 0.01
    slow = np.asarray(jr.sensors.Noise(0.2, correlation_time=5e-3).added(key, clean, 1e-3))
    assert slow.std() == pytest.approx(0.2, rel=0.02)
    assert slow[1:] @ slow[:-1] / (slow @ slow) == pytest.approx(np.exp(-0.2), rel=0.01)
    stepped = np.asarray(jr.sensors.Noise(0.2, quantum=0.5).added(key, clean, 1e-3))
    np.testing.assert_array_equal(stepped, np.round(white / 0.5) * 0.5)
    np.testing.assert_array_equal(white, jr.sensors.Noise(0.2).added(key, clean, 1e-3))


def test_pulses(whirl):
    """60 marks at a constant speed: instants, and back to angle and speed."""
    instants = jr.sensors.pulse_times(whirl, "d", 60)
    np.testing.assert_allclose(np.diff(instants), 2 * np.pi / 60 / W, rtol=1e-7)
    np.testing.assert_allclose(instants[0], 2 * np.pi / 60 / W, rtol=1e-7)
    angle = jr.sensors.angle_of(instants, 60)
    np.testing.assert_allclose(np.diff(angle.values) / np.diff(angle.t), W, rtol=1e-7)
    np.testing.assert_allclose(jr.sensors.speed_of(instants, 60).values, W, rtol=1e-7)


def test_sensors_refuse(whirl):
    for sensor, words in [
        (jr.sensors.Tachometer("disc"), "did you mean|no element"),
        (jr.sensors.Tachometer("bearing"), "is no station"),
        (jr.sensors.TorqueSensor("bearing"), "has no torque"),
    ]:
        with pytest.raises(jr.InputError, match=words):
            sensor.signal(whirl)
    with pytest.raises(jr.InputError, match="pulses must be a whole number"):
        jr.sensors.pulse_times(whirl, "d", 0)


def test_a_unit_of_the_sensors_kind_wants_its_factor():
    """What is recorded in um is a million times what is seen in m: 1 is a slip of six orders."""
    from jaxrotor.core.parameter import problems

    probe = jr.sensors.ProximityProbe("disc", 0.0)
    (said,) = problems(jr.Channel(probe, unit="um"), "probe")
    assert said.startswith(
        "`probe`: sensitivity must be 1e+06 um per m, as the unit says, but is 1"
    )
    for fits in (
        jr.Channel(probe),
        jr.Channel(probe, unit="m"),
        jr.Channel(probe, unit="um", sensitivity=0.98e6),
        jr.Channel(probe, unit="V"),
    ):
        assert not list(problems(fits, "probe"))
