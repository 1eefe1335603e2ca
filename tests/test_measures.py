"""Measures of a run: against closed forms, the standard's own example and a plain account of its text; their
derivatives, through a run, against central differences."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.optimize
from helpers import at_instants
from jaxtyping import Array

import jaxrotor as jr
from jaxrotor.objectives.fatigue import FatigueDamage, rainflow
from jaxrotor.objectives.integral import Integral
from jaxrotor.objectives.level import Percentile, RootMeanSquare
from jaxrotor.objectives.mass import polar_inertia, total_mass
from jaxrotor.objectives.peak import PassageAmplitude, PeakValue, smooth_max
from jaxrotor.objectives.settling import SettlingTime
from jaxrotor.sensors import quantities as q
from jaxrotor.simulation.run_info import RunInfo


class Given(jr.sensors.AbstractSensor):
    """Sees what it is told."""

    values: Array = eqx.field(converter=lambda x: jnp.asarray(x, float))
    unit: str = eqx.field(static=True, default="N*m")

    def signal(self, response):
        return self.values


def over(t):
    """A run of which the instants matter alone."""
    return jr.Response(None, jnp.asarray(t), jnp.zeros((len(t), 0)), RunInfo("none"))


H = 1e-3
T = np.arange(2001) * H
RUN = over(T)


# Peaks


@pytest.mark.parametrize("phase", np.linspace(0.0, 0.3, 7))
def test_peak_does_not_depend_on_where_samples_fall(phase):
    """20 samples a period; of the samples alone the highest is up to 1.2 % low."""
    wave = -3.0 * np.cos(2 * np.pi * 50 * T + phase)
    found = PeakValue(Given(wave))(RUN)
    assert float(found) == pytest.approx(3.0, rel=2.2e-4)
    assert float(PeakValue(Given(wave + 7), about="mean")(RUN)) == pytest.approx(3.0, rel=2e-3)
    assert float(PeakValue(Given(wave + 7))(RUN)) == pytest.approx(10.0, rel=1e-4)


def test_peak_of_a_parabola_is_exact():
    tops = 5.0 - (T - 0.70036) ** 2
    assert float(PeakValue(Given(tops))(RUN)) == pytest.approx(5.0, rel=1e-14)
    late = PeakValue(Given(tops), start=0.9, stop=1.1)  # the ends of a window stand as they are
    assert float(late(RUN)) == pytest.approx(5.0 - (0.9 - 0.70036) ** 2, rel=1e-14)
    assert PeakValue(Given(tops)).unit == "N*m"


@pytest.mark.parametrize("sharpness", [1.0, 8.0, 50.0, 400.0])
def test_smooth_peak_keeps_its_bounds_and_knows_no_scale(sharpness):
    values = np.random.default_rng(0).normal(size=300)
    largest, n = np.abs(values).max(), values.size
    found = float(smooth_max(jnp.asarray(values), sharpness))
    assert largest <= found <= largest * n ** (1 / sharpness)
    assert found == pytest.approx(np.linalg.norm(values, sharpness), rel=1e-12)
    for scale in (1e-200, 1e200):
        again = float(smooth_max(jnp.asarray(scale * values), sharpness))
        assert again == pytest.approx(scale * found, rel=1e-12)
    slope = jax.grad(smooth_max)(jnp.asarray(values), sharpness)
    assert slope @ values == pytest.approx(found, rel=1e-12)  # Euler: homogeneous of degree one
    np.testing.assert_array_equal(jax.grad(smooth_max)(jnp.zeros(3), sharpness), 0.0)


def test_smooth_peak_in_a_window():
    values = np.exp(-T)
    found = PeakValue(Given(values), 20.0, start=1.0, stop=1.5)(RUN)
    assert float(found) == pytest.approx(np.linalg.norm(values[1000:1501], 20.0), rel=1e-12)


def test_passage():
    """A bump on the way up, a higher one beyond: the machine's speed says which counts."""
    machine = jr.Machine({"d": jr.Rotor(1.0, 0.02, 0.02)}, {})
    motion = np.zeros((T.size, 1, 6))
    motion[:, 0, 5] = -100.0 * T  # a ramp to 200 rad/s, backwards
    run = at_instants(machine, np.zeros_like(motion), motion, T)
    seen = 2 * np.exp(-(((T - 0.8003) / 0.05) ** 2)) - 5 * np.exp(-(((T - 1.6) / 0.05) ** 2))
    assert float(PassageAmplitude(Given(seen), "d", 60, 100)(run)) == pytest.approx(2.0, rel=1e-6)
    assert float(PassageAmplitude(Given(seen), "d", 60, 190)(run)) == pytest.approx(5.0, rel=1e-6)
    inside = (T >= 0.6 - 1e-9) & (T <= 1.0 + 1e-9)
    soft = PassageAmplitude(Given(seen), "d", 59.99, 100.01, 30.0)(run)
    assert float(soft) == pytest.approx(np.linalg.norm(seen[inside], 30.0), rel=1e-12)
    with pytest.raises(
        jr.InputError, match="speed of `d` is never between 300 and 400 rad/s: .*200"
    ):
        PassageAmplitude(Given(seen), "d", 300, 400)(run)
    with pytest.raises(jr.InputError, match="there is no element `disc`"):
        PassageAmplitude(Given(seen), "disc", 60, 100)(run)
    for compare in (lambda m: m <= 1e-3, lambda m: m >= 1e-3):
        with pytest.raises(
            jr.InputError,
            match=r"judges a run.*\.measure\(PassageAmplitude\(\.\.\.\)\) [<>]= 0.001",
        ):
            compare(PassageAmplitude(Given(seen), "d", 60, 100))


