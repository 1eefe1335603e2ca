"""Mutated studies: quantities and keys of the paper's study spoiled one by one; each is refused at once."""

import copy
import random
import re
import tomllib
from pathlib import Path

import tomli_w
from test_bad_calls import outcome

import jaxrotor as jr

STUDY = Path(__file__).parents[1] / "configs" / "two_rotor_startup.toml"
SPOILED = [
    True, 10**4000, {}, [[]], "", "3", "five mm", "nan m", "1e999 m", "3 dB", "5 qqq", "1,5 m",
    "1 (kg**9)**9**9**9", "1 " + "kg*" * 4000 + "kg", "1 m" + " " * 50_000 + "x", 10**19,
]  # fmt: skip


def leaves(table, path=()):
    items = table.items() if isinstance(table, dict) else enumerate(table)
    for key, value in items:
        if isinstance(value, (dict, list)):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key), value


def at(document, path):
    for key in path:
        document = document[key]
    return document


def mutants():
    sound = tomllib.loads(STUDY.read_text())
    found = list(leaves(sound))
    for path, value in found:
        if isinstance(value, str) and re.match(r"\s*-?\d", value):
            for bad in SPOILED:
                spoiled = copy.deepcopy(sound)
                at(spoiled, path[:-1])[path[-1]] = bad
                yield f"{path} = {str(bad)[:20] if bad != 10**4000 else 'huge'}", spoiled
        if isinstance(path[-1], str):
            spoiled = copy.deepcopy(sound)
            owner = at(spoiled, path[:-1])
            owner[path[-1] + "x"] = owner.pop(path[-1])
            yield f"{path} misspelt", spoiled


def test_300_mutated_studies_are_refused(tmp_path):
    assert isinstance(jr.load(STUDY), jr.Study)
    drawn = random.Random(17).sample(list(mutants()), 300)
    wrong = {}
    for label, document in drawn:
        file = tmp_path / "mutant.toml"
        file.write_text(tomli_w.dumps(document))
        if (got := outcome(lambda file=file: jr.load(file))) != "refused":
            wrong[label] = got
    assert wrong == {}
