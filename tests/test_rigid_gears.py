"""Rigid gears: TOR-02, what is seen through a ratio, balance, statics, derivatives."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree, hertz

import jaxrotor as jr
from jaxrotor.elements import RigidGears
from jaxrotor.linear.shafts import shafts_of
from jaxrotor.machine.field import vector_field
from jaxrotor.machine.system import assemble

TURNING_ONLY = ("x", "y", "z", "psi", "theta")


def turning(inertia):
    return jr.Rotor(1.0, inertia, inertia)


def torsion(stiffness, damping=0.0):
    return jr.Coupling(stiffness=[0, 0, 0, 0, 0, stiffness], damping=[0, 0, 0, 0, 0, damping])


Jm, Jr, Jg = 0.0004, 0.0007, 2.5e-5


def branched(n):
    """motor - A = B - rotor 2, and A - rotor 1; B turns n times as fast as A, the other way round."""
    return jr.Machine(
        {
            "motor": turning(Jm),
            "shaft": torsion(1e4),
            "gears": RigidGears([n, 1.0], [Jg, Jg]),
            "shaft 1": torsion(5e3),
            "rotor 1": turning(Jr),
            "shaft 2": torsion(5e3),
            "rotor 2": turning(Jr),
        },
        {
            "shaft": ("motor", "gears"),
            "shaft 1": ("gears", "rotor 1"),
            "shaft 2": ("gears.b", "rotor 2"),
        },
        fixed={name: TURNING_ONLY for name in ("motor", "rotor 1", "rotor 2")},
    )


def test_tor_02_geared_branches():
    """Friswell et al. 2010, ch. 9; openTorsion tests. Four degrees of freedom, none of them the mesh's."""
    np.testing.assert_allclose(hertz(branched(1.0)), [425.4, 634.1, 3247.2], atol=0.05)


def test_what_is_behind_gears_counts_by_the_square_of_the_ratio():
    n = 1.7
    J = np.diag([Jm, Jg + n**2 * Jg, Jr, n**2 * Jr])
    K = np.zeros((4, 4))
    for a, b, k in ((0, 1, 1e4), (1, 2, 5e3), (1, 3, n**2 * 5e3)):
        K[np.ix_([a, b], [a, b])] += k * np.array([[1, -1], [-1, 1]])
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(J, K)).real)[1:]
    np.testing.assert_allclose(hertz(branched(n)), np.sqrt(squares) / (2 * np.pi), rtol=1e-9)


def test_shafts_and_speeds():
    machine = branched(1.7)
    assert shafts_of(machine) == (("motor", "gears", "rotor 1"), ("rotor 2",))
    np.testing.assert_allclose(assemble(machine).turns(), [1, 1, 1, -1.7])
    ring = eqx.tree_at(lambda m: m["gears"].radii, machine, jnp.array([0.1, -0.4]))
    np.testing.assert_allclose(assemble(ring).turns(), [1, 1, 1, 0.25])
    found = [e.name for e in jr.standards.torsional_excitations(machine, orders=(1.0,))]
    assert found == ["motor 1x", "rotor 2 1x"]


def driven(n, geared, shaft=None):
    """Drive, gears, shaft and fan in a line; not `geared`: one shaft, all seen through the gears."""
    square = 1.0 if geared else n**2
    both = 0.02 + n**2 * 0.01
    return jr.Machine.in_line(
        {
            "drive": jr.PrescribedSpin(jr.CosineRamp(60.0, 0.1)),
            "coupling": torsion(2e3, 0.5),
            "gears": RigidGears([n, 1.0], [0.02, 0.01]) if geared else turning(both),
            "shaft": torsion(4e3 * square, 0.2 * square) if shaft is None else shaft(square),
            "fan": turning(0.05 * square),
        },
        {"air": (jr.FanLoad(2e-4 * square * (1.0 if geared else n)), "fan")},
        fixed={"fan": TURNING_ONLY} | ({} if geared else {"gears": TURNING_ONLY}),
    )


