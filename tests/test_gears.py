"""Gear meshes and branches: TOR-01, TOR-02, ratios, forces, balances, derivatives."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import TIGHT, assert_derivatives_agree, at_instants, hertz

import jaxrotor as jr

TURNING_ONLY = ("x", "y", "z", "psi", "theta")


def turning(inertia):
    return jr.Rotor(1.0, inertia, inertia)


def torsion(stiffness):
    return jr.Coupling(stiffness=[0, 0, 0, 0, 0, stiffness])


def test_tor_01_five_disc_chain():
    """Friswell et al. 2010, Ex. 9.7.1; openTorsion tests. 0.005 Hz."""
    J = [0.0035, 0.0035, 0.0035, 0.15, 0.05]
    k = [12000.0, 12000.0, 14000.0, 10000.0]
    parts = {}
    for i, inertia in enumerate(J):
        parts[f"disc {i}"] = turning(inertia)
        if i < len(k):
            parts[f"shaft {i}"] = torsion(k[i])
    machine = jr.Machine.in_line(parts, fixed={f"disc {i}": TURNING_ONLY for i in range(5)})
    np.testing.assert_allclose(hertz(machine), [81.21, 141.21, 378.95, 536.36], atol=0.005)


def geared(ratio=1.0, mesh=1e12):
    """motor - A = B - rotor 2, and A - rotor 1; B turns `ratio` times as fast as A."""
    Jm, Jr, Jg = 0.0004, 0.0007, 2.5e-5
    names = ("motor", "A", "B", "rotor 1", "rotor 2")
    return jr.Machine(
        {
            "motor": turning(Jm),
            "shaft": torsion(1e4),
            "A": turning(Jg),
            "mesh": jr.GearMesh([0.05, 0.05 / ratio], jr.elements.KelvinVoigt(mesh)),
            "B": turning(Jg),
            "shaft 1": torsion(5e3),
            "rotor 1": turning(Jr),
            "shaft 2": torsion(5e3),
            "rotor 2": turning(Jr),
        },
        {
            "shaft": ("motor", "A"),
            "mesh": ("A", "B"),
            "shaft 1": ("A", "rotor 1"),
            "shaft 2": ("B", "rotor 2"),
        },
        fixed={name: TURNING_ONLY for name in names},
    )


def test_tor_02_geared_branches():
    """Friswell et al. 2010, ch. 9; openTorsion tests. 0.05 Hz, the mesh all but rigid."""
    np.testing.assert_allclose(hertz(geared())[:3], [425.4, 634.1, 3247.2], atol=0.05)


def test_another_ratio_reduces_inertia_and_stiffness_by_its_square():
    """What turns n times as fast counts n² times: against one line without gears."""
    n, Jm, Jr, Jg = 1.7, 0.0004, 0.0007, 2.5e-5
    J = np.diag([Jm, Jg + n**2 * Jg, Jr, n**2 * Jr])
    K = np.zeros((4, 4))
    for a, b, k in ((0, 1, 1e4), (1, 2, 5e3), (1, 3, n**2 * 5e3)):
        K[np.ix_([a, b], [a, b])] += k * np.array([[1, -1], [-1, 1]])
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(J, K)).real)[1:]
    expected = np.sqrt(squares) / (2 * np.pi)
    np.testing.assert_allclose(hertz(geared(n))[:3], expected, rtol=1e-4)


def pair(mesh=None, **options):
    """Driven pinion, helical mesh, wheel on a soft bearing, with a load on it."""
    mesh = jr.elements.KelvinVoigt(1e7, 500.0) if mesh is None else mesh
    support = jr.LinearSupport([1e7, 1e7, 1e7, 1e4, 1e4, 0], [200.0, 200.0, 200.0, 5.0, 5.0, 0])
    given = dict(orientation=0.7, helix_angle=0.2) | options
    return jr.Machine(
        {
            "drive": jr.PrescribedSpin(jr.CosineRamp(60.0, 0.1)),
            "shaft": jr.Shaft(0.1, 0.03, rayleigh=(0.0, 2e-5)),
            "pinion": jr.Rotor(2.0, 2e-3, 1.2e-3, unbalance=jr.Unbalance(5e-5)),
            "mesh": jr.GearMesh([0.05, 0.1], mesh, **given),
            "wheel": jr.Rotor(5.0, 2e-2, 1.1e-2),
            "bearing": support,
            "load": jr.Torque(jr.Step(0.12, 20.0)),
        },
        {
            "shaft": ("drive", "pinion"),
            "mesh": ("pinion", "wheel"),
            "bearing": "wheel",
            "load": "wheel",
        },
    )


@pytest.fixture(scope="module")
def run():
    machine = pair(error_amplitudes=[2e-6, 1e-6], error_phases=[0.3, -0.4])
    return jr.simulate(machine, 0.4, 2000.0, initial="undeformed")


def test_ratio_and_tooth_force(run):
    """The wheel turns backwards at half the speed; the teeth carry the load over its base radius."""
    last = slice(-400, None)
    assert float(jnp.mean(run["wheel"].speed[last])) == pytest.approx(-30.0, rel=1e-3)
    # 20 N·m in the sense of +phi speeds up a wheel that turns backwards: it brakes the pair
    base = 0.1 * np.cos(np.deg2rad(20)) * np.cos(0.2)
    assert float(jnp.mean(run["mesh"].tooth_force[last])) == pytest.approx(20 / base, rel=5e-3)
    torque = float(jnp.mean(run["drive"].reaction[last, 5]))
    assert torque == pytest.approx(20 / 2, rel=5e-3)


def test_forces_of_a_mesh_at_one_instant():
    """By the vectors of the pair: flank normal, arms, virtual work; error and its torque on phi."""
    machine = pair(
        error_amplitudes=[2e-6],
        error_phases=[0.3],
        teeth=24.0,
        stiffness_amplitudes=[0.2, 0.1],
        stiffness_phases=[0.5, 1.0],
    )
    rng = np.random.default_rng(5)
    q, v = rng.normal(size=(2, 3, 6)) * 1e-5
    names = machine.wiring.stations
    a, b = names.index("pinion"), names.index("wheel")
    q[a, 5], v[a, 5] = 0.4, 50.0
    q[b, 5] = -0.2 + 1e-4
    out = np.array([np.cos(0.7), np.sin(0.7), 0])
    across = np.array([-out[1], out[0], 0])
    alpha = np.deg2rad(20)
    n = np.cos(0.2) * (np.cos(alpha) * across + np.sin(alpha) * out) + np.sin(0.2) * np.eye(3)[2]
    moved = q[a, :3] + np.cross(q[a, 3:], 0.05 * out) - q[b, :3] - np.cross(q[b, 3:], -0.1 * out)
    rate = v[a, :3] + np.cross(v[a, 3:], 0.05 * out) - v[b, :3] - np.cross(v[b, 3:], -0.1 * out)
    error = 2e-6 * np.cos(24 * 0.4 + 0.3)
    slope = -24 * 2e-6 * np.sin(24 * 0.4 + 0.3)
    delta, delta_t = n @ moved - error, n @ rate - slope * 50.0
    share = 1 + 0.2 * np.cos(24 * 0.4 + 0.5) + 0.1 * np.cos(48 * 0.4 + 1.0)
    steep = -24 * 0.2 * np.sin(24 * 0.4 + 0.5) - 48 * 0.1 * np.sin(48 * 0.4 + 1.0)
    force = share * (1e7 * delta + 500.0 * delta_t)
    on_a = -force * np.concatenate([n, np.cross(0.05 * out, n)])
    on_a[5] += force * slope - 0.5 * 1e7 * delta**2 * steep
    on_b = force * np.concatenate([n, np.cross(-0.1 * out, n)])
    # the mesh turns by chi: that is what was given above
    phi, rate = q[:, 5] - q[:, 3] * q[:, 4] / 2, v[:, 3] * q[:, 4] + q[:, 3] * v[:, 4]
    q, v = np.c_[q[:, :5], phi], np.c_[v[:, :5], v[:, 5] - rate / 2]
    found = at_instants(machine, q, v)["mesh"]
    np.testing.assert_allclose(found.forces[0], [on_a, on_b], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.tooth_force, [force], rtol=1e-9)
    np.testing.assert_allclose(found.deflection, [delta], rtol=1e-9)


@pytest.mark.parametrize(
    "mesh, error",
    [
        (
            jr.elements.KelvinVoigt(1e7, 500.0),
            dict(
                error_amplitudes=[2e-6],
                error_phases=[0.3],
                stiffness_amplitudes=[0.2, 0.1],
                stiffness_phases=[0.0, 0.7],
            ),
        ),
        (jr.elements.Backlash(gap=1e-4, stiffness=1e7, damping=500.0), {}),
    ],
    ids=["transmission error and stiffness that varies", "backlash"],
)
def test_balance(mesh, error):
    """The error turns with the pinion and acts back on it; a loose pair rattles by Kvaerno5."""
    audit = jr.energy_audit(pair(mesh, **error), 0.16, 2000.0, initial="undeformed")
    assert float(audit.relative) < 1e-6
    assert float(audit.lost[-1]) > 1e-4 * float(audit.exchanged)


def test_a_loose_pair_carries_no_force_within_its_play():
    machine = pair(jr.elements.Backlash(gap=2e-4, stiffness=1e7))
    q = np.zeros((3, 6))
    b = machine.wiring.stations.index("wheel")
    base = 0.1 * np.cos(np.deg2rad(20)) * np.cos(0.2)
    for deflection, force in ((0.9e-4, 0.0), (1.5e-4, 500.0), (-1.5e-4, -500.0)):
        q[b, 5] = deflection / base
        found = at_instants(machine, q, 0 * q)["mesh"].tooth_force[0]
        assert float(found) == pytest.approx(force, abs=1e-6)


def test_derivatives():
    """Of the forces on both gears by every parameter: forward, reverse, differences."""
    q = jnp.array([1e-5, -2e-5, 3e-6, 1e-4, -2e-4, 0.4, 2e-5, 1e-5, 0, 2e-4, 1e-4, -0.2])
    v = jnp.array([1e-3, 2e-3, 0, 0.01, 0.02, 50.0, 0, 1e-3, 0, 0.01, 0, -25.0])
    motions = ((q[:6], v[:6]), (q[6:], v[6:]))

    def forces(x):
        gear = jr.GearMesh(
            x[:2],
            jr.elements.KelvinVoigt(x[2], x[3]),
            *x[4:8],
            x[8:10],
            x[10:12],
            x[12:14],
            x[14:16],
        )
        on = gear.forces(jnp.zeros(()), motions, jnp.zeros(0))
        books = gear.energy(0.0, motions, None), gear.power_lost(0.0, motions, None)
        return jnp.concatenate([*on, jnp.stack(books)])

    x = [0.05, 0.1, 1e7, 500.0, 0.35, 0.2, 0.7, 24.0, 2e-6, 1e-6, 0.3, -0.4, 0.2, 0.1, 0.5, -0.7]
    assert_derivatives_agree(forces, x, rtol=1e-6, step=1e-5)


def test_a_free_pair_keeps_its_momenta():
    """Two free gears in mesh, one spinning: the teeth's impulse leaves J_a w_a/r_a - J_b w_b/r_b."""
    machine = jr.Machine(
        {
            "a": turning(0.02),
            "mesh": jr.GearMesh([0.05, 0.1], jr.elements.KelvinVoigt(1e5, 200.0)),
            "b": turning(0.1),
        },
        {"mesh": ("a", "b")},
        fixed={"a": TURNING_ONLY, "b": TURNING_ONLY},
    )
    v = np.zeros((2, 6))
    v[0, 5] = 10.0
    end = jr.simulate(machine, 0.3, 1000.0, jr.State(np.zeros((2, 6)), v), **TIGHT)
    kept = 0.02 * end["a"].speed / 0.05 - 0.1 * end["b"].speed / 0.1
    np.testing.assert_allclose(kept, 0.02 * 10.0 / 0.05, rtol=1e-10)
    assert float(jnp.ptp(end["b"].speed)) > 1.0


