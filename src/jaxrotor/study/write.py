"""A machine as the text of a study's [machine] section, which reads back equal to the last bit."""

import dataclasses
import re
import sys
from typing import Any, get_args, get_origin

import equinox as eqx
import numpy as np
import tomli_w

from ..core.declared import ALONE, Within, is_default, same
from ..core.errors import InputError
from ..core.parameter import known
from ..core.protocol import AbstractConnector, AbstractStation, Ended
from ..machine.machine import Machine
from ..profiles.schedule import Steady
from .build import flat, hints_of
from .kinds import public_constants, public_kinds

# A list of more numbers than this carries its unit once.
_FEW = 6


def machine_text(machine: Machine) -> str:
    """`[machine]` with quantities in SI units; what is as by default is left out.

    Raises `InputError` for what has no such form: traced numbers, batches, classes that cannot be imported by
    name."""
    machine.check()
    writer = _Writer()
    table = writer.machine(machine)
    if writer.faults:
        raise InputError(*writer.faults)
    return _text(table)


def written(value: np.ndarray, units: tuple[str, ...]) -> Any:
    """A parameter as it stands in a study. `units`: one, or one for each entry."""
    if value.ndim == 0:
        return quantity_text(float(value), units[0])
    if value.ndim == 1 and (len(units) == value.size or value.size <= _FEW):
        several = units if len(units) == value.size else units * value.size
        return [quantity_text(float(v), u) for v, u in zip(value, several)]
    if len(units) == 1 and units[0]:
        return {"unit": units[0], "values": value.tolist()}
    return value.tolist()


def quantity_text(value: float, unit: str) -> str | float:
    """All digits: it reads back equal."""
    return f"{repr(value).removesuffix('.0')} {unit}" if unit else value


class _Writer:
    def __init__(self):
        self.faults: list[str] = []

    def machine(self, machine: Machine) -> dict[str, Any]:
        table: dict[str, Any] = {}
        if not same(machine.gravity, np.zeros(3)):
            table["gravity"] = self._numbers(machine.gravity, ("m/s^2",), "machine", "gravity")
        table |= self._held(machine)
        condensed = machine.wiring.condensation
        if condensed is not None:
            table["reduce"] = False
            if condensed.spans:
                up_to = quantity_text(condensed.up_to, "Hz")
                speed = quantity_text(condensed.speed, "rad/s")
                table["reduce"] = {"up_to": up_to, "tolerance": condensed.tolerance, "speed": speed}
        elements = {name: self._element(name, part) for name, part in machine.elements().items()}
        places = {n: list(p) if len(p) > 1 else p[0] for n, p in machine.connections().items()}  # pyright: ignore[reportGeneralTypeIssues]
        line = _line(machine)
        if line is None:
            table["elements"] = elements
            table["connections"] = places
            return table
        table["line"] = [{"name": name} | elements[name] for name in line]
        rest = [name for name in elements if name not in line]
        if rest:
            table["attachments"] = [
                {"name": name, "kind": elements[name].pop("kind"), "at": places[name]}
                | elements[name]
                for name in rest
            ]
        return table

    def _held(self, machine: Machine) -> dict[str, Any]:
        def told(station: str, coordinate: str, motion: Any) -> Any:
            within = Within(length=coordinate in "xyz")
            return self._part(motion, object, within, f"{station}.{coordinate}", "")

        fixed = {station: list(names) for station, names in machine.fixed().items()}
        given = {
            station: {coordinate: told(station, coordinate, m) for coordinate, m in motions.items()}
            for station, motions in machine.prescribed().items()
        }
        return {k: v for k, v in (("fixed", fixed), ("prescribed", given)) if v}

    def _element(self, name: str, part: Any) -> dict[str, Any]:
        return self._part(part, object, ALONE, name, "")

    def _part(
        self, part: Any, base: Any, within: Within, place: str, prefix: str
    ) -> dict[str, Any]:
        """`base`: what is read where no kind is named."""
        cls, table = type(part), {}
        if cls is not base:
            table["kind"] = self._kind(cls, place)
        hints = hints_of(cls)
        for field in dataclasses.fields(cls):
            value = getattr(part, field.name)
            if field.init and not is_default(field, value):
                path = prefix + field.name
                table[field.name] = self._value(
                    field, hints[field.name], value, within, place, path
                )
        return table

    def _kind(self, cls: type, place: str) -> str:
        if public_kinds(object).get(cls.__name__) is cls:
            return cls.__name__
        module = sys.modules.get(cls.__module__)
        if cls.__module__ == "__main__" or getattr(module, cls.__qualname__, None) is not cls:
            self.faults.append(
                f"`{place}`: is a {cls.__name__}, a class that no study can import by name: define it at the "
                "top of a module of its own, and import it from there"
            )
        return f"{cls.__module__}:{cls.__qualname__}"

    def _value(
        self, field: dataclasses.Field, hint: Any, value: Any, within: Within, place: str, path: str
    ) -> Any:
        if "unit" in field.metadata and value is not None:
            return self._numbers(value, within.units(field), place, path)
        below = within.below(field)
        if isinstance(value, eqx.Module):
            return self._module(field, hint, value, below, place, path)
        if isinstance(value, tuple) and value and all(isinstance(x, eqx.Module) for x in value):
            base = get_args(hint)[0] if get_origin(hint) is tuple else object
            parts = enumerate(value)
            return [self._part(x, base, below, place, f"{path}.{i}.") for i, x in parts]
        if isinstance(value, float) and "quantity" in field.metadata:
            return quantity_text(value, field.metadata["quantity"])
        if isinstance(value, (bool, int, float, str)):
            return value
        self.faults.append(
            f"`{place}`: {path} cannot stand in a study, for it is {type(value).__name__}: keep this machine "
            "as a Python script"
        )
        return ""

    def _module(
        self, field: dataclasses.Field, hint: Any, value: Any, below: Within, place: str, path: str
    ) -> Any:
        if "drives" in field.metadata and type(value) is Steady:
            return self._numbers(value.level, (below.driven,), place, path)
        convert = field.metadata.get("converter", lambda x: x)
        for name, constant in public_constants().items():
            if same(convert(constant), value):
                return name
        bases = [a for a in flat(hint) if isinstance(a, type) and issubclass(a, eqx.Module)]
        base = type(value) if type(value) in bases else bases[0] if bases else object
        return self._part(value, base, below, place, f"{path}.")

    def _numbers(self, value: Any, units: tuple[str, ...], place: str, path: str) -> Any:
        found = known(value)
        if found is None:
            self.faults.append(
                f"`{place}`: {path} is traced, and has no number to write: write the machine outside of jit "
                "and vmap"
            )
            return 0.0
        return written(found, units)


