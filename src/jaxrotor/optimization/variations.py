"""A batch of machines about a nominal one: scatter of parameters, for designs that must bear it."""

from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import listed, mapping, number, real_array, short, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import as_float64
from ..core.part import Part
from ..machine.machine import Machine
from ..machine.paths import split_entry
from ..search.instrumented import Instrumented

# What scatters unless it is named: not the gravity, and not where forces or axes point.
_LEFT = ("gravity",)


class Variations(Part):
    """`factors`: path -> (b,) factors on the parameter (all its entries alike; one entry as
    `"bearing.stiffness[0]"`), the b machines that a design is judged by. A factor acts on top of what the
    design chooses."""

    factors: dict[str, Float[Array, " b"]]

    def __init__(self, factors: Mapping[str, Any]):
        mapping(factors, "factors")
        self.factors = {path: as_float64(value) for path, value in factors.items()}
        sizes = {path: np.shape(value) for path, value in self.factors.items()}
        if not sizes:
            raise InputError("factors: no parameter is varied: name one at least")
        for path, size in sizes.items():
            if len(size) != 1 or size != next(iter(sizes.values())):
                raise InputError(
                    f"factors: `{path}` must have one factor for each machine, but has the shape {size}, "
                    f"and `{next(iter(sizes))}` {next(iter(sizes.values()))}"
                )
            if real_array(value := self.factors[path]) is None or not np.all(np.isfinite(value)):
                raise InputError(
                    f"factors: `{path}` must be finite numbers, but are {short(value)}"
                )

    @property
    def count(self) -> int:
        return next(iter(self.factors.values())).shape[0]

    def member(self, machine: Machine, own: Mapping[str, Array]) -> Machine:
        """The machine with one factor each, `own`."""
        bench = Instrumented(machine, {})
        changed = {}
        for path, factor in own.items():
            value = bench.get(path) if split_entry(path)[1] is not None else machine.get(path)
            changed[path] = value * factor
        return bench.set(changed).machine

    def check(self, machine: Machine) -> None:
        """Raises `InputError` for paths that are no parameters."""
        self.member(machine, {path: jnp.ones(()) for path in self.factors})

    @classmethod
    @takes(paths=listed, spread=number(above=0.0, below=1.0), count=whole(2))
    def uniform(
        cls,
        machine: Machine,
        paths: Sequence[str] | None = None,
        spread: float = 0.2,
        count: int = 100,
        seed: int = 0,
    ) -> "Variations":
        """Each parameter by a factor between `1 - spread` and `1 + spread`, independently and evenly (Latin
        hypercube, scipy.stats.qmc). `paths`: by default every parameter of the machine that is not zero, but
        gravity. The first machine is the nominal one. Raises `InputError` for a path that is no
        parameter, a spread not between 0 and 1, and a count below 2."""
        from scipy.stats import qmc

        if paths is None:
            paths = [
                path
                for path, value in machine.parameters().items()
                if path not in _LEFT and value is not None and np.any(np.asarray(value) != 0)
            ]
        drawn = qmc.LatinHypercube(len(paths), rng=seed).random(count - 1)
        factors = np.concatenate([np.ones((1, len(paths))), 1 + spread * (2 * drawn - 1)])
        found = cls(dict(zip(paths, factors.T)))
        found.check(machine)
        return found