# Levels and integrals


def test_integrals_of_a_decaying_sine():
    """∫ e^(-at) sin(wt) and its square, in closed form; straight between samples: right to (wh)²/12."""
    a, w, stop = 3.0, 40.0, 1.2345  # between samples
    wave = np.exp(-a * T) * np.sin(w * T)

    def whole(a, w, x):
        return np.imag((np.exp((-a + 1j * w) * x) - 1) / (-a + 1j * w))

    found = Integral(Given(wave), start=0.2505, stop=stop)(RUN)
    want = whole(a, w, stop) - whole(a, w, 0.2505)
    assert float(found) == pytest.approx(want, abs=2e-4 * np.abs(wave).sum() * H)
    square = Integral(Given(wave), power=2, stop=stop)(RUN)

    def energy(x):  # sin² = (1 - cos 2wt)/2
        z = -2 * a + 2j * w
        return (1 - np.exp(-2 * a * x)) / (4 * a) - 0.5 * np.real((np.exp(z * x) - 1) / z)

    assert float(square) == pytest.approx(energy(stop), rel=1e-3)
    rms = RootMeanSquare(Given(wave), start=0.2505, stop=stop)(RUN)
    want = np.sqrt((energy(stop) - energy(0.2505)) / (stop - 0.2505))
    assert float(rms) == pytest.approx(want, rel=1e-3)
    size = Integral(Given(np.sin(np.pi * 10 * T)), absolute=True)(RUN)
    assert float(size) == pytest.approx(2.0 * 2 / np.pi, rel=1e-3)


def test_integral_is_exact_for_a_straight_line_from_anywhere_to_anywhere():
    for start, stop in [(0.0, 2.0), (0.3141, 0.3144), (0.25, 1.75)]:
        found = Integral(Given(2 * T - 1), start=start, stop=stop)(RUN)
        assert float(found) == pytest.approx(stop**2 - stop - start**2 + start, rel=1e-9)
    slope = jax.grad(lambda x: Integral(Given(2 * T - 1), stop=x)(RUN))(0.7777)
    assert float(slope) == pytest.approx(2 * 0.7777 - 1, rel=1e-12)


@pytest.mark.parametrize(
    "measure, unit",
    [
        (Integral(Given(T, "W")), "J"),
        (Integral(Given(T, "m/s^2"), power=2), "m^2/s^3"),
        (Integral(Given(T, "")), "s"),
    ],
)
def test_unit_of_an_integral(measure, unit):
    from pint import UnitRegistry

    units = UnitRegistry()
    assert units(measure.unit).check(units(unit).dimensionality)


def test_root_mean_square():
    wave = 3.0 * np.sin(2 * np.pi * 10 * T)
    assert float(RootMeanSquare(Given(wave))(RUN)) == pytest.approx(3 / np.sqrt(2), rel=1e-9)
    off = Given(wave + 11)
    assert float(RootMeanSquare(off)(RUN)) == pytest.approx(np.hypot(11, 3 / np.sqrt(2)), rel=1e-9)
    assert float(RootMeanSquare(off, about="mean")(RUN)) == pytest.approx(3 / np.sqrt(2), rel=1e-9)


