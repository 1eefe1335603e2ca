"""Bad Python calls by the hundred: every argument of the public functions and classes, given what it cannot
be, is refused in a sentence, at once, and before anything compiles.

The calls are generated: a table says what a right call looks like, type hints and declared parameters say
which kind each argument is of, and each kind has its list of values that are none.
"""

import dataclasses
import inspect
import signal
import typing

import equinox as eqx
import jax
import numpy as np
import pytest
from helpers import at_instants

import jaxrotor as jr

NAN, INF = float("nan"), float("inf")
HUGE = (
    10**4000
)  # Python's own number of digits: more than a float holds, and than can be printed quickly

NOT_A_NUMBER = ["3 mm", True, 1j, {}, object(), np.datetime64("2026-01-01"), jr.Rotor]
NOT_FINITE = [NAN, INF, -INF, HUGE]
BAD: dict[str, list] = {
    "number": [*NOT_A_NUMBER, *NOT_FINITE, [1.0, 2.0]],
    "positive": [*NOT_A_NUMBER, *NOT_FINITE, [1.0, 2.0], 0.0, -1.0],
    "count": [-1, 2.5, NAN, "3", True, 10**12, 10**19, HUGE, [3], None, np.float64(3.0)],
    "flag": ["no", "false", 1, 0.0, NAN, [], np.array([True, False])],
    "text": [3, 1.5, None, {}, ["main"], True, jr.Rotor],
    "station": ["nobody", "", 3, None, {}, ["main"], "shaft"],
    "place": ["nobody.x", "main.w", "main", "", 3, None, {}, [3]],
    "choice": ["xyz", "", 3, True, [], {}, NAN],
    "machine": [None, 3, "machine", jr.Rotor, {}, jr.Rotor(1.0, 1.0, 1.0)],
    "object": [None, 3, "this", {}, jr.Rotor],
    "numbers": ["3 mm", None, {}, [NAN], [1.0, INF], [True], ["x"], object(), [[1.0], [2.0, 3.0]]],
    "rising": ["3 mm", None, {}, [0.0, NAN], [2.0, 1.0], [1.0, 1.0], [3.0], ["x", "y"], 5.0],
    "signal": ["x", None, 3.0, [1.0], np.full(64, NAN), np.zeros((8, 8)), {}, ["a"] * 64],
    "matrix": ["x", None, [1.0], np.full((2, 2), NAN), np.zeros((2, 3)), {}, [["a", "b"]] * 2],
    "mapping": [3, "main.mass", [1, 2], {3: [1.0]}, {"main.mass": "x"}, {"nobody.mass": [1.0]}, {}],
    "outputs": [3, "peak", {}, {"a": 3}, {"a": jr.Radial}, [jr.Radial("main")]],
    "initial": ["xyz", "", 3, True, {}, np.zeros(12), NAN],
    "at": ["xyz", "", 3, True, {}, np.zeros(12), NAN],
    "solver": ["Tsit5", 3, True, {}, jr.Rosenbrock],
    "step": ["1 ms", 0.0, -1.0, NAN, INF, True, {}, HUGE],
}


def line(main=None, section=None, end=None, extra=None, at="main"):
    parts = {
        "main": main or jr.Rotor(6.0, 0.0187, 0.0102),
        "shaft": section or jr.Shaft(0.2, 0.012),
        "end": end or jr.PrescribedSpin(jr.ConstantSpeed(100.0)),
    }
    attachments = {"bearing": (jr.LinearSupport((1e6, 1e6, 1e6, 0.0, 0.0, 0.0)), "main")}
    if extra is not None:
        attachments["extra"] = (extra, at)
    return jr.Machine.in_line(parts, attachments)


# Every element, law, profile, controller: how a sound one is made, and where in a machine it stands.


def attached(element):
    return line(extra=element)


def station(element):
    return line(main=element)


def joint(element):
    return line(section=element)


def law(x):
    return attached(jr.RadialBearing(x))


def profile(x):
    return attached(jr.Torque(x))


def motion(x):
    return line(end=jr.PrescribedSpin(x))


def flaw(x):
    return joint(jr.Shaft(0.2, 0.012, flaw=x))


def controller(x):
    return line(extra=jr.ActiveTorque(x), at=("main", "end"))


def loop(x):
    return line(extra=x, at=("main", "end"))


def defect(x):
    return attached(jr.RollingBearing(1e9, 0.01, 0.05, defects=(x,)))