def heavy(square):
    """With mass, which couples the accelerations of what it joins."""
    return jr.FiniteElementShaft(
        0.5, 0.04, elements=1, material=jr.Material(2.1e11 * square, 8e10 * square, 7850.0 * square)
    )


@pytest.mark.parametrize("shaft", [None, heavy], ids=["coupling", "shaft with mass"])
def test_accelerations_are_those_of_one_line(shaft):
    """At any state, turning or not: the fan's are `ratio` times those of the line that gears are left out
    of."""
    n, rng = 2.5, np.random.default_rng(3)
    u, s = rng.normal(size=(2, 2)) * np.array(
        [[1e-3], [1.0]]
    )  # of gears and fan, seen at the gears
    scale = np.array([1.0, -n])
    found = []
    for geared in (True, False):
        system = assemble(driven(n, geared, shaft))
        scaled = scale if geared else 1.0
        y = np.concatenate([u * scaled, s * scaled])
        rates = eqx.filter_jit(vector_field)(jnp.asarray(0.06), jnp.asarray(y), system)
        found.append(np.asarray(rates).reshape(2, 2) / scaled)
    np.testing.assert_allclose(*found, rtol=1e-9)
    assert np.abs(found[0][1]).min() > 1.0


def test_balance_of_a_run():
    audit = jr.energy_audit(driven(2.5, True), 0.3, 2000.0, initial="undeformed")
    assert float(audit.relative) < 1e-9
    assert float(audit.lost[-1]) > 1e-3 * float(audit.exchanged)
    # all that turns: gears at 60 rad/s, gear b and fan 2.5 times as fast
    turns = 0.5 * (0.02 * 60.0**2 + (0.01 + 0.05) * 150.0**2)
    assert float(audit.kinetic[-1]) == pytest.approx(turns, rel=0.02)


def test_statics():
    """30 N·m on the fan twist its own shaft, and 2.5 times as many the coupling, against them."""
    machine = driven(2.5, True)
    load = jr.Machine(
        machine.elements() | {"load": jr.Torque(30.0)},
        machine.connections() | {"load": "fan"},
        fixed=machine.fixed(),
    )
    q = np.asarray(jr.static_equilibrium(load).position)[:, 5]
    np.testing.assert_allclose(q[1], -2.5 * 30.0 / 2e3, rtol=1e-9)
    np.testing.assert_allclose(q[2], -2.5 * q[1] + 30.0 / 4e3, rtol=1e-9)


def test_derivatives():
    def what(x):
        gears = RigidGears(x[:2], x[2:4])
        a = gears.acceleration(x[4:10], x[10:16], x[16:22])
        more = gears.kinetic_energy(x[4:10], x[10:16]), gears.ratio()
        return jnp.concatenate([a, gears.shift("b", x[4:10]), jnp.stack(more)])

    rng = np.random.default_rng(1)
    assert_derivatives_agree(what, np.r_[0.05, 0.02, 1e-3, 2e-4, rng.normal(size=18)], rtol=1e-6)


@pytest.mark.parametrize(
    "make, sentence",
    [
        (lambda: RigidGears([0.1, 0.0], [1.0, 1.0]), "`gears`: radii must be positive, or that of"),
        (lambda: RigidGears([0.1, 0.1], [0.0, 0.0]), "`gears`: inertias must be positive for one"),
    ],
)
def test_bad_gears(make, sentence):
    with pytest.raises(jr.InputError, match=sentence):
        jr.Machine(
            {"gears": make(), "rotor": turning(1.0), "s": torsion(1.0)}, {"s": ("gears", "rotor")}
        )


def test_they_turn_alone():
    with pytest.raises(jr.InputError, match="`gears`: turns alone, a RigidGears: prescribe no"):
        jr.Machine(
            {"gears": RigidGears([1.0, 2.0], [1.0, 1.0])},
            {},
            prescribed={"gears": {"x": jr.ConstantSpeed(0.0)}},
        )
