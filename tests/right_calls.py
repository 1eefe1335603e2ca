"""Right calls of every public part and function, for tests that spoil one argument of them; and what each
kind of argument cannot be."""

import numpy as np

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
    "span": ["3 mm", None, {}, [0.0, NAN], [2.0, 1.0], [3.0], ["x", "y"], 5.0],
    "signal": ["x", None, 3.0, [1.0], np.full(64, NAN), np.zeros((8, 8)), {}, ["a"] * 64],
    "matrix": ["x", None, [1.0], np.full((2, 2), NAN), np.zeros((2, 3)), {}, [["a", "b"]] * 2],
    "mapping": [3, "main.mass", [1, 2], {3: [1.0]}, {"main.mass": "x"}, {"nobody.mass": [1.0]}, {}],
    "outputs": [3, "peak", {}, {"a": 3}, {"a": jr.sensors.Radial}, [jr.sensors.Radial("main")]],
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
    if "third" in at:
        parts |= {"joint": jr.Shaft(0.2, 0.012), "third": jr.Rotor(6.0, 0.0187, 0.0102)}
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


def planets(element):
    return line(extra=element, at=("main", "end", "third"))


def law(x):
    return attached(jr.LawSupport(x=x))


def profile(x):
    return attached(jr.Torque(x))


def motion(x):
    return line(end=jr.PrescribedSpin(x))


def flaw(x):
    return joint(jr.Shaft(0.2, 0.012, flaw=x))


def controller(x):
    return line(extra=jr.elements.ActiveTorque(x), at=("main", "end"))


def loop(x):
    return line(extra=x, at=("main", "end"))


def defect(x):
    return attached(jr.RollingBearing(1e9, 0.01, 0.05, defects=(x,)))


def amplified(x):
    return attached(jr.elements.MagneticBearing(MAGNETS, LEVITATOR, x))


def levitated(x):
    return attached(jr.elements.MagneticBearing(MAGNETS, x))


def magnet(x):
    return attached(jr.elements.MagneticBearing(x, LEVITATOR))


def grounded(x):
    return attached(jr.elements.MovingBase(x, ((0.0, 0.1, 0.2),), SIX))