SIX = (1e3,) * 6
PARTS: dict[str, tuple] = {
    "Rotor": (station, (6.0, 0.0187, 0.0102)),
    "RigidBody": (station, (6.0, (1.0, 1.2, 1.5))),
    "SelfAligningBearing": (station, (1.0, 1e6, 200.0)),
    "Shaft": (joint, (0.2, 0.012)),
    "FiniteElementShaft": (joint, (0.2, 0.012)),
    "RigidElementShaft": (joint, (0.2, 0.012)),
    "Coupling": (joint, (SIX,)),
    "ElasticMatrix": (joint, (np.eye(12), np.zeros((12, 12)))),
    "UniversalJoint": (joint, (100.0,)),
    "GearMesh": (joint, ((0.1, 0.2), jr.KelvinVoigt(1e8))),
    "AddedInertia": (attached, (0.1,)),
    "Brake": (attached, (1.0,)),
    "DCMotor": (attached, (1.0, 1e-3, 0.1, 12.0)),
    "EngineTorque": (attached, (1.0, (2.0,), (3.0,))),
    "FanLoad": (attached, (1e-3,)),
    "Force": (attached, (1.0,)),
    "InductionMotor": (attached, (0.5, 0.4, 0.08, 0.08, 0.07, 230.0, 50.0)),
    "KlossMotor": (attached, (10.0, 0.1, 157.0)),
    "LawSupport": (attached, (jr.KelvinVoigt(1e5),)),
    "LinearSupport": (attached, (SIX,)),
    "Rub": (attached, (1e-3, 1e6, 0.1)),
    "SpeedDependentSupport": (attached, ((0.0, 100.0), (SIX, SIX), (SIX, SIX))),
    "SpeedGovernor": (attached, (10.0, 1.0, 1.0, 5.0)),
    "SpeedTorque": (attached, ((0.0, 10.0), (1.0, 2.0))),
    "Torque": (attached, (1.0,)),
    "TorsionalDamper": (attached, (0.1, 1.0)),
    "JournalBearing": (attached, (0.05, 0.03, 1e-4, 0.01)),
    "SqueezeFilmDamper": (attached, (0.05, 0.03, 1e-4, 0.01)),
    "RollingBearing": (attached, (1e9, 0.01, 0.05)),
    "RadialBearing": (attached, (jr.KelvinVoigt(1e6),)),
    "SwitchedDamper": (loop, (0.1, 1.0, 0.1, 0.1)),
    "ActiveTorque": (loop, (jr.PD(1.0, 0.1),)),
    "SampledTorque": (loop, (jr.PD(1.0, 0.1), 1e-3)),
    "Actuator": (lambda x: loop(jr.ActiveTorque(jr.PD(1.0), actuator=x)), (5.0,)),
    "PD": (controller, (1.0, 0.1)),
    "PI": (controller, (1.0, 0.1)),
    "PositivePositionFeedback": (controller, (1.0, 30.0)),
    "ResonantController": (controller, (1.0, 30.0)),
    "KelvinVoigt": (law, (1e5,)),
    "Backlash": (law, (1e-4, 1e5)),
    "Bilinear": (law, (1e5, 2e5)),
    "BoucWen": (law, (1e5, 0.1, 1e-4)),
    "Maxwell": (law, (1e5, 10.0)),
    "Progressive": (law, ((1e5, 1e9),)),
    "TabulatedLaw": (law, ((-1.0, 0.0, 1.0), (-1.0, 0.0, 1.0))),
    "Steady": (profile, (1.0,)),
    "Step": (profile, (0.1, 1.0)),
    "Ramp": (profile, (0.1, 0.1, 1.0)),
    "Harmonic": (profile, (1.0, (1.0,), (20.0,))),
    "Impulse": (profile, (0.1, 0.1, 1.0)),
    "PulseTrain": (profile, (0.1, 0.05, 1.0)),
    "Table": (profile, ((0.0, 1.0), (0.0, 1.0))),
    "ConstantSpeed": (motion, (100.0,)),
    "CosineRamp": (motion, (100.0, 1.0)),
    "LinearRamp": (motion, (100.0, 1.0)),
    "SpeedTable": (motion, ((0.0, 1.0), (0.0, 100.0))),
    "SpeedSpline": (motion, ((0.0, 1.0, 2.0), (0.0, 50.0, 100.0))),
    "PrescribedSpin": (lambda x: line(end=x), (jr.ConstantSpeed(100.0),)),
    "Bow": (flaw, (1e-4,)),
    "Kink": (flaw, (1e-3,)),
    "Crack": (flaw, (0.2,)),
    "SwitchingCrack": (flaw, (0.2,)),
    "Asymmetry": (flaw, (0.1,)),
    "Unbalance": (lambda x: station(jr.Rotor(6.0, 0.02, 0.01, unbalance=x)), (1e-5,)),
    "Imperfection": (lambda x: station(jr.Rotor(6.0, 0.02, 0.01, imperfection=x)), (1e-5,)),
    "Misalignment": (lambda x: joint(jr.Coupling(SIX, misalignment=x)), (1e-5,)),
    "Material": (lambda x: joint(jr.Shaft(0.2, 0.012, material=x)), (2e11, 8e10, 7850.0)),
    "BallDefect": (defect, (0.0, 0.1, 1e-5)),
    "InnerRaceDefect": (defect, (0.0, 0.1, 1e-5)),
    "OuterRaceDefect": (defect, (0.0, 0.1, 1e-5)),
}