def test_moving_mean():
    """A trend is taken out all along; a wave is left with 1 - sin(pi f T)/(pi f T) of it."""
    trend = 1e4 - 300 * T
    assert float(RootMeanSquare(Given(trend), 0.31)(RUN)) == pytest.approx(0.0, abs=1e-9)
    wave = np.sin(2 * np.pi * 10 * T)
    for length in (0.02, 0.06, 0.1, 0.1234):
        found = RootMeanSquare(Given(trend + wave), length, start=0.2, stop=1.8)(RUN)
        left = 1 - np.sinc(10 * length)
        assert float(found) == pytest.approx(left / np.sqrt(2), abs=3e-4)


def test_percentile():
    values = np.random.default_rng(4).normal(size=T.size)
    for share in (0.0, 0.5, 0.95, 0.9873, 1.0):
        found = Percentile(Given(values), share)(RUN)
        assert float(found) == pytest.approx(np.quantile(np.abs(values), share), rel=1e-12)
    part = Percentile(Given(values), 0.9, start=0.5, stop=0.75)(RUN)
    want = np.quantile(np.abs(values[500:751]), 0.9)
    assert float(part) == pytest.approx(want, rel=1e-12)


# Settling


def test_settling_of_an_exponential():
    """`ln(A/band)/a`, after a start within the run, to a level that is not zero."""
    a, level = 8.0, 4.0
    seen = level - 3.0 * np.exp(-a * T)
    found = SettlingTime(Given(seen), 0.06, level)(RUN)
    assert float(found) == pytest.approx(np.log(3.0 / 0.06) / a, rel=1e-4)
    later = SettlingTime(Given(seen), 0.06, level, start=0.25)(RUN)
    assert float(later) == pytest.approx(np.log(3.0 / 0.06) / a - 0.25, rel=1e-4)
    slope = jax.grad(lambda band: SettlingTime(Given(seen), band, level)(RUN))(0.06)
    assert float(slope) == pytest.approx(-1 / (a * 0.06), rel=1e-2)  # straight between samples
    # left out, the level is the mean of the last tenth: 3 e^(-8 * 1.9) or so off
    assert float(SettlingTime(Given(seen), 0.06)(RUN)) == pytest.approx(float(found), rel=1e-5)


def test_settling_of_a_decaying_sine():
    def wave(t):
        return np.exp(-2.0 * t) * np.sin(30.0 * t)

    crests = (np.arctan(15.0) + np.pi * np.arange(20)) / 30
    above = crests[np.abs(wave(crests)) > 0.1][-1]  # down from the last crest above the band
    want = scipy.optimize.brentq(lambda t: abs(wave(t)) - 0.1, above, above + 0.05)
    found = SettlingTime(Given(wave(T)), 0.1, 0.0)(RUN)
    assert float(found) == pytest.approx(want, abs=1e-5)


def test_settling_at_once_and_never():
    wave = np.sin(30 * T)
    assert float(SettlingTime(Given(wave), 1.5, 0.0)(RUN)) == 0.0
    assert float(SettlingTime(Given(wave + T), 0.1, 0.0, start=0.5)(RUN)) == pytest.approx(1.5)


# Fatigue


def counted(values):
    """{range: count} of ASTM E1049-85, sec. 5.4.4, step by step as its text has it."""
    points = [values[0]]
    for x in values[1:]:  # peaks and valleys alone
        if len(points) > 1 and (points[-1] - points[-2]) * (x - points[-1]) >= 0:
            points[-1] = x
        elif x != points[-1]:
            points.append(x)
    found, history, rest = [], [], list(points)
    while True:
        if not rest:  # (1) out of data: go to step 6
            break
        history.append(rest.pop(0))  # read the next peak or valley
        while len(history) >= 3:  # (2) fewer than three points: go to step 1
            x, y = abs(history[-1] - history[-2]), abs(history[-2] - history[-3])
            if x < y:  # (3a)
                break
            if len(history) == 3:  # (5) Y contains the start: half a cycle; the start moves on
                found.append((y, 0.5))
                history.pop(0)
            else:  # (4) one cycle; its peak and valley are discarded
                found.append((y, 1.0))
                del history[-3:-1]
    # (6) each range that has not been counted is half a cycle
    return found + [(abs(b - a), 0.5) for a, b in zip(history, history[1:])]


