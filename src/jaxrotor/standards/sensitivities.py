"""How the numbers of checks change with every parameter of the machine, from what moves them."""

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..core.quick import quickly_compiled
from ..linear.slopes import Form, slopes_of
from ..machine.machine import Machine
from .moves import Moves, Numbers

# Of so many entries each is a parameter by itself; a longer list (a table over speed) is one as a whole.
_FEW = 6
_PART = 1e-4


def derivatives(
    moves: Sequence[Moves], step: Callable[[int, int], None] = lambda done, of: None
) -> list[dict[str, np.ndarray]]:
    """Of each number: path -> derivative by that parameter, SI; empty where nothing of the machine moves it.
    `step` is told how many sweeps are done, of how many."""
    groups: dict[tuple[int, Any], tuple[Machine, list[Any]]] = {}
    for term in (term for one in moves for term in one):
        _, held = groups.setdefault((id(term.machine), term.at), (term.machine, []))
        if not any(term.form is form for form in held):
            held.append(term.form)
    total = sum(len(held) for _, held in groups.values())
    found: dict[int, dict[str, np.ndarray]] = {}
    done = 0
    for (_, at), (machine, held) in groups.items():
        forms = [form for form in held if isinstance(form, Form)]
        direct = [form for form in held if not isinstance(form, (Form, Numbers))]
        slopes = slopes_of(machine.full(), forms, at, lambda k, begun=done: step(begun + k, total))
        slopes += _directly(machine, direct)
        done += len(held)
        step(done, total)
        for form, slope in zip(forms + direct, slopes):
            values = slope.parameters()
            found[id(form)] = {p: np.asarray(v) for p, v in values.items() if v is not None}
        for form in held:
            if isinstance(form, Numbers):
                found[id(form)] = _by_differences(machine, form)
    out = []
    for one in moves:
        summed: dict[str, np.ndarray] = {}
        for term in one:
            for path, slope in found[id(term.form)].items():
                summed[path] = summed.get(path, 0.0) + term.weight * slope
        out.append(summed)
    return out


def _directly(machine: Machine, functions: Sequence[Callable[[Machine], Any]]) -> list[Machine]:
    if not functions:
        return []

    @quickly_compiled
    def program(machine: Machine) -> list[Machine]:
        inside, rest = eqx.partition(machine, eqx.is_inexact_array)
        found = jax.jacrev(
            lambda x: jnp.stack([jnp.asarray(f(eqx.combine(x, rest))) for f in functions])
        )(inside)
        return [jax.tree.map(lambda x, k=k: x[k], found) for k in range(len(functions))]

    return program(machine)


def _by_differences(machine: Machine, numbers: Numbers) -> dict[str, np.ndarray]:
    """Of numbers and of the entries of short rows, central ones over 0.01 %."""
    out = {}
    for path, value in machine.parameters().items():
        value, units = np.asarray(value, float), machine.units(path)
        wanted = "rad" not in units if numbers.units is None else units[0] in numbers.units
        if not wanted or value.ndim > 1 or value.size > _FEW or not np.any(value):
            continue
        slope = np.zeros(value.shape)
        for place in np.ndindex(value.shape):
            step = _PART * abs(value[place])
            if step == 0:
                continue
            ends = []
            for side in (-1, 1):
                moved = value.copy()
                moved[place] += side * step
                ends.append(numbers.function(machine.set({path: moved})))
            slope[place] = (ends[1] - ends[0]) / (2 * step)
        out[path] = slope
    return out


def by_percent(machine: Machine, slopes: dict[str, np.ndarray]) -> dict[str, float]:
    """Of derivatives: path -> the change of the number where the parameter grows by 1 %. Of up to six entries
    each is told by itself, `b1.stiffness[0]`; a table as a whole. Of angles no part is taken."""
    values, out = machine.parameters(), {}
    for path, slope in slopes.items():
        if "rad" in machine.units(path):
            continue
        change = 0.01 * slope * np.asarray(values[path])
        if change.ndim == 1 and change.size <= _FEW:
            out |= {f"{path}[{k}]": float(x) for k, x in enumerate(change)}
        else:
            out[path] = float(np.sum(change))
    return {path: x for path, x in out.items() if x != 0 and np.isfinite(x)}
