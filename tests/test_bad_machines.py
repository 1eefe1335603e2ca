"""Wrong input from Python: each is refused in one sentence that says where, what, which and how to
put it right, before anything runs."""

import os
import subprocess
import sys

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import at_instants

import jaxrotor as jr


def rotor(**change):
    numbers = dict(mass=6.0, polar_inertia=0.018, transverse_inertia=0.0101)
    return jr.Rotor(**{**numbers, **change})


def shaft(**change):
    return jr.Shaft(**{**dict(length=0.1, diameter=0.012), **change})


def bearing(**change):
    numbers = dict(housing_mass=1.0, stiffness=1e6, damping=200.0)
    return jr.SelfAligningBearing(**{**numbers, **change})


def end(profile=None):
    return jr.PrescribedSpin(jr.ConstantSpeed(50.0) if profile is None else profile)


def line(main=None, section=None, driven=None, **options):
    return jr.Machine.in_line(
        {
            "main": rotor() if main is None else main,
            "shaft": shaft() if section is None else section,
            "end": end() if driven is None else driven,
        },
        **options,
    )


def attach(element, place="main", **options):
    return line(attachments={"extra": (element, place)}, **options)


nan, inf = float("nan"), float("inf")

# what is wrong: how it is built, what the sentence must hold
BAD = {
    # numbers
    "negative mass": (lambda: line(rotor(mass=-1.0)), "`main` mass positive -1 kg"),
    "zero inertia": (
        lambda: line(rotor(polar_inertia=0.0)),
        "`main` polar_inertia positive kg*m^2",
    ),
    "zero length": (lambda: line(section=shaft(length=0.0)), "`shaft` length positive 0 m"),
    "negative diameter": (lambda: line(section=shaft(diameter=-0.01)), "`shaft` diameter -0.01"),
    "nan mass": (lambda: line(rotor(mass=nan)), "`main` mass finite nan"),
    "infinite stiffness": (
        lambda: jr.Machine.in_line({"b": bearing(stiffness=inf), "s": shaft(), "end": end()}),
        "`b` stiffness finite inf N/m",
    ),
    "nan gravity": (lambda: line(gravity=(0, nan, 0)), "`machine` gravity finite nan"),
    "two-number gravity": (lambda: line(gravity=(0, -9.81)), "`machine` gravity 3 numbers (2,)"),
    "number for gravity": (lambda: line(gravity=-9.81), "`machine` gravity 3 numbers"),
    "list for mass": (lambda: line(rotor(mass=[1.0, 2.0])), "`main` mass one number (2,)"),
    "text for mass": (lambda: line(rotor(mass="6 kg")), "`main` mass number kg '6 kg'"),
    "none for mass": (lambda: line(rotor(mass=None)), "`main` mass missing kg"),
    "complex mass": (lambda: line(rotor(mass=1 + 2j)), "`main` mass number"),
    "negative eccentricity": (
        lambda: line(rotor(unbalance=jr.Unbalance(eccentricity=-1e-4))),
        "`main` unbalance.eccentricity zero or positive -0.0001 m",
    ),
    "negative offset": (
        lambda: line(rotor(imperfection=jr.Imperfection(offset=-1e-4))),
        "`main` imperfection.offset -0.0001 m",
    ),
    "flatter than a disc": (
        lambda: line(rotor(polar_inertia=0.03)),
        "`main` polar_inertia twice transverse_inertia 0.03 0.0101",
    ),
    "bore as wide as the shaft": (
        lambda: line(section=shaft(inner_diameter=0.012)),
        "`shaft` inner_diameter smaller diameter 0.012",
    ),
    "one rayleigh number": (
        lambda: line(section=shaft(rayleigh=0.002)),
        "`shaft` rayleigh 2 numbers",
    ),
    "negative rayleigh": (
        lambda: line(section=shaft(rayleigh=(0.1, -1e-5))),
        "`shaft` rayleigh zero or positive -1e-05",
    ),
    "negative modulus": (
        lambda: line(section=shaft(material=jr.Material(-2.1e11, 8e10, 7850))),
        "`shaft` material.youngs_modulus positive -2.1e+11 Pa",
    ),
    "impossible body": (
        lambda: jr.Machine({"body": jr.RigidBody(1.0, (1.0, 1.0, 3.0))}, {}),
        "`body` inertia principal moments 3 kg*m^2",
    ),
    "unsymmetric inertia": (
        lambda: jr.Machine(
            {"body": jr.RigidBody(1.0, np.diag([1.0, 1, 1]) + np.eye(3, k=1) * 0.1)}, {}
        ),
        "`body` inertia symmetric",
    ),
    "small matrix": (
        lambda: line(section=jr.ElasticMatrix(np.eye(6), np.eye(12))),
        "`shaft` K 12 x 12 (6, 6)",
    ),
    "five stiffnesses": (
        lambda: attach(jr.LinearSupport((1.0,) * 5)),
        "`extra` stiffness 6 numbers (5,)",
    ),
    "text for a torque": (lambda: attach(jr.Torque("5 N*m")), "`extra` value.level number '5 N*m'"),
    "direction of two": (lambda: attach(jr.Force(1.0, (1, 0))), "`extra` direction 3 numbers"),
    "two of three lumped inertias": (
        lambda: jr.Machine.in_line({"b": bearing(shaft_mass=0.1), "s": shaft(), "end": end()}),
        "`b` shaft_transverse_inertia give all three",
    ),
    "nothing to lump": (
        lambda: jr.Machine.in_line(
            {"b": bearing(), "m": jr.ElasticMatrix(np.eye(12), np.eye(12)), "end": end()}
        ),
        "`b` give shaft_mass",
    ),
    # profiles
    "zero duration": (
        lambda: line(driven=end(jr.CosineRamp(100.0, 0.0))),
        "`end` profile.duration positive 0 s",
    ),
    "unsorted table": (
        lambda: line(driven=end(jr.SpeedTable((0, 2, 1), (0, 1, 2)))),
        "`end` times increase row 3 1 s 2 s",
    ),
    "ragged table": (
        lambda: line(driven=end(jr.SpeedTable((0, 1, 2), (0, 1)))),
        "`end` times speeds equally long 3 2",
    ),
    "one-row table": (lambda: line(driven=end(jr.SpeedTable((0,), (1,)))), "`end` two rows"),
    "table of text": (
        lambda: line(driven=end(jr.SpeedTable(("0", "a"), (1, 2)))),
        "`end` profile.times number",
    ),
    # a value where a part belongs
    "unbalance as a number": (lambda: line(rotor(unbalance=5e-4)), "`main` unbalance Unbalance"),
    "imperfection as a number": (
        lambda: line(rotor(imperfection=1e-4)),
        "`main` imperfection Imperfection",
    ),
    "profile as a number": (
        lambda: line(driven=jr.PrescribedSpin(1000.0)),
        "`end` profile ConstantSpeed",
    ),
    "material as text": (lambda: line(section=shaft(material="steel")), "`shaft` material STEEL"),
    "misspelt twist": (lambda: line(section=shaft(twist="papper")), "`Shaft` twist papper paper"),
    "misspelt damping": (
        lambda: line(section=shaft(damping="fix")),
        "`Shaft` damping 'fix' fixed rotating",
    ),
    "class for an element": (lambda: line(main=jr.Rotor), "`main` Rotor"),
    "number for an element": (lambda: line(main=3.0), "`main` element float"),
    "motion for a torque": (
        lambda: attach(jr.Torque(jr.LinearRamp(1.0, 1.0))),
        "`extra` value LinearRamp Step",
    ),
    # names and places
    "dot in a name": (
        lambda: jr.Machine.in_line({"a.b": rotor(), "s": shaft(), "end": end()}),
        "`a.b` dot rename",
    ),
    "empty name": (lambda: jr.Machine.in_line({"": rotor(), "s": shaft(), "e": end()}), "name ''"),
    "number for a name": (lambda: jr.Machine({3: rotor()}, {}), "name 3"),
    "two stations side by side": (
        lambda: jr.Machine.in_line({"a": rotor(), "b": rotor(), "s": shaft(), "end": end()}),
        "`a` `b` nothing between put a shaft",
    ),
    "shaft at the end": (
        lambda: jr.Machine.in_line({"a": rotor(), "s": shaft()}),
        "`s` between two stations",
    ),
    "shaft at the beginning": (
        lambda: jr.Machine.in_line({"s": shaft(), "a": rotor()}),
        "`s` between two stations",
    ),
    "two shafts in a row": (
        lambda: jr.Machine.in_line({"a": rotor(), "s": shaft(), "t": shaft(), "b": rotor()}),
        "`s` between two stations",
    ),
    "attachment in the line": (
        lambda: jr.Machine.in_line({"a": rotor(), "t": jr.Torque(1.0), "b": rotor()}),
        "`t` Torque attachments",
    ),
    "no station": (lambda: jr.Machine({}, {}), "no station add a rotor"),
    "apart": (lambda: jr.Machine({"a": rotor(), "b": rotor()}, {}), "disconnected `b` `a` add"),
    "connected to nothing": (
        lambda: jr.Machine({"a": rotor(), "s": shaft()}, {}),
        "`s` connected to nothing connections",
    ),
    "unknown station": (
        lambda: attach(jr.Torque(1.0), "mian"),
        "`extra` station `mian` did you mean `main`",
    ),
    "unknown port": (
        lambda: attach(jr.Force(1.0), "main.mass_center"),
        "`extra` port `main` did you mean `mass_centre`",
    ),
    "port of a bearing": (
        lambda: jr.Machine.in_line(
            {"b": bearing(), "s": shaft(), "end": end()},
            attachments={"f": (jr.Force(1.0), "b.mass_centre")},
        ),
        "`f` port `b` none",
    ),
    "connection of nobody": (
        lambda: jr.Machine({"a": rotor()}, {"s": "a"}),
        "connections element `s`",
    ),
    "connected station": (lambda: jr.Machine({"a": rotor()}, {"a": "a"}), "`a` station Rotor"),
    "shaft with one end": (
        lambda: jr.Machine({"a": rotor(), "s": shaft()}, {"s": "a"}),
        "`s` two stations 1",
    ),
    "shaft onto itself": (
        lambda: jr.Machine({"a": rotor(), "s": shaft()}, {"s": ("a", "a")}),
        "`s` both ends `a`",
    ),
    "torque at two stations": (
        lambda: jr.Machine.in_line(
            {"a": rotor(), "s": shaft(), "b": rotor()},
            attachments={"t": (jr.Torque(1.0), ("a", "b"))},
        ),
        "`t` Torque 1 station 2 given",
    ),
    "name used twice": (
        lambda: line(attachments={"main": (jr.Torque(1.0), "main")}),
        "`main` twice rename",
    ),
    "attachment without a place": (
        lambda: line(attachments={"extra": jr.Torque(1.0)}),
        "`extra` (element, station)",
    ),
    "attachment back to front": (
        lambda: line(attachments={"extra": ("main", jr.Torque(1.0))}),
        "`extra` element str",
    ),
    "station as an attachment": (
        lambda: line(attachments={"extra": (rotor(), "main")}),
        "`extra` station",
    ),
    # held coordinates
    "unknown coordinate": (
        lambda: line(fixed={"main": ("pis",)}),
        "`main` coordinate `pis` did you mean `psi`",
    ),
    "hold of an unknown station": (
        lambda: line(fixed={"mian": ("z",)}),
        "fixed `mian` did you mean `main`",
    ),
    "hold of a driven end": (lambda: line(fixed={"end": ("z",)}), "`end` prescribed already fixed"),
    "held twice": (lambda: line(fixed={"main": ("z", "z")}), "`main` z held twice"),
    "fixed and prescribed": (
        lambda: line(fixed={"main": ("z",)}, prescribed={"main": {"z": jr.ConstantSpeed(0.0)}}),
        "`main` z held twice",
    ),
    "number for a motion": (
        lambda: line(prescribed={"main": {"z": 0.0}}),
        "`main.z` motion CosineRamp 0.0",
    ),
    "motion out of its bounds": (
        lambda: line(prescribed={"main": {"z": jr.CosineRamp(1.0, -1.0)}}),
        "`main.z` duration positive -1 s",
    ),
    # paths
    "get of an unknown element": (
        lambda: line().get("mian.mass"),
        "`mian.mass` element `mian` did you mean `main`",
    ),
    "get of an unknown parameter": (
        lambda: line().get("main.mas"),
        "`main.mas` parameter `mas` did you mean `mass`",
    ),
    "get below a number": (lambda: line().get("main.mass.value"), "`main.mass.value` `value` none"),
    "set out of bounds": (lambda: line().set({"main.mass": -2.0}), "`main` mass positive -2 kg"),
    "set of a text": (lambda: line().set({"main.mass": "6 kg"}), "`main` mass number '6 kg'"),
    "set of an entry of no row": (
        lambda: line().set({"main.mass[0]": 1.0}),
        "`main.mass[0]` no such entry",
    ),
    "set of an entry to a row": (
        lambda: line().set({"gravity[1]": [1.0, 2.0]}),
        "`gravity[1]` one number shape (2,)",
    ),
    "get of an entry beyond": (lambda: line().get("gravity[3]"), "`gravity[3]` no such entry"),
    "set of an option": (
        lambda: line().set({"shaft.twist": "paper"}),
        "`shaft.twist` option build the machine anew",
    ),
    "set of a part to a number": (
        lambda: line().set({"main.unbalance": 5e-4}),
        "`main.unbalance` main.unbalance.eccentricity",
    ),
    "set of a whole element to a number": (
        lambda: line().set({"main": 5.0}),
        "`main` main.mass",
    ),
    "set of a station to a shaft": (lambda: line().set({"main": shaft()}), "`main` Rotor Shaft"),
    "unknown element of a machine": (lambda: line()["mian"], "`mian` did you mean `main`"),
}