def kind_of_field(field, hint, declared) -> str | None:
    """Which list of bad values a constructor's argument is given."""
    if "unit" in field.metadata:
        rule = field.metadata
        if () not in rule["shapes"]:
            return "matrix" if all(len(s) == 2 for s in rule["shapes"]) else "numbers"
        return "positive" if rule["positive"] else "number"
    members = typing.get_args(hint) or (hint,)
    if typing.get_origin(hint) is typing.Literal:
        return "choice"
    for plain, kind in ((bool, "flag"), (int, "count"), (float, "positive"), (str, "text")):
        if plain in members:
            return kind
    if any(isinstance(m, type) and issubclass(m, eqx.Module) for m in members):
        return "object"
    return None


def bad_parts():
    for name, (place, right) in PARTS.items():
        cls = getattr(jr, name)
        hints = typing.get_type_hints(cls)
        parameters = list(inspect.signature(cls).parameters)
        given = dict(zip(parameters, right))
        fields = {f.name: f for f in dataclasses.fields(cls)}
        for key in parameters:
            field = fields.get(key)
            kind = None if field is None else kind_of_field(field, hints[key], given.get(key))
            for value in BAD.get(kind or "", []):
                if value is None and (field.metadata.get("optional") or field.default is None):
                    continue
                if value is None and type(None) in typing.get_args(hints[key]):
                    continue
                several = () in field.metadata.get("shapes", ()) and any(
                    len(s) == 1 for s in field.metadata["shapes"]
                )
                if isinstance(value, list) and several:
                    continue
                yield (
                    f"{name}({key}={shown(value)})",
                    lambda c=cls, k={**given, key: value}, p=place: p(c(**k)),
                )
        yield f"{name}(misspelt)", lambda c=cls, k=given: c(**k, lenghth=1.0)


def shown(value):
    return "huge" if value is HUGE else " ".join(repr(value).split())[:40]


# Functions: how a right call looks, and of which kind each argument is.

T = np.arange(64) / 64.0
WAVE = np.sin(2 * np.pi * 4 * T)
ANGLE = 2 * np.pi * 4 * T
EYE = np.eye(2)


@pytest.fixture(scope="module")
def calls():
    """name -> (function, right arguments, name -> kind). Nothing here runs or compiles, but for one model."""
    m = line()
    model = jax.tree.map(lambda x: x, object.__new__(jr.LinearModel))
    return m, model


