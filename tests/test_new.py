"""`jaxrotor new`, `schema`, `completion`: studies to begin with, and what editors and shells know of them."""

import copy
import json
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import jsonschema
import pytest

import jaxrotor as jr
from jaxrotor.commands.check import check_study
from jaxrotor.commands.cli import main
from jaxrotor.commands.new import SCHEMA, names
from jaxrotor.study import (
    cases,
    identify,
    machine,
    optimize,
    read_standards,
    study,
    sweep,
    torsional,
)
from jaxrotor.study.schema import schema

CONFIGS = sorted((Path(__file__).parents[1] / "configs").glob("*.toml"))


@pytest.fixture(scope="module")
def known():
    found = schema()
    jsonschema.Draft7Validator.check_schema(found)
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """All templates, written."""
    place = tmp_path_factory.mktemp("new")
    for name in names():
        assert main(["new", name, str(place / f"my_{name}.toml")]) == 0
    return place


def faults(known, document):
    return list(jsonschema.Draft7Validator(known).iter_errors(document))


@pytest.mark.parametrize("name", names())
def test_each_template_is_a_study(folder, known, name):
    """All of it is checked, with the files beside it; it is found well-formed by its own schema."""
    path = folder / f"my_{name}.toml"
    text = path.read_text()
    assert text.startswith(f"#:schema {SCHEMA}\n") and "RECORD" not in text
    read = jr.load(path, run=name not in ("linear", "standards", "torsional"))
    check_study(read)
    assert read.title and len(text.splitlines()) < 100
    assert not faults(known, tomllib.loads(text))
    assert json.loads((folder / SCHEMA).read_text()) == json.loads(json.dumps(known))
    section = {"identify": "identify", "optimize": "optimize", "sweep": "sweep"}.get(name)
    assert section is None or getattr(read, section) is not None


@pytest.mark.parametrize("path", CONFIGS, ids=lambda p: p.stem)
def test_configs_keep_the_schema(known, path):
    assert not faults(known, tomllib.loads(path.read_text()))


def spoilt(document, at):
    """A copy in which one key is misspelt."""
    found = copy.deepcopy(document)
    table = found
    for step in at[:-1]:
        table = table[step]
    table[f"{at[-1]}x"] = table.pop(at[-1])
    return found


def keys_of(value, at=()):
    """Places of all keys of all tables, but of those whose names are free."""
    free = {"elements", "connections", "fixed", "prescribed", "sensors", "outputs", "conditions"}
    free |= {"also", "unbalance", "clearances", "films"}
    if isinstance(value, dict):
        for key, inside in value.items():
            if not at or at[-1] not in free or "kind" in value:
                yield (*at, key)
            yield from keys_of(inside, (*at, key))
    elif isinstance(value, list):
        for k, inside in enumerate(value):
            yield from keys_of(inside, (*at, k))


@pytest.mark.parametrize("name", names())
def test_any_misspelt_key_fails(folder, known, name):
    """Of every key of every template, one at a time."""
    document = tomllib.loads((folder / f"my_{name}.toml").read_text())
    places = list(keys_of(document))
    assert len(places) > 20
    passed = [at for at in places if not faults(known, spoilt(document, at))]
    assert not passed


def test_wrong_values_fail(folder, known):
    document = tomllib.loads((folder / "my_startup.toml").read_text())
    for at, value in (
        (("machine", "line", 0, "mass"), 7.4),  # no unit
        (("machine", "line", 0, "kind"), "Roter"),
        (("machine", "line", 1, "length"), ["1 m", True]),
        (("machine", "gravity"), ["0 m/s^2"]),
        (("simulation", "initial"), "still"),
        (("simulation", "t_end"), "soon"),
        (("figures", 1, "kind"), "waterfalls"),
        (("report", "main"), 3),
    ):
        wrong = copy.deepcopy(document)
        table = wrong
        for step in at[:-1]:
            table = table[step]
        table[at[-1]] = value
        assert faults(known, wrong), at
    # what is allowed beside the usual form
    document["machine"]["line"][0]["kind"] = "mine.parts:Disc"
    document["machine"]["line"][0]["thing"] = 3
    document["machine"]["line"][1]["kind"] = "FiniteElementShaft"
    document["machine"]["line"][1]["length"] = ["100 mm", "50 mm"]
    document["machine"]["line"][1]["diameter"] = {"unit": "mm", "values": [20, 30]}
    assert not faults(known, document)


