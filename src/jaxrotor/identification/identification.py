"""What an identification found, and what it does not know."""

import dataclasses
import os
from pathlib import Path
from typing import Any

import numpy as np

from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.files import save_json
from ..machine.machine import Machine
from ..machine.paths import split_entry
from ..search.instrumented import Instrumented
from ..search.space import Space
from ..search.unknown import Unknown
from ..sensors.channel import AbstractChannel
from ..sensors.record import Record
from .domain import Time
from .fit_by_channel import ChannelFit, meet
from .loss import LOSSES
from .problem import Problem, pose, weighed
from .trials import Trial, as_trials
from .uncertainty import Knowledge

# Below this probability of being chance a residual is called not white, or too large; all the tests of an
# identification share it (Bonferroni), so that one in a hundred right models is called wrong.
_CHANCE = 0.01


@dataclasses.dataclass(frozen=True)
class Identification:
    """**What was found:**

    - `values`: path -> value, SI, angles from -pi to pi. `machine`, `sensors`: with these values.
    - `std`, `intervals(level)`: standard deviations and confidence intervals; infinite where the data
      cannot see a parameter. `correlation`: (n, n), in the order of `values`.
    - `blind`: combinations of parameters that the data cannot see. `warnings`: sentences on all that is
      doubtful, `suspects` among them: channels whose residual looks like one mistake. `print(found)` shows
      the table and the warnings.
    - `channels`: measured and simulated signals. `histories`: cost at each iteration of each search, by name:
      those of the stages, and those that a stage repeats with weights from its residuals.
    - `aic`, `bic`: to compare models of the same data; the smaller is the better.
    """

    machine: Machine
    sensors: dict[str, AbstractChannel]
    space: Space
    u: np.ndarray
    slopes: np.ndarray
    knowledge: Knowledge
    channels: tuple[ChannelFit, ...]
    histories: dict[str, np.ndarray]
    stopped: bool
    cost: float
    count: int
    units: tuple[str, ...]
    problem: Problem
    interrupted: bool = False
    suspects: tuple[str, ...] = ()

    plot = plot_door()

    @property
    def paths(self) -> tuple[str, ...]:
        return self.space.paths

    @property
    def values(self) -> dict[str, float]:
        found = self.space.shown(self.space.values(self.u))
        return dict(zip(self.paths, found.tolist()))

    @property
    def changed(self) -> tuple[str, ...]:
        """Paths of the machine's parameters that were set, ties among them, entries as their whole."""
        named = [p for path, ties in zip(self.paths, self.space.ties) for p in (path, *dict(ties))]
        whole = [split_entry(path)[0] for path in named]
        return tuple(dict.fromkeys(p for p in whole if p.split(".")[0] not in self.sensors))

    @property
    def std(self) -> dict[str, float]:
        return dict(zip(self.paths, (np.abs(self.slopes) * self.knowledge.std).tolist()))

    def intervals(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Confidence intervals of each parameter by itself, from the curvature at the optimum; those of
        positive and bounded parameters stay positive and in their bounds. An angle's is around its
        value. Raises `InputError` where `level` is not between 0 and 1."""
        if not 0 < level < 1:
            raise InputError(f"level must be between 0 and 1, but is {level!r}")
        reach = self.knowledge.reach(level)
        low = np.asarray(self.space.values(self.u - reach))
        high = np.asarray(self.space.values(self.u + reach))
        return {
            path: (float(a + s), float(b + s))
            for path, a, b, s in zip(self.paths, low, high, self.turns)
        }

    @property
    def turns(self) -> np.ndarray:
        """(n,): whole turns between an angle as it was searched for and as it is shown, rad; else 0."""
        searched = np.asarray(self.space.values(self.u))
        return self.space.shown(searched) - searched

    @property
    def correlation(self) -> np.ndarray:
        return self.knowledge.correlation

    @property
    def blind(self) -> tuple[dict[str, float], ...]:
        return self.knowledge.blind

    @property
    def aic(self) -> float:
        return self._misfit() + 2 * len(self.paths)

    @property
    def bic(self) -> float:
        return self._misfit() + len(self.paths) * float(np.log(self.count))

    def _misfit(self) -> float:
        """-2 log likelihood but for a constant of the data; noise of unknown size at its best estimate."""
        if LOSSES[int(self.problem.loss)] != "squares":
            sizes = [s.count * float(np.log(s.std)) for s in self.problem.signals]
            return 2 * (self.cost + sum(sizes))
        if all(c.sized is not None for c in self.channels):
            return 2 * self.cost
        return sum(
            int(np.isfinite(c.residual).sum()) * float(np.log(np.nanmean(np.abs(c.residual) ** 2)))
            for c in self.channels
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        found = []
        if self.interrupted:
            found.append("the search was interrupted: these are the estimates so far, unfinished")
        elif not self.stopped:
            found.append(
                "the search had not come to rest when its iterations ran out: allow more, or start nearer"
            )
        for direction in self.blind:
            words = " ".join(f"{share:+.3g} {path}" for path, share in direction.items())
            found.append(
                f"the data cannot see {words}: hold one of them, give it a prior, or record something else"
                if len(direction) > 1
                else f"the data cannot see `{next(iter(direction))}`: nothing recorded depends on it here"
            )
        c = np.abs(self.correlation)
        for i, j in zip(*np.where(np.triu(np.where(np.isfinite(c), c, 0.0), 1) > 0.99)):
            found.append(
                f"`{self.paths[i]}` and `{self.paths[j]}` are hardly told apart (correlation "
                f"{self.correlation[i, j]:.4f})"
            )
        found += self.suspects
        tests = [p for fit in self.channels for p in (fit.white, fit.sized) if p is not None]
        chance = _CHANCE / max(1, len(tests))
        for fit in self.channels:
            where = f"{fit.channel} of `{fit.run}`"
            if fit.white is not None and fit.white < chance and fit.std > 0:
                found.append(
                    f"the residual of {where} is not white (probability {fit.white:.1e}): the model misses "
                    "something, or the noise is correlated; intervals are too narrow"
                )
            if fit.sized is not None and fit.sized < chance:
                found.append(
                    f"the residual of {where} is larger than its noise (probability {fit.sized:.1e}): the "
                    "model misses something, or the noise was understated"
                )
        return tuple(found)

    def __str__(self) -> str:
        width = max(len(p) for p in self.paths)
        lines = [f"{'parameter':{width}}  {'value':>13}  {'std':>10}  95 % interval"]
        intervals = self.intervals()
        for path, unit in zip(self.paths, self.units):
            low, high = intervals[path]
            lines.append(
                f"{path:{width}}  {self.values[path]:13.6g}  {self.std[path]:10.3g}  "
                f"{low:.6g} to {high:.6g} {unit}"
            )
        return "\n".join([*lines, *(f"! {w}" for w in self.warnings)])

    __repr__ = __str__

    def predicted(self, data: Record | Trial) -> tuple[ChannelFit, ...]:
        """Another run, simulated with what was found: a held-out one for cross-validation. Its channels say
        by `white` and `sized` whether the model holds there too."""
        bench = Instrumented(self.machine, self.sensors)
        trial = as_trials(data)[0].planned(self.machine)
        space = Space.of(bench, tuple(Unknown(path, scale=1.0) for path in self.paths))
        stds = {c.channel: c.std for c in self.channels}
        problem = pose(bench, space, [trial], Time(), None)
        problem = weighed(problem, [stds[s.channel] for s in problem.signals])
        return meet(problem, np.zeros(len(self.paths)), 1.0, known=True)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the signals, for JSON."""
        intervals = self.intervals()

        def plain(x: float) -> float | None:
            return float(x) if np.isfinite(x) else None

        return {
            "parameters": {
                path: {
                    "value": self.values[path],
                    "std": plain(self.std[path]),
                    "interval_95": [plain(x) for x in intervals[path]],
                    "unit": unit,
                }
                for path, unit in zip(self.paths, self.units)
            },
            "correlation": [[plain(x) for x in row] for row in self.correlation],
            "singular_values": self.knowledge.singular_values.tolist(),
            "blind": list(self.blind),
            "warnings": list(self.warnings),
            "values_compared": self.count,
            "loss": LOSSES[int(self.problem.loss)],
            "cost": self.cost,
            "aic": self.aic,
            "bic": self.bic,
            "iterations": {name: len(costs) for name, costs in self.histories.items()},
            "came_to_rest": self.stopped,
            "interrupted": self.interrupted,
            "channels": [
                {
                    "run": c.run,
                    "channel": c.channel,
                    "unit": c.unit,
                    "std": c.std,
                    "rms_residual": plain(np.sqrt(np.nanmean(np.abs(c.residual) ** 2))),
                    "white": c.white,
                    "sized": c.sized,
                }
                for c in self.channels
            ],
        }

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes `to_dict` as JSON, whole or not at all."""
        save_json(Path(path), self.to_dict())
        return Path(path)