SIX = (1e3,) * 6
SHAKEN = jr.elements.BaseMotion(y=jr.profiles.HarmonicMotion((1e-4,), (3.0,)))
EYE = np.eye(2)
MAGNETS, LEVITATOR = jr.elements.LinearMagnet(100.0, 5e5), jr.elements.PID(1e4, 10.0)
# Seals' arguments.
LIQUID = (0.2, 0.1, 4e-4, 4e5, 8e-4, 996.0)
GAS = (0.2, 3e-4, 4e-3, 3.5e-3, 6e5, 3.5e5, 320.0, 188.9, 1.6e-5)
TEETH = jr.elements.ToothMesh(jr.elements.KelvinVoigt(1e8))
GEARS = jr.elements.GearPair((20, 40), 0.01, 0.05)
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
    "GearMesh": (joint, ((0.1, 0.2), jr.elements.KelvinVoigt(1e8))),
    "InvoluteMesh": (joint, (GEARS, 1e3, 10.0, 0.1, (), (), 0.5)),
    "PlanetaryGear": (planets, ((24, 36, 96), 0.03, 1e-3, TEETH, TEETH, (0.5,))),
    "RigidGears": (station, ((0.1, 0.2), (1.0, 2.0))),
    "AddedInertia": (attached, (0.1,)),
    "Brake": (attached, (1.0,)),
    "DCMotor": (attached, (1.0, 1e-3, 0.1, 12.0)),
    "EngineTorque": (attached, (1.0, (2.0,), (3.0,))),
    "FanLoad": (attached, (1e-3,)),
    "Force": (attached, (1.0,)),
    "InductionMotor": (attached, (0.5, 0.4, 0.08, 0.08, 0.07, 230.0, 50.0)),
    "InverterDrive": (
        attached,
        (jr.elements.PI(1.0, 2.0), jr.elements.SpeedError(10.0), (6.0,), (0.1,)),
    ),
    "KlossMotor": (attached, (10.0, 0.1, 157.0)),
    "LawSupport": (attached, (jr.elements.KelvinVoigt(1e5),)),
    "LinearSupport": (attached, (SIX,)),
    "MovingBase": (attached, (SHAKEN, ((0.0, 0.1, 0.2),), SIX)),
    "FoundationBlock": (
        attached,
        (9.0, (1.0, 1.2, 1.5), ((0.0, 0.1, 0.2),), SIX, ((0.0, -0.1, 0.0),), SIX),
    ),
    "ModalFoundation": (attached, ((3.0, 5.0), 0.1, np.full((1, 3, 2), 0.1), SIX)),
    "MeasuredFoundation": (
        attached,
        (
            ((0.0, 1.0), (-4.0, -0.1)),
            ((0.0, 0.0), (1.0, 0.5)),
            ((1.0, 0.0), (0.5, 0.0)),
            SIX,
            (0.0,) * 6,
            2,
        ),
    ),
    "BaseMotion": (grounded, (jr.profiles.HarmonicMotion((1e-4,), (3.0,)),)),
    "Rub": (attached, (1e-3, 1e6, 0.1)),
    "SpeedDependentSupport": (attached, ((0.0, 100.0), (SIX, SIX), (SIX, SIX))),
    "SpeedGovernor": (attached, (10.0, 1.0, 1.0, 5.0)),
    "SpeedTorque": (attached, ((0.0, 10.0), (1.0, 2.0))),
    "SynchronousStart": (attached, ((0.0, 180.0), (9.0, 0.0), (5.0, 6.0), 60.0)),
    "SynchronousMachine": (
        attached,
        (0.1, 0.01, 0.1, 0.07, 0.01, 0.02, 0.1, 0.02, (0.1,), (0.02,), 5.0, 230.0, 50.0),
    ),
    "TorqueRipple": (attached, ((6.0,), (0.0, 100.0), ((1.0,), (2.0,)))),
    "Torque": (attached, (1.0,)),
    "TorsionalDamper": (attached, (0.1, 1.0)),
    "JournalBearing": (attached, (0.05, 0.03, 1e-4, 0.01)),
    "SqueezeFilmDamper": (attached, (0.05, 0.03, 1e-4, 0.01)),
    "AnnularSeal": (attached, LIQUID),
    "LabyrinthSeal": (attached, GAS),
    "FixedPadBearing": (
        attached,
        (0.05, 0.03, 1e-4, 0.01, (0.0, -200.0), (100.0, 200.0), (-1.57, 1.57), 2.8, 0.1, 0.5),
    ),
    "TiltingPadBearing": (
        attached,
        (
            0.05,
            0.03,
            1e-4,
            0.01,
            (0.0, -200.0),
            (100.0, 200.0),
            (0.0, 200.0),
            (-1.57, 0.0, 1.57),
            1.2,
            0.3,
        ),
    ),
    "RollingBearing": (attached, (1e9, 0.01, 0.05)),
    "RadialBearing": (attached, (jr.elements.KelvinVoigt(1e6),)),
    "SwitchedDamper": (loop, (0.1, 1.0, 0.1, 0.1)),
    "ActiveTorque": (loop, (jr.elements.PD(1.0, 0.1),)),
    "SampledTorque": (loop, (jr.elements.PD(1.0, 0.1), 1e-3)),
    "Actuator": (lambda x: loop(jr.elements.ActiveTorque(jr.elements.PD(1.0), actuator=x)), (5.0,)),
    "PD": (controller, (1.0, 0.1)),
    "PI": (controller, (1.0, 0.1)),
    "PositivePositionFeedback": (controller, (1.0, 30.0)),
    "ResonantController": (controller, (1.0, 30.0)),
    "MagneticBearing": (attached, (MAGNETS, LEVITATOR)),
    "Electromagnets": (magnet, (2.0, 4e-4, 150.0, 2e-4)),
    "LinearMagnet": (magnet, (100.0, 5e5)),
    "CurrentAmplifier": (amplified, (2.0, 1e3)),
    "PID": (levitated, (1e4, 10.0)),
    "TransferFunction": (levitated, ((1e4, 2e7), (1.0, 3e3))),
    "StateSpace": (levitated, (-EYE, np.ones(2), np.ones(2))),
    "InSeries": (levitated, ((LEVITATOR, jr.elements.TransferFunction((1.0,), (1e-3, 1.0))),)),
    "KelvinVoigt": (law, (1e5,)),
    "Backlash": (law, (1e-4, 1e5)),
    "Bilinear": (law, (1e5, 2e5)),
    "BoucWen": (law, (1e5, 0.1, 1e-4)),
    "Maxwell": (law, (1e5, 10.0)),
    "Progressive": (law, ((1e5, 1e9),)),
    "TabulatedLaw": (law, ((0.0, 1.0, 2.0), (0.0, 1.0, 3.0))),
    "Steady": (profile, (1.0,)),
    "Step": (profile, (0.1, 1.0)),
    "Ramp": (profile, (0.1, 0.1, 1.0)),
    "Harmonic": (profile, (1.0, (1.0,), (20.0,))),
    "Impulse": (profile, (0.1, 0.1, 1.0)),
    "PulseTrain": (profile, (0.1, 0.05, 1.0)),
    "ShortCircuit": (profile, (0.1, 60.0, 100.0)),
    "Reclosing": (profile, (0.1, 0.2, 0.3, 60.0, 100.0)),
    "Table": (profile, ((0.0, 1.0), (0.0, 1.0))),
    "ConstantSpeed": (motion, (100.0,)),
    "CosineRamp": (motion, (100.0, 1.0)),
    "LinearRamp": (motion, (100.0, 1.0)),
    "SpeedTable": (motion, ((0.0, 1.0), (0.0, 100.0))),
    "AccelerationRecord": (motion, ((0.0, 1.0, 2.0), (0.0, 1.0, 2.0))),
    "HarmonicMotion": (motion, ((0.1, 0.2), (1.0, 2.0))),
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
    "NamedMaterial": (lambda x: joint(jr.Shaft(0.2, 0.012, material=x)), ("42CrMo4",)),
    "BallDefect": (defect, (0.0, 0.1, 1e-5)),
    "InnerRaceDefect": (defect, (0.0, 0.1, 1e-5)),
    "OuterRaceDefect": (defect, (0.0, 0.1, 1e-5)),
}


