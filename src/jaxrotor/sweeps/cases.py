"""Which machines a sweep runs: a table of parameters, a row for each."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from scipy import stats

from ..core.arguments import LARGEST, choice, mapping, real_array, short, whole
from ..core.errors import InputError
from ..core.result_text import shows

Method = Literal["sobol", "latin", "random"]
_TINY = float(np.finfo(float).eps)


@shows()
@dataclasses.dataclass(frozen=True)
class Cases:
    """`values`: path -> (n,), SI; one entry of several as `"bearing.stiffness[0]"`. `axes`: of a grid, path
    -> values along each; else empty. `how`: in words, with the seed."""

    values: dict[str, np.ndarray]
    how: str = "a table"
    axes: dict[str, np.ndarray] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        mapping(self.values, "cases:")
        values = {path: _column(path, value) for path, value in self.values.items()}
        object.__setattr__(self, "values", values)
        if not values:
            raise InputError("cases: no parameter is swept: name one at least")
        sizes = {path: x.size for path, x in values.items()}
        first = next(iter(sizes))
        for path, size in sizes.items():
            if size != sizes[first]:
                raise InputError(
                    f"cases: `{path}` has {size} values, but `{first}` has {sizes[first]}: give one for "
                    "each case"
                )

    def __len__(self) -> int:
        return next(iter(self.values.values())).size

    @classmethod
    def grid(cls, axes: Mapping[str, Any]) -> "Cases":
        """Every combination; the last axis runs fastest. Raises `InputError` for values that are no
        finite numbers."""
        mapping(axes, "axes")
        named = {path: _column(path, value) for path, value in axes.items()}
        whole(1)(math.prod(x.size for x in named.values()), "axes: the number of combinations")
        mesh = np.meshgrid(*named.values(), indexing="ij") if named else []
        values = {path: x.ravel() for path, x in zip(named, mesh)}
        words = " x ".join(str(x.size) for x in named.values())
        return cls(values, f"a grid, {words}", named)

    @classmethod
    def sampled(
        cls,
        distributions: Mapping[str, Any],
        count: int,
        method: Method = "sobol",
        seed: int = 0,
        correlations: Mapping[tuple[str, str], float] | None = None,
    ) -> "Cases":
        """Drawn from frozen distributions of scipy.stats, such as `scipy.stats.norm(5e-4, 5e-5)`.

        `method`: scrambled Sobol points (best in powers of two), a Latin hypercube, or independent numbers;
        `seed` repeats them. `correlations`: (path, path) -> correlation of their normal scores, by a Gaussian
        copula: of normal distributions it is their own. Raises `InputError` for what is no distribution, and
        for correlations that no distribution has. Source: Nelsen, An Introduction to Copulas (2006).
        """
        count, seed = whole(1)(count, "count"), whole(0, LARGEST)(seed, "seed")
        choice("sobol", "latin", "random")(method, "method")
        if not isinstance(distributions, Mapping) or not distributions:
            raise InputError(
                "distributions: must be a mapping from paths to distributions, such as "
                f"{{'main.mass': scipy.stats.norm(6.0, 0.1)}}, but are {short(distributions)}"
            )
        for path, one in distributions.items():
            # one that is not frozen has a `ppf` too, of its standard form
            if not hasattr(one, "ppf") or isinstance(one, stats.rv_continuous | stats.rv_discrete):
                raise InputError(
                    f"`{path}`: must be a frozen distribution such as scipy.stats.norm(1.0, 0.1), "
                    f"but is {one!r}"
                )
        scores = _scores(len(distributions), count, method, seed)
        names = list(distributions)
        if correlations:
            scores = _correlated(scores, names, correlations)
        u = np.clip(stats.norm.cdf(scores), _TINY, 1 - _TINY)
        with np.errstate(all="ignore"):  # what is not finite is told below
            values = {path: distributions[path].ppf(one) for path, one in zip(names, u.T)}
        words = {"sobol": "Sobol points", "latin": "a Latin hypercube", "random": "random numbers"}
        return cls(values, f"{count} cases by {words[method]}, seed {seed}")

    def tied(self, ties: Mapping[str, str]) -> "Cases":
        """With further parameters that follow one that is swept: `{"right.stiffness[0]":
        "left.stiffness[0]"}`. Raises `InputError` where the one is swept already, or the other is not."""
        for new, old in mapping(ties, "ties").items():
            if old not in self.values:
                raise InputError(f"`{new}`: follows `{old}`, which is not swept")
            if new in self.values:
                raise InputError(f"`{new}`: is swept itself and cannot follow `{old}`")
        more = {new: self.values[old] for new, old in ties.items()}
        return dataclasses.replace(self, values=self.values | more)


def as_cases(parameters: Any) -> Cases:
    return parameters if isinstance(parameters, Cases) else Cases(parameters)


def _column(path: str, value: Any) -> np.ndarray:
    found = real_array(value)
    if found is None:
        raise InputError(f"cases: `{path}` must be a list of numbers, but is {short(value)}")
    if found.ndim != 1 or not found.size:
        raise InputError(
            f"cases: `{path}` must be a list of numbers, but has the shape {found.shape}"
        )
    if not np.all(np.isfinite(found)):
        row = int(np.argmin(np.isfinite(found)))
        raise InputError(f"cases: `{path}` must be finite, but value {row + 1} is {found[row]}")
    return found


def _scores(d: int, count: int, method: str, seed: int) -> np.ndarray:
    """Standard normal numbers (count, d)."""
    if method == "sobol":
        # all of a power of two are balanced; drawn so and cut
        whole = stats.qmc.Sobol(d, rng=seed).random_base2(max(1, int(np.ceil(np.log2(count)))))
        drawn = whole[:count]
    elif method == "latin":
        drawn = stats.qmc.LatinHypercube(d, rng=seed).random(count)
    else:
        drawn = np.random.default_rng(seed).random((count, d))
    return stats.norm.ppf(np.clip(drawn, _TINY, 1 - _TINY))


def _correlated(scores: np.ndarray, names: Sequence[str], wanted: Mapping) -> np.ndarray:
    R, told = np.eye(len(names)), {}
    for pair, r in wanted.items():
        if not isinstance(pair, tuple) or len(set(pair)) != 2:
            raise InputError(f"correlations: must be of pairs of two paths, but {pair!r} is none")
        for path in pair:
            if path not in names:
                raise InputError(f"correlations: `{path}` is not swept")
        if not isinstance(r, (int, float)) or not -1 < r < 1:
            raise InputError(f"correlations: {pair} must lie between -1 and 1, but is {r!r}")
        if told.setdefault(frozenset(pair), r) != r:
            raise InputError(
                f"correlations: {pair} is given twice, as {told[frozenset(pair)]} and {r}"
            )
        i, j = (names.index(path) for path in pair)
        R[i, j] = R[j, i] = r
    if np.min(np.linalg.eigvalsh(R)) <= 0:
        raise InputError(
            "correlations: together they contradict one another (their matrix is not positive definite): "
            "weaken one"
        )
    return scores @ np.linalg.cholesky(R).T
