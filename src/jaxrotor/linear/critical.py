"""Critical speeds, directly: where a mode's frequency is so many times the speed."""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array, Complex, Float

from ..core.arguments import numbers, positive, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from ..core.quick import traced
from ..core.threads import one_thread
from ..machine.machine import Machine
from .condensing import until_within
from .crossing import crossings
from .eigen import eigensystem
from .frozen import (
    PROBES,
    Frozen,
    at_rest,
    at_speed,
    frozen_at,
    shares_and_whirl,
    solved,
)
from .linearise import (
    LinearModel,
    check_linearized,
    linearize,
    models_at,
    models_over_speed,
)
from .lowest_modes import lowest
from .modes import STRAIGHT, Mode, describe, named, told_apart
from .observe import at_coordinates
from .whirling import refuse_whirl_dependent

Whirl = Literal["forward", "backward"]
_RANGE = numbers("rad/s", least=0.0, size=2, rising=True)
# Of the lowest and the highest root: the range in which all others are looked for.
_BELOW, _ABOVE = 1e-3, 1.05
_LOOKED_AT = 33
_SECANT = 1e-5  # of the speed
Models = Callable[[float], LinearModel]


class _Found(NamedTuple):
    """`speeds`: (m,), rising; `shapes`: (n, m)."""

    speeds: Float[Array, " m"]
    shapes: Complex[Array, "n m"]


@takes(order=positive(), count=whole(1), speeds=_RANGE, stiffness_at=positive("rad/s"))
def critical_speeds(
    machine: Machine,
    order: float = 1.0,
    damped: bool = False,
    at: Any = "undeformed",
    count: int | None = None,
    speeds: tuple[float, float] | None = None,
    whirl: Whirl | None = None,
    stiffness_at: float | None = None,
) -> Float[Array, " m"]:
    """Speeds (rad/s, rising) at which a mode's frequency is `order` times the speed.

    Undamped: `K u = w² (M - i G1/order) u`, with M, K at rest and G1 the gyroscopic matrix per speed: one
    eigenvalue problem gives all of them, forward and backward whirl, torsion and axial motion, whatever their
    scales. Where stiffness depends on the speed (bearing tables, films), all meetings are searched for: a
    mode may have several. `damped`: where Im lambda(speed) = order speed in the full model at each speed;
    those that damping removes are left out.

    Large machines are reduced for a range or a count (see `Machine.reduced`), which raises frequencies by
    1e-8 at most; `machine.full()` is not.

    - `stiffness_at`: rad/s; where stiffness depends on the speed that of this one is taken throughout: one
      eigenvalue problem in place of a search, as for bearings of a given stiffness. Not with `damped`.
    - `speeds`: (low, high), rad/s, the range of those asked for. - `whirl`: lateral modes of this sense
      alone, "forward" (with the spin: what unbalance excites) or "backward". - `count`: only the lowest so
      many of these (needed under `jit`, where what there is not is inf).

    Derivatives by every parameter are exact in both modes, first ones (of several that coincide, those of
    their mean). Under `jit` a machine whose stiffness depends on the speed gives NaN, and `damped` is
    refused. Raises `InputError` where scales are so far apart that rounding hides some of those asked for.
    Warns where the machine at rest has buckled (`modes`).

    Source: Friswell et al., Dynamics of Rotating Machines (2010), sec. 6.8 and 6.9.
    """
    if damped and stiffness_at is not None:
        raise InputError("stiffness_at goes with undamped critical speeds: take one of both out")
    return _critical(machine, order, damped, at, count, speeds, whirl, stiffness_at)[1].speeds


@takes(order=positive(), count=whole(1), speeds=_RANGE, stiffness_at=positive("rad/s"))
def critical_modes(
    machine: Machine,
    order: float = 1.0,
    at: Any = "undeformed",
    count: int | None = None,
    speeds: tuple[float, float] | None = None,
    whirl: Whirl | None = None,
    stiffness_at: float | None = None,
) -> list[Mode]:
    """What whirls, twists or shuttles at each of the undamped `critical_speeds`, in their order: a mode's
    `frequency` is `order` times the speed. Unbalance excites forward whirl; a backward one by unequal
    supports alone, a torsional or axial one (`kind`) hardly. Where forward and backward whirl coincide (no
    gyroscopic effect), each is told once. Not for use under `jit`. Raises `InputError` for wrong
    arguments, and where rounding hides critical speeds (stiffnesses and masses far apart).
    """
    of, found = _critical(machine, order, False, at, count, speeds, whirl, stiffness_at)
    turning = models_at(of, at)(PROBES[-1])
    modes = named(turning, 1j * order * np.asarray(found.speeds), np.asarray(found.shapes))
    if of is machine:
        return modes
    return [mode._replace(shape=at_coordinates(machine, of, mode.shape)) for mode in modes]