POINT = jr.periodic.SpecialPoint("fold", 100.0, 0, None)

# Functions: how a right call looks, and of which kind each argument is.

T = np.arange(64) / 64.0
WAVE = np.sin(2 * np.pi * 4 * T)
ANGLE = 2 * np.pi * 4 * T


def standards(machine):
    """The functions of `jr.standards`."""
    ranged = dict(machine=machine, unbalance={"main": 1e-5})
    looks = dict(machine="machine", unbalance="object", count="count", points="count", at="at")
    margin = dict(least=50.0, greatest=80.0)
    margins = dict(least="positive", greatest="positive")
    grade = dict(mass=10.0, speed=300.0)
    grades = dict(mass="positive", speed="positive", grade="positive")
    holes = dict(correction=1e-5, angles=[0.0, 1.0, 2.0, 4.0], radius=0.1)
    impeller = dict(power=1e6, speed=1e3, diameter=0.5, height=0.02)
    return {
        "resonances": (
            dict(ranged, probe="main.x", start=20.0, stop=90.0),
            dict(looks, probe="object", start="positive", stop="positive", drop="positive"),
        ),
        "placed_response": (
            dict(ranged, outputs="main.x", speeds=[30.0]),
            dict(machine="machine", unbalance="object", speeds="numbers", at="at"),
        ),
        "amplification_factors": (dict(found=3), dict(found="object")),
        "separation_margins": (
            dict(ranged, probes="main.x", **margin),
            dict(looks, probes="object", **margins, start="positive", stop="positive"),
        ),
        "unbalance_response_check": (
            dict(machines=machine, probes="main.x", unbalance={"main": 1e-5}, **margin),
            dict(machines="object", probes="object", unbalance="object", **margins, trip="positive"),
        ),
        "required_margins": (dict(factor=5.0), dict(most_below="positive", most_above="positive")),
        "residual_unbalance_of_api": (grade, dict(mass="number", speed="positive", constant="positive")),
        "probe_limit": (dict(speed=1e3), dict(speed="positive", most="positive", knee="positive")),
        "scale_factor": (dict(limit=1.0, amplitude=1.0), dict(most="positive")),
        "unbalance_cases": (
            dict(machine=machine, speed=300.0), dict(machine="machine", speed="positive", count="count")
        ),
        "at_clearances": (
            dict(machine=machine, clearances={"bearing": (1e-5, 2e-5)}),
            dict(machine="machine", clearances="object"),
        ),
        "anticipated_cross_coupling": (
            impeller, dict(speed="positive", diameter="positive", height="positive", constant="positive")
        ),
        "stability_chart": (
            dict(machine=machine, place="main", speed=100.0),
            dict(machine="machine", place="station", speed="number", cross_couplings="numbers", at="at"),
        ),
        "rigid_critical_speed": (
            dict(machine=machine), dict(machine="machine", bearings="text", stiffness="positive")
        ),
        "level_two": (
            dict(machine=machine, speed=100.0), dict(machine="machine", speed="number", at="at")
        ),
        "permissible_unbalance": (grade, grades),
        "in_two_planes": (dict(unbalance=1.0, planes=[0.0, 1.0], centre=0.5), dict(planes="numbers")),
        "residual_unbalance": (dict(grade, residual=1e-5), dict(grades, planes="numbers")),
        "split_correction": (holes, dict(angles="numbers", radius="numbers")),
        "fill_holes": (
            dict(holes, masses=[1e-3]), dict(angles="numbers", masses="numbers", most="count")
        ),
        "shaft_zone_limits": (dict(speed=300.0), dict(speed="positive", constants="rising")),
        "shaft_vibration": (
            dict(amplitude=1e-5, speed=300.0), dict(speed="positive", accepted="choice")
        ),
        "housing_zone_limits": ({}, dict(group="choice", support="choice")),
        "housing_vibration": (dict(velocity=1e-3), dict(group="choice", accepted="choice")),
        "peak_sensitivity": (
            dict(machine=machine, loop="bearing"),
            dict(machine="machine", loop="text", speed="number", points="count"),
        ),
        "loop_sensitivity": (
            dict(machine=machine, loop="bearing"),
            dict(machine="machine", loop="text", speed="number", accepted="choice"),
        ),
    }  # fmt: skip


