"""All public names: where each stands, what it is, and in which file of the reference it is told."""

import ast
import dataclasses
import inspect
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import jaxrotor as jr

SOURCE = Path(jr.__file__).parent
# What no room holds: machines, studies, settings, errors.
CORE = "core"


@dataclasses.dataclass
class Name:
    """One public thing. `places`: what may be written after `jr.`, the shortest first."""

    thing: Any
    places: list[str]

    @property
    def place(self) -> str:
        return self.places[0]

    @property
    def identifier(self) -> str:
        """For mkdocstrings. A function that has its module's name is hidden by it there."""
        hidden = isinstance(_static(self.place), ModuleType)
        return (
            f"{self.thing.__module__}.{self.thing.__name__}" if hidden else f"jaxrotor.{self.place}"
        )

    @property
    def page(self) -> str:
        """Of the reference, without its ending."""
        rooms = [p.split(".")[0] for p in self.places if "." in p]
        if "elements" in rooms:
            return "elements-" + _module(self.thing).split(".")[2]
        return rooms[0] if rooms else CORE

    @property
    def link(self) -> str:
        """From the root of the site."""
        return f"api/{self.page}.md#jaxrotor.{self.place}"

    @property
    def summary(self) -> str:
        """The first sentence of its docstring."""
        words = re.split(r"\n\s*\n", inspect.getdoc(self.thing) or "")[0].replace("\n", " ")
        return re.split(r"(?<=[a-z0-9)`])[.:;](?=\s|$)", words)[0].rstrip(".")


def _module(thing: Any) -> str:
    """Where it is written; of a constant such as STEEL, where its class is."""
    return thing.__module__ if hasattr(thing, "__name__") else type(thing).__module__


def _static(place: str) -> Any:
    """The module at that path, if there is one."""
    path = SOURCE.joinpath(*place.split("."))
    return jr if "." in place and path.with_suffix(".py").is_file() else None


def rooms() -> list[str]:
    return [n for n in jr.__all__ if inspect.ismodule(getattr(jr, n))]


def public() -> list[Name]:
    """Every public thing once, in the order in which the faces name them."""
    found: dict[int, Name] = {}
    for name in jr.__all__:
        if name not in rooms() and name != "__version__":
            found.setdefault(id(getattr(jr, name)), Name(getattr(jr, name), [])).places.append(name)
    for room in rooms():
        for name in getattr(jr, room).__all__:
            thing = getattr(getattr(jr, room), name)
            if isinstance(thing, ModuleType):  # a module of that name, once it has been imported
                thing = getattr(jr, name)
            found.setdefault(id(thing), Name(thing, [])).places.append(f"{room}.{name}")
    return list(found.values())


def groups() -> dict[str, list[str]]:
    """The top names by what they are for: the comments of `__init__.pyi`."""
    text = (SOURCE / "__init__.pyi").read_text(encoding="utf-8")
    lines, found, words = text.splitlines(), {}, ""
    starts = {
        node.lineno: node for node in ast.parse(text).body if isinstance(node, ast.ImportFrom)
    }
    for number, line in enumerate(lines, 1):
        if line.startswith("# "):
            words = line[2:]
        elif number in starts and words:
            found.setdefault(words, []).extend(a.asname or a.name for a in starts[number].names)
    return found