def _critical(
    machine, order, damped, at, count, speeds, whirl, stiffness_at
) -> tuple[Machine, _Found]:
    """And the machine that was looked at: a reduced one where it is large and few or low ones are asked
    for."""
    check_linearized(at)
    machine.check()
    if known(order) is None or float(order) != 1.0:
        refuse_whirl_dependent(machine, "an order other than 1")
    low, high = (0.0, np.inf) if speeds is None else map(float, speeds)
    asked = order, damped, at, low, high, count, whirl
    if stiffness_at is not None:
        there = at_speed(machine, jnp.asarray(stiffness_at, float), jnp.asarray(float(order)), at)
        there = eqx.tree_at(lambda f: f.varies, there, there.varies & False)
        return machine, _constant(machine, there, low, high, whirl, count)
    if count is None and high == np.inf:
        return machine, _found(machine, *asked)

    def looked_at(machine: Machine) -> tuple[tuple[Machine, _Found], float]:
        found = _found(machine, *asked)
        there = known(found.speeds)
        if there is None or (high == np.inf and there.size < (count or 0)):
            return (machine, found), np.inf
        return (machine, found), order * float(there.max(initial=0.0))

    return until_within(machine, order * high if high < np.inf else 0.0, at, looked_at)


@one_thread
def _found(machine, order, damped, at, low, high, count, whirl) -> _Found:
    order = jnp.asarray(float(order))
    rest = at_rest(machine, order, at)
    varies = known(rest.varies)
    if damped:
        if varies is None:
            raise InputError(
                "damped=True is a search, which `jit` and `vmap` do not go through: call it outside of them"
            )
        return _damped(machine, rest, order, at, low, high, whirl, count)
    if varies is not None and varies:
        return _speed_dependent(machine, rest, order, at, low, high, whirl, count)
    return _constant(machine, rest, low, high, whirl, count)


def _constant(machine: Machine, rest: Frozen, low, high, whirl, count) -> _Found:
    """From the roots of one pencil."""
    xp = np if isinstance(rest.M, np.ndarray) else jnp
    wanted = xp.isfinite(rest.speeds) & (rest.speeds >= low) & (rest.speeds <= high)
    if whirl is not None:
        shares, sense = shares_and_whirl(rest)
        lateral = shares["lateral"] > xp.maximum(shares["axial"], shares["torsional"])
        wanted &= lateral & ((sense if whirl == "forward" else -sense) > STRAIGHT)
    place = xp.argsort(xp.where(wanted, rest.speeds, xp.inf))
    values = xp.where(wanted[place], rest.speeds[place], xp.inf)
    hidden = (rest.lost > 0) & (place >= rest.complete)
    chosen = known(wanted)
    if chosen is None:
        values = jnp.where(rest.varies | hidden, jnp.nan, values)
        return _Found(values[:count], rest.shapes[:, place[:count]])
    size = int(chosen.sum()) if count is None else min(count, int(chosen.sum()))
    if rest.lost > 0:
        told = np.append(0.0, np.asarray(known(rest.speeds)))
        sure = float(told[int(rest.complete)])
        short = count is None or size < count or bool(np.any(np.asarray(known(hidden))[:size]))
        if short and high > sure:
            raise InputError(
                f"critical speeds: {int(rest.lost)} above {sure:.6g} rad/s are hidden by rounding, so "
                f"far apart "
                f"are stiffnesses and masses: ask for speeds=({low:g}, {sure:.6g}), or give rigid "
                f"supports as `fixed`"
            )
    return _Found(*map(jnp.asarray, (values[:size], rest.shapes[:, place[:size]])))


def _bounds(models: Models, rest: Frozen, order, low, high) -> tuple[float, float]:
    """The range, where it is open narrowed to that of the roots with the matrices at any speed."""
    roots = np.asarray(known(rest.speeds))
    for probe in PROBES if rest.varies else ():
        roots = np.append(roots, solved(frozen_at(models(probe)), order).speeds)
    roots = roots[np.isfinite(roots) & (roots > 0)]
    if not roots.size:
        return 1.0, 0.0
    return max(low, _BELOW * roots.min()), min(high, _ABOVE * roots.max())


