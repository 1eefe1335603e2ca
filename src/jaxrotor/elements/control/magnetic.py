"""The radial active magnetic bearing: magnets on two axes, each with its sensor, controller and amplifier."""

from collections.abc import Callable, Iterator
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.part import option
from ...core.protocol import (
    AbstractAttachment,
    Energetic,
    Motion,
    NonSmooth,
    Powered,
    Signalling,
    Stateful,
    Timed,
    Vec6,
)
from .amplifier import CurrentAmplifier
from .low_pass import low_pass_rates
from .magnet import AbstractMagnet
from .position import AbstractPositionController

Pair = Float[Array, "2"]


def ideal() -> CurrentAmplifier:
    return CurrentAmplifier()


class Axis(NamedTuple):
    """What is known of one axis: how far the rotor is out of the middle at the magnets, and out of the
    setpoint at the sensor (m); and its states."""

    at_magnet: Array
    error: Array
    state: Array


class MagneticBearing(
    AbstractAttachment, Stateful, Energetic, Powered, Timed, Signalling, NonSmooth
):
    """A radial active magnetic bearing: two axes, v at `angle` from x and w a quarter turn on, each with
    magnets, a controller and an amplifier.

    Attached to the journal's station, or to `(journal, sensor)` where the rotor is measured at another
    station than it is pulled at. With `housed` the last station is that of the housing in which magnets and
    sensors stand: `(journal, housing)` or `(journal, sensor, housing)`. A run that begins levitated has
    `initial="running"`: currents and integrators at rest then carry the weight.

    - `magnet`: `Electromagnets` by their dimensions, or `LinearMagnet` by ki and ks.
    - `controller`: `PID`, `TransferFunction`, `StateSpace`, `InSeries`, or one of your own, from the error
      (`setpoint` less what is measured, m) to the control current (A).
    - `amplifier`: limits, lag, voltage, delay; by default ideal but for the limit that the bias sets.
    - `sensor_cutoff`: Hz, of a second-order Butterworth low-pass in the sensors; none by default.
    - `angle`: rad, of the axis v from x. `setpoint`: m, where the rotor is held, along v and w.
    - `fails_at`: s, when the power fails: from then on all currents, the bias too, die with the time constant
      `decay_time` (inductance over resistance of coils that are short-circuited). Before 0: a run without.
    - `other_magnet`, `other_controller`: those of the axis w, where they differ.

    At its limits a loop is stiff, so a machine with it is run by `Rosenbrock`; where nothing comes near them
    `solver=jr.ExponentialAdams()` does too. Give the rotor an auxiliary bearing (`Rub`) that is narrower than
    the gap: where that closes the pull has no bound. Signals, along v and w: `current_v`, `current_w` (A,
    control currents), `force_v`, `force_w` (N, on the rotor), `measured_v`, `measured_w` (m).

    Source: Schweitzer & Maslen (eds.), Magnetic Bearings: Theory, Design, and Application to Rotating
    Machinery (2009).
    """

    magnet: AbstractMagnet
    controller: AbstractPositionController
    amplifier: CurrentAmplifier = eqx.field(default_factory=ideal)
    sensor_cutoff: Float[Array, ""] | None = parameter(
        "Hz", positive=True, optional=True, default=None
    )
    angle: Float[Array, ""] = parameter("rad", default=0.7853981633974483)
    setpoint: Pair = parameter("m", shapes=((2,),), default=(0.0, 0.0))
    fails_at: Float[Array, ""] | None = parameter("s", optional=True, default=None)
    decay_time: Float[Array, ""] = parameter("s", positive=True, default=1e-3)
    other_magnet: AbstractMagnet | None = None
    other_controller: AbstractPositionController | None = None
    housed: bool = option(default=False)

    signals: ClassVar[dict[str, str]] = {
        "current_v": "A",
        "current_w": "A",
        "force_v": "N",
        "force_w": "N",
        "measured_v": "m",
        "measured_w": "m",
    }

    def faults(self) -> Iterator[str]:
        for name in ("magnet", "other_magnet"):
            magnet = getattr(self, name)
            if magnet is None:
                continue
            most, limit = magnet.limit(), self.amplifier.limit
            if most is not None and limit is not None and limit > most:
                yield (
                    f"amplifier.limit must not exceed what {name} is made for, {float(most):g} A, but is "
                    f"{float(limit):g} A: a larger control current would reverse a coil's"
                )
            if self.amplifier.voltage is not None and not magnet.inductance() > 0:
                yield f"{name}.coil is missing: a voltage changes currents by the coil's inductance, in H"

    # What both axes do: `one` is called for each, with its own parts.

    def _alike(self) -> bool:
        return self.other_magnet is None and self.other_controller is None

    def _parts(self) -> list[tuple[AbstractMagnet, AbstractPositionController]]:
        return [
            (self.magnet, self.controller),
            (self.other_magnet or self.magnet, self.other_controller or self.controller),
        ]

    def _sizes(self) -> list[int]:
        """States of each axis."""
        more = self.amplifier.initial().shape[0] + 2 * (self.sensor_cutoff is not None)
        return [more + controller.initial().shape[0] for _, controller in self._parts()]

    def _each(self, one: Callable[..., Array], axes: Axis) -> Array:
        """`one(magnet, controller, axis)`, numbers (2,) or rows end to end."""
        if self._alike():
            # both as one: half of what is to be compiled
            found = jax.vmap(lambda axis: one(self.magnet, self.controller, axis))(axes)
            return found.reshape(-1) if found.ndim > 1 else found
        states = jnp.split(axes.state, self._sizes()[:1])
        each = [
            one(*parts, Axis(axes.at_magnet[k], axes.error[k], states[k]))
            for k, parts in enumerate(self._parts())
        ]
        return jnp.concatenate(each) if each[0].ndim else jnp.stack(each)

    def _turn(self) -> Float[Array, "2 2"]:
        c, s = jnp.cos(self.angle), jnp.sin(self.angle)
        return jnp.stack([jnp.stack([c, s]), jnp.stack([-s, c])])

    def _along(self, places: list[Pair]) -> tuple[Pair, Pair]:
        """At the magnets and at the sensors, along v and w, of what the stations' x and y (or rates) are."""
        turn, ground = self._turn(), 0.0
        if self.housed and len(places) > 1:
            *places, ground = places
        return turn @ (places[0] - ground), turn @ (places[-1] - ground)

    def _axes(self, places: list[Pair], state: Any) -> Axis:
        at_magnet, measured = self._along(places)
        sizes = self._sizes()
        states = jnp.zeros(sum(sizes)) if state is None else state
        if self._alike():
            states = states.reshape(2, -1)
        return Axis(at_magnet, self.setpoint - measured, states)

    def _share(self, t: Float[Array, ""]) -> Float[Array, ""]:
        """Of all currents, what is alive."""
        if self.fails_at is None:
            return jnp.ones(())
        since = t - self.fails_at
        return jnp.where(since < 0, 1.0, jnp.exp(-jnp.maximum(since, 0.0) / self.decay_time))

    def _split(self, axis: Axis) -> tuple[Array, Array, Array, Array]:
        """The error as the controller sees it, and the states of filter, controller and amplifier."""
        first = 2 * (self.sensor_cutoff is not None)
        last = axis.state.shape[0] - self.amplifier.initial().shape[0]
        seen = axis.error if self.sensor_cutoff is None else axis.state[0]
        return seen, axis.state[:first], axis.state[first:last], axis.state[last:]

    def _limit(self, magnet: AbstractMagnet) -> Array | None:
        return magnet.limit() if self.amplifier.limit is None else self.amplifier.limit

    def _control(self, magnet, controller, axis: Axis) -> Array:
        """The control current as it would be with the power on, A."""
        seen, _, inner, driven = self._split(axis)
        return self.amplifier.current(controller.current(seen, inner), driven, self._limit(magnet))

    def _axis_rates(self, magnet, controller, axis: Axis) -> Array:
        seen, filtered, inner, driven = self._split(axis)
        wanted, limit = controller.current(seen, inner), self._limit(magnet)
        excess = self.amplifier.limited(wanted, limit) - wanted
        parts = [
            controller.rates(seen, inner, excess),
            self.amplifier.rates(wanted, driven, limit, magnet.inductance()),
        ]
        if self.sensor_cutoff is not None:
            parts = [
                jnp.stack(low_pass_rates(self.sensor_cutoff, axis.error, filtered[0], filtered[1])),
                *parts,
            ]
        return jnp.concatenate(parts)

    def initial(self) -> Float[Array, " k"]:
        return jnp.zeros(sum(self._sizes()))

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        return self._each(self._axis_rates, self._axes(_places(motions), state))

    def _forces(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Pair:
        share = self._share(t)

        def one(magnet, controller, axis):
            coils = magnet.coils(self._control(magnet, controller, axis), share)
            return magnet.force(axis.at_magnet, coils)

        return self._each(one, self._axes(_places(motions), state))

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        f = self._turn().T @ self._forces(t, motions, state)
        on = jnp.concatenate([f, jnp.zeros(4)])
        found = [on, *(jnp.zeros(6) for _ in motions[1:])]
        if self.housed and len(motions) > 1:
            found[-1] = -on
        return tuple(found)

    def times(self) -> Float[Array, " n"]:
        return jnp.zeros(0) if self.fails_at is None else self.fails_at[None]

    # The books: of the field and of the supply, without the forces.

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        share = self._share(t)

        def one(magnet, controller, axis):
            coils = magnet.coils(self._control(magnet, controller, axis), share)
            return magnet.energy(axis.at_magnet, coils)

        return jnp.sum(self._each(one, self._axes(_places(motions), state)))

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        share = self._share(t)

        def one(magnet, controller, axis):
            return magnet.heat(magnet.coils(self._control(magnet, controller, axis), share))

        return jnp.sum(self._each(one, self._axes(_places(motions), state)))

    def power_in(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """W: voltages times currents, `R i² + i dψ/dt` of each coil with its flux linkage ψ; negative while
        the field gives back."""
        places, rates = _places(motions), [v[:2] for _, v in motions]
        state = jnp.zeros(0) if state is None else state
        moved = self.rates(t, motions, (), state)

        def linked(t, places, state):
            share = self._share(t)

            def one(magnet, controller, axis):
                coils = magnet.coils(self._control(magnet, controller, axis), share)
                return magnet.linkages(axis.at_magnet, coils)

            return self._each(one, self._axes(places, state))

        _, induced = jax.jvp(linked, (t, places, state), (jnp.ones_like(t), rates, moved))
        return self._coils(t, motions, state) @ induced + self.power_lost(t, motions, state)

    def _coils(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """All four, A."""
        share = self._share(t)

        def one(magnet, controller, axis):
            return magnet.coils(self._control(magnet, controller, axis), share)

        return self._each(one, self._axes(_places(motions), state))

    # What it tells.

    def currents(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Pair:
        """Control currents along v and w, A."""
        return self._share(t) * self._each(self._control, self._axes(_places(motions), state))

    def current_v(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.currents(t, motions, state)[0]

    def current_w(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.currents(t, motions, state)[1]

    def force_v(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self._forces(t, motions, state)[0]

    def force_w(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self._forces(t, motions, state)[1]

    def measured(self, motions: tuple[Motion, ...]) -> Pair:
        """What the sensors see along v and w, m, before their filters."""
        return self._along(_places(motions))[1]

    def measured_v(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.measured(motions)[0]

    def measured_w(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.measured(motions)[1]


def _places(motions: tuple[Motion, ...]) -> list[Pair]:
    return [q[:2] for q, _ in motions]
