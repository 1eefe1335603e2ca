"""Planetary gears: natural frequencies, ratios, torques, power, phasing, derivatives."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree

import jaxrotor as jr
from jaxrotor.elements import KelvinVoigt, Maxwell, Parallel, PlanetaryGear, ToothMesh
from jaxrotor.machine.field import jacobian
from jaxrotor.machine.system import assemble

TURNING_ONLY = ("x", "y", "z", "psi", "theta")
TEETH, RADIUS, PLANET = (24, 36, 96), 0.03, 1.5e-3
SUN, CARRIER, RING = 6e-4, 0.05, 0.06  # kg·m²


def around(count):
    return 2 * np.pi * np.arange(count) / count


def planetary(positions, sun=None, ring=None):
    sun = ToothMesh(KelvinVoigt(5e8)) if sun is None else sun
    ring = ToothMesh(KelvinVoigt(7e8)) if ring is None else ring
    return PlanetaryGear(TEETH, RADIUS, PLANET, sun, ring, positions)


def stage(gear, held="", turned=None):
    """Sun, carrier and ring, of which one may be held."""
    stations = {"sun": SUN, "carrier": CARRIER, "ring": RING}
    parts: dict = {name: jr.Rotor(1.0, J, J) for name, J in stations.items()} | {"set": gear}
    fixed = {n: TURNING_ONLY + ("phi",) * (n == held) for n in stations}
    places = {"set": ("sun", "carrier", "ring")}
    return jr.Machine(parts, places, fixed=fixed, prescribed=turned)


def test_natural_frequencies():
    """Kahraman (1994), free, in his coordinates u = r phi: springs with the pressure angle, carrier at the
    pins' circle. All but three of the planets' modes in closed form."""
    count, ks, kr, alpha = 4, 5e8, 7e8, np.deg2rad(20)
    base = RADIUS * np.array(TEETH) / TEETH[0]
    pins = (base[0] + base[1]) / np.cos(alpha)
    radii = np.array([base[0], pins, base[2], *[base[1]] * count])
    M = np.diag(np.array([SUN, CARRIER, RING, *[PLANET] * count]) / radii**2)
    K, c = np.zeros((3 + count, 3 + count)), np.cos(alpha)
    K[0, 0], K[2, 2], K[1, 1] = count * ks, count * kr, count * (ks + kr) * c**2
    K[0, 1] = K[1, 0] = -count * ks * c
    K[1, 2] = K[2, 1] = -count * kr * c
    for p in range(3, 3 + count):
        K[p, p] = ks + kr
        K[0, p] = K[p, 0] = ks
        K[2, p] = K[p, 2] = -kr
        K[1, p] = K[p, 1] = (kr - ks) * c
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)[2:]  # two turn freely
    jac = eqx.filter_jit(lambda m: jacobian(assemble(m), jnp.zeros(())))
    roots = np.linalg.eigvals(np.asarray(jac(stage(planetary(around(count))))))
    found = np.sort(roots.imag[roots.imag > 10.0])
    np.testing.assert_allclose(found, np.sqrt(squares), rtol=1e-7)
    own = base[1] * np.sqrt((ks + kr) / PLANET)
    assert np.sum(np.abs(found / own - 1) < 1e-7) == count - 1


@pytest.mark.parametrize(
    "held, turned, expected",
    [
        ("ring", "sun", (1, 24 / 120, 0)),
        ("carrier", "sun", (1, 0, -24 / 96)),
        ("sun", "carrier", (0, 1, 120 / 96)),
        ("", "sun", (1, 24 / 120, 0)),
    ],
)
def test_ratios(held, turned, expected):
    """Willis: z_s (w_s - w_c) + z_r (w_r - w_c) = 0; a ring of which nothing is known is taken to stand."""
    drive = {turned: {"phi": jr.ConstantSpeed(10.0)}}
    machine = stage(planetary(around(3)), held, drive)
    np.testing.assert_allclose(assemble(machine).turns(), expected, atol=1e-15)


def test_tooth_frequency():
    """Of a ring that stands: its teeth times the carrier's turns, here as an order of the sun's."""
    drive = {"sun": {"phi": jr.ConstantSpeed(10.0)}}
    machine = stage(planetary(around(3)), "ring", drive)
    one = jr.standards.torsional_excitations(machine)[-1]
    assert (one.name, one.shaft) == ("set teeth", "sun")
    assert one.order == pytest.approx(96 * 24 / 120)


@pytest.fixture(scope="module")
def study(request):
    return jr.load(request.config.rootpath / "configs/planetary_reducer.toml")


def test_a_reducer_and_its_torques(study):
    """Sun 100, carrier 20, fan -10 rad/s; its 400 N·m shared as the teeth have it; the housing bears 160."""
    run = study.run(progress=False)
    last = run.t > run.t[-1] - 20 * 2 * np.pi / (24 * 80)  # tooth meshes, whole

    def mean(x):
        return np.mean(np.asarray(x)[np.asarray(last)], axis=0)

    assert mean(run["carrier"].speed) == pytest.approx(20.0, rel=1e-3)
    assert mean(run["fan"].speed) == pytest.approx(-10.0, rel=1e-3)
    # against the carrier planets turn z_s/z_p of the sun's way back
    np.testing.assert_allclose(mean(run["planets"].planet_speeds), 20 - 80 * 24 / 36, rtol=1e-3)
    assert mean(run["fan shaft"].torque) == pytest.approx(400.0, rel=2e-3)
    assert mean(run["drive"].reaction)[5] == pytest.approx(40.0, rel=2e-3)
    assert mean(run["ring"].reaction)[5] == pytest.approx(160.0, rel=2e-3)
    for forces in (run["planets"].sun_tooth_forces, run["planets"].ring_tooth_forces):
        np.testing.assert_allclose(mean(forces), 40.0 / 3 / 28.19e-3, rtol=2e-3)


def test_balance(study):
    s = study.settings
    audit = jr.energy_audit(study.machine, 0.1, s.sample_rate, s.initial, step=4e-6)
    assert float(audit.relative) < 1e-8
    assert float(audit.lost[-1]) > 1e-3 * float(audit.exchanged)


MOTIONS = tuple(
    (jnp.zeros(6).at[5].set(q), jnp.zeros(6).at[5].set(v))
    for q, v in ((0.7, 100.0), (0.14, 21.0), (-1e-3, 0.3))
)
FASTER = tuple(jnp.zeros(6).at[5].set(a) for a in (300.0, -40.0, 70.0))


def given(x):
    """A gear by all its numbers, and its states, of which a law has some."""

    def mesh(x):
        law = Parallel([KelvinVoigt(x[0], x[1]), Maxwell(x[2], x[3])])
        return ToothMesh(law, x[4:6], x[6:8], x[8:10], x[10:12])

    gear = PlanetaryGear(x[:3], x[3], x[4], mesh(x[5:17]), mesh(x[17:29]), x[29:32])
    return gear, jnp.concatenate([x[32:35], x[35:38], x[38:41], x[41:44]])


TEETHS = [1.0, 1e-2, 0.4, 1e-3, 2.0, 1.0, 0.3, -0.4, 0.2, 0.1, 0.5, -0.7]
NUMBERS = np.array(
    [*TEETH, RADIUS, PLANET, *TEETHS, *np.array(TEETHS)[::-1] + 0.2, 0.1, 2.2, 4.3]
    + [0.03, 0.02, -0.01, 1.0, -2.0, 0.5, 0.01, 0.02, 0.03, 0.03, 0.02, 0.01]
)
# teeth of 1 N/m and errors of metres: so every part of the energy is of the others' size


def test_power_at_one_instant():
    """What the stations lose to the gear is stored there or lost; no moment comes from nowhere."""
    gear, state = given(jnp.asarray(NUMBERS))
    t, time = jnp.zeros(()), jnp.ones(())
    on = gear.forces(t, MOTIONS, state)
    rates = gear.rates(t, MOTIONS, FASTER, state)

    def later(h):
        moved = tuple((q + h * v, v + h * a) for (q, v), a in zip(MOTIONS, FASTER))
        return gear.energy(t, moved, state + h * rates), gear.planet_speeds(
            t, moved, state + h * rates
        )

    (_, _), (stored, spun) = jax.jvp(later, (t,), (time,))
    lost = gear.power_lost(t, MOTIONS, state)
    given_ = -sum(Q @ v for Q, (_, v) in zip(on, MOTIONS))
    np.testing.assert_allclose(given_, stored + lost, rtol=1e-12)
    assert abs(float(lost)) > 1e-3 * abs(float(stored)) > 0.0
    np.testing.assert_allclose(sum(Q[5] for Q in on), -PLANET * jnp.sum(spun), rtol=1e-12)


def test_derivatives():
    """Of forces, rates and accounts by every parameter and state: forward, reverse, differences."""

    def everything(x):
        gear, state = given(x)
        on = gear.forces(0.0, MOTIONS, state)
        rates = gear.rates(0.0, MOTIONS, FASTER, state)
        books = gear.energy(0.0, MOTIONS, state), gear.power_lost(0.0, MOTIONS, state)
        return jnp.concatenate([jnp.stack([Q[5] for Q in on]), rates, jnp.stack(books)])

    assert_derivatives_agree(everything, NUMBERS, rtol=1e-6, step=1e-5)


@pytest.mark.parametrize("count, together", [(3, True), (5, False)])
def test_phasing(count, together):
    """Parker & Lin (2004): harmonics that are no multiple of the planets' number cancel where the sun's teeth
    over that number leave a rest (24 over 5), and add up where none is left (24 over 3)."""
    vary = dict(stiffness_amplitudes=[0.1], stiffness_phases=[0.2])
    gear = planetary(around(count), *[ToothMesh(KelvinVoigt(5e8), **vary) for _ in "sr"])
    state = jnp.zeros(2 * count).at[:count].set(1e-6)

    def torque(angle):
        """What the teeth do to the sun, pressed alike: without the stiffness's own."""
        turned = tuple(jnp.zeros(6).at[5].set(x) for x in (angle, 0.0, 0.0))
        return jnp.sum(gear.sun_tooth_forces(0.0, tuple((q, 0 * q) for q in turned), state))

    found = np.asarray(jax.vmap(torque)(jnp.linspace(0.0, 2 * np.pi / 24, 16, endpoint=False)))
    mean = count * 5e8 * 1e-6
    waves = np.cos(np.linspace(0.0, 2 * np.pi, 16, endpoint=False) + 0.2)
    np.testing.assert_allclose(found, mean * (1 + 0.1 * together * waves), rtol=1e-12)


@pytest.mark.parametrize(
    "options, sentence",
    [
        (dict(teeth=[24, 36, 90]), "`set`: teeth must fill the ring"),
        (dict(positions=[0.0, 2.0]), "`set`: positions must be where the teeth fit, but planet 1"),
        (dict(positions=[]), "`set`: positions must tell one planet at least"),
        (
            dict(ring_mesh=ToothMesh(KelvinVoigt(1e8), error_amplitudes=[1e-6])),
            "`set`: error_amplitudes and error_phases must be equally long",
        ),
    ],
)
def test_bad_planets(options, sentence):
    mesh = ToothMesh(KelvinVoigt(1e8))
    usual = dict(
        teeth=TEETH, sun_radius=RADIUS, planet_inertia=PLANET, sun_mesh=mesh, ring_mesh=mesh
    )
    with pytest.raises(jr.InputError, match=sentence):
        stage(PlanetaryGear(**usual | options))