def functions(machine, model, response, found, record):
    radial = {"peak": jr.objectives.PeakValue(jr.sensors.Radial("main"))}
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
    excitation = jr.standards.TorsionalExcitation("main 1x", 1.0, "main")
    meeting = dict(
        machine=machine,
        excitation=excitation,
        torque=1.0,
        station="main",
        shaft="shaft",
        speeds=(10.0, 20.0),
    )
    curve = jr.standards.SNCurve([2e8, 1e8], [1e3, 1e6])
    fit = dict(
        machine=machine,
        parameters=["main.mass"],
        sensors={"x": jr.sensors.Radial("main")},
        data=record,
    )
    return {
        **standards(machine),
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
            dict(machine="machine", stiffness="numbers", supports="text", count="count", progress="flag"),
        ),
        "stability_threshold": (
            dict(machine=machine, start=1.0, stop=100.0),
            dict(machine="machine", start="number", stop="number", points="count", at="at"),
        ),
        "interferences": (
            dict(machine=machine, orders=[1.0], speeds=(1.0, 10.0)),
            dict(machine="machine", orders="numbers", speeds="rising", count="count", at="at"),
        ),
        "torsional_excitations": (
            dict(machine=machine),
            dict(machine="machine", line_frequency="positive", orders="numbers", mesh="flag"),
        ),
        "torsional_separation": (
            dict(machine=machine, speeds=(10.0, 20.0)),
            dict(machine="machine", speeds="span", excitations="object", line_frequency="positive",
                 margin="number", count="count", each="flag", at="at"),
        ),
        "torsional_margin": (
            dict(natural=1.0, low=2.0, high=3.0), dict(natural="number", low="number", high="number")
        ),
        "torque_at_meeting": (
            meeting,
            dict(machine="machine", excitation="object", torque="number", station="station",
                 shaft="text", speeds="span", mode="count", at="at"),
        ),
        "torsional_life": (
            {**meeting, "curve": curve, "hours": 10.0, "diameter": 0.05},
            dict(machine="machine", excitation="object", torque="number", station="station",
                 shaft="text", speeds="span", curve="object", hours="positive", mode="count",
                 diameter="positive", inner_diameter="number", concentration="positive",
                 mean_torque="number", at="at"),
        ),
        "cycle_damage": (
            dict(torque=WAVE, curve=curve), dict(torque="numbers", curve="object", per_torque="number")
        ),
        "starts_allowed": (
            dict(torque=WAVE, curve=curve, starts=10.0),
            dict(torque="numbers", curve="object", starts="positive", place="text",
                 per_torque="number"),
        ),
        "start_resonance": (
            dict(natural=100.0, synchronous_speed=180.0, frequency=60.0),
            dict(natural="numbers", synchronous_speed="positive", frequency="positive"),
        ),
        "shear_stress": (
            dict(torque=1.0, diameter=0.1),
            dict(torque="numbers", diameter="positive", inner_diameter="number",
                 concentration="number"),
        ),
        "shaft_torque": (
            dict(response=response, name="shaft"), dict(response="object", name="text")
        ),
        "short_circuit_amplitude": (
            dict(power=1e6, synchronous_speed=180.0, reactance=0.2),
            dict(power="positive", synchronous_speed="positive", reactance="positive",
                 voltage="number"),
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
        "control_loops": (
            dict(machine=levitated(LEVITATOR), frequencies=[100.0], bearings="extra"),
            dict(machine="machine", frequencies="numbers", speed="number", bearings="place", at="at"),
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
        "buckling_factor": (
            dict(machine=line(jr.Node(), jr.FiniteElementShaft(0.2, 0.02, elements=1, axial_force=-1.0))),
            dict(machine="machine", at="at"),
        ),
        "line_from_profile": (
            dict(profile=[(0.0, 0.02), (0.3, 0.02)], stations={"a": (0.1, jr.Node())}),
            dict(stations="object", name="text", between="choice", longest="positive"),
        ),
        "read_profile": (dict(file="nowhere.csv"), dict(file="object", unit="text")),
        "keyway": (
            dict(diameter=0.05, width=0.01, depth=0.005),
            dict(diameter="positive", width="positive", depth="positive", angle="number"),
        ),
        "identify": (
            fit,
            dict(machine="machine", parameters="outputs", sensors="outputs", data="object",
                 shaft="station", progress="flag", stages="object"),
        ),
        "experiment_design": (
            dict(machine=machine, parameters=["main.mass"],
                 sensors={"probe": jr.Channel(jr.sensors.Tachometer("main"), noise=jr.sensors.Noise(1.0))},
                 runs={"run": jr.Simulation(0.1, 1000.0)}),
            dict(machine="machine", parameters="outputs", sensors="outputs", runs="outputs",
                 choose="count", of="choice", criterion="choice", progress="flag"),
        ),
        "optimize": (
            dict(machine=machine, parameters=["main.mass"], objective=jr.objectives.TotalMass()),
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
            dict(machine=machine, parameters=cases, quantity=jr.sensors.Radial("main"), shaft="main"),
            dict(machine="machine", parameters="mapping", quantity="object", shaft="station",
                 drop="count", keep="count", phase="number", samples="count"),
        ),
        "likelihood_profiles": (
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
        "harmonic_balance": (
            dict(machine=machine, speed=100.0),
            dict(machine="machine", speed="positive", harmonics="count", turns="count", samples="count"),
        ),
        "continuation": (
            dict(machine=machine, speeds=(100.0, 200.0)),
            dict(machine="machine", speeds="numbers", harmonics="count", turns="count", samples="count",
                 step="step", points="count"),
        ),
        "switch_branch": (
            dict(machine=machine, point=POINT), dict(machine="machine", point="object", size="positive",
            samples="count")
        ),
    }  # fmt: skip
