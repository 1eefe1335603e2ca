"""The synchronous machine with its field and dampers, in Park's two axes."""

from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import number, numbers, positive, whole
from ...core.gate import takes
from ...core.parameter import as_float64, parameter
from ...core.part import option
from ...core.protocol import (
    AbstractAttachment,
    Energetic,
    Motion,
    Powered,
    Signalling,
    Stateful,
    Timed,
    Vec6,
)
from ...profiles.schedule import AbstractSchedule, Steady, as_schedule
from .load import about_axis
from .machine_constants import base_of, one_winding, two_windings
from .two_axis import Axis, Terminals, turned

Scalar = Float[Array, ""]


def _schedule(unit: str, **kwargs: Any) -> Any:
    return eqx.field(converter=as_schedule, metadata={"drives": unit}, **kwargs)


def _length(pair: Float[Array, "2"]) -> Scalar:
    """Its root has no derivative at zero: there it is none."""
    square = pair @ pair
    some = square > 0
    return jnp.where(some, jnp.sqrt(jnp.where(some, square, 1.0)), 0.0)


class SynchronousMachine(AbstractAttachment, Stateful, Energetic, Powered, Timed, Signalling):
    """A synchronous motor or generator with its field winding and damper cage, flux linkages as states.

    Park's equations in the axes of the rotor (d, q; amplitude-invariant, q ahead of d, currents into the
    machine, w = p phi' with p = `pole_pairs`, rotor quantities referred to the stator):

        psi_d' = u_d - Rs i_d + w psi_q,    psi_d = Lls i_d + Lmd (i_d + i_f + i_kd)
        psi_q' = u_q - Rs i_q - w psi_d,    psi_q = Lls i_q + Lmq (i_q + sum i_kq)
        psi_f' = Rf `excitation` - (Rf + `discharge_resistance`) i_f,    psi_k' = -Rk i_k
        T = 3/2 p (psi_d i_q - psi_q i_d)

    T (N·m) acts on the station in the sense of phi. One damper in d, any number in q (rows
    of `q_damper_...`).

    - `excitation`: the exciter's voltage as the field current that it drives when settled, A, referred: so
      `w Lmd excitation` is the peak of the open phase's voltage. `discharge_resistance`: ohm, referred, in
      series with the field. A start as an induction motor is a `Step` of both at the date at which the field
      is switched on.
    - `voltage` (peak of the phase's, V), `frequency` (Hz; negative turns backward): of a stiff grid.
      `phase`: rad, how far the grid's voltage is ahead of d at t = 0, and by how much it jumps later: another
      bus to which the machine is brought.
    - `connected`: the breaker, closed where above one half. An opened current decays within `breaker_time`
      (s), which stands for the arc; what it takes counts as power drawn. Reclosing is a `PulseTrain`.
    - `line_fault`: lines b and c short-circuited where above one half; phase a keeps the grid's voltage, or
      is open with the breaker. A three-phase short circuit is a `Step` of `voltage` to zero.
    - `start`: the states at t = 0 (of `running`); left out, the machine is without flux.

    States: the grid's angle ahead of d (rad), psi_d, psi_q, psi_f, psi_kd, psi_kq... (V·s). No saturation or
    iron loss. Signals: `current` and `terminal_voltage` (A, V, peak of the stator's phases),
    `field_current` (A, referred), `torque`, `load_angle` (rad, by which the field's voltage leads the
    grid's: positive of a generator).

    Sources: Park, Trans. AIEE 48 (1929) 716; Krause, Wasynczuk & Sudhoff, Analysis of Electric Machinery and
    Drive Systems, ch. 5. An opened phase: derived.
    """

    stator_resistance: Scalar = parameter("ohm", nonnegative=True)
    stator_leakage: Scalar = parameter("H", positive=True)
    d_magnetizing: Scalar = parameter("H", positive=True)
    q_magnetizing: Scalar = parameter("H", positive=True)
    field_resistance: Scalar = parameter("ohm", positive=True)
    field_leakage: Scalar = parameter("H", positive=True)
    d_damper_resistance: Scalar = parameter("ohm", positive=True)
    d_damper_leakage: Scalar = parameter("H", positive=True)
    q_damper_resistances: Float[Array, " n"] = parameter("ohm", positive=True, shapes=((None,),))
    q_damper_leakages: Float[Array, " n"] = parameter("H", positive=True, shapes=((None,),))
    excitation: AbstractSchedule = _schedule("A")  # pyright: ignore
    voltage: AbstractSchedule = _schedule("V")  # pyright: ignore
    frequency: AbstractSchedule = _schedule("Hz")  # pyright: ignore
    phase: AbstractSchedule = _schedule("rad", default=0.0)
    connected: AbstractSchedule = _schedule("", default=1.0)
    line_fault: AbstractSchedule = _schedule("", default=0.0)
    discharge_resistance: AbstractSchedule = _schedule("ohm", default=0.0)
    breaker_time: Scalar = parameter("s", positive=True, default=1e-3)
    start: Float[Array, " k"] | None = parameter(
        shapes=((None,),), optional=True, default=None, label="states at t = 0"
    )
    pole_pairs: int = option(whole(1, 1000), default=1)

    signals: ClassVar[dict[str, str]] = {
        "current": "A",
        "terminal_voltage": "V",
        "field_current": "A",
        "torque": "N*m",
        "load_angle": "rad",
    }

    def faults(self) -> Iterator[str]:
        given, other = self.q_damper_resistances.size, self.q_damper_leakages.size
        if given != other:
            yield (
                f"q_damper_resistances and q_damper_leakages must be equally long, but have {given} and "
                f"{other} entries"
            )
        if self.start is not None and self.start.size != 5 + other:
            yield (
                f"start must have {5 + other} entries, but has {self.start.size}: take what `running` gives"
            )

    @property
    def synchronous_speed(self) -> Scalar:
        """rad/s of the shaft, with the grid's frequency at t = 0."""
        return 2 * jnp.pi * self.frequency.value(jnp.zeros(())) / self.pole_pairs

    def initial(self) -> Float[Array, " k"]:
        if self.start is not None:
            return self.start
        return jnp.zeros(5 + self.q_damper_leakages.shape[0])

    def rates(
        self,
        t: Scalar,
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        stator, rotor = self._flux_rates(t, motions, state)
        speed = self.pole_pairs * motions[0][1][5]
        angle = 2 * jnp.pi * self.frequency.value(t) - speed
        return jnp.concatenate([angle[None], stator, rotor])

    def forces(self, t: Scalar, motions: tuple[Motion, ...], state: Any) -> tuple[Vec6, ...]:
        return about_axis(self.torque(t, motions, state))

    def times(self) -> Float[Array, " n"]:
        driven = (
            self.excitation,
            self.voltage,
            self.frequency,
            self.phase,
            self.connected,
            self.line_fault,
            self.discharge_resistance,
        )
        return jnp.concatenate([s.jumps() for s in driven])

    def torque(self, t: Scalar, motions: tuple[Motion, ...], state: Any) -> Array:
        """N·m on the station."""
        stator, _ = self._currents(state)
        return 1.5 * self.pole_pairs * (turned(state[1:3]) @ stator)

    def current(self, t: Scalar, motions: tuple[Motion, ...], state: Any) -> Array:
        """Peak of the stator's phase current, A."""
        return _length(self._currents(state)[0])

    def terminal_voltage(self, t: Scalar, motions: tuple[Motion, ...], state: Any) -> Array:
        """Peak of the phase voltage at the stator's terminals, V: with an open breaker the residual one."""
        return _length(self._terminals(t, motions, state))

    def field_current(self, t: Scalar, motions: tuple[Motion, ...], state: Any) -> Array:
        """A, referred to the stator."""
        return self._currents(state)[1][0]

    def load_angle(self, t: Scalar, motions: tuple[Motion, ...], state: Any) -> Array:
        """rad; it counts the poles that slip."""
        return 0.5 * jnp.pi - state[0] - self.phase.value(t)

    def energy(self, t: Scalar, motions: tuple[Motion, ...], state: Any) -> Array:
        stator, rotor = self._currents(state)
        return 0.75 * (state[1:3] @ stator + state[3:] @ rotor)

    def power_lost(self, t: Scalar, motions: tuple[Motion, ...], state: Any) -> Array:
        stator, rotor = self._currents(state)
        return 1.5 * (self.stator_resistance * (stator @ stator) + self._resistances(t) @ rotor**2)

    def power_in(self, t: Scalar, motions: tuple[Motion, ...], state: Any) -> Array:
        stator, rotor = self._currents(state)
        exciter = self.field_resistance * self.excitation.value(t)
        return 1.5 * (self._terminals(t, motions, state) @ stator + exciter * rotor[0])

    def _terminals(self, t: Scalar, motions: tuple[Motion, ...], state: Any) -> Float[Array, "2"]:
        """V, across the stator's windings in d and q."""
        speed = self.pole_pairs * motions[0][1][5]
        change, _ = self._flux_rates(t, motions, state)
        stator, _ = self._currents(state)
        return self.stator_resistance * stator + change + speed * turned(state[1:3])

    def _axes(self) -> tuple[Axis, Axis]:
        d = jnp.stack([self.field_leakage, self.d_damper_leakage])
        return (
            Axis(self.stator_leakage, self.d_magnetizing, d),
            Axis(self.stator_leakage, self.q_magnetizing, self.q_damper_leakages),
        )

    def _currents(self, state: Any) -> tuple[Float[Array, "2"], Float[Array, " m"]]:
        """A: of the stator in d and q, of field and dampers."""
        d, q = self._axes()
        along, rotor_d = d.currents(state[1], state[3:5])
        across, rotor_q = q.currents(state[2], state[5:])
        return jnp.stack([along, across]), jnp.concatenate([rotor_d, rotor_q])

    def _resistances(self, t: Scalar) -> Float[Array, " m"]:
        """ohm, of field and dampers."""
        field = self.field_resistance + self.discharge_resistance.value(t)
        d = jnp.stack([field, self.d_damper_resistance])
        return jnp.concatenate([d, self.q_damper_resistances])

    def _flux_rates(self, t: Scalar, motions: tuple[Motion, ...], state: Any):
        """V: of the stator's flux linkages, of field's and dampers'."""
        ((turn, v),) = motions
        d, q = self._axes()
        stator, currents = self._currents(state)
        rotor = (
            (-self._resistances(t) * currents)
            .at[0]
            .add(self.field_resistance * self.excitation.value(t))
        )
        ahead = state[0] + self.phase.value(t)
        terminals = Terminals(
            self.voltage.value(t) * jnp.stack([jnp.cos(ahead), jnp.sin(ahead)]),
            self.connected.value(t) > 0.5,
            self.line_fault.value(t) > 0.5,
            self.pole_pairs * turn[5],
            self.breaker_time,
        )
        change = terminals.flux_rates(
            self.pole_pairs * v[5],
            self.stator_resistance,
            jnp.stack([d.subtransient(), q.subtransient()]),
            stator,
            state[1:3],
            jnp.stack([d.behind(rotor[:2]), q.behind(rotor[2:])]),
        )
        return change, rotor

    @takes(power=number("W"), reactive_power=number("V*A"))
    def running(self, power: float, reactive_power: float = 0.0) -> "SynchronousMachine":
        """The machine settled on its grid at t = 0: with `start`, and the `excitation` that this takes.

        `power` (W) and `reactive_power` (V·A) are drawn from the grid by the stator: a generator has a
        negative power, an overexcited machine a negative reactive power. Voltage and frequency are those
        at t = 0; the station must turn at the synchronous speed, and what turns it takes or gives the
        torque. Derivatives pass through. Raises `InputError` for what is no number.
        """
        now = jnp.zeros(())
        volts, turn = self.voltage.value(now), 2 * jnp.pi * self.frequency.value(now)
        amps = (power - 1j * reactive_power) / (1.5 * volts)  # beside the voltage, which is real
        across = self.q_magnetizing + self.stator_leakage
        along = self.d_magnetizing + self.stator_leakage
        # it lies along q, where the rotor turns forward: there the d axis is a quarter behind
        inner = volts - (self.stator_resistance + 1j * turn * across) * amps
        sense = jnp.sign(turn)
        ahead = sense * 0.5 * jnp.pi - jnp.angle(inner)
        current = amps * jnp.exp(1j * ahead)
        i_d, i_q = current.real, current.imag
        u_q = volts * jnp.sin(ahead)
        psi_d = (u_q - self.stator_resistance * i_q) / turn
        field = (psi_d - along * i_d) / self.d_magnetizing
        mutual_d, mutual_q = self.d_magnetizing * (i_d + field), self.q_magnetizing * i_q
        d = jnp.stack([mutual_d + self.field_leakage * field, mutual_d])
        q = jnp.broadcast_to(mutual_q, self.q_damper_leakages.shape)
        first = jnp.stack([ahead - self.phase.value(now), psi_d, across * i_q])
        start = jnp.concatenate([first, d, q])
        return eqx.tree_at(
            lambda m: (m.start, m.excitation),
            self,
            (start, Steady(field)),
            is_leaf=lambda x: x is None,
        )

    @classmethod
    @takes(
        power=positive("V*A"),
        line_voltage=positive("V"),
        frequency=positive("Hz"),
        stator=numbers(size=2, least=0.0),
        magnetizing=numbers(size=2, above=0.0),
        field=numbers(size=2, above=0.0),
        d_damper=numbers(size=2, above=0.0),
        excitation=number(),
        pole_pairs=whole(1, 1000),
    )
    def from_per_unit(
        cls,
        power: float,
        line_voltage: float,
        frequency: float,
        stator: Sequence[float],
        magnetizing: Sequence[float],
        field: Sequence[float],
        d_damper: Sequence[float],
        q_dampers: Sequence[Sequence[float]],
        excitation: float = 1.0,
        pole_pairs: int = 1,
    ) -> "SynchronousMachine":
        """A machine from per-unit resistances and reactances, on its rated voltage and frequency.

        **Arguments:**

        - `power`: V·A, rated apparent power. - `line_voltage`: V, rms between lines. - `frequency`: Hz.
        - `stator`, `field`, `d_damper`: (resistance, leakage reactance) of each. - `q_dampers`: such a pair
          of each damper. - `magnetizing`: (d, q). Rotor quantities as referred to the stator, in the
          reciprocal system (Krause; Kundur).
        - `excitation`: 1 gives the rated voltage at no load. For a start or a fault replace `excitation`,
          `voltage` and their like.

        Raises `InputError` for numbers that are not positive, or too few.
        """
        for k, pair in enumerate(q_dampers):
            numbers(size=2, above=0.0)(pair, f"SynchronousMachine.from_per_unit: q_dampers[{k}]")
        base = base_of(power, line_voltage, frequency)
        ohm, henry = base.impedance, base.inductance
        rows = [[x * b for x in row] for row, b in zip(zip(*q_dampers), (ohm, henry))]
        given = [
            stator[0] * ohm,
            stator[1] * henry,
            magnetizing[0] * henry,
            magnetizing[1] * henry,
            field[0] * ohm,
            field[1] * henry,
            d_damper[0] * ohm,
            d_damper[1] * henry,
            *rows,
        ]
        no_load = base.voltage / (magnetizing[0] * ohm)
        return cls(
            *map(as_float64, given),
            excitation=excitation * no_load,
            voltage=base.voltage,
            frequency=frequency,
            pole_pairs=pole_pairs,
        )

    @classmethod
    @takes(
        **{name: positive() for name in ("xd", "xq", "leakage")},
        **{f"xd_{name}transient": positive() for name in ("", "sub")},
        xq_subtransient=positive(),
        td0_transient=positive("s"),
        td0_subtransient=positive("s"),
        tq0_subtransient=positive("s"),
        xq_transient=positive(),
        tq0_transient=positive("s"),
        stator_resistance=number(least=0.0),
        power=positive("V*A"),
        line_voltage=positive("V"),
        frequency=positive("Hz"),
        excitation=number(),
        pole_pairs=whole(1, 1000),
    )
    def from_standard(
        cls,
        power: float,
        line_voltage: float,
        frequency: float,
        xd: float,
        xq: float,
        xd_transient: float,
        xd_subtransient: float,
        xq_subtransient: float,
        td0_transient: float,
        td0_subtransient: float,
        tq0_subtransient: float,
        leakage: float,
        stator_resistance: float,
        xq_transient: float | None = None,
        tq0_transient: float | None = None,
        excitation: float = 1.0,
        pole_pairs: int = 1,
    ) -> "SynchronousMachine":
        """A machine from the reactances (per unit) and open-circuit time constants (s) of its data sheet.

        `xd`, `xq`, the transient and subtransient ones, `leakage` and `stator_resistance` in per unit;
        `td0_transient`, `td0_subtransient`, `tq0_subtransient` in s. With `xq_transient` and
        `tq0_transient` (a solid rotor) there are two dampers in q, without them one (salient poles). The
        others as for `from_per_unit`.

        Time constants by the classical definitions, one winding at a time (Kundur, Power System Stability and
        Control, sec. 4.2; EN 60034-4, annex C). The roots of the operational inductances, which a test
        shows, differ from them by some percent. Raises `InputError` for reactances that do not fall from
        the synchronous one to the leakage.
        """
        d, rd = two_windings(
            "xd",
            xd,
            leakage,
            xd_transient,
            xd_subtransient,
            (td0_transient, td0_subtransient),
            frequency,
        )
        if xq_transient is None or tq0_transient is None:
            q, rq = one_winding("xq", xq, leakage, xq_subtransient, tq0_subtransient, frequency)
        else:
            times = tq0_transient, tq0_subtransient
            q, rq = two_windings("xq", xq, leakage, xq_transient, xq_subtransient, times, frequency)
        return cls.from_per_unit(
            power,
            line_voltage,
            frequency,
            (stator_resistance, leakage),
            (xd - leakage, xq - leakage),
            (rd[0], d[0]),
            (rd[1], d[1]),
            list(zip(rq, q)),
            excitation,
            pole_pairs,
        )
