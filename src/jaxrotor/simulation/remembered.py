"""What was found for a machine, or for what else holds numbers, for its next run."""

from typing import Any, Generic, TypeVar

import jax
import numpy as np

from ..core.parameter import numbers

T = TypeVar("T")


class Remembered(Generic[T]):
    """The latest few, by the machine's values (or those of any tree of arrays) and what was asked."""

    def __init__(self, most: int):
        self._most = most
        self._found: dict[Any, T] = {}

    def get(self, machine: Any, asked: Any) -> T | None:
        return self._found.get(_key(machine, asked))

    def put(self, machine: Any, asked: Any, found: T) -> T:
        self._found[_key(machine, asked)] = found
        while len(self._found) > self._most:
            self._found.pop(next(iter(self._found)))
        return found


def _key(machine: Any, asked: Any) -> Any:
    leaves, tree = jax.tree.flatten(machine)
    values = [np.asarray(numbers(x)) for x in leaves]
    return tree, tuple((x.shape, x.tobytes()) for x in values), asked