def refusal(build):
    with pytest.raises(jr.InputError) as caught:
        build()
    return str(caught.value)


def assert_says(sentence, words):
    assert "\n" not in sentence, sentence
    assert "Traceback" not in sentence and len(sentence) < 400
    for word in words.split(" "):
        assert word in sentence, f"{word!r} is not in: {sentence}"


@pytest.mark.parametrize("name", BAD)
def test_a_bad_machine_is_refused(name):
    build, words = BAD[name]
    assert_says(refusal(build), words)


def test_every_fault_is_named_at_once():
    with pytest.raises(jr.InputError) as caught:
        line(rotor(mass=-1.0, polar_inertia=nan), shaft(length=0.0))
    assert len(caught.value.problems) == 3


def test_good_machines_are_not_refused():
    """The builders above are fine but for what each test breaks."""
    good = [
        (line(), ["main", "shaft", "end"]),
        (attach(jr.Torque(1.0)), ["main", "shaft", "end", "extra"]),
        (attach(jr.Force(1.0), "main.mass_centre"), ["main", "shaft", "end", "extra"]),
        (jr.Machine.in_line({"b": bearing(), "s": shaft(), "end": end()}), ["b", "s", "end"]),
        (jr.Machine({"thin": rotor(polar_inertia=0.0202)}, {}), ["thin"]),  # Jp = 2 Jt is a disc
        (jr.Machine({"plate": jr.RigidBody(1.0, (1.0, 1.0, 2.0))}, {}), ["plate"]),
    ]
    for machine, names in good:
        machine.check()
        assert set(machine.elements()) == set(names)


