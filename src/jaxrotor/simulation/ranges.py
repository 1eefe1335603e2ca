"""Did a run leave the tables that its parts draw on?"""

import warnings

import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..core.parameter import numbers
from ..core.protocol import Tabulated
from ..core.quick import quickly_compiled
from ..machine.field import node_motions
from ..machine.machine import Machine
from ..machine.system import System
from .named_parts import part_of
from .response import Response


def tell_ranges(response: Response) -> None:
    """Warns once of each table that the run went beyond."""
    elements = response.machine.elements()
    tables = {name: part for name, part in elements.items() if isinstance(part, Tabulated)}
    if not tables:
        return
    for name, (seen, rows) in _seen(
        response.machine, response._system, response.t, response.y
    ).items():
        low, high, first, last = map(float, (*numbers(seen), *numbers(rows)))
        margin = 1e-9 * (last - first)
        beyond = [
            f"{x:.6g}"
            for x, out in ((low, low < first - margin), (high, high > last + margin))
            if out
        ]
        if beyond:
            unit = tables[name].looked_up(((jnp.zeros(6), jnp.zeros(6)),))[2]
            told = tables[name].beyond.format(
                first=first, last=last, found=" and ".join(beyond), unit=unit
            )
            warnings.warn(f"`{name}`: {told}", stacklevel=3)


@quickly_compiled
def _seen(machine: Machine, system: System, t: Array, y: Array) -> dict[str, tuple[Array, Array]]:
    """Least and largest value that each table was entered with, and its first and last row."""
    q, v = jax.vmap(lambda t, y: node_motions(t, y, system))(t, y)
    found = {}
    for name, element in machine.elements().items():
        if isinstance(element, Tabulated):
            element, nodes, _ = part_of(machine, system, name)
            motions = tuple((q[:, :, i], v[:, :, i]) for i in nodes)
            at = jax.vmap(lambda m, e=element: e.looked_up(m)[0])(motions)
            rows = element.looked_up(jax.tree.map(lambda x: x[0], motions))[1]
            found[name] = (jnp.stack([jnp.min(at), jnp.max(at)]), rows[jnp.array([0, -1])])
    return found
