"""How near a control loop is to losing its stability: its sensitivity over frequency, in zones."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, numbers, text, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.kinematics import COORDINATES
from ..core.parameter import known
from ..core.quick import lightly_compiled, traced
from ..core.readable import amount
from ..core.result_text import HERTZ, shows
from ..elements.control.loop import ActiveTorque
from ..elements.control.sampled import SampledTorque
from ..linear.coordinates import coordinate_order
from ..linear.linearise import check_linearized
from ..linear.loops import AXES, magnetic_bearings, opened
from ..linear.matrix_equations import stable
from ..linear.observe import outputs_of
from ..linear.response import as_complex, observed, solve
from ..linear.transfer import Transfer, met
from ..linear.whirling import refuse_whirl_dependent
from ..machine.machine import Machine
from ..machine.wiring import unknown
from .curve import searched, searched_in_program, with_slopes, without_slopes
from .finding import Assessment, Finding
from .vibration_zones import zone_of

SOURCE = (
    "ISO 14839-3:2006, zones of the peak sensitivity (3, 4, 5; as commonly restated, text not seen)"
)


@shows(frequency=HERTZ)
class PeakSensitivity(NamedTuple):
    """`value`: the largest |1/(1 + L)|; `frequency`: rad/s, where it is."""

    value: Float[Array, ""]
    frequency: Float[Array, ""]

    @property
    def decibels(self) -> Float[Array, ""]:
        return 20 * jnp.log10(self.value)


@takes(loop=text, speed=number("rad/s"), signal=text, acts_on=text, against=text, points=whole(5))
def peak_sensitivity(
    machine: Machine,
    loop: str,
    speed: Any = 0.0,
    *,
    signal: str | None = None,
    acts_on: str | None = None,
    against: str | None = None,
    points: int = 401,
    at: Any = "equilibrium",
) -> PeakSensitivity:
    """The largest sensitivity |1/(1 + L)| over all frequencies of a control loop, L its open loop's transfer
    function, the machine turning at `speed` (rad/s) and all other loops closed.

    `loop`: name of the control loop. Of an `ActiveTorque` nothing else is asked, nor of a `MagneticBearing`:
    `"bearing.v"` and `"bearing.w"` are its axes, opened at their sensors, `"bearing"` the worse of them. Of
    an element of your own: `signal`, the one that it offers of its force or torque ("force"), `acts_on`, the
    coordinate that it acts on ("rotor.x"), and `against`, that which bears the reaction, where one does. A
    disturbance d added to what the loop exerts makes its force d/(1 + L) in all: 1 + c (i w - A)^-1 b of the
    closed loop's linear model.

    Exact derivatives in both modes. Raises `InputError` for names that are none, for a sampled loop (it has
    no linear model in continuous time), and where the closed loop is not stable (under `jit` it is infinite).
    """
    axes = axes_of(machine, loop)
    if axes is not None:
        name, at_axes = axes
        found = opened(machine, (name,), speed, at)
        return _worst([_peak(met(found.axis(k)), points) for k in at_axes])[1]
    element = machine[loop]
    if isinstance(element, SampledTorque):
        raise InputError(
            f"`{loop}`: a sampled loop has no linear model in continuous time: take an ActiveTorque whose "
            "actuator delays by half of a period and the computing time"
        )
    if isinstance(element, ActiveTorque) and acts_on is None:
        (first, _), *rest = machine.wiring.ends[machine.wiring.connectors.index(loop)]
        names = machine.wiring.stations
        signal, acts_on = "torque", f"{names[first]}.phi"
        against = f"{names[rest[0][0]]}.phi" if element.between else None
    if signal is None or acts_on is None:
        raise InputError(
            f"`{loop}`: is no ActiveTorque or MagneticBearing: say signal=, what it offers of its force, and "
            "acts_on=, the coordinate that this acts on"
        )
    check_linearized(at)
    machine.check()
    refuse_whirl_dependent(machine, "the sensitivity of a loop")
    labels = coordinate_order(machine)[3]
    outputs = outputs_of(machine, labels, (f"{loop}.{signal}",))
    model, C = observed(machine, outputs, speed, at)
    b = _column(model, labels, acts_on, machine.wiring.stations)
    if against is not None:
        b = b - _column(model, labels, against, machine.wiring.stations)
    G = met(Transfer(model.A, b, C[0]))
    dies = known(stable(G.A))
    if dies is not None and not dies:
        raise InputError(
            f"`{loop}`: the closed loop is not stable at {amount(speed, 'rad/s')}: its sensitivity tells "
            "nothing"
        )
    return _peak(G, points)


def axes_of(machine: Machine, loop: str) -> tuple[str, tuple[int, ...]] | None:
    """Name of a magnetic bearing, and which of its axes are meant; `None` where another loop is."""
    name, dot, axis = loop.rpartition(".")
    every = magnetic_bearings(machine)
    if loop in every:
        return loop, (0, 1)
    if dot and name in every:
        if axis not in AXES:
            raise InputError(unknown("axis", loop, [f"{name}.{one}" for one in AXES]))
        return name, (AXES.index(axis),)
    return None


def _worst(peaks: list[PeakSensitivity]) -> tuple[Array, PeakSensitivity]:
    """Which is the highest, and it."""
    k = jnp.argmax(jnp.stack([jax.lax.stop_gradient(peak.value) for peak in peaks]))
    return k, jax.tree.map(lambda *x: jnp.stack(x)[k], *peaks)


def _column(model, labels, place: str, stations: tuple[str, ...]) -> Array:
    station, _, coordinate = place.rpartition(".")
    if (station, coordinate) in labels:
        return model.B[:, labels.index((station, coordinate))]
    if station in stations and coordinate in COORDINATES:
        return jnp.zeros(model.A.shape[0])  # held or driven: nothing moves there
    raise InputError(unknown("coordinate", place, [f"{s}.{c}" for s, c in labels]))


def _level(G: Transfer, w: Array) -> Float[Array, ""]:
    A, b, c = G
    return jnp.log(jnp.abs(1.0 + jnp.dot(as_complex(c), solve(A, w, b))))


def _peak(G: Transfer, points: int) -> PeakSensitivity:
    numbers_ = [known(x) for x in G]
    one = jnp.ones(())
    if any(x is None for x in numbers_):
        return _peak_in_program(G, points)
    A, b, c = (np.asarray(x) for x in numbers_)
    values = np.linalg.eigvals(A)
    eye = np.eye(len(A))

    def level(w: float) -> float:
        return float(np.log(abs(1.0 + c @ np.linalg.solve(1j * w * eye - A, b.astype(complex)))))

    grid = _grid(values, points, np)
    near, heights = searched(level, grid, 0.5**0.5)
    if not len(heights) or heights.max() <= 1.0:
        return PeakSensitivity(one, jnp.asarray(np.inf))
    k = int(np.argmax(heights))
    if not traced(G):
        return PeakSensitivity(jnp.asarray(heights[k]), jnp.asarray(near.place[k]))
    near = jax.tree.map(lambda x: jnp.asarray(np.atleast_1d(np.asarray(x))), near._replace(found=0))
    near = near._replace(
        place=near.place[k : k + 1], low=near.low[k : k + 1], high=near.high[k : k + 1]
    )
    return _ended(G, near)


def _grid(values: Any, points: int, xp: Any) -> Any:
    """From far below the slowest to far above the quickest eigenvalue, and beside each."""
    size = abs(values)
    grid = xp.geomspace(0.01 * xp.min(size), 10.0 * xp.max(size), points)
    width = xp.array([-3.0, -1.0, 0.0, 1.0, 3.0])
    beside = (abs(values.imag)[:, None] + width * abs(values.real)[:, None]).ravel()
    return xp.sort(xp.concatenate([grid, xp.clip(beside, grid[0], grid[-1])]))


@lightly_compiled
def _ended(G: Transfer, near: Any) -> PeakSensitivity:
    peaks = with_slopes(lambda w: _level(G, w), near, jnp.asarray(0.5**0.5))
    return PeakSensitivity(peaks.height[0], peaks.place[0])


@lightly_compiled
def _peak_in_program(G: Transfer, points: int) -> PeakSensitivity:
    still = without_slopes(G)
    size = jnp.abs(jnp.linalg.eigvals(still.A))
    low, high = jnp.log(0.01 * jnp.min(size)), jnp.log(10.0 * jnp.max(size))
    drop = jnp.asarray(0.5**0.5)
    grid = jnp.linspace(low, high, points)
    near = searched_in_program(lambda x: _level(still, jnp.exp(x)), grid, drop, 1)
    near = near._replace(place=jnp.exp(near.place), low=jnp.exp(near.low), high=jnp.exp(near.high))
    peaks = with_slopes(lambda w: _level(G, w), near, drop)
    value, where = peaks.height[0], peaks.place[0]
    beyond = jnp.isnan(value) | (value <= 1.0)
    dies = stable(still.A)
    value = jnp.where(dies, jnp.where(beyond, 1.0, value), jnp.inf)
    return PeakSensitivity(value, jnp.where(beyond, jnp.inf, where))


@takes(
    loop=text,
    speed=number("rad/s"),
    limits=numbers(above=0.0, size=3, rising=True),
    accepted=None,
    signal=text,
    acts_on=text,
    against=text,
)
def loop_sensitivity(
    machine: Machine,
    loop: str,
    speed: Any = 0.0,
    limits: Any = (3.0, 4.0, 5.0),
    accepted: str = "A",
    *,
    signal: str | None = None,
    acts_on: str | None = None,
    against: str | None = None,
    at: Any = "equilibrium",
) -> Assessment:
    """The peak sensitivity of a control loop (of a magnetic bearing its worse axis), as `peak_sensitivity`
    finds it, against the end of the zone
    that is `accepted`: zones A, B and C end at `limits`, 3, 4 and 5 (9.5, 12 and 14 dB). Raises `InputError`
    as that does, and for another zone. Source: ISO 14839-3, as commonly restated."""
    if accepted not in ("A", "B", "C"):
        raise InputError(f'accepted must be "A", "B" or "C", but is {accepted!r}')
    found = peak_sensitivity(
        machine, loop, speed, signal=signal, acts_on=acts_on, against=against, at=at
    )
    ends = jnp.asarray(limits, float)
    told = [known(x) for x in (found.value, found.frequency, ends)]
    words = loop
    if all(x is not None for x in told):
        value, frequency, shown = told
        words = f"{loop}, {float(frequency) / 2 / np.pi:.4g} Hz, zone {zone_of(value, shown)}"  # pyright: ignore
    limit = ends["ABC".index(accepted)]
    return Assessment(
        (Finding("peak sensitivity", words, found.value, limit, "at most", "", SOURCE),)
    )