def by_range(cycles, values):
    sizes = np.abs(np.asarray(values)[cycles.first] - np.asarray(values)[cycles.last])
    return sorted((float(s), float(n)) for s, n in zip(sizes, cycles.count) if n > 0)


def test_rainflow_of_the_standards_example():
    """ASTM E1049-85, Fig. 6: the ranges and counts of its table."""
    history = jnp.array([-2.0, 1, -3, 5, -1, 3, -4, 4, -2])
    table: dict[float, float] = {}
    for size, count in by_range(rainflow(history), history):
        table[size] = table.get(size, 0.0) + count
    assert table == {3.0: 0.5, 4.0: 1.5, 6.0: 0.5, 8.0: 1.0, 9.0: 0.5}


def test_rainflow_of_random_histories():
    """Rough and smooth ones, with plateaus and ties, some of whose samples do not belong to them."""
    rng = np.random.default_rng(7)
    count = jax.jit(jax.vmap(rainflow))
    rough = rng.integers(-6, 7, size=(30, 60)).astype(float)
    smooth = np.cumsum(rng.normal(size=(30, 60)), axis=1)
    histories = np.concatenate(
        [rough, smooth, np.repeat(rough[:5, :30], 2, axis=1), np.ones((1, 60))]
    )
    inside = rng.random(histories.shape) > 0.2
    inside[::2] = True
    batch = count(jnp.asarray(histories), jnp.asarray(inside))
    for i, history in enumerate(histories):
        found = by_range(type(batch)(*(x[i] for x in batch)), history)
        assert len(found) == len(want := sorted(counted(history[inside[i]])))
        np.testing.assert_allclose(found, want)


def test_damage_of_a_sine():
    """N amplitudes S make N (S/reference)^m; of a window, what lies in it."""
    wave = 3.0 * np.cos(2 * np.pi * 5 * T)
    m, reference = 4.5, 60.0
    assert float(FatigueDamage(Given(wave), m, reference)(RUN)) == pytest.approx(
        10 * (3.0 / reference) ** m, rel=1e-12
    )
    part = FatigueDamage(Given(wave), m, reference, start=0.5, stop=1.1)(RUN)
    assert float(part) == pytest.approx(3 * (3.0 / reference) ** m, rel=1e-12)
    assert float(FatigueDamage(Given(0 * T + 2), m, reference)(RUN)) == 0.0


def test_damage_has_no_jumps():
    """Where the counting changes the sum has a kink: its steps are no larger than its derivative says."""
    wave = np.random.default_rng(2).normal(size=(2, 150))

    def damage(s):
        return FatigueDamage(Given(wave[0] + s * wave[1]), 3.0, 1.0)(over(T[:150]))

    at = np.linspace(0.0, 1.0, 4001)
    values, slopes = jax.jit(jax.vmap(jax.value_and_grad(damage)))(jnp.asarray(at))
    steps, bound = np.diff(values), np.abs(slopes).max() * (at[1] - at[0])
    assert np.abs(steps).max() < 1.05 * bound
    assert np.sum(0.5 * (slopes[1:] + slopes[:-1]) * np.diff(at)) == pytest.approx(
        float(values[-1] - values[0]), rel=1e-3
    )


# Sensors


def couple(**more):
    """A driven end, a hollow shaft, a rotor."""
    return jr.Machine.in_line(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(1e4)),
            "shaft": jr.Shaft(0.4, 0.02, 0.012, **more),
            "rotor": jr.Rotor(2.0, 0.02, 0.015),
        },
        attachments={"support": (jr.LinearSupport([3e5, 2e5, 0, 0, 0, 0], [50.0] * 6), "rotor")},
    )


def test_twist_after_thousands_of_turns():
    """1e-7 rad ahead at an angle of 1e4 rad: whole angles keep 2e-12 of it."""
    motion = np.zeros((2, 6))
    t, twist = 0.999999, 1e-7 / 3
    motion[:, 5] = 1e4 * t
    run = at_instants(couple(), motion, 0 * motion, t)
    y = run.y.at[:, :6].set(jnp.zeros(6).at[5].set(twist))
    run = eqx.tree_at(lambda r: r.y, run, y)
    assert float(q.Twist("end", "rotor").signal(run)[0]) == twist
    assert float(q.Twist("rotor", "end").signal(run)[0]) == -twist
    assert abs(float(run["rotor"].phi[0] - run["end"].phi[0]) - twist) > 1e-14