def still(count=2):
    return jr.State(np.zeros((count, 6)), np.zeros((count, 6)))


def run(t_end=0.01, sample_rate=1000.0, **options):
    return jr.simulate(line(), t_end, sample_rate, **options)


BAD_RUNS = {
    "no time": (lambda: run(0.0), "t_end positive 0 s"),
    "back in time": (lambda: run(-1.0), "t_end positive -1 s"),
    "nan time": (lambda: run(nan), "t_end finite nan"),
    "endless": (lambda: run(inf), "t_end finite inf"),
    "text for time": (lambda: run("10 s"), "t_end number '10 s'"),
    "no samples": (lambda: run(1.0, 0.0), "sample_rate positive 0 Hz"),
    "negative rate": (lambda: run(1.0, -1000.0), "sample_rate positive -1000 Hz"),
    "nan rate": (lambda: run(1.0, nan), "sample_rate finite nan"),
    "too few samples": (lambda: run(0.001, 1000.0), "t_end sample_rate 2 samples raise"),
    "misspelt start": (lambda: run(initial="statc"), "initial static steady undeformed 'statc'"),
    "number for the start": (lambda: run(initial=0.0), "initial State 0.0"),
    "array for the start": (lambda: run(initial=np.zeros((2, 6))), "initial State"),
    "start of three stations": (
        lambda: run(initial=still(3)),
        "initial.position shape (2, 6) (3, 6)",
    ),
    "half a start": (
        lambda: run(initial=jr.State(np.zeros((2, 6)), np.zeros(6))),
        "initial.velocity shape (2, 6) (6,)",
    ),
    "nan in the start": (
        lambda: run(initial=jr.State(np.full((2, 6), nan), np.zeros((2, 6)))),
        "initial.position finite",
    ),
    "text in the start": (
        lambda: run(initial=jr.State("rest", np.zeros((2, 6)))),
        "initial.position shape (2, 6)",
    ),
    "states of nobody": (
        lambda: run(initial=jr.State(np.zeros((2, 6)), np.zeros((2, 6)), np.zeros(4))),
        "initial.internal 0 4",
    ),
    "a speed beside a start": (lambda: run(initial=still(), speed=1.0), "State speed leave"),
    "a speed that is not the drive's": (
        lambda: run(speed=60.0),
        "speed 60 rad/s drive 50 leave profile",
    ),
    "text for a speed": (lambda: run(speed="50 rad/s"), "speed number '50 rad/s'"),
    "nan speed": (lambda: run(speed=nan), "speed finite nan"),
    "two speeds": (lambda: run(speed=(1.0, 2.0)), "speed one number"),
    "steady at rest": (
        lambda: jr.simulate(
            line(driven=end(jr.CosineRamp(100.0, 1.0))), 0.01, 1000.0, initial="steady"
        ),
        "steady speed 0",
    ),
    "negative step": (lambda: run(step=-1e-3), "step positive -0.001"),
    "step of nothing": (lambda: run(step=0.0), "step positive"),
    "nan step": (lambda: run(step=nan), "step positive nan"),
    "text for a step": (lambda: run(step="1 ms"), "step number '1 ms'"),
    "negative step, other solver": (
        lambda: run(step=-1e-3, solver=diffrax.Tsit5()),
        "step positive -0.001",
    ),
    "plan for another solver": (
        lambda: run(step=jr.Plan(1, 6, 0.0, 0.0, 0.0, 0.0), solver=diffrax.Tsit5()),
        "Plan exponential step",
    ),
    "text for a solver": (lambda: run(solver="Tsit5"), "solver diffrax 'Tsit5'"),
    "class for a solver": (lambda: run(solver=diffrax.Tsit5), "solver diffrax Tsit5()"),
    "negative tolerance": (
        lambda: run(solver=diffrax.Tsit5(), rtol=-1.0),
        "rtol above 0 below 1 -1",
    ),
    "no machine": (lambda: jr.simulate("main", 0.01, 1000.0), "machine Machine"),
    "load that nothing carries": (
        lambda: jr.static_equilibrium(jr.Machine({"main": rotor()}, {}, gravity=(0, -9.81, 0))),
        "`main` along y 58.9 N support undeformed",
    ),
    "whether an unknown station sways": (
        lambda: line().sways("mian"),
        "there is no station `mian`: did you mean `main`?",
    ),
    "static start that nothing carries": (
        lambda: jr.simulate(
            jr.Machine({"main": rotor()}, {}, gravity=(0, -9.81, 0)), 0.01, 1000.0, step=1e-3
        ),
        "`main` along y 58.9 N support undeformed",
    ),
    "result of an unknown element": (
        lambda: at_instants(line(), np.zeros((2, 6)), np.zeros((2, 6)))["mian"],
        "`mian` did you mean `main`",
    ),
}


