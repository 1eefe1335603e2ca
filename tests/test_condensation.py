"""Component mode synthesis: what follows few stations, against all stations solved for."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_derivatives_agree

import jaxrotor as jr
from jaxrotor.machine.layout import count_of_free
from jaxrotor.plot.deflection import station_amplitudes
from jaxrotor.simulation.condensing import condensed_for

UP_TO = 800.0
STIFFNESS, DAMPING = [1e6, 2e6, 1e6, 0, 0, 0], [100, 100, 100, 0, 0, 0]


def shaft(elements, **more):
    given = dict(length=0.4, diameter=0.02, rayleigh=(1.0, 2e-5)) | more
    return jr.FiniteElementShaft(elements=elements, **given)


def rotor(damping="fixed", stiffness=STIFFNESS, finer=1):
    """A disc between two shafts of eight elements, one stepped; an overhang of seven that a drive turns. Of
    the stations inside, one holds a support."""
    own = dict(damping=damping) | (dict(rayleigh=(0.0, 1e-4)) if damping == "rotating" else {})
    return jr.Machine.in_line(
        {
            "left": jr.Node(),
            "shaft 1": shaft(8 * finer, **own),
            "disc": jr.Rotor(3.0, 0.02, 0.011, unbalance=jr.Unbalance(2e-4, 0.3)),
            "shaft 2": shaft(4 * finer, **own, diameter=[0.02, 0.03], length=[0.2, 0.2]),
            "right": jr.Node(),
            "shaft 3": shaft(7 * finer),
            "drive": jr.PrescribedSpin(jr.CosineRamp(speed=300.0, duration=0.1)),
        },
        attachments={
            "left bearing": (jr.LinearSupport(stiffness, DAMPING), "left"),
            "right bearing": (jr.LinearSupport(stiffness, DAMPING), "right"),
            "snubber": (jr.LinearSupport([1e4] * 2 + [0] * 4, [5.0] * 2 + [0] * 4), "shaft 3.1"),
        },
        gravity=(0.0, -9.81, 0.0),
    )


def geared():
    """Two shafts with a gear between; the second turns backwards, half again as fast."""
    k, c = [5e7, 5e7, 1e7, 0, 0, 0], [1e3, 1e3, 1e3, 0, 0, 0]
    rigid = dict(polar_inertia=0.002, transverse_inertia=0.001)
    return jr.Machine(
        {
            "drive": jr.PrescribedSpin(jr.ConstantSpeed(200.0)),
            "shaft a": shaft(9),
            "wheel": jr.Rotor(2.0, **rigid),
            "mesh": jr.GearMesh([0.09, 0.06], jr.elements.KelvinVoigt(1e8, 1e3)),
            "pinion": jr.Rotor(1.0, **rigid),
            "shaft b": shaft(8, damping="rotating"),
            "end": jr.Rotor(1.5, **rigid),
            "bearing a": jr.LinearSupport(k, c),
            "bearing b": jr.LinearSupport(k, c),
            "bearing c": jr.LinearSupport(k, c),
        },
        {
            "shaft a": ("drive", "wheel"),
            "mesh": ("wheel", "pinion"),
            "shaft b": ("pinion", "end"),
            "bearing a": "wheel",
            "bearing b": "pinion",
            "bearing c": "end",
        },
    )


def poles(machine, speed, below, at="equilibrium"):
    """Eigenvalues that oscillate below a frequency (rad/s), in the order of both parts."""
    found = np.asarray(jr.linearize(machine, speed, at).eigenvalues)
    found = found[(found.imag > 1.0) & (np.abs(found) < below)]
    return found[np.argsort(np.abs(found))]


@pytest.fixture(scope="module")
def pair():
    machine = rotor()
    return machine, machine.reduced(UP_TO)


def test_modes_are_met_to_the_estimate(pair):
    """At rest and at any speed of as many turns; in pairs that are nearly alike in both planes."""
    full, reduced = pair
    condensation = reduced.wiring.condensation
    assert 3 * count_of_free(reduced) < 2 * count_of_free(full)
    assert condensation.error < 1e-6
    for speed in (0.0, 300.0, 2 * np.pi * UP_TO):
        whole, few = (poles(m, speed, 2 * np.pi * UP_TO) for m in pair)
        assert len(whole) == len(few) >= 9
        off = np.abs(np.abs(few) / np.abs(whole) - 1)
        assert np.all(off < condensation.error + 1e-8)
        np.testing.assert_allclose(few.real, whole.real, rtol=2e-5)
    assert off.max() > 0.05 * condensation.error  # no less than a twentieth of what is told


def test_a_wider_tolerance_keeps_fewer(pair):
    full, reduced = pair
    coarse = full.reduced(UP_TO, tolerance=1e-3)
    assert 1e-6 < coarse.wiring.condensation.error < 1e-3
    assert count_of_free(coarse) < count_of_free(reduced)
    whole, few = (poles(m, 0.0, 2 * np.pi * UP_TO) for m in (full, coarse))
    off = np.abs(few) / np.abs(whole) - 1
    assert 0.1 < off.max() / coarse.wiring.condensation.error < 1.0


def test_statics_are_exact(pair):
    """The weight of all of the shaft; inside the shafts too, where some of a run are kept and where none is.
    (Their ends are held unlike each other.)"""
    full, reduced = pair
    none = full.reduced(20.0, tolerance=0.1)
    assert all(span.kept == () for span in none.wiring.condensation.spans)
    whole, *others = (np.asarray(jr.static_equilibrium(m).position) for m in (full, reduced, none))
    size = np.abs(whole).max(axis=0)
    assert size[1] > 1e-4 and size[3] > 1e-4
    for few in others:
        assert np.all(np.abs(few - whole) <= 1e-10 * size + 1e-16)


def test_damping_that_turns():
    """What it does to the poles of a straight shaft: one of them grows."""
    full = rotor("rotating", stiffness=[1e6, 1e6, 1e6, 0, 0, 0])
    reduced = full.reduced(UP_TO)
    whole, few = (poles(m, 900.0, 3000.0, "undeformed") for m in (full, reduced))
    assert whole.size > 4 and whole.real.max() > 0.0
    np.testing.assert_allclose(few, whole, rtol=1e-6)
    np.testing.assert_allclose(few.real, whole.real, rtol=2e-5)


def test_followers_in_linear_results(pair):
    """By name in a response to unbalance, and in the shape of a mode."""
    speeds = np.array([50.0, 110.0, 250.0])
    outputs = ["disc.x", "shaft 1.4.y", "shaft 3.3.x"]
    assert pair[1].wiring.stations.index("shaft 1.4") in pair[1].wiring.condensation.followers
    whole, few = (np.asarray(jr.unbalance_response(m, outputs, speeds).values) for m in pair)
    off, size = np.abs(few - whole), np.abs(whole)
    assert np.all(off < 1e-4 * size) and np.all(off < 1e-7 * size.max(axis=1, keepdims=True))
    shapes = []
    for machine in pair:
        model = jr.linearize(machine, 100.0)
        shapes.append(station_amplitudes(machine, model, np.asarray(model.mode_shapes[:, 0])))
    np.testing.assert_allclose(shapes[1], shapes[0], atol=1e-6)


def test_a_run_is_the_same(pair):
    """From rest through the first criticals, under the weight: coordinates, forces and torques of what is
    solved for and of what follows; and the books close, which elements keep by the motion of all stations."""
    full, reduced = pair
    simulation = jr.Simulation(0.12, 2000.0, tolerance=1e-6)
    whole, few = (jr.simulate(m, simulation) for m in (full, reduced))
    places = ("disc", "left", "shaft 1.4", "shaft 3.1", "shaft 3.3", "drive")
    for name in places:
        for what in ("position", "velocity"):
            a, b = (np.asarray(getattr(r[name], what)) for r in (whole, few))
            kinds = np.abs(np.stack([np.asarray(getattr(whole[n], what)) for n in places]))
            across = kinds[..., :2].max(), kinds[..., 3:5].max()
            assert np.abs(b - a)[:, :2].max() < 1e-5 * across[0], (name, what)
            assert np.abs(b - a)[:, 3:5].max() < 1e-5 * across[1], (name, what)
    for name, what in (
        ("drive", "reaction"),
        ("shaft 1.element 3", "torque"),
        ("shaft 2.element 2", "torque"),
        ("left bearing", "forces"),
        ("disc", "acceleration"),
    ):
        a, b = (np.asarray(getattr(r[name], what)) for r in (whole, few))
        assert np.abs(b - a).max() < 1e-5 * np.abs(a).max(), (name, what)
    audit = jr.energy_audit(reduced, simulation)
    assert audit.relative < 1e-7


def test_derivatives_pass_through():
    """Of a measure of a run's motion, that of a station that follows too: by a bearing's stiffness, a shaft's
    diameter, the disc's mass. Both planes are alike, so that modes come in equal pairs."""
    k, c = [1e6, 1e6, 1e6, 0, 0, 0], [1e2, 1e2, 1e2, 0, 0, 0]
    machine = jr.Machine(
        {
            "end": jr.Node(),
            "shaft": shaft(8),
            "disc": jr.Rotor(3.0, 0.02, 0.011, unbalance=jr.Unbalance(2e-4)),
            "bearing": jr.LinearSupport(k, c),
            "other": jr.LinearSupport(k, c),
        },
        {"shaft": ("end", "disc"), "bearing": "end", "other": "shaft.5"},
        prescribed={"disc": {"phi": jr.ConstantSpeed(250.0)}},
    ).reduced(500.0)
    followers = [machine.wiring.stations[k] for k in machine.wiring.condensation.followers]
    assert "shaft.4" in followers, followers
    paths = ("bearing.stiffness", "shaft.diameter", "disc.mass")
    base = [machine.get(path) for path in paths]

    def motion(x):
        changed = machine.set({path: b * x[i] for i, (path, b) in enumerate(zip(paths, base))})
        run = jr.simulate(changed, 0.03, 2000.0, initial="undeformed", step=2.5e-4)
        return 1e8 * jnp.mean(run["disc"].y ** 2 + run["shaft.4"].y ** 2)

    assert_derivatives_agree(motion, jnp.ones(3), rtol=1e-6, step=1e-4)