def test_twist_of_geared_lines():
    """As seen at the first station: `b` turns half as fast as `a`, against it. A line that turns as a whole
    has none after a thousand turns, and a loop that is fed the twist asks for nothing; else it is what each
    side has turned beyond its share, by hand."""
    mesh = jr.GearMesh([0.05, 0.1], jr.elements.KelvinVoigt(1e7, 1e3))
    feedback = jr.elements.TwistOf(0, 1, ratio=1 / mesh.ratio())
    machine = jr.Machine(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(100.0)),
            "shaft": jr.Shaft(0.4, 0.02),
            "a": jr.Rotor(2.0, 0.02, 0.015),
            "mesh": mesh,
            "b": jr.Rotor(2.0, 0.02, 0.015),
            "loop": jr.elements.ActiveTorque(jr.elements.PD(50.0, 0.4), feedback),
        },
        {"shaft": ("end", "a"), "mesh": ("a", "b"), "loop": ("a", "b")},
    )
    shares = {"end": 1.0, "a": 1.0, "b": -0.5}
    order = machine.wiring.stations
    rng = np.random.default_rng(0)
    q, v = rng.normal(size=(2, 2, 3, 6))
    t, at = np.array([0.3, 60.0]), {name: order.index(name) for name in shares}
    for name, share in shares.items():
        q[1, at[name]], v[1, at[name]] = 0.0, 0.0  # the second instant: turned as a whole
        q[1, at[name], 5], v[1, at[name], 5] = share * 6000.0, share * 100.0
    q[0, at["end"]], v[0, at["end"]] = 0.0, 0.0
    q[0, at["end"], 5], v[0, at["end"], 5] = 30.0, 100.0
    run = at_instants(machine, q, v, t)
    chi = q[0, :, 5] + q[0, :, 3] * q[0, :, 4] / 2
    for first, second in (("a", "b"), ("end", "b"), ("b", "a"), ("end", "a")):
        ratio = shares[first] / shares[second]
        want = ratio * chi[at[second]] - chi[at[first]]
        np.testing.assert_allclose(
            jr.sensors.Twist(first, second).signal(run), [want, 0.0], rtol=1e-12, atol=1e-15
        )
    rate = v[0, :, 5] + (q[0, :, 3] * v[0, :, 4] + v[0, :, 3] * q[0, :, 4]) / 2
    (qa, qb), (va, vb) = ((x[at["a"]], x[at["b"]]) for x in (chi, rate))
    want = -(50 * (qa + 2 * qb) + 0.4 * (va + 2 * vb))
    np.testing.assert_allclose(run["loop"].torque, [want, 0.0], rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("damping", ["fixed", "rotating"])
def test_stress_of_a_bent_and_twisted_shaft(damping):
    """A cantilever with a force and a torque at its tip: s = M/W, tau = T/Wp at the wall."""
    length, outer, inner = 0.4, 0.02, 0.012
    machine = couple(damping=damping)
    E, G = 2.1e11, 8.1e10
    moment = np.pi / 64 * (outer**4 - inner**4)
    force, torque, pull = 40.0, -7.0, 900.0
    bend = force * length**2 / (E * moment)
    motion = np.zeros((2, 6))
    motion[1] = (
        bend * length / 3, 0, pull * length / (E * np.pi / 4 * (outer**2 - inner**2)),
        0, bend / 2, torque * length / (G * 2 * moment),
    )  # fmt: skip
    run = at_instants(machine, motion, 0 * motion)
    tau = torque * outer / 2 / (2 * moment)
    shear = q.ShaftStress("shaft", "shear").signal(run)
    np.testing.assert_allclose(shear, [tau], rtol=1e-9)
    sigma = force * length * outer / 2 / moment + pull / (np.pi / 4 * (outer**2 - inner**2))
    found = q.ShaftStress("shaft").signal(run)
    np.testing.assert_allclose(found, [np.sqrt(sigma**2 + 3 * tau**2)], rtol=1e-9)


def test_stress_in_a_finite_element_shaft():
    """Tapered, twisted: tau at its thin end. And a still shaft has a derivative."""
    machine = jr.Machine.in_line(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
            "shaft": jr.FiniteElementShaft(0.4, 0.03, end_diameter=0.02, elements=1),
            "rotor": jr.Rotor(2.0, 0.02, 0.015),
        }
    )
    motion = np.zeros((2, 6))
    motion[1, 5] = 0.01
    run = at_instants(machine, motion, 0 * motion)
    stress = q.ShaftStress("shaft.element", "shear").signal(run)
    torque = run["shaft.element"].torque
    np.testing.assert_allclose(stress, 16 * torque / (np.pi * 0.02**3), rtol=1e-12)
    mises = q.ShaftStress("shaft.element").signal(run)
    np.testing.assert_allclose(mises, np.sqrt(3) * stress, rtol=1e-9)

    def at_rest(y):
        return q.ShaftStress("shaft.element").signal(eqx.tree_at(lambda r: r.y, run, y))[0]

    np.testing.assert_array_equal(jax.jit(jax.jacfwd(at_rest))(0 * run.y), 0.0)