def functions(machine, model, response, found, record):
    radial = {"peak": jr.PeakValue(jr.Radial("main"))}
    cases = {"main.mass": [5.9, 6.1]}
    run = dict(
        machine="machine",
        t_end="positive",
        sample_rate="positive",
        initial="initial",
        speed="number",
    )
    two = dict(machine=machine, t_end=0.1, sample_rate=1000.0)
    pair = dict(machine=machine, input="main.x", output="main.x")
    ends = dict(
        machine="machine", input="place", output="place", speed="number", at="at", torsion="flag"
    )
    orbit = dict(x=WAVE, y=WAVE, angle=ANGLE, sample_rate=64.0)
    orbits = dict(x="signal", y="signal", angle="signal", sample_rate="positive")
    swept = dict(machine=machine, parameters=cases, outputs=radial, t_end=0.1, sample_rate=1000.0)
    sweeps = {**run, "parameters": "mapping", "outputs": "outputs"}
    regulator = dict(A=-EYE, B=EYE, Q=EYE, R=EYE)
    regulators = dict.fromkeys(regulator, "matrix")
    fit = dict(
        machine=machine, parameters=["main.mass"], sensors={"x": jr.Radial("main")}, data=record
    )
    return {
        "simulate": (two, {**run, "solver": "solver", "step": "step", "rtol": "positive",
                           "atol": "positive", "adjoint": "object", "progress": "flag"}),
        "plan": (two, {**run, "tolerance": "positive", "order": "count"}),
        "energy_audit": (two, {**run, "step": "step", "rtol": "positive"}),
        "static_equilibrium": (dict(machine=machine), dict(machine="machine")),
        "total_mass": (dict(machine=machine), dict(machine="machine")),
        "polar_inertia": (dict(machine=machine), dict(machine="machine")),
        "linearize": (dict(machine=machine), dict(machine="machine", speed="number", at="at")),
        "modes": (dict(model=model), dict(model="object", count="count")),
        "torsional": (dict(model=model), dict(model="object")),
        "decay_rate": (dict(model=model), dict(model="object")),
        "pole_cluster": (dict(model=model, near=100.0), dict(model="object", near="number", count="count")),
        "torsional_modes": (
            dict(machine=machine), dict(machine="machine", speed="number", count="count", at="at")
        ),
        "holzer_table": (dict(mode=3), dict(mode="object")),
        "campbell": (
            dict(machine=machine, speeds=[0.0, 10.0]),
            dict(machine="machine", speeds="rising", count="count", at="at", progress="flag"),
        ),
        "critical_speeds": (
            dict(machine=machine),
            dict(machine="machine", order="positive", damped="flag", at="at", count="count"),
        ),
        "critical_modes": (
            dict(machine=machine), dict(machine="machine", order="positive", at="at", count="count")
        ),
        "critical_speed_map": (
            dict(machine=machine, stiffness=[1e5, 1e6]),
            dict(machine="machine", stiffness="rising", supports="text", count="count", progress="flag"),
        ),
        "stability_threshold": (
            dict(machine=machine, start=1.0, stop=100.0),
            dict(machine="machine", start="number", stop="number", points="count", at="at"),
        ),
        "interferences": (
            dict(machine=machine, orders=[1.0], speeds=(1.0, 10.0)),
            dict(machine="machine", orders="numbers", speeds="rising", count="count", at="at"),
        ),
        "frequency_response": (
            dict(machine=machine, inputs="main.x", outputs="main.x", frequencies=[1.0]),
            dict(machine="machine", inputs="place", outputs="place", frequencies="numbers",
                 speed="number", kind="choice", at="at"),
        ),
        "unbalance_response": (
            dict(machine=machine, outputs="main.x", speeds=[1.0]),
            dict(machine="machine", outputs="place", speeds="numbers", kind="choice", at="at",
                 shaft="station"),
        ),
        "order_response": (
            dict(machine=machine, outputs="main.x", speeds=[1.0], orders=[1.0]),
            dict(machine="machine", outputs="place", speeds="numbers", orders="numbers", at="at",
                 shaft="station"),
        ),
        "unbalance_peak": (
            dict(machine=machine, output="main.x", start=1.0, stop=9.0),
            dict(machine="machine", output="place", start="number", stop="number", points="count",
                 at="at"),
        ),
        "h2_norm": (pair, ends),
        "h_infinity_norm": (pair, {**ends, "points": "count"}),
        "response_peaks": (
            {**pair, "start": 1.0, "stop": 9.0},
            {**ends, "start": "number", "stop": "number", "count": "count", "points": "count"},
        ),
        "lyapunov": (dict(A=-EYE, Q=EYE), dict(A="matrix", Q="matrix")),
        "riccati": (regulator, regulators),
        "lqr": (regulator, regulators),
        "closed_loop_cost": (
            {**regulator, "K": EYE, "X0": EYE}, {**regulators, "K": "matrix", "X0": "matrix"}
        ),
        "full_spectrum": (
            dict(x=WAVE, y=WAVE, sample_rate=64.0),
            dict(x="signal", y="signal", sample_rate="positive", window="choice"),
        ),
        "filtered_orbit": (orbit, {**orbits, "orders": "numbers", "window": "choice"}),
        "orbit": (orbit, {**orbits, "turns": "count"}),
        "shaft_centreline": (orbit, {**orbits, "turns": "count"}),
        "turn_instants": (
            dict(angle=ANGLE, sample_rate=64.0),
            dict(angle="signal", sample_rate="positive", phase="number"),
        ),
        "poincare": (
            dict(x=WAVE, v=WAVE, angle=ANGLE, sample_rate=64.0),
            dict(x="signal", v="signal", angle="signal", sample_rate="positive", phase="number",
                 every="count"),
        ),
        "order_tracking": (
            dict(signal=WAVE, angle=ANGLE, sample_rate=64.0),
            dict(signal="signal", angle="signal", sample_rate="positive", orders="numbers",
                 turns="count", window="choice"),
        ),
        "waterfall": (
            dict(x=WAVE, speed=ANGLE, sample_rate=64.0),
            dict(x="signal", speed="signal", sample_rate="positive", window="choice",
                 overlap="number"),
        ),
        "angle_of": (dict(instants=T, pulses=8), dict(instants="rising", pulses="count", first="number")),
        "speed_of": (dict(instants=T, pulses=8), dict(instants="rising", pulses="count")),
        "pulse_times": (
            dict(response=response, station="main", pulses=8),
            dict(response="object", station="station", pulses="count"),
        ),
        "keyway": (
            dict(diameter=0.05, width=0.01, depth=0.005),
            dict(diameter="positive", width="positive", depth="positive", angle="number"),
        ),
        "identify": (
            fit,
            dict(machine="machine", parameters="outputs", sensors="outputs", data="object",
                 shaft="station", progress="flag", stages="object"),
        ),
        "optimize": (
            dict(machine=machine, parameters=["main.mass"], objective=jr.TotalMass()),
            dict(machine="machine", parameters="outputs", objective="object", iterations="count",
                 tolerance="positive", reverse="flag", progress="flag", constraints="text"),
        ),
        "sweep": (
            swept,
            {**sweeps, "solver": "solver", "step": "step", "rtol": "positive", "atol": "positive",
             "chunk": "count", "progress": "flag", "resume": "flag"},
        ),
        "local_slopes": (swept, {**sweeps, "chunk": "count"}),
        "bifurcation": (
            dict(machine=machine, parameters=cases, quantity=jr.Radial("main"), shaft="main"),
            dict(machine="machine", parameters="mapping", quantity="object", shaft="station",
                 drop="count", keep="count", phase="number", samples="count"),
        ),
        "profiles": (
            dict(found=found),
            dict(found="object", reach="positive", points="count", iterations="count",
                 progress="flag"),
        ),
        "bootstrap": (
            dict(found=found),
            dict(found="object", count="count", seed="count", level="positive", iterations="count"),
        ),
        "posterior": (
            dict(found=found),
            dict(found="object", draws="count", warmup="count", chains="count", seed="count",
                 progress="flag"),
        ),
        "read_record": (dict(path="nowhere.csv"), dict(path="object")),
        "load": (dict(path="nowhere.toml"), dict(path="object")),
    }  # fmt: skip