@pytest.mark.parametrize("name", BAD_RUNS)
def test_a_bad_run_is_refused(name):
    build, words = BAD_RUNS[name]
    assert_says(refusal(build), words)


def test_a_step_is_not_chosen_under_jit():
    machine = line()

    def final(mass):
        return jr.simulate(machine.set({"main.mass": mass}), 0.01, 1000.0).y[-1]

    assert_says(refusal(lambda: jax.jit(final)(6.0)), "jr.plan step=plan")
    assert_says(refusal(lambda: jax.vmap(final)(jnp.array([6.0, 6.1]))), "jr.plan step=plan")
    with pytest.raises(jr.InputError, match="t_end"):
        jax.jit(lambda t: run(t).y)(0.01)


def test_machines_are_checked_under_jit_where_numbers_are_known():
    """Setting one traced parameter inside jit leaves the others known, and they are checked."""
    machine = line(section=shaft(material=jr.STEEL))

    @jax.jit
    def mass(m):
        return machine.set({"main.mass": m}).get("main.mass")

    assert float(mass(7.0)) == 7.0

    @jax.jit
    def bad(m):
        return machine.set({"main.mass": m, "shaft.length": -1.0}).get("main.mass")

    assert_says(refusal(lambda: bad(7.0)), "`shaft` length positive -1 m")