def test_radial_and_forces():
    motion, rate = np.random.default_rng(3).normal(size=(2, 2, 6))
    motion[0], rate[0] = 0, 0
    run = at_instants(couple(), motion, rate)
    x, y = motion[1, :2]
    np.testing.assert_allclose(q.Radial("rotor").signal(run), [np.hypot(x, y)], rtol=1e-11)
    force = np.hypot(3e5 * x + 50 * rate[1, 0], 2e5 * y + 50 * rate[1, 1])
    np.testing.assert_allclose(q.BearingForce("support").signal(run), [force], rtol=1e-9)
    acceleration = q.AngularAcceleration("rotor").signal(run)
    np.testing.assert_array_equal(acceleration, run["rotor"].acceleration[:, 5])
    np.testing.assert_array_equal(q.Signal("shaft", "torque").signal(run), run["shaft"].torque)
    # the end turns steadily and takes no force of its own: torque of the shaft, less that on the end
    on_end = run["shaft"].forces[:, 0, 5]
    np.testing.assert_allclose(q.DriveTorque("end").signal(run), -on_end, rtol=1e-12)
    np.testing.assert_allclose(q.DrivePower("end").signal(run), -on_end * 1e4, rtol=1e-12)
    still = at_instants(couple(), 0 * motion, 0 * rate)
    for sensor in (q.Radial("rotor"), q.BearingForce("support")):
        assert float(sensor.signal(still)[0]) == 0.0


def test_force_of_a_self_aligning_bearing(two_rotor):
    motion, rate = 1e-4 * np.random.default_rng(3).normal(size=(2, 5, 6))
    run = at_instants(two_rotor(), motion, rate)
    want = np.linalg.norm(run["left"].bearing_force[0, :2])
    np.testing.assert_allclose(q.BearingForce("left").signal(run), [want], rtol=1e-5)


def test_sensors_and_measures_refuse():
    zero = np.zeros((2, 6))
    run = at_instants(couple(), zero, zero)
    for sensor, words in [
        (q.Twist("end", "rotr"), "did you mean `rotor`"),
        (q.Twist("end", "shaft"), "`shaft`: is no station"),
        (q.Radial("support"), "`support`: is no station"),
        (q.Signal("shaft", "torqe"), "`shaft`: there is no signal `torqe`: did you mean `torque`"),
        (q.Signal("shaft", "torque", "N"), r"torque is in N\*m, but unit says N"),
        (q.BearingForce("rotor"), "`rotor`: is no bearing"),
        (q.BearingForce("shaft"), "`shaft`: is no bearing"),
        (q.DriveTorque("rotor"), "`rotor`: is not driven"),
        (q.ShaftStress("support"), "`support`: is no shaft section"),
        (q.ShaftStress("shft"), "did you mean `shaft`"),
    ]:
        with pytest.raises(jr.InputError, match=words):
            sensor.signal(run)


