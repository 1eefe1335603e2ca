"""What a finer mesh changes: natural frequencies of shafts with mass, cut more and more finely."""

import dataclasses
from typing import Any

import equinox as eqx
import numpy as np

from ..core.arguments import number, whole
from ..core.bar import with_bar
from ..core.errors import InputError
from ..core.gate import takes
from ..core.protocol import Composite
from ..core.result_text import table_of
from ..machine.machine import Machine
from .linearise import linearize
from .modes import modes

# Below this part of a frequency a change is rounding.
_ROUNDING = 1e-10


class Convergence(eqx.Module):
    """Natural frequencies of a machine over how finely its shafts are cut. Prints as a table.

    - `elements`: shaft -> (n,), its number of elements in each section, mesh by mesh.
    - `names`: of the m modes, on the finest mesh.
    - `frequencies`: (n, m), rad/s. `limit`: (m,), rad/s, towards which they go, by Richardson's
      extrapolation of the last three. `order`: (m,), of the error in an element's length; NaN where rounding
      or a mode that changed its place hides it (then `limit` is the finest).
    - `error`: (n, m), each frequency less the limit, as part of it.
    """

    elements: dict[str, np.ndarray]
    names: tuple[str, ...] = eqx.field(static=True)
    frequencies: np.ndarray
    limit: np.ndarray
    order: np.ndarray

    @property
    def error(self) -> np.ndarray:
        return self.frequencies / self.limit - 1

    def __repr__(self) -> str:
        return f"Convergence of {len(self.names)} modes on {len(self.frequencies)} meshes\n{self}"

    def __str__(self) -> str:
        meshes = ["x".join(map(str, row)) for row in zip(*self.elements.values())]
        rows = [("mode", "limit, Hz", "order", *(f"error, {mesh}" for mesh in meshes))]
        for k, name in enumerate(self.names):
            order = "-" if np.isnan(self.order[k]) else f"{self.order[k]:.1f}"
            errors = (f"{100 * e:.2g} %" for e in self.error[:, k])
            rows.append((name, f"{self.limit[k] / (2 * np.pi):.6g}", order, *errors))
        return f"{table_of(rows)}\nelements in each section of {', '.join(self.elements)}"


@takes(speed=number("rad/s"), count=whole(1), meshes=whole(3, 6))
def convergence(
    machine: Machine,
    speed: float = 0.0,
    count: int = 6,
    meshes: int = 3,
    progress: bool | None = None,
) -> Convergence:
    """The `count` lowest natural frequencies at `speed` (rad/s) on the machine's own mesh and on `meshes` - 1
    finer ones, each with twice the elements of that before in every shaft with mass. What is attached to a
    shaft's inner stations stays where it is.

    Raises `InputError` where no shaft has elements, and what `jr.linearize` raises.
    """
    shafts: dict[str, Any] = {k: e for k, e in machine.elements().items() if _is_meshed(e)}
    if not shafts:
        raise InputError(
            "machine: no shaft of it is cut into elements: give it a FiniteElementShaft or a "
            "RigidElementShaft"
        )
    found = []
    for k in with_bar(range(meshes), "meshes", progress):
        model = linearize(_refined(machine, 2**k), speed)
        found.append(modes(model, count))
    least = min(map(len, found))
    w = np.array([[mode.frequency for mode in row[:least]] for row in found])
    limit, order = _extrapolated(w)
    return Convergence(
        {name: int(shaft.elements) * 2 ** np.arange(meshes) for name, shaft in shafts.items()},
        tuple(mode.name for mode in found[-1][:least]),
        w,
        limit,
        order,
    )


def _is_meshed(element: Any) -> bool:
    """Whether it is cut into so many elements."""
    return isinstance(element, Composite) and hasattr(element, "elements")


def _extrapolated(w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Limit and order of each column, whose last three rows halve the length of an element."""
    before, after = w[-2] - w[-3], w[-1] - w[-2]
    clear = np.minimum(np.abs(before), np.abs(after)) > _ROUNDING * w[-1]
    ratio = np.divide(before, after, out=np.full(after.shape, np.nan), where=clear)
    ratio = np.where(ratio > 1.5, ratio, np.nan)
    limit = w[-1] + np.nan_to_num(after / (ratio - 1))
    return limit, np.log2(ratio)


def _refined(machine: Machine, factor: int) -> Machine:
    """The same with `factor` times the elements in each shaft with mass."""
    if factor == 1:
        return machine
    elements: dict[str, Any] = dict(machine.elements())
    for name, e in elements.items():
        if _is_meshed(e):
            elements[name] = dataclasses.replace(e, elements=e.elements * factor)

    def place(name: str) -> str:
        shaft, _, inner = name.partition(".")
        if _is_meshed(elements[shaft]) and inner.isdigit():
            return f"{shaft}.{int(inner) * factor}"
        return name

    connections = {k: tuple(map(place, ends)) for k, ends in machine.connections().items()}
    return Machine(elements, connections, machine.gravity, machine.fixed(), machine.prescribed())
