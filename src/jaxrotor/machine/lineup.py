"""The line-up: every part of a machine, with what is lumped filled in and composites taken apart."""

from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax

from ..protocol import LEFT, Composite
from .wiring import Wiring

if TYPE_CHECKING:
    from .machine import Machine


class Block(eqx.Module):
    """Elements of one origin: one as it is (`count` None), or so many stacked on the last axis."""

    element: Any
    count: int | None = eqx.field(static=True)

    def __len__(self) -> int:
        return 1 if self.count is None else self.count

    def one(self) -> Any:
        """The shapes and options of one member."""
        if self.count is None:
            return self.element
        return jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape[:-1], x.dtype), self.element)


class Lineup(eqx.Module):
    """Stations and connectors in blocks; `wiring` names every member of every block, in order."""

    stations: tuple[Block, ...]
    connectors: tuple[Block, ...]
    wiring: Wiring = eqx.field(static=True)


def line_up(machine: "Machine") -> Lineup:
    """Takes composites apart. Under `jax.eval_shape` it serves for the static structure alone."""
    machine = machine.filled()
    wiring = machine.wiring
    stations = [Block(s, None) for s in machine.stations]
    connectors, names, ends = [], [], []
    for i, element in enumerate(machine.connectors):
        name, own = wiring.connectors[i], wiring.ends[i]
        if not isinstance(element, Composite):
            connectors.append(Block(element, None))
            names.append(name)
            ends.append(own)
            continue
        parts = element.parts()
        stations += [Block(stacked, count) for stacked, count in parts.stations]
        first = wiring.inner[i]
        for label, stacked, places in parts.connectors:
            count = len(places[0])
            connectors.append(Block(stacked, count))
            for k in range(count):
                names.append(f"{name}.{label}" + (f" {k + 1}" if count > 1 else ""))
                ends.append(
                    tuple(
                        (first + p[k], "") if p[k] >= 0 else own[0 if p[k] == LEFT else 1]
                        for p in places
                    )
                )
    whole = Wiring(
        wiring.stations, tuple(names), tuple(ends), wiring.held, wiring.order, wiring.inner
    )
    return Lineup(tuple(stations), tuple(connectors), whole)


def structure_of(machine: "Machine") -> Lineup:
    """The line-up with shapes in place of arrays: nothing is computed."""
    return eqx.filter_eval_shape(line_up, machine)


def stack(blocks: list[Block]) -> Any:
    """All members of blocks of one kind, stacked on the last axis."""

    def joined(*leaves):
        parts = [x[..., None] if b.count is None else x for x, b in zip(leaves, blocks)]
        return parts[0] if len(parts) == 1 else jax.numpy.concatenate(parts, axis=-1)

    return jax.tree.map(joined, *[b.element for b in blocks])