def test_behind_gears():
    """The second shaft turns backwards, and with it its damping."""
    full = geared()
    reduced = full.reduced(1000.0)
    assert len(reduced.wiring.condensation.followers) > 6
    whole, few = (poles(m, 200.0, 2 * np.pi * 1000.0) for m in (full, reduced))
    np.testing.assert_allclose(few, whole, rtol=1e-6)
    spins = jr.linearize(reduced, 200.0).state.velocity[:, 5]
    follower = reduced.wiring.condensation.followers[-1]
    assert reduced.wiring.stations[follower].startswith("shaft b")
    np.testing.assert_allclose(spins[follower], -300.0, rtol=1e-9)


def test_values_may_change_in_a_batch(pair):
    _, reduced = pair
    masses = jnp.array([2.0, 3.0, 4.0])

    def sag(mass):
        return jr.static_equilibrium(reduced.set({"disc.mass": mass})).position

    found = jax.jit(jax.vmap(sag))(masses)
    one = jr.static_equilibrium(pair[0].set({"disc.mass": 4.0})).position
    np.testing.assert_allclose(found[2], one, atol=1e-12, rtol=1e-8)


def test_it_is_told_and_written(pair, tmp_path):
    full, reduced = pair
    told = str(reduced)
    gone = len(reduced.wiring.condensation.followers)
    assert f"reduced: {gone} stations follow others" in told and "800 Hz" in told
    assert f"{count_of_free(reduced)} degrees of freedom" in told
    for machine in (reduced, full.full(), full):
        path = tmp_path / "machine.toml"
        path.write_text(machine.to_toml(), encoding="utf-8")
        read = jr.load(path, run=False).machine
        assert read.wiring.condensation == machine.wiring.condensation
    assert reduced.set({"disc.mass": 4.0}).wiring.condensation == reduced.wiring.condensation


