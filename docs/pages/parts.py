"""A part's section, from its class: its words, parameters with units and bounds, what it can do, what a run
tells of it."""

import dataclasses
import inspect
import re
from typing import Any

import equinox as eqx
import jax
import numpy as np

from jaxrotor import protocols
from jaxrotor.core.declared import default_of

from .names import Name

MARK = re.compile(r"<!-- part: jr\.(?P<place>[\w.]+)(?: picture: (?P<picture>\w+))? -->")
ABILITIES = {
    "NonSmooth": "its force kinks or sticks: `jr.Rosenbrock` runs it",
    "Linear": "linear: stiffness and damping are assembled once",
    "Energetic": "accounts for its energy and losses",
    "Stateful": "has states of its own",
    "Timed": "instants at which it jumps are met exactly",
    "Sampled": "changes at the ticks of a clock",
    "Powered": "draws power from outside",
    "Composite": "makes stations of its own inside",
}


def section(name: Name, picture: str) -> str:
    """Markdown. `picture`: of it, empty where there is none."""
    thing = name.thing
    lines = [f"### {name.place.split('.')[-1]} {{ #{name.place.split('.')[-1]} }}", ""]
    if picture:
        lines += [f"![{name.place}]({picture}){{ .part }}", ""]
    lines += [words(thing), "", *parameters(thing)]
    can = [f"{said} ([`{k}`](../extending.md#abilities))" for k, said in ABILITIES.items()
           if issubclass(thing, getattr(protocols, k, ()))]  # fmt: skip
    if can:
        lines += [f"*Abilities:* {'; '.join(can)}.", ""]
    signals = getattr(thing, "signals", {})
    if isinstance(signals, dict) and signals:
        told = ", ".join(
            f"`.{k}`" + (f" ({_straight(unit)})" if unit else "") for k, unit in signals.items()
        )
        lines += [f"*In results:* {told}.", ""]
    lines += [f"*Reference:* [`jr.{name.place}`](../{name.link}).", ""]
    return "\n".join(lines)


def words(thing: Any) -> str:
    """Its docstring without the list of units, which the table has."""
    text = inspect.getdoc(thing) or ""
    return re.split(r"\n\nParameters, SI:", text)[0].strip()


def parameters(thing: type) -> list[str]:
    """The table of what it is made of."""
    rows = []
    for field in dataclasses.fields(thing) if dataclasses.is_dataclass(thing) else ():
        if field.init and not field.name.startswith("_"):
            facts = field.metadata
            physical = "unit" in facts
            unit = _unit(facts) if physical else _straight(facts.get("drives", ""))
            rows.append(f"| `{field.name}` | {unit} | {_kind(field)} | {_default(field)} |")
    if not rows:
        return []
    return [
        "| parameter | unit (SI) | what it may be | if left out |",
        "|---|---|---|---|",
        *rows,
        "",
    ]


def _unit(facts: Any) -> str:
    units = list(dict.fromkeys(facts["units"])) or [facts["unit"]]
    told = ", ".join(map(_straight, units))
    return told or ("of what it drives" if facts["times"] else "1")


def _straight(unit: str) -> str:
    """As it is printed in a book."""
    return unit.replace("*", "·").replace("^2", "²").replace("^3", "³")


def _kind(field: dataclasses.Field) -> str:
    facts = field.metadata
    if facts.get("drives"):
        return "a number or a schedule"
    if "unit" not in facts:
        hint = field.type if isinstance(field.type, str) else inspect.formatannotation(field.type)
        hint = re.sub(r"\b(?:[a-z_]+\.)+(?=[A-Z])|jaxtyping\.|typing\.", "", hint)
        hint = re.sub(
            r"Literal\[(.*?)\]", lambda m: m[1].replace(", ", " or ").replace("'", '"'), hint
        )
        return hint.replace(" | None", "").replace("|", "or").replace("ForwardRef", "").strip("'")
    sign = "positive" if facts["positive"] else "zero or positive" if facts["nonnegative"] else ""
    shapes = [s for s in facts["shapes"] if s]
    shape = " or ".join("×".join("n" if k is None else str(k) for k in s) for s in shapes)
    label = facts["label"]
    return (
        ", ".join(x for x in (label, sign, f"{shape} numbers" if shape else "") if x)
        or "any number"
    )


def _default(field: dataclasses.Field) -> str:
    value = default_of(field)
    if value is dataclasses.MISSING:
        return "must be given"
    if value is None:
        return "none"
    if isinstance(value, (jax.Array, np.ndarray)):
        numbers = np.asarray(value)
        if numbers.ndim == 0:
            return f"{float(numbers):g}"
        return "zeros" if not numbers.any() else f"{numbers.tolist()}"
    if isinstance(value, eqx.Module):
        return f"`{value!r}`"
    return f"`{value!r}`"