def _line(machine: Machine) -> list[str] | None:
    """The names of a serial machine from left to right, attachments behind it; `None` for all others."""
    elements, places = machine.elements(), machine.connections()
    names = list(elements)
    joining = (AbstractStation, AbstractConnector)
    line = [name for name in names if isinstance(elements[name], joining)]
    if names[: len(line)] != line or len(line) % 2 == 0:
        return None
    for i, name in enumerate(line):
        if isinstance(elements[name], AbstractStation) != (i % 2 == 0):
            return None
        if i % 2:
            beside = (line[i - 1], "right"), (line[i + 1], "left")
            ends = []
            for station, side in beside:
                part = elements[station]
                ends.append(station + (part.end(side) if isinstance(part, Ended) else ""))
            if places[name] != tuple(ends):
                return None
    return line


_PLAIN = ("gravity", "fixed", "prescribed", "reduce")


def _text(machine: dict[str, Any]) -> str:
    """Laid out as people write it: a table for each element, what is inside it on one line."""
    plain = {key: machine[key] for key in _PLAIN if key in machine}
    blocks = [["[machine]", *_lines(plain)]]
    for section in ("line", "attachments"):
        blocks += [[f"[[machine.{section}]]", *_lines(table)] for table in machine.get(section, [])]
    for name, table in machine.get("elements", {}).items():
        blocks.append([f"[machine.elements.{_key(name)}]", *_lines(table)])
    if machine.get("connections"):
        blocks.append(["[machine.connections]", *_lines(machine["connections"])])
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _lines(table: dict[str, Any]) -> list[str]:
    return [f"{_key(key)} = {_rows(value)}" for key, value in table.items()]


def _rows(value: Any) -> str:
    """A matrix row by row, all else on one line."""
    if isinstance(value, list) and value and all(isinstance(row, list) for row in value):
        return "\n".join(["[", *(f"  {_inline(row)}," for row in value), "]"])
    return _inline(value)


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _inline(key)


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        inside = ", ".join(f"{_key(key)} = {_inline(one)}" for key, one in value.items())
        return f"{{ {inside} }}" if value else "{}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_inline, value))}]"
    return tomli_w.dumps({"x": value}).partition(" = ")[2].rstrip("\n")
