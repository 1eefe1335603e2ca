"""What an experiment would tell, of any choice of its candidates."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from ..core.arguments import nearest
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.result_text import table_of
from .uncertainty import Knowledge, knowledge

_WORDS = {
    "D": "the geometric mean of the relative standard deviations along the principal axes",
    "A": "the root mean square of the relative standard deviations",
    "E": "the largest relative standard deviation of any combination",
}
# Below this part a further one brings nothing that is worth its name.
_WORTH = 1e-3
# Changes that differ by less than this part of theirs are told as one.
_ALIKE = 0.02


@dataclasses.dataclass(frozen=True)
class Experiment:
    """The unknowns and what the candidates see of them. `rows`: of each candidate (k, n), by the search's own
    coordinates, and of the `prior`; `rate` (n,): from these to SI units; `sizes` (n,): what a standard
    deviation is relative to; `own`: channels, whose own unknowns nobody needs where they are not chosen."""

    paths: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray
    sizes: np.ndarray
    circular: tuple[bool, ...]
    rate: np.ndarray
    prior: np.ndarray
    rows: tuple[np.ndarray, ...]
    names: tuple[str, ...]
    own: tuple[str, ...]

    def known_by(self, chosen: Sequence[int]) -> Knowledge:
        n = len(self.paths)
        J = np.vstack([self.prior, *(self.rows[c] for c in chosen), np.zeros((n, n))])
        return knowledge(J, np.zeros(len(J)), self.paths, len(J), given=True)

    def std(self, chosen: Sequence[int]) -> np.ndarray:
        """(n,), SI."""
        return self.rate * self.known_by(chosen).std

    def shares(self) -> np.ndarray:
        """(candidates, n): of the information on each unknown, the others known, the part that each candidate
        brings; the priors' part is what is missing to 1. 0 where there is none."""
        each = np.array([np.sum(r**2, axis=0) for r in self.rows])
        total = each.sum(axis=0) + np.sum(self.prior**2, axis=0)
        return each / np.where(total > 0, total, 1.0)


