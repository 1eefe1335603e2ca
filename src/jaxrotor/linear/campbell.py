"""Natural frequencies over speed, each mode followed through its crossings."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import numpy as np
from scipy.optimize import linear_sum_assignment

from ..core.arguments import number, numbers, whole
from ..core.bar import with_bar
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import HERTZ, shows
from ..core.threads import one_thread
from ..machine.machine import Machine
from .condensing import until_within
from .linearise import LinearModel, check_linearized, models_over_speed
from .lowest_modes import lowest
from .matched import Whirling
from .modes import describe, named, told_apart
from .whirling import whirl_dependent

# Modes that come down from above what is followed take part in the matching.
_MORE = 8


@shows(without=("eigenvalues", "kinds"), speeds="rad/s", frequencies=HERTZ, damping_ratios="")
class Campbell(eqx.Module):
    """Modes over speed. Rows are speeds, columns modes, each column one mode followed throughout.

    - `speeds`: (n,), rad/s. `eigenvalues`: (n, m) complex, 1/s. `whirl`: (n, m), -1 to 1, forward positive.
    - `names`: (m,), by what each mode is at the speed furthest from rest, as `modes` calls it there.
      `kinds`: "lateral", "torsional", "axial".
    """

    speeds: np.ndarray
    eigenvalues: np.ndarray
    whirl: np.ndarray
    names: tuple[str, ...] = eqx.field(static=True)
    kinds: tuple[str, ...] = eqx.field(static=True)

    plot = plot_door()

    @property
    def frequencies(self) -> np.ndarray:
        """Im lambda, (n, m), rad/s."""
        return np.imag(self.eigenvalues)

    @property
    def damping_ratios(self) -> np.ndarray:
        """(n, m); negative is unstable."""
        return -np.real(self.eigenvalues) / np.abs(self.eigenvalues)

    @takes(order=number())
    def crossings(self, order: float = 1.0) -> dict[str, list[float]]:
        """Speeds (rad/s) at which each mode meets `order` times the speed, in either sense of the spin,
        between the speeds given, by interpolation; `critical_speeds` finds them exactly. Raises
        `InputError` for an order that is no finite number."""
        found: dict[str, list[float]] = {}
        for k, name in enumerate(self.names):
            gap = self.frequencies[:, k] - order * np.abs(self.speeds)
            meets = np.flatnonzero(np.sign(gap[:-1]) * np.sign(gap[1:]) < 0)
            shares = gap[meets] / (gap[meets] - gap[meets + 1])
            between = (1 - shares) * self.speeds[meets] + shares * self.speeds[meets + 1]
            on_the_line = self.speeds[(gap == 0) & (self.speeds != 0)]
            if where := sorted(map(float, (*between, *on_the_line))):
                found[name] = where
        return found


@one_thread
@takes(speeds=numbers("rad/s", fewest=2, rising=True), count=whole(1))
def campbell(
    machine: Machine,
    speeds: Any,
    count: int = 12,
    at: Any = "equilibrium",
    progress: bool | None = None,
) -> Campbell:
    """The `count` lowest modes of `machine` at `speeds` (rad/s, rising; negative ones turn the other way),
    followed from speed to speed by how alike their shapes are, not by their order. Each has the coefficients
    of its own frequency, where a `WhirlDependentSupport` gives them. `progress` shows a bar; by default a
    terminal gets one where the work lasts.

    Where a mode does not oscillate (overdamped), its entries are NaN. Large machines are reduced (see
    `Machine.reduced`), which raises frequencies by 1e-8 at most; `machine.full()` is not.
    Raises `InputError` for speeds that do not rise or are fewer than two."""
    speeds = np.asarray(speeds, float)
    if speeds.ndim != 1 or speeds.size < 2 or not np.all(np.diff(speeds) > 0):
        raise InputError("speeds must be a rising list of two speeds at least, in rad/s")
    check_linearized(at)
    machine.check()
    # from the speed furthest from rest: there the modes are furthest apart
    way = range(speeds.size - 1, -1, -1)
    if abs(speeds[0]) > abs(speeds[-1]):
        way = range(speeds.size)
    first, *others = way

    def looked_at(machine: Machine):
        modes_at = _modes_over_speed(machine, speeds, at)
        model, *found = modes_at(speeds[first], count)
        there, beside = named(model, *found), modes_at(speeds[others[-1]], count)[1]
        missing = len(there) < count
        highest = np.abs([*(m.eigenvalue for m in there), *beside]).max(initial=0.0)
        return (modes_at, model, there), np.inf if missing else float(highest)

    start = float(np.abs(speeds).max())
    modes_at, model, seen_first = until_within(machine, start, at, looked_at)
    shapes = [m.shape for m in seen_first]
    shapes = np.stack(shapes, axis=1) if shapes else np.zeros((len(model.M), 0))
    followed = _Followed(np.array([m.eigenvalue for m in seen_first]), shapes)
    values = np.full((speeds.size, len(seen_first)), np.nan, complex)
    whirl = np.zeros((speeds.size, len(seen_first)))
    values[first], whirl[first] = followed.values, [m.whirl for m in seen_first]
    for i in with_bar(others, "Campbell", progress):
        model, found, shapes = modes_at(speeds[i], count + _MORE)
        shapes = told_apart(model, found, shapes)
        followed, seen = _follow(followed, found, shapes, np.asarray(model.M))
        values[i, seen] = followed.values[seen]
        whirl[i, seen] = describe(model, followed.shapes)[1][seen]
    kinds = tuple(m.kind for m in seen_first)
    whirl[:, [k != "lateral" for k in kinds]] = 0.0
    return Campbell(speeds, values, whirl, tuple(m.name for m in seen_first), kinds)


def _modes_over_speed(
    machine: Machine, speeds: np.ndarray, at: Any
) -> Callable[[float, int], tuple[LinearModel, np.ndarray, np.ndarray]]:
    """At a speed so many of the lowest modes, as `lowest` gives them, and the model in whose coordinates."""
    if whirl_dependent(machine):
        return Whirling(machine, at).modes
    models = models_over_speed(machine, speeds, at)

    def found(speed: float, count: int) -> tuple[LinearModel, np.ndarray, np.ndarray]:
        model = models(speed)
        return model, *lowest(model, count)

    return found


class _Followed(NamedTuple):
    """Each mode as it was last seen."""

    values: np.ndarray
    shapes: np.ndarray


def _follow(
    before: _Followed, values: np.ndarray, shapes: np.ndarray, M: np.ndarray
) -> tuple[_Followed, np.ndarray]:
    """The modes `before` among those found now, and which of them were."""
    # what each shape holds of those before: their least-squares combination, in the metric of mass
    dual = before.shapes.conj().T @ M
    alike = np.abs(np.linalg.lstsq(dual @ before.shapes, dual @ shapes, rcond=1e-10)[0])
    size = np.sqrt(np.real(np.sum(shapes.conj() * (M @ shapes), axis=0)))
    alike *= np.sqrt(np.real(np.sum(dual.T * before.shapes, axis=0)))[:, None] / size
    # where two shapes are equally alike (the planes of a machine at rest) the nearer frequency counts
    frequency = np.imag(before.values)[:, None]
    apart = np.abs(frequency - np.imag(values)[None]) / np.maximum(frequency, 1e-9)
    rows, found = linear_sum_assignment(-alike + np.minimum(apart, 1.0))
    value, shape = before.values.copy(), before.shapes.copy()
    value[rows], shape[:, rows] = values[found], shapes[:, found]
    return _Followed(value, shape), rows
