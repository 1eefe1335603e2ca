"""Study files: the machine that comes out, and what is refused with which sentence."""

import equinox as eqx
import jax
import numpy as np
import pytest

import jaxrotor as jr

STUDY = """
title = "a disc on a shaft"

[machine]
gravity = ["0 m/s^2", "-9.81 m/s^2", "0 m/s^2"]

[[machine.line]]
name = "disc"
kind = "Rotor"
mass = "6 kg"
polar_inertia = "0.0187 kg*m^2"
transverse_inertia = "0.0102 kg*m^2"
unbalance = { eccentricity = "0.05 mm", angle = "90 deg" }

[[machine.line]]
name = "shaft"
kind = "Shaft"
length = "200 mm"
diameter = "12 mm"
material = "steel"
rayleigh = ["0.002 1/s", "0.1 ms"]
twist = "paper"

[[machine.line]]
name = "end"
kind = "PrescribedSpin"
profile = { kind = "CosineRamp", speed = "3000 rpm", duration = "2 s" }

[[machine.attachments]]
name = "load"
kind = "Torque"
at = "disc"
value = { kind = "Step", time = "0.5 s", after = "-3 N*m" }

[simulation]
t_end = "1 s"
sample_rate = "1 kHz"
"""


@pytest.fixture
def study_file(tmp_path):
    def write(text, name="disc.toml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def problems(path):
    with pytest.raises(jr.InputError) as caught:
        jr.load(path)
    return caught.value.problems


def test_the_papers_study_is_the_papers_machine_to_the_last_bit(two_rotor):
    study = jr.load("configs/two_rotor_startup.toml")
    written, built = study.machine, two_rotor(twist="paper")
    assert eqx.tree_equal(written, built)
    assert written.wiring == built.wiring
    assert (study.settings.t_end, study.settings.sample_rate) == (10.0, 1000.0)
    assert study.settings.initial == "static"
    assert study.report.main == "main"


def test_a_line_is_read(study_file):
    study = jr.load(study_file(STUDY))
    machine = study.machine
    assert study.title == "a disc on a shaft"
    assert study.name == "disc"
    assert list(machine.elements()) == ["disc", "shaft", "end", "load"]
    expected = {
        "disc.unbalance.eccentricity": 5e-5,
        "disc.unbalance.angle": np.pi / 2,
        "shaft.length": 0.2,
        "shaft.rayleigh": [0.002, 1e-4],
        "shaft.material.youngs_modulus": 2.1e11,
        "end.profile.speed": 100 * np.pi,
        "load.value.after": -3.0,
        "load.value.time": 0.5,
    }
    for path, value in expected.items():
        assert np.asarray(machine.get(path)) == pytest.approx(np.asarray(value), rel=1e-15), path
    assert machine["shaft"].twist == "paper"


GENERAL = """
[machine]
fixed = { hub = ["z"] }
prescribed = { hub = { x = { kind = "ConstantSpeed", speed = "2 mm/s" } } }
[machine.elements.hub]
kind = "Rotor"
mass = "1 kg"
polar_inertia = "2 kg*cm^2"
transverse_inertia = "1 kg*cm^2"
[machine.elements.rod]
kind = "Shaft"
length = "0.1 m"
diameter = "10 mm"
material = { youngs_modulus = "70 GPa", shear_modulus = "26 GPa", density = "2700 kg/m^3" }
[machine.elements.tip]
kind = "Rotor"
mass = "1 kg"
polar_inertia = "2 kg*cm^2"
transverse_inertia = "1 kg*cm^2"
[machine.elements.ground]
kind = "LinearSupport"
stiffness = ["1 N/mm", "1 N/mm", "1 N/mm", "1 N*m", "1 N*m/rad", "1 N*m/rad"]
[machine.connections]
rod = ["hub", "tip"]
ground = "hub"
[[machine.attachments]]
name = "push"
kind = "Force"
at = "tip.mass_centre"
value = "3 N"
direction = [1, 0, 0]
[simulation]
t_end = "1 s"
sample_rate = "1 kHz"
"""


def test_the_general_form_is_read(study_file):
    machine = jr.load(study_file(GENERAL)).machine
    assert machine.connections() == {
        "rod": ("hub", "tip"),
        "ground": ("hub",),
        "push": ("tip.mass_centre",),
    }
    assert machine["ground"].stiffness.tolist() == [1e3, 1e3, 1e3, 1, 1, 1]
    assert float(machine.get("rod.material.density")) == 2700.0
    # a prescribed displacement is in m, though the same ramp turns a station in rad
    assert float(machine.get("hub.x.speed")) == pytest.approx(2e-3)
    assert machine["push"].value.level.tolist() == 3.0


def test_a_table_of_speeds_names_its_unit_once(study_file):
    profile = (
        'profile = { kind = "SpeedTable", times = { unit = "ms", values = [0, 500, 2000] }, '
        'speeds = { unit = "rpm", values = [0, 600, 3000] } }'
    )
    old = 'profile = { kind = "CosineRamp", speed = "3000 rpm", duration = "2 s" }'
    machine = jr.load(study_file(STUDY.replace(old, profile))).machine
    assert machine["end"].profile.times.tolist() == [0.0, 0.5, 2.0]
    np.testing.assert_allclose(machine["end"].profile.speeds, np.array([0, 20, 100]) * np.pi)


def test_matrices_stay_in_bare_si_numbers(study_file):
    rows = np.diag([1e3, 1e3, 1e3, 1.0, 1.0, 1.0]).tolist()
    old = 'stiffness = ["1 N/mm", "1 N/mm", "1 N/mm", "1 N*m", "1 N*m/rad", "1 N*m/rad"]'
    machine = jr.load(study_file(GENERAL.replace(old, f"stiffness = {rows}"))).machine
    assert machine["ground"].stiffness.tolist() == rows
    rows[0].pop()
    (sentence,) = problems(study_file(GENERAL.replace(old, f"stiffness = {rows}"), "disc.toml"))
    assert 'elements "ground"' in sentence and "stiffness must have rows of one length" in sentence
    assert "5, 6, 6, 6, 6, 6" in sentence


def test_a_users_own_element_beside_the_study(study_file):
    study_file(
        "import jax.numpy as jnp\n"
        "import jaxrotor as jr\n"
        "class Brake(jr.AbstractAttachment):\n"
        "    strength: object = jr.parameter('N*m*s/rad', positive=True)\n"
        "    def forces(self, t, motions, state):\n"
        "        return (-self.strength * motions[0][1] * jnp.array([0., 0, 0, 0, 0, 1]),)\n",
        "my_brakes.py",
    )
    own = STUDY + '[[machine.attachments]]\nname = "b"\nkind = "my_brakes:Brake"\nat = "disc"\n'
    machine = jr.load(study_file(own + 'strength = "0.5 N*m*s"\n')).machine
    assert float(machine["b"].strength) == 0.5
    (sentence,) = problems(study_file(own + 'strength = "-0.5 N*m*s"\n'))
    assert '`attachments "b"`: strength must be positive, but is -0.5 N*m*s/rad' in sentence


# what stands in STUDY, what is written instead, and what the one sentence must say:
# the place, the field, the value, the remedy
BAD = [
    # units
    ('"200 mm"', "0.2", ['line "shaft"', "length", "0.2", 'write "0.2 m"']),
    ('"200 mm"', "200", ['line "shaft"', "length", "200", 'write "200 m"']),
    ('"200 mm"', '"200 kg"', ['line "shaft"', "length", "200 kg", "in m", 'write "1 m"']),
    ('"200 mm"', '"200 mmm"', ['line "shaft"', "length", "mmm", 'did you mean "200 mm"?']),
    ('"200 mm"', '"200"', ['line "shaft"', "length", '"200"', 'write "200 m"']),
    ('"200 mm"', '"long"', ['line "shaft"', "length", '"long"', 'write "1 m"']),
    ('"200 mm"', '"0,2 m"', ['line "shaft"', "length", '"0,2 m"', "decimal point"]),
    ('"200 mm"', '["200 mm"]', ['line "shaft"', "length", "a list of 1", 'write "1 m"']),
    ('"200 mm"', "true", ['line "shaft"', "length", "true", 'write "1 m"']),
    ('"200 mm"', "nan", ['line "shaft"', "length", "finite", "nan", 'write "1 m"']),
    ('"200 mm"', '"inf m"', ['line "shaft"', "length", "finite", "inf m", 'write "1 m"']),
    ('"3000 rpm"', '"50 Hz"', ['line "end"', "profile.speed", "50 Hz", '"3000 rpm"']),
    ('"3000 rpm"', "314", ['line "end"', "profile.speed", "314", 'write "314 rad/s"']),
    ('"90 deg"', "1.57", ['line "disc"', "unbalance.angle", "1.57", 'write "1.57 rad"']),
    ('"0.05 mm"', '"0.05 N"', ['line "disc"', "unbalance.eccentricity", "0.05 N", "in m"]),
    ('"-3 N*m"', '"-3 N"', ['attachments "load"', "value.after", "-3 N", "in N*m"]),
    ('"-3 N*m"', "-3", ['attachments "load"', "value.after", "-3", 'write "-3 N*m"']),
    ('"0.1 ms"', "0.0001", ['line "shaft"', "rayleigh[1]", "0.0001", 'write "0.0001 s"']),
    ('"0.002 1/s"', '"0.002 s"', ['line "shaft"', "rayleigh[0]", "0.002 s", "in 1/s"]),
    ('["0.002 1/s", "0.1 ms"]', '["1 1/s"]', ['"shaft"', "rayleigh", "has 1", '["1 1/s", "1 s"]']),
    ('["0.002 1/s", "0.1 ms"]', '"1 s"', ['"shaft"', "rayleigh", '"1 s"', '["1 1/s", "1 s"]']),
    ('"-9.81 m/s^2"', "-9.81", ["machine", "gravity[1]", "-9.81", 'write "-9.81 m/s^2"']),
    ('["0 m/s^2", "-9.81 m/s^2", "0 m/s^2"]', '"9.81 m/s^2"', ["gravity", "9.81", "write ["]),
    # bounds
    ('"200 mm"', '"-200 mm"', ['line "shaft"', "length", "positive", "-0.2 m"]),
    ('"6 kg"', '"0 kg"', ['line "disc"', "mass", "positive", "0 kg"]),
    ('"0.0187 kg*m^2"', '"0.05 kg*m^2"', ['line "disc"', "polar_inertia", "0.05", "at most twice"]),
    ('"12 mm"', '"12 mm"\ninner_diameter = "13 mm"', ['"shaft"', "inner_diameter", "smaller"]),
    ('"2 s"', '"0 s"', ['line "end"', "profile.duration", "positive", "0 s"]),
    # names and keys
    ("length =", "lenght =", ['line "shaft"', "`lenght`", "did you mean `length`?"]),
    ('length = "200 mm"\n', "", ['line "shaft"', "length is missing", 'write length = "1 m"']),
    ('mass = "6 kg"\n', "", ['line "disc"', "mass is missing", 'write mass = "1 kg"']),
    ("eccentricity", "excentricity", ['"disc"', "unbalance.excentricity", "`eccentricity`?"]),
    ('"Rotor"', '"Roter"', ['line "disc"', 'kind "Roter"', "did you mean `Rotor`?"]),
    ('kind = "Rotor"\n', "", ['line "disc"', "kind is missing", 'write kind = "Rotor"']),
    ('"Rotor"', "7", ['line "disc"', "kind", "7", "text"]),
    ('"Rotor"', '"nowhere:Rotor"', ['line "disc"', "nowhere:Rotor", "No module", "check"]),
    ('"Rotor"', '"jaxrotor:Roter"', ['line "disc"', "jaxrotor:Roter", "did you mean `Rotor`?"]),
    ('"Rotor"', '"pathlib:Path"', ['line "disc"', "pathlib:Path", "AbstractElement"]),
    ('"Rotor"', '"Torque"', ['line "disc"', 'kind "Torque"', "[[machine.attachments]]"]),
    ('name = "shaft"', 'name = "disc"', ["line, entry 2", '"disc" is used twice', "rename"]),
    ('name = "load"', 'name = "disc"', ["attachments, entry 1", '"disc" is used twice', "rename"]),
    ('name = "shaft"', 'name = "shaft.1"', ["line, entry 2", '"shaft.1"', "no dot", "rename"]),
    ('name = "shaft"\n', "", ["line, entry 2", "name is missing", "write name ="]),
    ('name = "shaft"', "name = 2", ["line, entry 2", "name must be a text", "2", "quotes"]),
    ('"CosineRamp"', '"CosinRamp"', ['"end"', "profile.kind", "CosinRamp", "`CosineRamp`?"]),
    ('kind = "CosineRamp", ', "", ['"end"', "profile.kind is missing", "LinearRamp"]),
    ('"CosineRamp"', '"Step"', ['"end"', 'profile.kind "Step"', "known: `", "`ConstantSpeed`"]),
    ('"steel"', '"steal"', ['line "shaft"', "material", '"steal"', "did you mean `steel`?"]),
    ('"steel"', "7850", ['line "shaft"', "material", "7850", "youngs_modulus"]),
    ('"steel"', '{ density = "1 kg/m^3" }', None),
    ('"steel"', '{ densty = "1 kg/m^3" }', None),
    ('"paper"', '"papr"', ['line "shaft"', "twist", '"papr"', "did you mean `paper`?"]),
    ('at = "disc"', 'at = "disk"', ['"load"', 'at names no station "disk"', "`disc`?"]),
    ('at = "disc"', 'at = "shaft"', ['"load"', 'at names no station "shaft"', "`disc`"]),
    ('at = "disc"', 'at = "disc.rim"', ["load", "rim", "mass_centre"]),
    ('at = "disc"\n', "", ['attachments "load"', "at is missing", "write at ="]),
    # shape of the machine
    ('name = "end"', 'name = "end"\nat = "disc"', ['line "end"', "there is no `at`", "`profile`"]),
    ("[machine]\n", "[machine]\nlines = 3\n", ["machine", "`lines`", "did you mean `line`?"]),
    ("[machine]\n", "[machine]\nline = 3\n", None),
    ("[machine]\n", "[machine]\nconnections = { shaft = 'disc' }\n", ["connections", "remove"]),
    ("[machine]\n", "[machine]\nfixed = { disk = ['z'] }\n", ["fixed", '"disk"', "`disc`?"]),
    ("[machine]\n", "[machine]\nfixed = { disc = ['w'] }\n", ["fixed", '"disc"', '"w"', "`x`"]),
    ("[machine]\n", "[machine]\nfixed = { end = ['z'] }\n", ["`end`", "fixed", "leave it out"]),
    ("[machine]\n", "[machine]\nfixed = { disc = 'z' }\n", ["fixed", '"disc"', '"z"', "write"]),
    # the other sections
    ('t_end = "1 s"\n', "", ["simulation", "t_end is missing", 'write t_end = "10 s"']),
    ('"1 s"', '"-1 s"', ["simulation", "t_end", "positive", "-1"]),
    ('"1 s"', "1", ["simulation", "t_end", "bare number 1", 'write "1 s"']),
    ('"1 kHz"', '"1 krpm"', ["simulation", "sample_rate", "1 krpm", "in Hz"]),
    ('"1 kHz"', '"1 Hz"', ["simulation", "sample_rate", "1 Hz", "two samples"]),
    ("sample_rate", "samplerate", ["simulation", "`samplerate`", "did you mean `sample_rate`?"]),
    ('"1 kHz"', '"1 kHz"\ninitial = "rest"', ["simulation", "initial", '"rest"', "`static`"]),
    ('"1 kHz"', '"1 kHz"\ninitial = "steady"', ["simulation", "speed", "steady", "0 rad/s"]),
    ('"1 kHz"', '"1 kHz"\nspeed = "9 rpm"', ["simulation", "speed", "drive", "leave it out"]),
    ('"1 kHz"', '"1 kHz"\nsolver = "ode45"', ["simulation", "solver", "ode45", "`Kvaerno5`"]),
    ('"1 kHz"', '"1 kHz"\norder = 11', ["simulation", "order", "11", "`5`"]),
    ('"1 kHz"', '"1 kHz"\nrtol = 1e-6', ["simulation", "rtol", "remove rtol"]),
    ('"1 kHz"', '"1 kHz"\n[report]\nmain = "dics"', ["report", "main", '"dics"', "`disc`?"]),
    ('"1 kHz"', '"1 kHz"\n[report]\nmain = 3', ["report", "main", "3", "quotes"]),
    ("[simulation]", "[simulations]", None),
    ('"a disc on a shaft"', "3", ["title", "text", "3", "quotes"]),
    # what figures show
    (
        "[simulation]",
        "[report]\nfigures = ['spinn']\n[simulation]",
        ["report", "figures", "`spin`?"],
    ),
    ("[simulation]", "[report]\nfigures = 'spin'\n[simulation]", ["report", "figures", "list"]),
    (
        "[simulation]",
        "[[figures]]\ntitle = 'A'\ny = ['dics.x']\n[simulation]",
        ['figures "A"', 'y[0] names no part "dics"', "did you mean `disc`?"],
    ),
    (
        "[simulation]",
        "[[figures]]\ntitle = 'A'\ny = ['disc.x', 'disc.sped']\n[simulation]",
        ['figures "A"', 'y[1]: "disc" has no quantity "sped"', "did you mean `speed`?"],
    ),
    (
        "[simulation]",
        "[[figures]]\ntitle = 'A'\ny = ['disc.x']\nx = 'time'\n[simulation]",
        ['figures "A"', 'x must be "part.quantity"', '"time"', 'write "t" for the time'],
    ),
    (
        "[simulation]",
        "[[figures]]\ntitle = 'A'\ny = ['load.speed']\n[simulation]",
        ['"load" has no quantity "speed"', "known: `torque`, `force`"],
    ),
    (
        "[simulation]",
        "[[figures]]\ntitle = 'A'\ny = 'disc.x'\n[simulation]",
        ['figures "A"', "y must be a list of texts", '"disc.x"', 'write y = ["main.x", ...]'],
    ),
    (
        "[simulation]",
        "[[figures]]\ntitle = 'A'\ny = []\n[simulation]",
        ['figures "A"', "y must name a quantity", "is empty"],
    ),
    (
        "[simulation]",
        "[[figures]]\ny = ['disc.x']\n[simulation]",
        ["figures, entry 1", "title is missing", 'write title = "..."'],
    ),
    (
        "[simulation]",
        "[[figures]]\ntitle = 'A'\ny = ['disc.x']\nunits = ['mmm']\n[simulation]",
        ['figures "A"', 'unknown unit "mmm"', '"mm"'],
    ),
    (
        "[simulation]",
        "[[figures]]\ntitle = 'A'\ny = ['disc.x']\nunits = ['rpm']\n[simulation]",
        ['figures "A"', 'units has "rpm"', "`m`", "remove it"],
    ),
    (
        "[simulation]",
        2 * "[[figures]]\ntitle = 'A b'\ny = ['disc.x']\n" + "[simulation]",
        ['figures "A b"', '"a_b.png"', "give it a name"],
    ),
    ("[simulation]", "figures = 3\n[simulation]", None),
    # the file itself
    ('"200 mm"', "200 mm", ["line 18", "200 mm", "in quotes"]),
    ('title = "', 'title = ["', ["TOML", "line 4", "Unclosed array"]),
    ("[simulation]", "[machine]", ["TOML", "line 35", "once"]),
]


def test_figures_are_read(study_file):
    """Names with spaces and dots: parts inside a shaft made of several."""
    shaft = 'kind = "Shaft"\nlength = "200 mm"\ndiameter = "12 mm"\nmaterial = "steel"'
    assert shaft in STUDY
    text = STUDY.replace(shaft, shaft.replace('"Shaft"', '"FiniteElementShaft"\nelements = 3'))
    text += """
[[figures]]
title = "Whirl: all of it"
x = "end.speed"
y = ["disc.radial", "shaft.2.x", "shaft.element 1.torque", "load.torque"]
units = ["rpm", "um"]
[[figures]]
title = "1"
name = "first figure"
y = ["end.reaction_torque"]
"""
    first, second = jr.load(study_file(text)).figures
    assert (first.stem, second.stem) == ("whirl_all_of_it", "first_figure")
    assert first.y == ("disc.radial", "shaft.2.x", "shaft.element 1.torque", "load.torque")
    assert (first.x, second.x) == ("end.speed", "t")


@pytest.mark.parametrize("old, new, parts", BAD)
def test_a_wrong_study_is_refused_in_sentences(study_file, old, new, parts):
    assert old in STUDY
    found = problems(study_file(STUDY.replace(old, new, 1)))
    assert all("\n" not in sentence and len(sentence) < 500 for sentence in found)
    assert all("disc.toml" in sentence for sentence in found)
    if parts is not None:
        assert len(found) == 1, found
        for part in parts:
            assert part in found[0]


def test_every_fault_of_a_file_is_told_at_once(study_file):
    text = STUDY
    for old, new in [
        ('"200 mm"', "0.2"),
        ('"12 mm"', '"-12 mm"'),
        ('"Rotor"', '"Roter"'),
        ('"3000 rpm"', '"50 Hz"'),
        ('at = "disc"', 'at = "disk"'),
        ('t_end = "1 s"\n', ""),
        ("title", "titel"),
    ]:
        text = text.replace(old, new, 1)
    found = problems(study_file(text))
    assert len(found) == 7
    for part in ("length", "diameter", "Roter", "profile.speed", "`disc`", "t_end", "`title`"):
        assert any(part in sentence for sentence in found), part


@pytest.mark.parametrize(
    "text, parts",
    [
        ("", ["empty", "[machine]"]),
        ("title = 'x'", ["machine", "is missing", "[[machine.line]]"]),
        ("machine = 3\nsimulation = 4", ["machine", "must be a table", "3"]),
        ("[machine]\nline = []\n", ["line must be a list", "[[machine.line]]"]),
        ("[machine]\nline = [3]\n", ["line, entry 1", "must be a table", "3"]),
        ("[machine]\n", ["neither is given", "[[machine.line]]"]),
        ("[machine]\nelements = 3\nline = []", ["both are given"]),
        ("[machine]\nelements = { a = 3 }", ['elements "a"', "must be a table", "kind"]),
    ],
)
def test_a_file_of_the_wrong_shape(study_file, text, parts):
    found = "\n".join(problems(study_file(text)))
    for part in parts:
        assert part in found


def test_files_that_cannot_be_read(tmp_path, study_file):
    study_file(STUDY, "other.toml")
    (sentence,) = problems(tmp_path / "missing.toml")
    assert "missing.toml" in sentence and "no such file" in sentence and "other.toml" in sentence
    (sentence,) = problems(tmp_path)
    assert "is a folder" in sentence
    latin = tmp_path / "latin.toml"
    latin.write_bytes(b'# ok\ntitle = "Sch\xfctz"\n')
    (sentence,) = problems(latin)
    assert "line 2" in sentence and "UTF-8" in sentence and "0xfc" in sentence


def test_a_study_with_a_byte_order_mark_and_windows_ends(study_file, tmp_path):
    path = tmp_path / "windows.toml"
    path.write_bytes(b"\xef\xbb\xbf" + STUDY.replace("\n", "\r\n").encode())
    assert jr.load(path).title == "a disc on a shaft"


def test_32_bit_floats_are_refused_with_the_remedy(study_file):
    path = study_file(STUDY)
    with jax.enable_x64(False):
        (sentence,) = problems(path)
    assert "jax_enable_x64" in sentence


def test_run_passes_the_settings_on(study_file, monkeypatch):
    calls = []
    monkeypatch.setattr(
        "jaxrotor.simulation.simulate",
        lambda machine, simulation, **given: calls.append((machine, simulation, given)),
    )
    more = 'step = "0.5 ms"\norder = 4\nsolver = "ExponentialAdams"\n'
    study = jr.load(study_file(STUDY + more))
    study.run(progress=False)
    ((machine, simulation, given),) = calls
    assert machine is study.machine and given == {"progress": False}
    assert simulation.order == 4 and simulation.step == 5e-4
    assert (simulation.t_end, simulation.sample_rate, simulation.initial) == (1.0, 1000.0, "static")
