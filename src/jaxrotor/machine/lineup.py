"""The line-up: every part of a machine, with what is lumped filled in and composites taken apart."""

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

import equinox as eqx
import jax

from ..core.protocol import LEFT, Composite, Parts
from .built import Built
from .wiring import Wiring

T = TypeVar("T")


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


def structure(element: Any) -> Any:
    """What must agree for elements to stack: the kind, its options and the shapes of its fields."""
    leaves, tree = jax.tree.flatten(element)
    return tree, tuple(x.shape for x in leaves)


def line_up(machine: Built) -> Lineup:
    """Takes composites apart. Under `jax.eval_shape` it serves for the static structure alone."""
    machine = machine.filled()
    wiring = machine.wiring
    stations = [Block(s, None) for s in machine.stations]
    inner: dict[int, list[Block]] = {}
    connectors, names, ends = [], [], []
    for alike in _alike(machine.connectors):
        i = alike[0]
        if not isinstance(machine.connectors[i], Composite):
            connectors.append(Block(machine.connectors[i], None))
            names.append(wiring.connectors[i])
            ends.append(wiring.ends[i])
            continue
        made, count = _made(tuple(machine.connectors[i] for i in alike))
        for k, i in enumerate(alike):
            inner[i] = [
                Block(jax.tree.map(lambda x, k=k: x[..., k], stacked), size)
                for stacked, size in made.stations
            ]
        for label, stacked, places in made.connectors:
            size = len(places[0])
            connectors.append(Block(jax.tree.map(_flat, stacked), size * count))
            for piece in range(size):
                for i in alike:
                    own, first = wiring.ends[i], wiring.inner[i]
                    number = f" {piece + 1}" if size > 1 else ""
                    names.append(f"{wiring.connectors[i]}.{label}{number}")
                    ends.append(
                        tuple(
                            (first + p[piece], "") if p[piece] >= 0 else own[p[piece] != LEFT]
                            for p in places
                        )
                    )
    for i in sorted(inner):
        stations += inner[i]
    whole = replace(wiring, connectors=tuple(names), ends=tuple(ends))
    return Lineup(tuple(stations), tuple(connectors), whole)


def _alike(connectors: tuple[Any, ...]) -> list[list[int]]:
    """Composites of one structure together, all else by itself; in the order in which they appear."""
    found: list[list[int]] = []
    seen: dict[Any, list[int]] = {}
    for i, element in enumerate(connectors):
        if isinstance(element, Composite):
            key = structure(element)
            if key in seen:
                seen[key].append(i)
                continue
            seen[key] = [i]
            found.append(seen[key])
        else:
            found.append([i])
    return found


def _made(composites: tuple[Any, ...]) -> tuple[Parts, int]:
    """What composites of one structure are made of: one more axis, the last, counts them."""
    rest = []  # labels and places, the same for each

    def arrays(composite):
        found, static = eqx.partition(composite.parts(), eqx.is_array)
        rest.append(static)
        return found

    stacked = jax.tree.map(lambda *x: jax.numpy.stack(x, axis=-1), *composites)
    made = jax.vmap(arrays, in_axes=-1, out_axes=-1)(stacked)
    return eqx.combine(made, rest[0]), len(composites)


def _flat(x: Any) -> Any:
    """(..., pieces, composites) as one axis."""
    return x.reshape(*x.shape[:-2], -1)


def by_structure(function: Callable[[Any], T]) -> Callable[[Any], T]:
    """For what is told by a machine's parts, names, options and shapes alone: told once for all machines that
    have them in common. `function` gets shapes in place of arrays."""

    @functools.lru_cache(maxsize=32)
    def of(tree: Any, kinds: tuple[tuple[tuple[int, ...], Any], ...]) -> T:
        return function(jax.tree.unflatten(tree, [jax.ShapeDtypeStruct(*kind) for kind in kinds]))

    @functools.wraps(function)
    def call(machine: Any) -> T:
        leaves, tree = jax.tree.flatten(machine)
        if all(hasattr(x, "shape") and hasattr(x, "dtype") for x in leaves):
            return of(tree, tuple((tuple(x.shape), x.dtype) for x in leaves))
        return function(machine)

    return call


@by_structure
def structure_of(machine: Built) -> Lineup:
    """The line-up with shapes in place of arrays: nothing is computed."""
    return eqx.filter_eval_shape(line_up, machine)


def stack(blocks: list[Block]) -> Any:
    """All members of blocks of one kind, stacked on the last axis."""

    def joined(*leaves):
        parts = [x[..., None] if b.count is None else x for x, b in zip(leaves, blocks)]
        return parts[0] if len(parts) == 1 else jax.numpy.concatenate(parts, axis=-1)

    return jax.tree.map(joined, *[b.element for b in blocks])