def _speed_dependent(machine, rest, order, at, low, high, whirl, count) -> _Found:
    """Fixed points: the roots of the pencil with the matrices at the speed itself."""
    models = models_at(jax.tree.map(jax.lax.stop_gradient, machine), at)
    low, high = _bounds(models, rest, order, low, high)

    def frozen(speed: float) -> Frozen:
        return solved(frozen_at(models(speed)), order)

    values, shapes = [], []
    for k, speed in (
        crossings(lambda w: np.asarray(frozen(w).speeds), low, high) if low < high else ()
    ):
        there = frozen(speed)
        if whirl is not None:
            shares, sense = shares_and_whirl(there)
            each = {name: float(share[k]) for name, share in shares.items()}
            if not _wanted(max(each, key=lambda s: each[s]), float(sense[k]), whirl):
                continue
        if traced(machine, at):
            values.append(_met(machine, jnp.asarray(speed), jnp.asarray(k), order, at))
        else:
            values.append(_refined(lambda w, k=k: float(frozen(w).speeds[k]) - w, speed))
        shapes.append(there.shapes[:, k])
        if len(values) == count:
            break
    n = rest.shapes.shape[0]
    return _Found(jnp.array(values), jnp.stack(shapes, 1) if shapes else jnp.zeros((n, 0), complex))


def _refined(gap: Callable[[float], float], near: float) -> float:
    """Newton's step from as near as a search can tell, with the secant's slope."""
    step = _SECANT * near
    return near - gap(near) * 2 * step / (gap(near + step) - gap(near - step))


@eqx.filter_jit
def _met(machine: Machine, near: Array, k: Array, order, at) -> Array:
    """Newton's step, which carries the derivatives: the search is not differentiated."""

    def gap(speed):
        return at_speed(machine, speed, order, at).speeds[k] - speed

    value, slope = jax.jvp(gap, (near,), (jnp.ones_like(near),))
    return near - value / jax.lax.stop_gradient(slope)


def _damped(machine, rest, order, at, low, high, whirl, count) -> _Found:
    still = jax.tree.map(jax.lax.stop_gradient, machine)
    low, high = _bounds(models_at(still, at), rest, order, low, high)
    size = rest.shapes.shape[0]
    times = float(order)
    if low < high:
        models = models_over_speed(still, np.linspace(low, high, _LOOKED_AT), at)

    def frequencies(speed: float) -> np.ndarray:
        return np.imag(scipy.linalg.eigvals(np.asarray(models(speed).A)))

    def curves(speed: float) -> np.ndarray:
        # overdamped motions count as zero; conjugates do not count
        return np.sort(np.maximum(frequencies(speed), 0.0))[-size:] / times

    values: list[Any] = []
    before = 0.0
    turn = 0
    for _, speed in crossings(curves, low, high) if low < high else ():
        turn = turn + 1 if speed <= before * (1 + 1e-7) else 0
        before = speed
        if whirl is not None:
            kind, sense = _seen(models(speed), times * speed, turn)
            if not _wanted(kind, sense, whirl):
                continue
        if traced(machine, at):
            values.append(_crossed(machine, jnp.asarray(speed), order, at))
        else:
            values.append(_refined(lambda w: _nearest(models(w), times * w), speed))
        if len(values) == count:
            break
    return _Found(jnp.array(values), jnp.zeros((size, len(values)), complex))


def _nearest(model: LinearModel, frequency: float) -> float:
    """By how much the frequency of the mode nearest to it is higher."""
    values: Any = scipy.linalg.eigvals(np.asarray(model.A))
    away = np.abs(values.imag - frequency) + 1e-6 * np.abs(values.real)
    return float(values[np.argmin(away)].imag) - frequency


def _seen(model: LinearModel, frequency: float, turn: int) -> tuple[str, float]:
    """Kind and whirl of the mode of that frequency, of several there one after the other."""
    found, shapes = lowest(model)
    shares, sense = describe(model, told_apart(model, found, shapes))
    near = np.argsort(np.abs(np.imag(found) - frequency), kind="stable")[turn]
    each = {name: float(share[near]) for name, share in shares.items()}
    return max(each, key=lambda s: each[s]), float(sense[near])


def _wanted(kind: str, sense: float, whirl: Whirl) -> bool:
    return kind == "lateral" and (sense if whirl == "forward" else -sense) > STRAIGHT


@eqx.filter_jit
def _crossed(machine: Machine, near: Array, order, at) -> Array:
    """Newton's step on Im lambda(speed) = order speed."""

    def gap(speed):
        values, _, _ = eigensystem(linearize(machine, speed, at).A)
        i = jnp.argmin(jnp.abs(values.imag - order * near) + 1e-6 * jnp.abs(values.real))
        return values[i].imag - order * speed

    value, slope = jax.jvp(gap, (near,), (jnp.ones_like(near),))
    return near - value / jax.lax.stop_gradient(slope)