def lin_and_parker(planets):
    """Natural frequencies, Hz, of their planetary gear by the stretches of its springs: coordinates x, y,
    u = r phi of carrier, ring and sun, and along each planet's radius, across it and u, all in m."""
    n, alpha = 9 + 3 * planets, np.deg2rad(24.6)
    M, K = np.tile([0.66, 0.66, 0.61], 3 + planets), np.zeros((n, n))
    M[:9] = [5.43, 5.43, 6.29, 2.35, 2.35, 3.0, 0.4, 0.4, 0.39]
    for i in (0, 1, 3, 4, 6, 7):
        K[i, i] = 1e8
    K[5, 5] = 1e9
    for p in range(planets):
        psi, own = 2 * np.pi * p / planets, slice(9 + 3 * p, 12 + 3 * p)
        sun, ring, along, across = np.zeros((4, n))
        sun[6:9] = -np.sin(psi - alpha), np.cos(psi - alpha), 1
        sun[own] = -np.sin(alpha), -np.cos(alpha), 1
        ring[3:6] = -np.sin(psi + alpha), np.cos(psi + alpha), 1
        ring[own] = np.sin(alpha), -np.cos(alpha), -1
        along[:2], along[own] = (np.cos(psi), np.sin(psi)), (-1, 0, 0)
        across[:3], across[own] = (-np.sin(psi), np.cos(psi), 1), (0, -1, 0)
        for k, row in ((5e8, sun), (5e8, ring), (1e8, along), (1e8, across)):
            K += k * np.outer(row, row)
    return np.sqrt(np.abs(np.linalg.eigvalsh(K / np.sqrt(np.outer(M, M))))) / (2 * np.pi)