@pytest.mark.parametrize(
    "element",
    [jr.RigidBody(1.0, (1.0, 1.2, 1.5)), jr.RigidBody(1.0, np.diag([1.0, 1.2, 1.5]))],
    ids=["moments", "tensor"],
)
def test_a_body_may_be_built_under_jit(element):
    @jax.jit
    def mass(m):
        machine = jr.Machine({"b": element}, {}, gravity=(0, m, 0))
        return machine.gravity[1]

    assert float(mass(7.0)) == 7.0


def test_a_table_may_be_used_under_jit():
    @jax.jit
    def speed(m):
        machine = line(rotor(mass=m), driven=end(jr.SpeedTable((0.0, 1.0), (0.0, 5.0))))
        return machine.get("main.mass")

    assert float(speed(7.0)) == 7.0


def test_32_bit_floats_are_refused():
    program = (
        "import jaxrotor as jr\n"
        "try:\n    jr.Rotor(1.0, 1.0, 1.0)\n"
        "except jr.InputError as error:\n    print('refused:', error)\n"
    )
    environment = {k: v for k, v in os.environ.items() if k != "JAX_ENABLE_X64"}
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert_says(done.stdout.strip(), "refused: 64-bit 32 jax_enable_x64 JAX_ENABLE_X64=1")
