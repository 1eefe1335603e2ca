"""Where the search moves: one number `u` for each unknown, of a like size, 0 at the start."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import mapping, number
from ..core.errors import InputError
from ..core.quick import lightly_compiled
from .instrumented import Instrumented
from .unknown import Kind, Unknown


def wrapped(angle: Any) -> Any:
    """rad, from -pi to pi."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


class Space(eqx.Module):
    """The unknowns, their numbers as leaves: another start or prior does not recompile."""

    starts: Float[Array, " n"]
    scales: Float[Array, " n"]
    bounds: Float[Array, "n 2"]
    prior_means: Float[Array, " n"]
    prior_stds: Float[Array, " n"]
    paths: tuple[str, ...] = eqx.field(static=True)
    kinds: tuple[Kind, ...] = eqx.field(static=True)
    ties: tuple[tuple[tuple[str, float], ...], ...] = eqx.field(static=True)
    with_prior: tuple[int, ...] = eqx.field(static=True)

    @classmethod
    def of(cls, bench: Instrumented, unknowns: tuple[Unknown, ...]) -> "Space":
        """Starts taken from the machine where none is given. Raises `InputError` for what is not there or
        does not fit."""
        found = []
        for one in unknowns:
            for path in one.also:
                bench.get(path)
            own = float(bench.get(one.path))
            found.append(one.checked(own if one.start is None else float(one.start)))
        nothing = (np.nan, np.nan)
        return cls(
            jnp.asarray([one.start for one in found], float),
            jnp.asarray([one.scale for one in found], float),
            jnp.asarray([(0.0, 1.0) if one.bounds is None else one.bounds for one in found], float),
            jnp.asarray([(one.prior or nothing)[0] for one in found], float),
            jnp.asarray([(one.prior or nothing)[1] for one in found], float),
            tuple(one.path for one in found),
            tuple(one.kind for one in found),
            tuple(tuple(one.also.items()) for one in found),
            tuple(i for i, one in enumerate(found) if one.prior is not None),
        )

    def __len__(self) -> int:
        return len(self.paths)

    def _is(self, kind: Kind) -> np.ndarray:
        return np.array([k == kind for k in self.kinds])

    def values(self, u: Any) -> Float[Array, "*b n"]:
        """The parameters at places of the search."""
        return self._values(jnp.asarray(u))

    @lightly_compiled
    def _values(self, u: Float[Array, "*b n"]) -> Float[Array, "*b n"]:
        low, high = self.bounds[:, 0], self.bounds[:, 1]
        bounded, positive = self._is("bounded"), self._is("positive")
        ratio = jnp.where(bounded, (high - self.starts) / (self.starts - low), 1.0)
        inside = low + (high - low) / (1 + ratio * jnp.exp(jnp.where(bounded, -u, 0.0)))
        grown = self.starts * jnp.exp(jnp.where(positive, u, 0.0))
        moved = self.starts + jnp.where(self._is("circular"), 1.0, self.scales) * u
        return jnp.where(bounded, inside, jnp.where(positive, grown, moved))

    def places(self, values: Any) -> Float[Array, "*b n"]:
        """Where parameters lie in the search: the inverse of `values`."""
        return self._places(jnp.asarray(values, float))

    @lightly_compiled
    def _places(self, x: Float[Array, "*b n"]) -> Float[Array, "*b n"]:
        low, high = self.bounds[:, 0], self.bounds[:, 1]
        inside = jnp.log((x - low) / (high - x) * (high - self.starts) / (self.starts - low))
        grown = jnp.log(x / self.starts)
        moved = (x - self.starts) / jnp.where(self._is("circular"), 1.0, self.scales)
        return jnp.where(self._is("bounded"), inside, jnp.where(self._is("positive"), grown, moved))

    def shown(self, values: Any) -> np.ndarray:
        """Angles from -pi to pi, the rest as it is."""
        x = np.asarray(values, float)
        return np.where(self._is("circular"), wrapped(x), x)

    def placed(self, bench: Instrumented, u: Float[Array, " n"]) -> Instrumented:
        """The machine and its channels at a place of the search, ties followed."""
        return self.set(bench, self.values(u))

    def set(self, bench: Instrumented, values: Any) -> Instrumented:
        """The machine and its channels with such `values` (n,), ties followed; raises `InputError` where
        known ones make no machine."""
        new: dict[str, Any] = {}
        for i, path in enumerate(self.paths):
            new[path] = values[i]
            for other, factor in self.ties[i]:
                new[other] = factor * values[i]
        return bench.set(new)

    def priors(self, u: Float[Array, " n"]) -> list[Array]:
        """Distances from what was known before, in its standard deviations."""
        values = self.values(u)
        found = []
        for i in self.with_prior:
            away = values[i] - self.prior_means[i]
            if self.kinds[i] == "circular":
                away = jnp.remainder(away + jnp.pi, 2 * jnp.pi) - jnp.pi
            found.append((away / self.prior_stds[i])[None])
        return found


def place_of(space: Space, bench: Instrumented, start: Mapping[str, float]) -> Array:
    """Where a start lies in the search; raises `InputError`."""
    mapping(start, "starts: each")
    wrong = [path for path in start if path not in space.paths]
    if wrong:
        raise InputError(
            f"starts: `{wrong[0]}` is not looked for: name one of {', '.join(space.paths)}"
        )
    values = np.array(space.starts)
    for path, value in start.items():
        values[space.paths.index(path)] = number()(value, f"starts: `{path}`")
    place = space.places(values)
    if not np.isfinite(place).all():
        path = space.paths[int(np.argmin(np.isfinite(place)))]
        raise InputError(
            f"starts: `{path}` cannot start at {start[path]:g}: it is out of its bounds"
        )
    space.set(bench, values)
    return place