SEEN = Given(T)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: PeakValue("rotor"), "sensor must be made by"),
        (lambda: PeakValue(SEEN, 0.5), "sharpness must be 1 or more, but is 0.5"),
        (lambda: PeakValue(SEEN, about="median"), "about must be 'zero' or 'mean'"),
        (lambda: PeakValue(SEEN, start=-1.0), "start must be zero or positive, but is -1 s"),
        (lambda: PeakValue(SEEN, start=1.0, stop=0.5), "start must lie before stop.* 1 and 0.5 s"),
        (lambda: RootMeanSquare(SEEN, -0.1), "moving must be positive, but is -0.1 s"),
        (lambda: FatigueDamage(SEEN, 0.0, 1.0), "exponent must be positive, but is 0"),
        (lambda: FatigueDamage(SEEN, 3.0, -1.0), "reference must be positive, but is -1"),
        (lambda: SettlingTime(SEEN, -0.1), "band must be positive, but is -0.1"),
        (lambda: Integral(SEEN, power=3), "power must be 1 or 2, but is 3"),
        (lambda: Percentile(SEEN, 95.0), "share must be 1 at most, but is 95"),
        (lambda: PassageAmplitude(SEEN, "a", 9.0, 8.0), "low must be below high.* 9 and 8 rad/s"),
        (lambda: PeakValue(SEEN, start=2.5)(RUN), "window from 2.5 s holds nothing of the run"),
        (lambda: Integral(SEEN, start=2.5)(RUN), "window from 2.5 s holds nothing of the run"),
    ],
)
def test_bad_measures_are_refused(make, words):
    with pytest.raises(jr.InputError, match=words):
        make()


def test_what_cannot_be_refused_is_nan():
    """A window beyond the run inside `jit`; a run that failed."""
    lost = Given(np.where(T > 1.5, np.nan, T))

    def all_of(sensor, start):
        return jnp.stack([m(RUN) for m in of_one_signal(sensor, start=start)])

    found = jax.jit(all_of)
    assert np.isnan(found(SEEN, 3.0)).all() and np.isnan(found(lost, 0.1)).all()
    assert np.isfinite(found(SEEN, 0.1)).all()


def of_one_signal(sensor, **window):
    """Every measure of one sensor."""
    return [
        PeakValue(sensor, **window),
        PeakValue(sensor, 60.0, about="mean", **window),
        RootMeanSquare(sensor, **window),
        RootMeanSquare(sensor, 0.05, **window),
        Percentile(sensor, 0.9, **window),
        Integral(sensor, power=2, **window),
        Integral(sensor, absolute=True, **window),
        FatigueDamage(sensor, 3.0, 40.0, **window),
        SettlingTime(sensor, 0.3, 0.0, **window),
    ]


# Through a run: an unbalanced rotor with a vibration damper, run up on a soft shaft


def run_up(p):
    e, support, damping, length = p
    machine = jr.Machine.in_line(
        {
            "end": jr.PrescribedSpin(jr.CosineRamp(speed=200.0, duration=0.3)),
            "shaft": jr.Shaft(length, 0.012, rayleigh=(0.0, 1e-4)),
            "rotor": jr.Rotor(2.0, 0.01, 0.006, unbalance=jr.Unbalance(e)),
        },
        attachments={
            "support": (
                jr.LinearSupport([2e4, 3e4, 0, 0, 0, 0], [support] * 2 + [0.0] * 4),
                "rotor",
            ),
            "damper": (jr.TorsionalDamper(0.002, damping), "rotor"),
        },
        fixed={"rotor": ("z", "psi", "theta")},
    )
    return jr.simulate(machine, 0.4, 1000.0, initial="undeformed", solver=jr.ETD4RK(), step=5e-4)


def judged(p):
    run = run_up(p)
    torque = Given(q.Signal("shaft", "torque", "N*m").signal(run))
    measures = [
        *of_one_signal(torque, start=0.05, stop=0.3905),
        PassageAmplitude(q.Radial("rotor"), "rotor", 90.0, 180.0),
        PassageAmplitude(jr.sensors.ProximityProbe("rotor", 0.3), "rotor", 90.0, 180.0, 40.0),
        PeakValue(q.BearingForce("support")),
        PeakValue(q.ShaftStress("shaft")),
        FatigueDamage(q.ShaftStress("shaft", "shear"), 5.0, 1e8),
        PeakValue(q.Twist("end", "rotor")),
        RootMeanSquare(q.AngularAcceleration("rotor")),
        Integral(q.DrivePower("end")),
        PeakValue(q.DriveTorque("end")),
        Integral(q.Signal("damper", "torque"), power=2),
    ]
    found = [m(run) for m in measures]
    return jnp.stack([*found, total_mass(run.machine), polar_inertia(run.machine)])


