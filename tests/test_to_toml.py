"""`machine.to_toml()`: every kind of part, its values to the last bit, reads back equal."""

import tomllib

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import right_calls

import jaxrotor as jr
from jaxrotor.commands.save_study import save_study
from jaxrotor.study.kinds import public_kinds

el = jr.elements
BASES = (
    jr.AbstractInertia, jr.protocols.AbstractPrescribed, jr.AbstractConnector, jr.AbstractAttachment,
    jr.profiles.AbstractSchedule, jr.profiles.AbstractMotion, el.AbstractLaw, el.AbstractShaftDefect,
    el.AbstractController, el.AbstractFeedback, el.AbstractRaceDefect,
)  # fmt: skip
# No decimal fraction: what is rounded in writing would show.
ODD = 1 + 1e-9 / 3


def read_back(machine, folder):
    path = folder / "kept.toml"
    path.write_text(machine.to_toml(), encoding="utf-8")
    return jr.load(path, run=False).machine


def assert_equal(a, b):
    """Names, kinds, options and joints; every leaf to the last bit."""
    assert jax.tree.structure(a) == jax.tree.structure(b)
    for path, value in a.parameters().items():
        np.testing.assert_array_equal(np.asarray(value), np.asarray(b.get(path)), err_msg=path)


def every_part(monkeypatch):
    """Elements with every kind of part that a study knows, by where they stand."""
    monkeypatch.setattr(right_calls, "line", lambda **stands: stands)
    parts = public_kinds(object)
    found = [make(parts[kind](*given)) for kind, (make, given) in right_calls.PARTS.items()]
    law = el.KelvinVoigt(1e5, 3.0)
    step, nine = jr.Step(0.1, 1.0, 0.5), np.arange(9.0)
    flaws = (el.Bow(1e-4, 0.4), el.Crack(0.2))
    neural = el.NeuralController.start((1e-3, 2.0), 5.0, jax.random.PRNGKey(1), width=3)
    loop = dict(at=("main", "end"))
    found += [
        dict(main=jr.Rotor(6.0, 0.02, 0.01, jr.Unbalance(1e-5, 1.0, 0.01, 2.0), angle=0.3, ends=(0.1, 0.2))),
        dict(main=jr.Node()),
        dict(section=jr.Coupling(misalignment=jr.Misalignment(1e-4, 1.0), phi=jr.CoulombClutch(5.0, step))),
        dict(section=jr.Coupling(x=law, phi=el.Parallel((el.Progressive((1e3, 1e5)), el.Maxwell(1e3, 2.0))))),
        dict(section=jr.Coupling(right_calls.SIX, phi=jr.StickSlipClutch(5.0, 1e-3, step))),
        dict(section=jr.Shaft(0.2, 0.012, flaw=flaws, twist="paper", shear=True)),
        dict(section=jr.FiniteElementShaft((0.2, 0.3), (0.02, 0.03), elements=3, damping="rotating")),
        dict(section=jr.Shaft(0.2, 0.012, material=jr.Material(7e10, 2.7e10, 2700.0))),
        dict(extra=jr.LinearSupport(1e5 * np.eye(6), right_calls.SIX, (1e-4, 0, 0, 0, 1e-3, 0)), at="main"),
        dict(extra=jr.LinearSupport(right_calls.SIX, mass=right_calls.SIX), at="main"),
        dict(extra=jr.AddedInertia((1.0, 2.0, 3.0)), at="main"),
        dict(extra=el.PointUnbalance(1e-4, 0.3), at="main"),
        dict(extra=el.Moment(step, (0.0, 1.0, 0.0)), at="main"),
        dict(extra=el.DampingMatrix(np.eye(6)), at="main"),
        dict(extra=el.WhirlDependentSupport((0.0, 9.0), (0.0, 5.0), *[np.ones((2, 2, 6))] * 2), at="main"),
        dict(extra=el.AnnularSeal(0.2, 0.1, 4e-4, 4e5, 8e-4, 996.0, rotor_friction=(0.1, -0.2)), at="main"),
        dict(extra=el.LabyrinthSeal(
            0.2, 3e-4, 4e-3, 3.5e-3, 6e5, 3.5e5, 320.0, 188.9, 1.6e-5, carry_over=1.3, teeth=6), at="main"),
        dict(extra=el.FixedPadBearing(
            0.1, 0.05, 1e-4, 0.02, (0.0, -2e3), (90.0, 200.0), arc=(2.5, 2.0), thinning=0.03), at="main"),
        dict(extra=el.TiltingPadBearing(
            0.1, 0.05, 1e-4, 0.02, (0.0, -2e3), (90.0, 200.0), (0.0, 200.0), (-1.5, 1.5), 1.0), at="main"),
        dict(extra=jr.SpeedTorque(np.linspace(0, 9, 10), np.linspace(0, 3, 10)), at="main"),
        dict(extra=jr.Torque(jr.Harmonic(1.0, nine, 1 + nine, nine)), at="main"),
        dict(extra=jr.JournalBearing(0.05, 0.03, 1e-4, 0.01, film="full"), at="main"),
        dict(extra=el.ActiveTorque(neural, actuator=el.Actuator(5.0), cutoff=300.0), **loop),
        dict(extra=el.ActiveTorque(el.PI(1.0, 0.1), el.SpeedError(step)), **loop),
        dict(extra=el.ActiveTorque(
            el.StateFeedback(np.ones(2)), el.RelativeStates(2), between=True), **loop),
        dict(extra=el.SampledTorque(
            el.PD(1.0, 0.1), 1e-3, el.TwistOf(1, 0), 2e-3, noise=(1e-4, 0.1)), **loop),
        dict(extra=el.SampledTorque(
            el.Compensator(-np.eye(3), np.ones((3, 2)), np.ones(3)), 1e-3, seed=4), **loop),
    ]  # fmt: skip
    return found