@pytest.mark.parametrize("planets", [3, 4])
def test_rings_with_teeth_inside_against_planetary_gears(planets):
    """Lin & Parker, J. Vib. Acoust. 121 (1999) 316: sun, ring, carrier and planets on springs, seen from the
    carrier, gyroscopic moments left out; their equations and figures. The meshes' stiffness is that of
    `GearMesh.forces`; what holds the parts is written here."""
    alpha, count = np.deg2rad(24.6), 3 + planets
    sun, ring, carrier = range(3)
    mass = {sun: (0.4, 0.39), ring: (2.35, 3.0), carrier: (5.43, 6.29)}  # kg: m, J/r²
    base = {sun: 77.42e-3 / 2, ring: 275.03e-3 / 2, carrier: 176.8e-3 / 2}
    pitch = {k: r / np.cos(alpha) for k, r in base.items()}
    planet = 100.35e-3 / 2 / np.cos(alpha)
    M, K = np.zeros((2, 3 * count, 3 * count))  # x, y, phi of each
    for k in range(count):
        m, i = mass.get(k, (0.66, 0.61))
        r = base.get(k, 100.35e-3 / 2)
        M[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = np.diag([m, m, i * r**2])
        if k in mass:
            K[3 * k, 3 * k] = K[3 * k + 1, 3 * k + 1] = 1e8
    K[3 * ring + 2, 3 * ring + 2] = 1e9 * base[ring] ** 2

    def add(matrix, a, b):
        rows = [3 * a + i for i in range(3)] + [3 * b + i for i in range(3)]
        K[np.ix_(rows, rows)] += matrix

    law = jr.elements.KelvinVoigt(5e8)
    turned = np.array([0, 1, 5, 6, 7, 11])

    @eqx.filter_jit
    def stiffness(mesh):
        def force(q):
            still = jnp.zeros(6)
            return -jnp.concatenate(mesh.forces(0.0, ((q[:6], still), (q[6:], still)), None))

        return jax.jacfwd(force)(jnp.zeros(12))[turned][:, turned]

    for p in range(planets):
        angle, k = 2 * np.pi * p / planets, 3 + p
        # the sun drives the planet, which turns with -phi and drives the ring by the flanks of that sense
        add(stiffness(jr.GearMesh([pitch[sun], planet], law, alpha, 0.0, angle)), sun, k)
        add(stiffness(jr.GearMesh([planet, -pitch[ring]], law, -alpha, 0.0, angle)), k, ring)
        pin = np.array([[1, 0, -base[carrier] * np.sin(angle), -1, 0, 0],
                        [0, 1, base[carrier] * np.cos(angle), 0, -1, 0]])  # fmt: skip
        add(1e8 * pin.T @ pin, carrier, k)
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    found = np.sqrt(np.abs(squares)) / (2 * np.pi)
    np.testing.assert_allclose(found[1:], lin_and_parker(planets)[1:], rtol=1e-7)
    assert found[0] < 0.1  # all turning together


@pytest.mark.parametrize(
    "options, sentence",
    [
        (dict(radii=[-0.05, 0.1]), "`g`: radii must be positive, or that of gear b negative"),
        (dict(radii=[0.1, -0.05]), "`g`: radii must be positive, or that of gear b negative"),
        (
            dict(pressure_angle=20.0),
            "`g`: pressure_angle must be below a right angle, but is 20 rad",
        ),
        (
            dict(error_amplitudes=[1e-6]),
            "`g`: error_amplitudes and error_phases must be equally long",
        ),
        (
            dict(stiffness_amplitudes=[1.1], stiffness_phases=[0.0]),
            "`g`: stiffness_amplitudes must leave the teeth some stiffness",
        ),
    ],
)
def test_bad_gears(options, sentence):
    given = dict(radii=[0.05, 0.1], mesh=jr.elements.KelvinVoigt(1e7)) | options
    with pytest.raises(jr.InputError, match=sentence):
        jr.Machine(
            {"a": turning(1.0), "g": jr.GearMesh(**given), "b": turning(1.0)}, {"g": ("a", "b")}
        )