P = np.array([3e-4, 60.0, 0.15, 0.3])


@pytest.fixture(scope="module")
def forward():
    """Jacobian and values for `u * P`: one program for both."""
    return jax.jit(jax.jacfwd(lambda u: (judged(u * P),) * 2, has_aux=True))


def test_derivatives_through_a_run(forward):
    """Forward against central differences, reverse against forward by a random sum of all; each in parts of
    its own value, for one bound to suit all."""
    at, h = jnp.ones(4), 1e-4
    slopes, value = forward(at)
    assert np.all(value > 0)
    for i, d in enumerate(np.eye(4) * h):
        near, far = (forward(at + k * d)[1] - forward(at - k * d)[1] for k in (1, 2))
        central = (8 * near - far) / (12 * h)
        np.testing.assert_allclose(slopes[:, i] / value, central / value, rtol=1e-6, atol=2e-8)
    assert np.all(np.abs(slopes[:-2]).max(axis=1) > 1e-3 * value[:-2])  # none of them is deaf

    weights = jnp.asarray(np.random.default_rng(1).normal(size=value.size)) / value
    reverse = jax.jit(jax.grad(lambda u: weights @ judged(u * P)))(at)
    np.testing.assert_allclose(reverse, weights @ slopes, rtol=1e-8)


def test_a_batch_is_what_its_members_are(forward):
    several = jnp.array([[1.0] * 4, [1.3, 0.8, 1.2, 1.1]])
    batch = jax.jit(jax.vmap(lambda u: judged(u * P)))(several)
    for found, u in zip(batch, several):
        np.testing.assert_allclose(found, forward(u)[1], rtol=1e-7)


# Mass


def test_mass_of_a_machine(two_rotor):
    """The rotors', the housings', and pi/4 d² l rho of what the bearings take of the shafts."""
    machine = two_rotor()
    taken = (0.060 + 0.080 + 0.127 + 0.020) / 2
    shafts = 7850 * np.pi / 4 * 0.012**2 * taken
    assert float(total_mass(machine)) == pytest.approx(
        3.0935 + 6.0788 + 2 * 1.0 + shafts, rel=1e-12
    )
    e, gamma = 5e-4, np.deg2rad(1.0)  # about an axis that is neither central nor principal
    tilted = 0.01873 * np.cos(gamma) ** 2 + 0.01018 * np.sin(gamma) ** 2
    want = 0.00485 + 3.0935 * 1e-5**2 + tilted + 6.0788 * e**2 + shafts * 0.012**2 / 8
    assert float(polar_inertia(machine)) == pytest.approx(want, rel=1e-9)
    slope = jax.grad(lambda m: total_mass(machine.set({"main.mass": m})))(6.0788)
    assert float(slope) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("kind", [jr.FiniteElementShaft, jr.RigidElementShaft])
def test_mass_of_shafts_with_mass(kind):
    machine = jr.Machine.in_line(
        {
            "left": jr.SelfAligningBearing(1.5, 1e6, 100.0),
            "shaft": kind([0.3, 0.2], [0.03, 0.04], 0.01, elements=3),
            "node": jr.Node(),
            "more": kind(0.1, 0.02, elements=2),
            "body": jr.RigidBody(3.0, [0.01, 0.02, 0.025], [0.01, 0.0, 0.0]),
        },
        attachments={"flange": (jr.AddedInertia(0.7, 0.003, 0.002, 0.01), "node")},
        gravity=(0, -9.81, 0),
        fixed={"left": ("x", "y", "z")},
    )
    sections = [(0.3, 0.03, 0.01), (0.2, 0.04, 0.01), (0.1, 0.02, 0.0)]
    parts = [7850 * np.pi / 4 * (d**2 - i**2) * length for length, d, i in sections]
    polar = [m * (d**2 + i**2) / 8 for m, (_, d, i) in zip(parts, sections)]
    assert float(total_mass(machine)) == pytest.approx(sum(parts) + 1.5 + 3.0 + 0.7, rel=1e-12)
    want = sum(polar) + 0.025 + 3.0 * 0.01**2 + 0.003
    assert float(polar_inertia(machine)) == pytest.approx(want, rel=1e-12)
