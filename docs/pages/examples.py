"""Which public names have an example that is executed: in a code block of a page or the README, in an
experiment, or as a kind of part of a study in configs/.

    python docs/pages/examples.py   # the share, and what has none
"""

import ast
import inspect
import os
import re
import sys
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
if __name__ == "__main__":
    os.environ["JAX_ENABLE_X64"] = "1"
    sys.path[:0] = [str(ROOT / "src"), str(ROOT / "docs")]

import jaxrotor as jr
from jaxrotor.plot.doors import _PICTURES
from pages.names import Name, public

# What compiles for ten seconds and more, for one sentence of a page: these tests run it.
ELSEWHERE = {
    "interop.from_ross": "tests/test_ross.py",
    "interop.to_ross": "tests/test_ross.py",
    "identification.posterior": "tests/test_uncertainty.py",
    "identification.bootstrap": "tests/test_identify.py",
    "plot.posteriors": "tests/test_uncertainty.py",
    "plot.profile_curves": "tests/test_uncertainty.py",
    "linear.unbalance_peak": "tests/test_torsion.py",
    "sweeps.local_slopes": "tests/test_sweep_cli.py",
    "sweeps.sobol_indices": "tests/test_sweep_cli.py",
    "optimization.NoRun": "tests/test_optimize.py",
}
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.M | re.S)
KIND = re.compile(r'kind = "(\w+)"')


def chains(code: str) -> Iterator[str]:
    """`jr.linear.modes` gives "linear.modes"; `el = jr.elements` and `from jaxrotor import standards` stand for
    what they are; of `run.plot.orbit(...)` the function behind it."""
    tree = ast.parse(code)
    short = {"jr": ""}
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            room = _chain(node.value, {"jr": ""})
            if room and "." not in room and room.islower():
                short[node.targets[0].id] = f"{room}."
        if isinstance(node, ast.ImportFrom):
            first, _, rest = (node.module or "").partition(".")
            if first == "jaxrotor":
                short |= {
                    a.asname or a.name: f"{rest}.{a.name}".strip(".") + "." for a in node.names
                }
    for node in ast.walk(tree):
        found = _chain(node, short)
        if found:
            yield found
        if isinstance(node, ast.Name) and node.id in short and node.id != "jr":
            yield short[node.id].rstrip(".")
        if isinstance(node, ast.Attribute) and _door(node.value):
            yield from DOORS.get(node.attr, ())
    yield from _drawn(tree, short)


def _drawn(tree: ast.AST, short: dict[str, str]) -> Iterator[str]:
    """What `result.plot()` draws: the first picture of the class that the function gave which made `result`."""
    made: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call):
            for target in ast.walk(node.targets[0]):
                if isinstance(target, ast.Name):
                    made[target.id] = _chain(node.value.func, short)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and _door(node.func) and isinstance(node.func, ast.Attribute):
            owner = node.func.value
            called = (
                made.get(owner.id)
                if isinstance(owner, ast.Name)
                else _chain(getattr(owner, "func", owner), short)
            )
            for kind in returns(_thing(called or "")):
                for function in list(_PICTURES.get(kind, {}).values())[:1]:
                    yield f"plot.{function.__name__}"


def _thing(path: str) -> Any:
    found: Any = jr
    for step in path.split("."):
        found = getattr(found, step, None)
    return found


def _door(node: ast.AST) -> bool:
    return isinstance(node, ast.Attribute) and node.attr == "plot"


def _doors() -> dict[str, set[str]]:
    """What a picture is called behind an object's `plot` -> the public function that draws it."""
    names: dict[str, set[str]] = {}
    for table in _PICTURES.values():
        for method, function in table.items():
            for name in (function.__name__, *(PUBLIC_FORM.get(function.__name__, ()))):
                names.setdefault(method, set()).add(f"plot.{name}")
    return names


# A run's own pictures make the result first, and hand it to these.
PUBLIC_FORM = {
    "run_orbit": ("orbits",), "run_full_spectrum": ("full_spectrum",), "run_waterfall": ("waterfall_map",),
    "run_cascade": ("cascade",), "run_order_tracks": ("order_tracks",), "run_centreline": ("centreline",),
    "run_poincare": ("poincare",), "model_shapes": ("mode_shapes",),
}  # fmt: skip
DOORS = _doors()


def _chain(node: ast.AST, short: dict[str, str]) -> str:
    names = []
    while isinstance(node, ast.Attribute):
        names.append(node.attr)
        node = node.value
    if isinstance(node, ast.Name) and node.id in short and names:
        return short[node.id] + ".".join(reversed(names))
    return ""


def sources() -> Iterator[tuple[str, str]]:
    """(place, code) of all that is executed."""
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        code = "\n".join(BLOCK.findall(page.read_text(encoding="utf-8")))
        yield page.relative_to(ROOT).as_posix(), code
    for script in sorted((ROOT / "experiments").glob("*.py")):
        yield script.relative_to(ROOT).as_posix(), script.read_text(encoding="utf-8")


def found() -> dict[str, list[str]]:
    """Path of a name -> where it is used. A longer chain, `Machine.in_line`, counts for all its beginnings."""
    places: dict[str, list[str]] = {}
    for place, code in sources():
        for chain in set(chains(code)):
            steps = chain.split(".")
            for n in range(1, len(steps) + 1):
                places.setdefault(".".join(steps[:n]), []).append(place)
    for study in sorted((ROOT / "configs").glob("*.toml")):
        for kind in set(KIND.findall(study.read_text(encoding="utf-8"))):
            for path in (
                kind,
                f"elements.{kind}",
                f"profiles.{kind}",
                f"sensors.{kind}",
                f"objectives.{kind}",
            ):
                places.setdefault(path, []).append(study.relative_to(ROOT).as_posix())
    return places


def without() -> tuple[list[Name], list[Name]]:
    """All public names, and those that have no example. What an exampled function returns has one."""
    names, places = public(), found()
    shown = [name for name in names if any(place in places for place in name.places)]
    elsewhere = [name for name in names if name.place in ELSEWHERE]
    returned = {id(kind) for name in shown + elsewhere for kind in returns(name.thing)}
    rest = [name for name in names if name not in shown and name not in elsewhere]
    return names, [name for name in rest if id(name.thing) not in returned]


def returns(thing: Any) -> Iterator[type]:
    """The classes that a function hands back, by its annotation."""
    if inspect.isfunction(thing) or hasattr(thing, "__wrapped__"):
        waiting = [typing.get_type_hints(inspect.unwrap(thing)).get("return")]
        while waiting:
            kind = waiting.pop()
            waiting += typing.get_args(kind)
            if isinstance(kind, type):
                yield kind


def main() -> None:
    names, lacking = without()
    told = f"{len(names) - len(lacking) - len(ELSEWHERE)} of {len(names)} public names have an example that is executed"
    print(f"{told}, {len(ELSEWHERE)} one in the tests alone")
    for name in lacking:
        print(f"  jr.{name.place}")


if __name__ == "__main__":
    main()