def test_large_machines_are_reduced_unless_they_are_full(pair):
    large, run = rotor(finer=2), jr.Simulation(1.0, 1600.0)
    found = condensed_for(large, run)
    assert found.wiring.condensation.up_to == UP_TO
    assert 300.0 <= found.wiring.condensation.speed < 500.0  # what the drive reaches
    assert abs(count_of_free(found) - count_of_free(pair[1])) <= 12
    assert condensed_for(large.full(), run).wiring.condensation.spans == ()
    small = pair[0]
    assert condensed_for(small, run) is small
    assert condensed_for(found, jr.Simulation(1.0, 9000.0)) is found


def test_what_cannot_be_is_refused(pair, tmp_path):
    full, _ = pair
    with pytest.raises(jr.InputError, match="up_to must be positive and finite, but is -1 Hz"):
        full.reduced(-1.0)
    with pytest.raises(jr.InputError, match="tolerance must be .* below 1"):
        full.reduced(500.0, tolerance=2.0)
    with pytest.raises(jr.InputError, match="cannot be chosen inside jit"):
        jax.jit(lambda x: full.set({"disc.mass": x}).reduced(500.0).gravity)(3.0)
    # nothing to leave out: all stations are solved for
    few = jr.Machine.in_line(
        {"a": jr.Rotor(1.0, 0.01, 0.01), "s": jr.Shaft(0.3, 0.02), "b": jr.Rotor(1.0, 0.01, 0.01)}
    )
    assert few.reduced(500.0).wiring.condensation.spans == ()
    for text, said in (
        ("reduce = true", "reduce must say up to which frequency"),
        ("[machine.reduce]\nup_to = 500", "up_to must carry a unit"),
        ('[machine.reduce]\nup_to = "500 Hz"\ntolerence = 1e-6', "did you mean `tolerance`"),
        ('[machine.reduce]\nup_to = "-5 Hz"', "up_to must be positive and finite, but is -5 Hz"),
    ):
        body = jr.Machine(few.elements(), few.connections()).to_toml()
        path = tmp_path / "wrong.toml"
        table = text.startswith("[")
        path.write_text(
            f"{body}\n{text}\n" if table else body.replace("[machine]", f"[machine]\n{text}", 1)
        )
        with pytest.raises(jr.InputError, match=said):
            jr.load(path, run=False)