def test_sections_have_the_keys_that_are_read(known):
    """What the readers take, from their own lists."""
    own = known["properties"]
    assert set(own) == set(study._SECTIONS)
    for section, reader in (
        ("machine", machine),
        ("identify", identify),
        ("optimize", optimize),
        ("sweep", sweep),
        ("torsional", torsional),
        ("standards", read_standards),
    ):
        assert set(own[section]["properties"]) == set(reader._KEYS), section
    assert set(own["optimize"]["properties"]["variations"]["properties"]) == set(
        optimize._VARIATIONS
    )
    inside = own["standards"]["properties"]
    for key, keys in (
        ("limits", read_standards._LIMITS),
        ("stability", read_standards._STABILITY),
        ("balance", read_standards._BALANCE),
    ):
        assert set(inside[key]["properties"]) == set(keys)
    for key, keys in (
        ("vibration", read_standards._VIBRATION),
        ("magnetic", read_standards._LOOP),
    ):
        assert set(inside[key]["items"]["properties"]) == set(keys)
    assert set(own["sweep"]["properties"]["method"]["enum"]) == set(cases._METHODS)


def test_units_and_words_are_told(known):
    """An editor shows them: of a shaft's length, and of a torque given in time."""
    line = known["properties"]["machine"]["properties"]["line"]["items"]["anyOf"]
    kinds = {one["properties"]["kind"].get("const"): one for one in line}
    shaft, rotor = kinds["Shaft"]["properties"], kinds["Rotor"]
    assert "in m or the like" in shaft["length"]["description"]
    assert '"1 kg"' in rotor["properties"]["mass"]["description"]
    assert "rigid axisymmetric rotor" in rotor["description"]
    assert set(rotor["required"]) == {
        "kind", "name", "mass", "polar_inertia", "transverse_inertia",
    }  # fmt: skip
    assert "N*m" in json.dumps(known["$defs"]["AbstractSchedule-N_m"])


def test_nothing_is_overwritten(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "identify"]) == 0
    said = capsys.readouterr().out
    assert "identify.toml, identify_record.toml, identify_record.csv" in said
    assert "  jaxrotor identify identify.toml\n" in said
    for name in ("identify.toml", "identify_record.csv"):
        (tmp_path / name).write_text("mine")
    (tmp_path / "identify.toml").rename(tmp_path / "kept.toml")
    (tmp_path / SCHEMA).write_text("mine")
    assert main(["new", "identify"]) == 2  # its record is there
    assert "`identify_record.toml`: is there already" in capsys.readouterr().err
    assert (tmp_path / "identify_record.csv").read_text() == "mine"
    assert not (tmp_path / "identify.toml").exists()
    assert main(["new", "startup"]) == 0 and (tmp_path / SCHEMA).read_text() == "mine"
    assert main(["new", "identify", "--force"]) == 0
    assert (tmp_path / "identify_record.csv").read_text().startswith("time,probe")
    assert main(["new", "identfy"]) == 2
    assert "did you mean `identify`?" in capsys.readouterr().err
    assert main(["new", "startup", "mine.txt"]) == 2
    assert main(["new", "--list"]) == 0
    listed = capsys.readouterr().out
    assert all(re.search(rf"^{name} +\S", listed, re.MULTILINE) for name in names())


def test_the_schema_is_printed(tmp_path, known, capsys):
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(known))
    assert main(["schema", "--out", str(tmp_path / "s.json")]) == 0
    assert json.loads((tmp_path / "s.json").read_text())["title"].startswith("A study of jaxrotor")


def completed(script, words):
    """What bash offers for the last of the words."""
    quoted = " ".join(f"'{w}'" for w in words)
    function = re.search(r"^complete .*-F (\S+) jaxrotor$", script, re.MULTILINE)
    assert function
    asked = (
        f"{script}\nCOMP_WORDS=({quoted})\nCOMP_CWORD={len(words) - 1}\n"
        f"{function[1]} jaxrotor '{words[-1]}' '{words[-2]}'\n"
        'printf "%s\\n" "${COMPREPLY[@]}"'
    )
    done = subprocess.run(["bash", "-c", asked], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_bash_completes_commands_options_and_files(tmp_path, monkeypatch, capsys):
    assert main(["completion", "bash"]) == 0
    script = capsys.readouterr().out
    commands = completed(script, ["jaxrotor", ""])
    assert {"run", "check", "identify", "report", "new", "schema", "completion"} <= set(commands)
    assert completed(script, ["jaxrotor", "camp"]) == ["campbell"]
    options = completed(script, ["jaxrotor", "sweep", "--"])
    assert {"--out", "--resume", "--quiet", "--force", "--time-limit"} <= set(options)
    assert set(completed(script, ["jaxrotor", "completion", ""])) >= {"bash", "zsh", "fish"}
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rotor.toml").write_text("")
    assert "rotor.toml" in completed(script, ["jaxrotor", "run", "ro"])


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_have_a_script(shell, tmp_path, capsys):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert "campbell" in script and "resume" in script
    if shutil.which(shell):
        (tmp_path / "script").write_text(script)
        assert subprocess.run([shell, "-n", str(tmp_path / "script")]).returncode == 0