def bad_functions():
    machine = line()
    model = object.__new__(jr.LinearModel)
    found = object.__new__(jr.Identification)
    response = at_instants(machine, np.zeros((2, 6)), np.zeros((2, 6)))
    record = jr.Record({"x": jr.Series(T, WAVE)})
    for name, (right, kinds) in functions(machine, model, response, found, record).items():
        function = getattr(jr, name)
        parameters = inspect.signature(function).parameters
        for key, kind in kinds.items():
            for value in BAD[kind]:
                if key in parameters and value is None and parameters[key].default is None:
                    continue
                if kind == "number" and key == "reach" and value == -1:
                    continue
                yield (
                    f"{name}({key}={shown(value)})",
                    lambda f=function, k={**right, key: value}: f(**k),
                )
        yield f"{name}(misspelt)", lambda f=function, k=right: f(**k, sampel_rate=1.0)


def outcome(call, seconds=5):
    """'refused', or what came instead of a sentence."""

    def too_long(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, too_long)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        got = call()
    except jr.InputError as error:
        long = max(map(len, error.problems))
        return "refused" if long < 500 and "\n" not in error.problems[0] else f"{long} characters"
    except TimeoutError:
        return "hangs"
    except Exception as error:
        return f"raw {type(error).__name__}: {str(error)[:100]}"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    return f"accepted: {shown(got)}"


# Calls of no common kind: what the measurement that found them named, and methods.