def test_linear_analysis_of_large_machines(pair):
    """Reduced by themselves as far as what is asked for needs; told over the machine's own coordinates, as
    the full one's, to some 1e-8."""
    large = rotor(finer=2)
    # to 300 rad/s as to 400: one reduced machine and its programs serve for most of this
    whole, speeds = large.full(), np.array([0.0, 60.0, 300.0])
    assert count_of_free(large) > 240

    few = jr.campbell(large, speeds, count=6, progress=False)
    all_ = jr.campbell(whole, speeds, count=6, progress=False)
    assert few.names == all_.names
    np.testing.assert_allclose(few.eigenvalues, all_.eigenvalues, rtol=1e-7)

    for asked in (dict(count=3), dict(speeds=(0.0, 400.0))):
        one, other = (np.asarray(jr.critical_speeds(m, **asked)) for m in (large, whole))
        assert one.size == other.size >= 3
        np.testing.assert_allclose(one, other, rtol=3e-8)
    one, other = (jr.critical_modes(m, speeds=(0.0, 400.0)) for m in (large, whole))
    assert [m.name for m in one] == [m.name for m in other]
    for mine, theirs in zip(one, other):
        # either plane's may be the largest; a frequency errs by the square of its shape
        share = np.vdot(theirs.shape, mine.shape) / np.vdot(theirs.shape, theirs.shape)
        np.testing.assert_allclose(mine.shape, share * theirs.shape, atol=1e-4)

    # pushed at a station that would follow others
    outputs = ["disc.x", "shaft 1.4.y", "left bearing.force.x"]
    one, other = (
        jr.frequency_response(m, "shaft 1.5.x", outputs, [40.0, 700.0], 210.0)
        for m in (large, whole)
    )
    off = np.abs(one.values - other.values).max(axis=1)
    assert np.all(off < 1e-6 * np.abs(other.values).max(axis=1))
    one, other = (jr.unbalance_response(m, outputs, speeds[1:]) for m in (large, whole))
    off = np.abs(one.values - other.values)
    assert np.all(off < 1e-6 * np.abs(other.values).max(axis=0))