@dataclasses.dataclass(frozen=True, repr=False)
class ExperimentDesign:
    """**What was found:**

    - `chosen`: names of the candidates that are chosen, the one that helps most first. `order`: of all, as
      numbers of `names`, the rest behind the chosen ones in the order in which they would be added.
    - `std`, `std_of_all`: path -> standard deviation to be expected (SI) with the chosen candidates and with
      all; infinite where these cannot see a parameter. `expected(names)`: the same for any choice.
      `stds`: (candidates + 1, n), with none, one, two, ... of the `order`.
    - `spread`: of the chosen candidates by the criterion, a relative standard deviation. `spreads`:
      (candidates + 1,), as `stds`. `further`: name -> `spread` where this one is added to the chosen.
    - `blind`: combinations of parameters that the chosen candidates cannot see, `blind_to_all`: that all
      together cannot. `warnings`: sentences on what is doubtful. `print(found)` shows the tables.
    - `information`: (sensors, runs, n, n), Fisher information of each sensor in each run in SI units, without
      priors; `prior_information`: (n, n), of these. `shares`: (candidates, n), the part that each candidate
      brings of the information on a parameter by itself.
    """

    experiment: Experiment
    of: str
    criterion: str
    count: int
    order: tuple[int, ...]
    spreads: np.ndarray
    further: dict[str, float]
    information: np.ndarray
    prior_information: np.ndarray
    runs: tuple[str, ...]
    correlated: tuple[str, ...] = ()

    plot = plot_door()

    @property
    def paths(self) -> tuple[str, ...]:
        return self.experiment.paths

    @property
    def names(self) -> tuple[str, ...]:
        return self.experiment.names

    @property
    def sensors(self) -> tuple[str, ...]:
        return self.experiment.own

    @property
    def chosen(self) -> tuple[str, ...]:
        return tuple(self.names[c] for c in self.order[: self.count])

    @property
    def std(self) -> dict[str, float]:
        return self.expected(self.chosen)

    @property
    def std_of_all(self) -> dict[str, float]:
        return self.expected(self.names)

    @property
    def spread(self) -> float:
        return float(self.spreads[self.count])

    @property
    def stds(self) -> np.ndarray:
        return np.array([self.experiment.std(self.order[:k]) for k in range(len(self.order) + 1)])

    @property
    def shares(self) -> np.ndarray:
        return self.experiment.shares()

    @property
    def blind(self) -> tuple[dict[str, float], ...]:
        return self._unseen(self.order[: self.count])

    @property
    def blind_to_all(self) -> tuple[dict[str, float], ...]:
        return self._unseen(self.order)

    def expected(self, names: Sequence[str]) -> dict[str, float]:
        """Path -> standard deviation (SI) with these candidates. Raises `InputError` for one that is none."""
        wrong = [name for name in names if name not in self.names]
        if wrong or isinstance(names, str):
            raise InputError(
                f"names must be a list of candidates ({', '.join(self.names)}), but is or holds "
                f"{names if isinstance(names, str) else wrong[0]!r}{nearest(wrong[0], self.names)}"
            )
        found = self.experiment.std([self.names.index(name) for name in names])
        return dict(zip(self.paths, found.tolist()))

    def _unseen(self, chosen: Sequence[int]) -> tuple[dict[str, float], ...]:
        """But for what belongs to a sensor that is not chosen."""
        names = [self.names[c] for c in chosen]
        idle = {
            sensor
            for sensor in self.sensors
            if self.of != "runs"
            and not any(x == sensor or x.startswith(f"{sensor} of ") for x in names)
        }
        return tuple(
            direction
            for direction in self.experiment.known_by(chosen).blind
            if not all(path.split(".")[0] in idle for path in direction)
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        found = []
        for direction in self.blind_to_all:
            found.append(
                f"none of the candidates sees {_combined(direction)}: hold one of these, give it a prior, or "
                "offer something else"
                if len(direction) > 1
                else f"none of the candidates sees {_combined(direction)}"
            )
        for direction in self.blind:
            if direction.keys() not in [d.keys() for d in self.blind_to_all]:
                found.append(f"what is chosen does not see {_combined(direction)}: choose more")
        found += [
            f"`{name}`: its noise is correlated, and counts as white here: standard deviations are too small"
            for name in self.correlated
        ]
        return tuple(found)

    def __str__(self) -> str:
        total = len(self.names)
        by = _WORDS.get(self.criterion, f"the relative standard deviation of {self.criterion}")
        rest = {
            "sensors": f", in each of {len(self.runs)} runs ({', '.join(self.runs)})",
            "runs": f", with each of {len(self.sensors)} sensors ({', '.join(self.sensors)})",
        }.get(self.of, "")
        lines = [f"{self.count} of {total} {self.of} chosen{rest}", f"spread: {by}", ""]
        with_all, chosen = (self.experiment.std(self.order[:k]) for k in (total, self.count))
        head = ("parameter", "guess", f"std, {self.count} chosen", "", f"std, all {total}", "")
        rows: list[tuple[str, ...]] = [head if self.count < total else head[:4]]
        for i, (path, unit) in enumerate(zip(self.paths, self.experiment.units)):
            row = (
                path,
                f"{self.experiment.values[i]:.6g} {unit}".rstrip(),
                *(_with(chosen[i], unit), self._part(chosen[i], i)),
                *(_with(with_all[i], unit), self._part(with_all[i], i)),
            )
            rows.append(row if self.count < total else row[:4])
        lines += [table_of(rows), ""]
        one = self.of.removesuffix("s")
        rows: list[tuple[str, ...]] = [("", one, "spread", "times", "most by it")]
        for k in range(1, self.count + 1):
            rows.append((str(k), *self._step(self.order[:k], self.spreads[k], self.spreads[k - 1])))
        for name, spread in self.further.items():
            members = (*self.order[: self.count], self.names.index(name))
            rows.append(("or +", *self._step(members, spread, self.spread)))
        lines.append(table_of(rows))
        return "\n".join([*lines, *(f"! {w}" for w in self.warnings)])

    __repr__ = __str__

    def _step(self, members: Sequence[int], spread: float, before: float) -> tuple[str, ...]:
        """A candidate's name, what the criterion is with it and by which factor it fell, and the parameter
        that gains most, or what is not seen yet."""
        name = self.names[members[-1]]
        if not np.isfinite(spread):
            unseen = self._unseen(members)
            return name, "-", "", f"does not see {_combined(unseen[0])}" if unseen else ""
        factor = f"{spread / before:.3g}" if np.isfinite(before) else ""
        return name, f"{100 * spread:.3g} %", factor, self._gain(members)

    def _gain(self, members: Sequence[int]) -> str:
        """What the last of them does for the parameter that gains most, or for the criterion's own."""
        then, now = (self.experiment.std(m) for m in (members[:-1], members))
        judged = (
            [self.paths.index(self.criterion)] if self.criterion in self.paths else range(len(now))
        )
        new = [i for i in judged if np.isfinite(now[i]) and not np.isfinite(then[i])]
        if new:
            return (
                "all seen"
                if len(new) == len(now)
                else f"sees {', '.join(self.paths[i] for i in new)}"
            )
        change = {i: now[i] / then[i] - 1 for i in judged if np.isfinite(now[i])}
        most = min(change, key=lambda i: change[i]) if change else 0
        if not change or change[most] > -_WORTH:
            return "no gain"
        alike = len(change) > 1 and max(change.values()) < change[most] * (1 - _ALIKE)
        return f"{'all' if alike else self.paths[most]} {100 * change[most]:+.2g} %"

    def _part(self, std: float, i: int) -> str:
        if not np.isfinite(std):
            return "unseen"
        if self.experiment.circular[i]:
            return f"{np.rad2deg(std):.2g} deg"
        return f"{100 * std / self.experiment.sizes[i]:.2g} %"


def _with(value: float, unit: str) -> str:
    return f"{value:.3g} {unit}".rstrip() if np.isfinite(value) else "-"


def _combined(direction: dict[str, float]) -> str:
    if len(direction) == 1:
        return f"`{next(iter(direction))}`"
    return " ".join(f"{share:+.3g} {path}" for path, share in direction.items())
