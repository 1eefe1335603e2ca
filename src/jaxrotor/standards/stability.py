"""Stability against cross coupling: what a machine bears, and what is to be expected."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.optimize
from jaxtyping import Array, Float

from ..core.arguments import listed, names, number, numbers
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import is_concrete, known, numbers as numbers_of
from ..core.quick import lightly_compiled, traced
from ..core.result_text import shows
from ..elements.bearings.support import LinearSupport
from ..linear.condensing import condensed_below
from ..linear.coordinates import coordinate_order
from ..linear.eigen import eigensystem
from ..linear.linearise import LinearModel, check_linearized, linearize, oscillating
from ..linear.modes import STRAIGHT, shares_of, whirl_of
from ..linear.supports import critical_speed_map
from ..linear.threshold import root
from ..linear.whirling import refuse_whirl_dependent
from ..machine.machine import Machine
from ..machine.wiring import unknown
from ..simulation.condensing import may_condense
from .curve import without_slopes
from .finding import Assessment, Finding

LEVEL_1 = "API RP 684 SP6.8.5.10, as read in ross-report (analysis.py)"
LEVEL_2 = "API level 2, log decrement 0.1 as in ross-report (analysis.py), which cites no paragraph"
# Mean gas density (kg/m³) and critical speed ratio between which region A ends.
BOUNDARY = ((0.0, 2.5), (16.53, 2.5), (60.0, 2.0), (60.0, 0.0))
_DOUBLINGS, _SECANTS = 30, 25
_POINTS = 21
_REACH = 2.0  # times the speed
_HEAVY = 0.5  # damping ratio of what is no whirl any more
_POSITIVE = number(above=0.0)


@takes(
    power=number("W", least=0.0),
    speed=number("rad/s", above=0.0),
    diameter=number("m", above=0.0),
    height=number("m", above=0.0),
    density_ratio=_POSITIVE,
    constant=_POSITIVE,
)
def anticipated_cross_coupling(
    power: Any,
    speed: Any,
    diameter: Any,
    height: Any,
    density_ratio: Any = 1.0,
    constant: Any = 3.0,
) -> Float[Array, ""]:
    """Cross-coupled stiffness (N/m) to be expected of one impeller or stage: `constant * density_ratio * T /
    (diameter * height)` with the torque T = power/speed (W, rad/s); of several, add them up.

    `diameter`: of the impeller or blades, m; `height`: of the narrowest restriction in its flow path (the
    discharge width of an impeller) or of the blades, m; `density_ratio`: gas density at discharge over that
    at suction; `constant`: 3 for centrifugal compressors, 1.5 (with density_ratio 1) for axial machines.
    Raises `InputError` for what is out of bounds. Source: API RP 684 SP6.8.5.6, after Wachel and Alford, as
    read in ross-report.
    """
    torque = jnp.asarray(power, float) / speed
    return constant * density_ratio * torque / (diameter * jnp.asarray(height, float))


def _places(machine: Machine, at: Any) -> tuple[tuple[str, ...], Array]:
    """Stations and their shares of the cross coupling, summing up to 1. Raises `InputError`."""
    labels = coordinate_order(machine)[3]
    given = {at: 1.0} if isinstance(at, str) else at
    if not isinstance(given, Mapping) or not given:
        raise InputError(f"place must be a station or a mapping station -> share, but is {given!r}")
    for station, share in given.items():
        if (station, "x") not in labels or (station, "y") not in labels:
            known_ = sorted({s for s, c in labels if c == "x"})
            raise InputError(f"place: {unknown('station that can move', station, known_)}")
        number(above=0.0)(share, f"share of {station!r}")
    shares = jnp.stack([jnp.asarray(x, float) for x in given.values()])
    return tuple(given), shares / jnp.sum(shares)


class _Loaded(eqx.Module):
    """A linear model whose rates change by `slope` per cross coupling, N/m."""

    model: LinearModel
    slope: Float[Array, "d d"]

    def decrement(self, cross_coupling: Array) -> Float[Array, ""]:
        """Log decrement of the lowest lateral mode that does not whirl backward."""
        values, right, _ = eigensystem(self.model.A + cross_coupling * self.slope)
        k, there = lowest_forward(
            without_slopes(self.model), *jax.lax.stop_gradient((values, right)), jnp
        )
        return jnp.where(there, -2 * jnp.pi * values[k].real / values[k].imag, jnp.nan)

    def numbers(self) -> Callable[[float], float]:
        """`decrement`, where no derivative is asked."""
        model, slope = jax.tree.map(
            lambda x: numbers_of(x) if eqx.is_array(x) else x, (self.model, self.slope)
        )

        def decrement(cross_coupling: float) -> float:
            found: Any = np.linalg.eig(model.A + cross_coupling * slope)
            values, right = found
            k, there = lowest_forward(model, values, right, np)
            return float(-2 * np.pi * values[k].real / values[k].imag) if there else np.nan

        return decrement


def lowest_forward(model: LinearModel, values: Any, right: Any, xp: Any) -> tuple[Any, Any]:
    """Which eigenvalue is that of the lowest lateral mode that does not whirl backward, and whether there is
    one; of NumPy's or JAX's arrays. Modes damped by half of the critical damping and more count where there
    are no others alone: they are no whirl that a seal could drive."""
    swings = oscillating(model.A, model.M, values, right)
    shapes = right[: model.M.shape[0]]
    each = shares_of(model.coordinates, model.M, shapes)
    lateral = each["lateral"] > xp.maximum(each["axial"], each["torsional"])
    sense: Any = xp.where(model.spins < 0, -1.0, 1.0)
    whirl = whirl_of(model.coordinates, abs(xp.diag(model.M)), shapes, sense)
    wanted = swings & lateral & (whirl > -STRAIGHT)
    light = wanted & (-values.real < _HEAVY * abs(values))
    wanted = xp.where(xp.any(light), light, wanted)
    return xp.argmin(xp.where(wanted, values.imag, xp.inf)), xp.any(wanted)


def _loaded(model: LinearModel, stations: tuple[str, ...], shares: Array) -> _Loaded:
    slope = jnp.zeros_like(model.A)
    for k, station in enumerate(stations):
        x, y = (model.row(f"{station}.{c}") for c in "xy")
        sense = jnp.where(model.spins[x] < 0, -1.0, 1.0) * shares[k]
        # F_x = -Q y, F_y = Q x: it drives the whirl with the spin
        slope = slope.at[:, y].add(-sense * model.B[:, x]).at[:, x].add(sense * model.B[:, y])
    return _Loaded(model, slope)


@shows(speed="rad/s", without=("level_one",))
class StabilityChart(eqx.Module):
    """Log decrement over the cross coupling applied.

    - `cross_couplings` (n,), N/m, and `log_decrements` (n,) of the lowest forward lateral mode there.
    - `anticipated`: Q_A, N/m, NaN where none was given; `at_anticipated`: the log decrement there.
    - `limit`: Q_0, N/m, at which it is zero; infinite where it is at none.
    - `density`: mean gas density, kg/m³, and `ratio`: greatest speed over the first critical speed on rigid
      supports; NaN where they were not given. `boundary`: of region A, (density, ratio) pairs.
    """

    cross_couplings: Float[Array, " n"]
    log_decrements: Float[Array, " n"]
    anticipated: Float[Array, ""]
    at_anticipated: Float[Array, ""]
    limit: Float[Array, ""]
    speed: Float[Array, ""]
    density: Float[Array, ""]
    ratio: Float[Array, ""]
    boundary: tuple[tuple[float, float], ...] = eqx.field(static=True)
    level_one: Assessment

    plot = plot_door()


@takes(
    place=None,
    speed=number("rad/s"),
    anticipated=number("N/m", least=0.0),
    cross_couplings=numbers("N/m", least=0.0),
    density=number("kg/m^3", least=0.0),
    ratio=number(least=0.0),
    least_ratio=_POSITIVE,
    least_decrement=number(),
    screened_ratio=_POSITIVE,
    boundary=listed,
    without=names,
)
def stability_chart(
    machine: Machine,
    place: Any,
    speed: Any,
    anticipated: Any = None,
    *,
    cross_couplings: Any = None,
    density: Any = None,
    ratio: Any = None,
    without: Sequence[str] = (),
    turbine: bool = False,
    least_ratio: Any = 2.0,
    least_decrement: Any = 0.1,
    screened_ratio: Any = 10.0,
    boundary: Sequence[tuple[float, float]] = BOUNDARY,
    at: Any = "equilibrium",
) -> StabilityChart:
    """Level 1: log decrement against cross coupling at `place`, the machine turning at `speed` (rad/s).

    - `place`: the station in the middle between the bearings, or a mapping station -> share (the impellers of
      an overhung rotor by their q_A). - `anticipated`: Q_A, N/m, the sum of `anticipated_cross_coupling`.
    - `cross_couplings`: N/m, at which the log decrement is told; by default 21 up to 1.2 times the larger of
      Q_0 and Q_A. - `without`: supports that are left out, such as seals.
    - `density`: mean of the gas density at suction and discharge, kg/m³; `ratio`: greatest continuous speed
      over the first undamped critical speed on rigid supports (`rigid_critical_speed`).

    `chart.level_one` holds the screening: Q_0/Q_A at least `least_ratio`, and at least `screened_ratio` in
    region B of the chart of density and ratio (the same as asking for level 2 between the two); log
    decrement at Q_A at least `least_decrement`. `turbine`: the last one alone. What is not met asks for
    level 2. The mode is the lowest lateral one that does not whirl backward, damped by less than half of
    the critical damping where there is one. Exact derivatives in both modes
    (Q_0 by the implicit function theorem; the region has none). Raises `InputError` for names and numbers
    that are none.
    """
    check_linearized(at)
    machine.check()
    refuse_whirl_dependent(machine, "stability_chart")
    machine = left_out(machine, without)
    speed = jnp.asarray(speed, float)
    stations, shares = _places(machine, place)
    model = linearize(_reduced(machine, speed, at, stations), speed, at)
    nothing = jnp.asarray(jnp.nan)
    expected = nothing if anticipated is None else jnp.asarray(anticipated, float)
    grid = None if cross_couplings is None else jnp.atleast_1d(jnp.asarray(cross_couplings, float))
    loaded = _loaded(model, stations, shares)
    where, curve, there, limit = _charted(loaded, expected, grid)
    density = nothing if density is None else jnp.asarray(density, float)
    ratio = nothing if ratio is None else jnp.asarray(ratio, float)
    edges = tuple((float(a), float(b)) for a, b in boundary)
    limits = least_ratio, least_decrement, screened_ratio
    found = (
        ()
        if anticipated is None
        else _level_one(limit, expected, there, density, ratio, edges, limits)
    )
    if turbine:
        found = found[-1:]
    return StabilityChart(
        where, curve, expected, there, limit, speed, density, ratio, edges, Assessment(tuple(found))
    )


def _reduced(machine: Machine, speed: Array, at: Any, stations: Sequence[str]) -> Machine:
    """A large machine with fewer stations, for the frequencies in which the lowest modes lie."""
    fast = known(speed)
    if fast is None or not may_condense(machine):
        return machine
    names = machine.wiring.stations
    keep = tuple(sorted(names.index(s) for s in stations if s in names))
    return condensed_below(machine, _REACH * abs(float(fast)), at, keep)


def left_out(machine: Machine, without: Any) -> Machine:
    supports = {}
    for name in (without,) if isinstance(without, str) else without:
        if name not in machine.wiring.connectors:
            raise InputError(f"without: {unknown('support', name, machine.wiring.connectors)}")
        supports[name] = LinearSupport(jnp.zeros(6), jnp.zeros(6))
    return machine.set(supports) if supports else machine


def _charted(loaded: _Loaded, expected: Array, grid: Array | None):
    """Where the log decrement is looked at, what it is there and at the anticipated cross coupling, and where
    it is zero."""
    if not all(is_concrete(x) for x in jax.tree.leaves((loaded, expected, grid))):
        limit = _limit_in_program(loaded)
    else:
        numbers = loaded.numbers()
        limit = _limit(numbers)
        if not traced(loaded, expected, grid):
            return _chart_of_numbers(numbers, limit, expected, grid)
        if 0 < limit < np.inf:
            limit = _newton(loaded, jnp.asarray(limit))
    limit = jnp.asarray(limit)
    end = 1.2 * jnp.fmax(jnp.where(jnp.isfinite(limit), limit, expected), expected)
    where = jnp.linspace(0.0, jax.lax.stop_gradient(end), _POINTS) if grid is None else grid
    safe = jnp.where(jnp.isnan(expected), 0.0, expected)
    curve = _curve(loaded, jnp.append(where, safe))
    return where, curve[:-1], jnp.where(jnp.isnan(expected), jnp.nan, curve[-1]), limit


def _chart_of_numbers(decrement, limit: float, expected, grid):
    wanted = float(numbers_of(expected))
    end = 1.2 * np.fmax(limit if np.isfinite(limit) else wanted, wanted)
    where = np.linspace(0.0, end, _POINTS) if grid is None else numbers_of(grid)
    curve = np.array([decrement(float(q)) for q in where])
    there = np.nan if np.isnan(wanted) else decrement(wanted)
    return tuple(map(jnp.asarray, (where, curve, there, limit)))


def _limit(decrement: Callable[[float], float]) -> float:
    """The cross coupling that the machine bears."""
    first = decrement(0.0)
    if not first > 0:
        return 0.0
    # any scale: it is doubled until it is enough, or halved until it is not
    low, high = 0.0, 1.0
    for _ in range(_DOUBLINGS):
        if not decrement(high) > 0:
            break
        low, high = high, 4 * high
    else:
        return np.inf
    options: Any = dict(xtol=1e-300, rtol=1e-13)
    found: Any = scipy.optimize.brentq(decrement, low, high, **options)
    return found


@lightly_compiled
def _newton(loaded: _Loaded, near: Array) -> Array:
    value, slope = jax.jvp(loaded.decrement, (near,), (jnp.ones(()),))
    return near - value / jax.lax.stop_gradient(slope)


@lightly_compiled
def _curve(loaded: _Loaded, asked: Array) -> Array:
    return jax.lax.map(loaded.decrement, asked)


@lightly_compiled
def _limit_in_program(loaded: _Loaded) -> Array:
    """As `_limit`."""
    still = without_slopes(loaded)

    def stays(state):
        high, k = state
        return (still.decrement(high) > 0) & (k < _DOUBLINGS)

    # no slope at 0 tells the size: forward and backward whirl may coincide there
    high, k = jax.lax.while_loop(stays, lambda x: (4 * x[0], x[1] + 1), (jnp.ones(()), 0))
    found = high * root(lambda it, x: it.decrement(x * high), loaded, 0.5 * jnp.ones(()), _SECANTS)
    return jnp.where(k == 0, 0.0, jnp.where(k < _DOUBLINGS, found, jnp.inf))


def in_region_b(
    density: Any, ratio: Any, boundary: Sequence[tuple[float, float]] = BOUNDARY
) -> Array:
    """Whether a mean gas density (kg/m³) and a critical speed ratio lie above the line of `boundary`."""
    points = np.asarray(boundary, float)
    line = jnp.interp(jnp.asarray(density, float), points[:, 0], points[:, 1], right=points[-1, 1])
    return jnp.asarray(ratio, float) > line


def _level_one(limit, expected, there, density, ratio, boundary, limits) -> tuple[Finding, ...]:
    least, decrement, screened = (jnp.asarray(x, float) for x in limits)
    unknown_ = jnp.isnan(density) | jnp.isnan(ratio)
    beyond = in_region_b(density, ratio, boundary) & ~unknown_
    told, gone = known(beyond), known(unknown_)
    region = "" if told is None or gone is None or gone else "region B" if told else "region A"
    shown = known(ratio)
    words = (
        f"{region}, critical speed ratio {float(shown):.3g}" if region and shown is not None else ""
    )
    bound = jnp.where(beyond, screened, least)
    return (
        Finding("level 1: Q0/QA", words, limit / expected, bound, "at least", "", LEVEL_1),
        Finding("level 1: log decrement at QA", "", there, decrement, "at least", "", LEVEL_1),
    )


@takes(bearings=names, stiffness=number("N/m", above=0.0))
def rigid_critical_speed(
    machine: Machine, bearings: Sequence[str] | None = None, stiffness: float = 1e11
) -> float:
    """The first undamped forward critical speed (rad/s) on rigid supports: with `bearings` (default: all
    linear and speed-dependent supports) of this `stiffness`. A plain number. The greatest speed over it is
    the critical speed ratio of `stability_chart`. Raises `InputError` as `critical_speed_map` does."""
    found = critical_speed_map(machine, [stiffness], bearings, 1, progress=False)
    return float(found.speeds[0, 0])


@takes(speed=number("rad/s"), least_decrement=number())
def level_two(
    machine: Machine, speed: Any, *, least_decrement: Any = 0.1, at: Any = "equilibrium"
) -> Assessment:
    """Level 2: the log decrement of the lowest forward lateral mode at `speed` (rad/s; the same as of
    `stability_chart`) with all that stands in the machine, its seals and destabilising parts, is at least
    `least_decrement`. Exact derivatives in
    both modes. Raises `InputError` for another `at`, and for a speed that is not finite."""
    check_linearized(at)
    machine.check()
    refuse_whirl_dependent(machine, "level_two")
    model = linearize(machine, jnp.asarray(speed, float), at)
    loaded = _Loaded(model, jnp.zeros_like(model.A))
    zero = jnp.zeros(())
    found = _curve(loaded, zero[None])[0] if traced(model) else jnp.asarray(loaded.numbers()(0.0))
    limit = jnp.asarray(least_decrement, float)
    return Assessment(
        (Finding("level 2: log decrement", "", found, limit, "at least", "", LEVEL_2),)
    )