@pytest.fixture
def everything(monkeypatch):
    """One machine of them all: stations in a row, joints to a rotor each, the rest at `main` and `end`."""
    elements = {
        "main": jr.Rotor(6.0, 0.0187, 0.0102),
        "end": jr.PrescribedSpin(jr.ConstantSpeed(100.0)),
    }
    connections = {}

    def add(kind, element, *places):
        name = f'{type(element).__name__} {len(elements)} "{kind}"'
        elements[name] = element
        if places:
            connections[name] = places if len(places) > 1 else places[0]
        return name

    elements["third"] = jr.Rotor(6.0, 0.0187, 0.0102)
    add("joint", jr.Shaft(0.2, 0.012), "main", "end")
    add("joint", jr.Shaft(0.2, 0.012), "main", "third")
    for stands in every_part(monkeypatch):
        places = stands.get("at", "main")
        for key in ("main", "end"):
            if key in stands:
                add("joint", jr.Shaft(0.2, 0.012), "main", add("station", stands[key]))
        if "section" in stands:
            add("joint", stands["section"], "main", add("far", jr.Rotor(6.0, 0.0187, 0.0102)))
        if "extra" in stands:
            add("extra", stands["extra"], *([places] if isinstance(places, str) else places))
    # a node has no inertia but what its neighbours give it
    (node,) = [n for n, e in elements.items() if isinstance(e, jr.Node)]
    add("extra", jr.AddedInertia(0.3, 0.01, 0.01), node)
    return jr.Machine(
        elements, connections, (0.1, -9.81, 0.0),
        fixed={"main": ["z"]},
        prescribed={"main": {"x": jr.CosineRamp(1e-3, 1.0), "psi": jr.SpeedTable((0, 1), (0, 1))}},
    )  # fmt: skip


def test_every_kind_of_part_reads_back(everything, tmp_path):
    odd = jax.tree.map(lambda x: x if x.dtype.kind != "f" else x * ODD, everything)
    assert_equal(read_back(odd, tmp_path), odd)
    kinds = {type(x) for x in _modules(odd)}
    wanted = {cls for base in BASES for cls in public_kinds(base).values()} - {*BASES}
    wanted |= {el.Actuator, jr.Unbalance, jr.Imperfection, jr.Misalignment}
    assert not wanted - kinds, sorted(c.__name__ for c in wanted - kinds)


def _modules(tree):
    yield tree
    below = (
        vars(tree).values()
        if isinstance(tree, eqx.Module)
        else tree
        if isinstance(tree, tuple)
        else ()
    )
    for one in below:
        if isinstance(one, (eqx.Module, tuple)):
            yield from _modules(one)


def small():
    line = {
        "fan": jr.Rotor(4.0, 0.02, 0.012, jr.Unbalance(1e-4, 1 / 3)),
        "long shaft": jr.Shaft(0.1, 0.02, rayleigh=(0.0, 1e-4)),
        "motor": jr.PrescribedSpin(jr.LinearRamp(150.0, 0.05)),
    }
    return jr.Machine.in_line(line, {"gust": (jr.Force(jr.Step(0.02, 20.0)), "fan.mass_centre")})


def test_a_line_is_written_as_people_write_it():
    assert (
        small().to_toml()
        == """\
[machine]

[[machine.line]]
name = "fan"
kind = "Rotor"
mass = "4 kg"
polar_inertia = "0.02 kg*m^2"
transverse_inertia = "0.012 kg*m^2"
unbalance = { eccentricity = "0.0001 m", angle = "0.3333333333333333 rad" }

[[machine.line]]
name = "long shaft"
kind = "Shaft"
length = "0.1 m"
diameter = "0.02 m"
rayleigh = ["0 1/s", "0.0001 s"]

[[machine.line]]
name = "motor"
kind = "PrescribedSpin"
profile = { kind = "LinearRamp", speed = "150 rad/s", duration = "0.05 s" }

[[machine.attachments]]
name = "gust"
kind = "Force"
at = "fan.mass_centre"
value = { kind = "Step", time = "0.02 s", after = "20 N" }
"""
    )