def named():
    m, nan = line(), float("nan")
    model = object.__new__(jr.LinearModel)
    radial = jr.Radial("main")
    record = jr.Record({"x": jr.Series(T, WAVE)})
    uneven = [[1.0, 2.0], [3.0]]
    orbit = jr.orbit(WAVE, WAVE, ANGLE, 64.0)
    response = at_instants(m, np.zeros((2, 6)), np.zeros((2, 6)))
    campbell = jr.Campbell(np.zeros(2), np.zeros((2, 1)), np.zeros((2, 1)), ("a",), ("lateral",))
    transient = jr.Transient(0.1, 1000.0)
    return {
        "machine of None": lambda: jr.Machine(None),
        "machine of a list": lambda: jr.Machine([jr.Rotor(1, 1, 1)], {}),
        "connections of None": lambda: jr.Machine({"a": jr.Rotor(1, 1, 1)}, None),
        "line of None": lambda: jr.Machine.in_line(None),
        "attachments as a list": lambda: jr.Machine.in_line(m.elements(), [1]),
        "fixed to a number": lambda: jr.Machine({"a": jr.Rotor(1, 1, 1)}, {}, fixed={"a": 3}),
        "fixed as a text": lambda: jr.Machine({"a": jr.Rotor(1, 1, 1)}, {}, fixed="a"),
        "fixed a number": lambda: jr.Machine({"a": jr.Rotor(1, 1, 1)}, {}, fixed={"a": [3]}),
        "prescribed to a number": lambda: jr.Machine({"a": jr.Rotor(1, 1, 1)}, {}, prescribed={"a": 3}),
        "prescribed a text": lambda: jr.Machine({"a": jr.Rotor(1, 1, 1)}, {}, prescribed={"a": {"x": "y"}}),
        "gravity of text": lambda: jr.Machine({"a": jr.Rotor(1, 1, 1)}, {}, gravity="down"),
        "gravity downwards": lambda: jr.Machine({"a": jr.Rotor(1, 1, 1)}, {}, gravity=9.81),
        "get a number": lambda: m.get(3),
        "get None": lambda: m.get(None),
        "get nobody": lambda: m.get("nobody.mass"),
        "units of a number": lambda: m.units(3),
        "an element by number": lambda: m[3],
        "set a list": lambda: m.set([("main.mass", 3.0)]),
        "set by number": lambda: m.set({3: 3.0}),
        "set to text": lambda: m.set({"main.mass": "heavy"}),
        "set to True": lambda: m.set({"main.mass": True}),
        "set to a date": lambda: m.set({"main.mass": np.datetime64("2026-01-01")}),
        "set an option": lambda: m.set({"shaft.shear": True}),
        "set by half a path": lambda: m.set({"main.": 1.0}),
        "part of a response by number": lambda: response[3],
        "part of a response": lambda: response["nobody"],
        "no time end": lambda: jr.simulate(m, 1e12, 1000.0),
        "samples beyond memory": lambda: jr.simulate(m, 1e5, 1e6),
        "rate beyond memory": lambda: jr.simulate(m, 1.0, 1e15),
        "plan back in time": lambda: jr.plan(m, -1.0, 1000.0),
        "plan at nan": lambda: jr.plan(m, 1.0, 1000.0, speed=nan),
        "plan without tolerance": lambda: jr.plan(m, 1.0, 1000.0, tolerance=0.0),
        "endless tolerance": lambda: jr.simulate(m, 1.0, 1000.0, solver=jr.Rosenbrock(), rtol=1e300),
        "linearize at nan": lambda: jr.linearize(m, nan),
        "frequencies of nan": lambda: jr.frequency_response(m, "main.x", "main.x", [nan]),
        "range the wrong way": lambda: jr.unbalance_peak(m, "main.x", 9.0, 1.0),
        "no range": lambda: jr.response_peaks(m, "main.x", "main.x", 5.0, 5.0),
        "threshold the wrong way": lambda: jr.stability_threshold(m, 100.0, 1.0),
        "interferences of no order": lambda: jr.interferences(m, [], (1.0, 2.0)),
        "half an element": lambda: jr.FiniteElementShaft(0.2, 0.01, elements=2.5),
        "too many elements": lambda: jr.FiniteElementShaft(0.2, 0.01, elements=10**19),
        "misspelt length": lambda: jr.Shaft(lenght=0.2, diameter=0.01),
        "too many arguments": lambda: jr.Tachometer("main", 1, 2),
        "no arguments": lambda: jr.Rotor(),
        "force towards nowhere": lambda: attached(jr.Force(1.0, direction=(0, 0, 0))),
        "balls that cannot fit": lambda: attached(jr.RollingBearing(1e9, 0.01, 0.05, balls=20)),
        "no planes": lambda: jr.Unbalance.from_planes([], 1.0, 1.0, 0.5),
        "planes of two": lambda: jr.Unbalance.from_planes([(1e-5, 0.0)], 1.0, 1.0, 0.5),
        "planes of text": lambda: jr.Unbalance.from_planes([("a", "b", "c")], 1.0, 1.0, 0.5),
        "planes of None": lambda: jr.Unbalance.from_planes(None, 1.0, 1.0, 0.5),
        "planes without mass": lambda: jr.Unbalance.from_planes([(1e-5, 0.0, 0.1)], 0.0, 1.0, 0.5),
        "no masses": lambda: jr.Unbalance.from_masses([], 1.0, 1.0, 0.5),
        "masses of three": lambda: jr.Unbalance.from_masses([(1, 2, 3)], 1.0, 1.0, 0.5),
        "masses of None": lambda: jr.Unbalance.from_masses(None, 1.0, 1.0, 0.5),
        "grade of text": lambda: jr.Unbalance.from_grade("G 2.5", 100.0),
        "grade of zero": lambda: jr.Unbalance.from_grade(0.0, 100.0),
        "grade at no speed": lambda: jr.Unbalance.from_grade(2.5, 0.0),
        "grade of nan": lambda: jr.Unbalance.from_grade(nan, 100.0),
        "one plane": lambda: jr.Unbalance(1e-5).in_planes((0.1,), 1.0, 1.0, 0.5),
        "planes at one place": lambda: jr.Unbalance(1e-5).in_planes((0.1, 0.1), 1.0, 1.0, 0.5),
        "planes as text": lambda: jr.Unbalance(1e-5).in_planes("ab", 1.0, 1.0, 0.5),
        "order of a solver": lambda: jr.ExponentialAdams(order=9),
        "half an order": lambda: jr.ExponentialAdams(order=2.5),
        "no substeps": lambda: jr.ExponentialAdams(substeps=0),
        "substeps of text": lambda: jr.ETD4RK(substeps="3"),
        "misspelt solver option": lambda: jr.ExponentialAdams(oder=6),
        "stage of nothing": lambda: jr.Stage(None),
        "stage without iterations": lambda: jr.Stage(jr.Time(), iterations=0),
        "unknown without a path": lambda: jr.Unknown(3),
        "unknown's bounds": lambda: jr.Unknown("main.mass", bounds=(1.0,)),
        "unknown's bounds of text": lambda: jr.Unknown("main.mass", bounds=("a", "b")),
        "unknown's three bounds": lambda: jr.Unknown("main.mass", bounds=(1.0, 2.0, 3.0)),
        "unknown that is perhaps positive": lambda: jr.Unknown("main.mass", positive="yes"),
        "unknown's scale": lambda: jr.Unknown("main.mass", scale=-1.0),
        "unknown's start": lambda: jr.Unknown("main.mass", start="3 kg"),
        "unknown's ties": lambda: jr.Unknown("main.mass", also=["end.mass"]),
        "unknown misspelt": lambda: jr.Unknown("main.mass", postive=True),
        "trial of no record": lambda: jr.Trial("run.csv"),
        "trial's rate": lambda: jr.Trial(record, sample_rate=-1.0),
        "trial's start": lambda: jr.Trial(record, initial="xyz"),
        "trial's speed": lambda: jr.Trial(record, speed="fast"),
        "trial's conditions": lambda: jr.Trial(record, conditions=[1]),
        "record of numbers": lambda: jr.Record({"x": [1, 2, 3]}),
        "record of a list": lambda: jr.Record([1]),
        "series of text": lambda: jr.Series(["a"] * 4, [1.0] * 4),
        "series of unequal lengths": lambda: jr.Series([1.0, 2.0], [1.0]),
        "series of rows": lambda: jr.Series(uneven, uneven),
        "series of True": lambda: jr.Series([0.0, 1.0, 2.0, 3.0], [True, False, True, True]),
        "series of complex numbers": lambda: jr.Series([0.0, 1.0, 2.0, 3.0], [1j] * 4),
        "series in no unit": lambda: jr.Series(T, WAVE, unit=3),
        "a channel by number": lambda: record[3],
        "a channel of nobody": lambda: record["y"],
        "cases of nothing": lambda: jr.Cases({}),
        "cases of a number": lambda: jr.Cases({"main.mass": 3.0}),
        "cases of text": lambda: jr.Cases({"main.mass": ["a"]}),
        "cases by number": lambda: jr.Cases({3: [1.0]}),
        "grid of None": lambda: jr.Cases.grid(None),
        "grid beyond memory": lambda: jr.Cases.grid({x: np.arange(10.0**4) for x in "abcd"}),
        "samples of nothing": lambda: jr.Cases.sampled({}, 8),
        "samples of a number": lambda: jr.Cases.sampled({"main.mass": 3.0}, 8),
        "too many samples": lambda: jr.Cases.sampled({"main.mass": 3.0}, 10**12),
        "samples by no method": lambda: jr.Cases.sampled({"main.mass": 3.0}, 8, method="dice"),
        "samples by a seed of text": lambda: jr.Cases.sampled({"main.mass": 3.0}, 8, seed="a"),
        "ties of a list": lambda: jr.Cases({"main.mass": [1.0]}).tied([1]),
        "variations of None": lambda: jr.Variations(None),
        "variations of text": lambda: jr.Variations({"main.mass": "a"}),
        "variations of True": lambda: jr.Variations({"main.mass": [True]}),
        "spread of 2": lambda: jr.Variations.uniform(m, spread=2.0),
        "spread of text": lambda: jr.Variations.uniform(m, spread="a lot"),
        "no variation": lambda: jr.Variations.uniform(m, count=1),
        "variations of no machine": lambda: jr.Variations.uniform("m"),
        "variations of no path": lambda: jr.Variations.uniform(m, paths=3),
        "variations by a seed of text": lambda: jr.Variations.uniform(m, seed="a"),
        "run without end": lambda: jr.Transient(-1.0, 1000.0),
        "run in text": lambda: jr.Transient("1 s", 1000.0),
        "run of no rate": lambda: jr.Transient(1.0, nan),
        "run over the worst": lambda: transient.measure(jr.PeakValue(radial), over="best"),
        "run measured by text": lambda: transient.measure("peak"),
        "a measure's sensor": lambda: jr.PeakValue("main"),
        "a measure's window": lambda: jr.PeakValue(radial, start=-1.0),
        "a measure's end": lambda: jr.PeakValue(radial, stop="end"),
        "a share above one": lambda: jr.Percentile(radial, share=1.5),
        "a power of minus one": lambda: jr.Integral(radial, power=-1),
        "a mean of text": lambda: jr.RootMeanSquare(radial, about="median"),
        "turns to keep": lambda: jr.OnceATurn(radial, "main", 0),
        "peaks the wrong way": lambda: jr.ResponsePeaks("main.x", "main.x", 9.0, 1.0),
        "no peaks": lambda: jr.ResponsePeaks("main.x", "main.x", 1.0, 9.0, count=0),
        "peaks at a place by number": lambda: jr.ResponsePeaks(3, "main.x", 1.0, 9.0),
        "unbalance the wrong way": lambda: jr.UnbalancePeak("main.x", 9.0, 1.0),
        "norm about nothing": lambda: jr.H2Norm("main.x", "main.x", at="xyz"),
        "decay with perhaps torsion": lambda: jr.DecayRate(torsion="perhaps"),
        "poles near nothing": lambda: jr.PoleMean(near="a"),
        "poles without number": lambda: jr.PoleMean(near=(0.0, 1.0), count=0),
        "every zeroth": lambda: jr.TimeSeries(radial, every=0),
        "series of no sensor": lambda: jr.TimeSeries("main"),
        "edges that fall": lambda: jr.sweep(
            m, {"main.mass": [6.0]}, {"a": jr.OverSpeed(radial, "main", [2.0, 1.0])}
        ),
        "edges of one": lambda: jr.sweep(
            m, {"main.mass": [6.0]}, {"a": jr.OverSpeed(radial, "main", [2.0])}
        ),
        "orders of zero": lambda: jr.Orders(orders=(0.0,)),
        "orders of text": lambda: jr.Orders(orders="1"),
        "orders within no turn": lambda: jr.Orders(turns=0.0),
        "an envelope of text": lambda: jr.Orders(envelope="yes"),
        "frequencies the wrong way": lambda: jr.Frequencies(9.0, 1.0),
        "frequencies of text": lambda: jr.Frequencies("1 Hz", "2 Hz"),
        "frequencies of nan in a domain": lambda: jr.Frequencies(nan, 2.0),
        "a channel of no sensor": lambda: jr.identify(m, ["main.mass"], {"x": 3}, record),
        "a channel's order": lambda: jr.Channel(radial, cutoff=10.0, order=0),
        "a channel's unit": lambda: jr.Channel(radial, unit=3),
        "noise of text": lambda: jr.identify(
            m, ["main.mass"], {"x": jr.Channel(radial, noise=jr.Noise("a"))}, record
        ),
        "no shares of the mean": lambda: campbell.crossings("1"),
        "crossings of nan": lambda: campbell.crossings(nan),
        "an ellipse of no order": lambda: orbit.ellipse(3.0),
        "an ellipse of text": lambda: orbit.ellipse("1"),
        "a phasor of text": lambda: jr.phasor("a", 3.0),
        "influence of text": lambda: jr.influence_coefficients("a", "b", "c"),
        "influence of nan": lambda: jr.influence_coefficients([nan], [1.0], [[1.0]]),
        "influence of rows": lambda: jr.influence_coefficients(uneven, uneven, uneven),
        "balance of text": lambda: jr.balance("a", "b"),
        "balance of nan": lambda: jr.balance([nan], [[1.0]]),
        "balance by weights": lambda: jr.balance([1.0], [[1.0]], weights=[-1.0]),
        "balance by two weights": lambda: jr.balance([1.0], [[1.0]], weights=[1.0, 2.0]),
        "balance with scatter": lambda: jr.balance([1.0], [[1.0]], std="a"),
        "modal balance of text": lambda: jr.modal_balance("a", ["p"], [1.0]),
        "modal balance of numbers": lambda: jr.modal_balance([[1.0]], 3, [1.0]),
        "modal balance of nan": lambda: jr.modal_balance([[nan]], ["p"], [1.0]),
        "a design of no parameter": lambda: jr.optimize(m, [], jr.TotalMass()),
        "a design for a text": lambda: jr.optimize(m, ["main.mass"], "mass"),
        "a design with a limit of text": lambda: jr.optimize(m, ["main.mass"], jr.TotalMass(), ["light"]),
        "a limit of text": lambda: jr.TotalMass() <= "light",
        "a limit of nan": lambda: jr.TotalMass() <= nan,
        "a design from nowhere": lambda: jr.optimize(m, ["main.mass"], jr.TotalMass(), starts=3),
        "a design from a list": lambda: jr.optimize(m, ["main.mass"], jr.TotalMass(), starts=[3]),
        "identification from a list": lambda: jr.identify(
            m, ["main.mass"], {"x": radial}, record, starts=[3]
        ),
        "identification from text": lambda: jr.identify(
            m, ["main.mass"], {"x": radial}, record, starts=[{"main.mass": "a"}]
        ),
        "a sweep of nothing": lambda: jr.sweep(m, {}, {"a": jr.TotalMass()}),
        "a sweep into a number": lambda: jr.sweep(m, {"main.mass": [6.0]}, {"a": jr.TotalMass()}, store=3),
        "a sweep by a text": lambda: jr.sweep(m, {"main.mass": [6.0]}, {"a": jr.TotalMass()}, client="dask"),
        "shares of text": lambda: jr.sobol_indices(m, {"main.mass": "a"}, {"a": jr.TotalMass()}),
        "shares of no count": lambda: jr.sobol_indices(m, {"main.mass": "a"}, {"a": jr.TotalMass()}, 0),
        "an audit of no machine": lambda: jr.energy_audit(None, 1.0, 1000.0),
        "a state of text": lambda: jr.simulate(m, 0.1, 1000.0, initial=jr.State("a", "b")),
        "a State of nothing": lambda: jr.State(),
        "poles of a model by text": lambda: jr.modes(model, "all"),
        "a keyway wider than the shaft": lambda: jr.keyway(0.05, 0.06, 0.01),
        "a parameter of no unit": lambda: jr.parameter(3),
        "material of text": lambda: joint(jr.Shaft(0.2, 0.012, material="steel")),
        "a sampled torque without period": lambda: loop(jr.SampledTorque(jr.PD(1.0), 0.0)),
        "a sampled torque's seed": lambda: loop(jr.SampledTorque(jr.PD(1.0), 1e-3, seed=-1)),
        "a network of no width": lambda: jr.NeuralController.initial_weights(0),
        "load of a folder": lambda: jr.load("."),
        "record of nothing": lambda: jr.read_record("nowhere.toml"),
    }  # fmt: skip