def test_supports_at_the_inner_stations_of_a_shaft(tmp_path):
    support = jr.LinearSupport((5e7, 5e7, 1e6, 0, 0, 0))
    machine = jr.Machine.in_line(
        {
            "motor": jr.PrescribedSpin(jr.ConstantSpeed(100.0)),
            "shaft": jr.FiniteElementShaft((0.1, 0.7, 0.4), 0.06, elements=3),
            "fan": jr.Rotor(40.0, 2.4, 1.2),
        },
        attachments={"left": (support, "shaft.3"), "right": (support, "shaft.6")},
    )
    assert_equal(read_back(machine, tmp_path), machine)
    (tmp_path / "wrong.toml").write_text(machine.to_toml().replace('"shaft.6"', '"shaft.9"'))
    with pytest.raises(jr.InputError, match=r'at names no station "shaft.9".*shaft.8'):
        jr.load(tmp_path / "wrong.toml", run=False)


def test_what_is_no_plain_line_is_written_with_its_joints():
    """Attachments before the end of the line, a shaft at another port, a line wired from right to left."""
    line = small()
    parts = line.elements()
    joined = line.connections()
    early = jr.Machine({"gust": parts.pop("gust"), **parts}, joined)
    back = jr.Machine(line.elements(), joined | {"long shaft": ("motor", "fan")})
    for machine in (early, back):
        table = tomllib.loads(machine.to_toml())["machine"]
        assert list(table) == ["elements", "connections"]
        assert list(table["elements"]) == list(machine.elements())
        assert table["connections"]["gust"] == "fan.mass_centre"
    assert tomllib.loads(back.to_toml())["machine"]["connections"]["long shaft"] == ["motor", "fan"]


class Felt(jr.AbstractAttachment):
    """A user's own, at the top of a module."""

    pull: jax.Array = jr.parameter("N")

    def forces(self, t, motions, state):
        return (jnp.zeros(6).at[0].set(self.pull),)


def test_a_class_of_ones_own_is_named_by_its_module(tmp_path):
    machine = jr.Machine.in_line(
        {"disc": jr.Rotor(4.0, 0.02, 0.012)}, {"felt": (Felt(2.0), "disc")}
    )
    assert f'kind = "{__name__}:Felt"' in machine.to_toml()
    assert_equal(read_back(machine, tmp_path), machine)


def test_what_no_study_can_say_is_refused():
    class Local(jr.AbstractAttachment):
        pull: jax.Array = jr.parameter("N")

        def forces(self, t, motions, state):
            return (jnp.zeros(6).at[0].set(self.pull),)

    disc = {"disc": jr.Rotor(4.0, 0.02, 0.012)}
    machine = jr.Machine.in_line(disc, {"felt": (Local(2.0), "disc")})
    with pytest.raises(
        jr.InputError, match="`felt`: is a Local, a class that no study can import by name: "
    ):
        machine.to_toml()
    machine = small()
    with pytest.raises(jr.InputError, match="`fan`: mass is traced, and has no number to write"):
        jax.make_jaxpr(lambda m: len(machine.set({"fan.mass": m}).to_toml()))(1.0)
    with pytest.raises(jr.InputError, match="must be one number, but has shape"):
        jax.tree.map(lambda x: jnp.stack([x, x]), machine).to_toml()


def test_a_study_with_changed_values_keeps_their_units_and_digits(tmp_path):
    """Of a law along a line, which was written in N*m/rad and could not be read."""
    line = {
        "a": jr.Rotor(1.0, 0.01, 0.006), "mesh": jr.GearMesh((0.1, 0.2), el.KelvinVoigt(1e8, 10.0)),
        "b": jr.Rotor(1.0, 0.01, 0.006), "shaft": jr.Shaft(0.1, 0.02),
        "motor": jr.PrescribedSpin(jr.ConstantSpeed(1.0)),
    }  # fmt: skip
    path = tmp_path / "train.toml"
    path.write_text(jr.Machine.in_line(line).to_toml(), encoding="utf-8")
    study = jr.load(path, run=False)
    changed = study.machine.set({"mesh.mesh.stiffness": 1e8 / 3})
    kept = save_study(study, changed, ["mesh.mesh.stiffness"], tmp_path / "changed.toml")
    assert_equal(jr.load(kept, run=False).machine, changed)
