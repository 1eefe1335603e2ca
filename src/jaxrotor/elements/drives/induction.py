"""The induction motor with its fluxes."""

from collections.abc import Iterator
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import number, whole
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
from ...profiles.schedule import AbstractSchedule, Step, as_schedule
from .load import about_axis
from .nameplate import equivalent_circuit
from .two_axis import turned


class InductionMotor(AbstractAttachment, Stateful, Energetic, Powered, Timed, Signalling):
    """A three-phase induction motor on a stiff grid, with its flux linkages as states.

    With the mechanical equation this is the fifth-order model, in the frame that turns with the
    grid (d, q; amplitude-invariant, psi = psi_d + j psi_q, w1 = 2 pi `frequency`, p = `pole_pairs`):

        psi_s' = u - Rs i_s - j w1 psi_s,         psi_s = Ls i_s + Lm i_r
        psi_r' =   - Rr i_r - j (w1 - p phi') psi_r,   psi_r = Lm i_s + Lr i_r
        T = 3/2 p (psi_ds i_qs - psi_qs i_ds)

    T (N·m) acts on the station in the sense of phi. Rotor quantities are referred to the stator:
    resistances in ohm, inductances in H, star-connected phases; Ls and Lr are the whole ones,
    leakage and magnetizing together. `voltage` is the peak of the phase voltage (V), so the line's
    rms times sqrt(2/3); phase a is `voltage cos(w1 t)`. It and `frequency` (Hz; negative turns
    backward) are numbers or schedules: a Step switches on, or is a blackout with the terminals
    shorted, a Ramp of both starts softly. `connected`: the breaker, a number or a schedule, closed
    where above one half; an opened current decays within `breaker_time` (s), which stands for the arc (what
    it takes counts as power drawn), and the rotor's flux stays behind: a PulseTrain opens and recloses.
    `phase` (rad) turns the grid's voltage ahead: a Step to another bus. At the start all fluxes are
    zero. No saturation, iron loss or skin effect. Signals: `current` (A, peak of the stator's phase
    current) and `torque`. Source: Krause, Wasynczuk & Sudhoff, Analysis of Electric Machinery and
    Drive Systems, ch. 4; an opened stator: derived.
    """

    stator_resistance: Float[Array, ""] = parameter("ohm", nonnegative=True)
    rotor_resistance: Float[Array, ""] = parameter("ohm", positive=True)
    stator_inductance: Float[Array, ""] = parameter("H", positive=True)
    rotor_inductance: Float[Array, ""] = parameter("H", positive=True)
    magnetizing_inductance: Float[Array, ""] = parameter("H", positive=True)
    voltage: AbstractSchedule = eqx.field(  # pyright: ignore
        converter=as_schedule, metadata={"drives": "V"}
    )
    frequency: AbstractSchedule = eqx.field(  # pyright: ignore
        converter=as_schedule, metadata={"drives": "Hz"}
    )
    pole_pairs: int = option(whole(1, 1000), default=1)
    connected: AbstractSchedule = eqx.field(
        converter=as_schedule, metadata={"drives": ""}, default=1.0
    )
    phase: AbstractSchedule = eqx.field(
        converter=as_schedule, metadata={"drives": "rad"}, default=0.0
    )
    breaker_time: Float[Array, ""] = parameter("s", positive=True, default=1e-3)

    signals: ClassVar[dict[str, str]] = {"current": "A", "torque": "N*m"}

    def faults(self) -> Iterator[str]:
        for name in ("stator_inductance", "rotor_inductance"):
            if not getattr(self, name) > self.magnetizing_inductance:
                yield (
                    f"{name} must be more than the magnetizing inductance, "
                    f"{float(self.magnetizing_inductance):g} H, but is "
                    f"{float(getattr(self, name)):g} H: give leakage and magnetizing together"
                )

    def initial(self) -> Float[Array, "4"]:
        return jnp.zeros(4)  # psi_ds, psi_qs, psi_dr, psi_qr

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, "4"]:
        ((_, v),) = motions
        turn = 2 * jnp.pi * self.frequency.value(t)
        slip = turn - self.pole_pairs * v[5]
        rotor = -self.rotor_resistance * self._currents(state)[2:] - slip * turned(state[2:])
        return jnp.concatenate([self._stator_rates(t, state, turn, rotor), rotor])

    def _stator_rates(self, t: Array, state: Array, turn: Array, rotor: Array) -> Float[Array, "2"]:
        """V: of the stator's flux linkages, in the grid's frame. `turn`: its speed, rad/s; `rotor`: the
        rates of the rotor's."""
        current = self._currents(state)[:2]
        ahead = self.phase.value(t)
        grid = self.voltage.value(t) * jnp.stack([jnp.cos(ahead), jnp.sin(ahead)])
        closed = grid - self.stator_resistance * current - turn * turned(state[:2])
        # open: the current decays as the stator sees it, and the flux linkage is what is left of the rotor's
        fading = -current / self.breaker_time - turn * turned(current)
        share = self.magnetizing_inductance / self.rotor_inductance
        short = self.stator_inductance - share * self.magnetizing_inductance
        return jnp.where(self.connected.value(t) > 0.5, closed, short * fading + share * rotor)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return about_axis(self.torque(t, motions, state))

    def times(self) -> Float[Array, " n"]:
        driven = self.voltage, self.frequency, self.connected, self.phase
        return jnp.concatenate([s.jumps() for s in driven])

    def torque(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """N·m on the station."""
        i = self._currents(state)
        return 1.5 * self.pole_pairs * (state[0] * i[1] - state[1] * i[0])

    def current(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """Peak of the stator's phase current, A."""
        i = self._currents(state)
        square = i[0] ** 2 + i[1] ** 2
        some = square > 0  # at the start the root has no derivative
        return jnp.where(some, jnp.sqrt(jnp.where(some, square, 1.0)), 0.0)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return 0.75 * jnp.sum(state * self._currents(state))

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        i = self._currents(state)
        stator, rotor = jnp.sum(i[:2] ** 2), jnp.sum(i[2:] ** 2)
        return 1.5 * (self.stator_resistance * stator + self.rotor_resistance * rotor)

    def power_in(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        turn = 2 * jnp.pi * self.frequency.value(t)
        current = self._currents(state)[:2]
        change = self.rates(t, motions, (), state)[:2]
        terminals = self.stator_resistance * current + change + turn * turned(state[:2])
        return 1.5 * (terminals @ current)

    def _currents(self, state: Float[Array, "4"]) -> Float[Array, "4"]:
        """i_ds, i_qs, i_dr, i_qr, A."""
        s, r, m = self.stator_inductance, self.rotor_inductance, self.magnetizing_inductance
        stator = r * state[:2] - m * state[2:]
        rotor = s * state[2:] - m * state[:2]
        return jnp.concatenate([stator, rotor]) / (s * r - m**2)

    @classmethod
    def from_nameplate(
        cls,
        power: float,
        line_voltage: float,
        frequency: float,
        speed: float,
        power_factor: float,
        efficiency: float,
        breakdown_torque_ratio: float,
        starting_torque_ratio: float | None = None,
        starting_current_ratio: float | None = None,
        switch_on: Any = None,
    ) -> "InductionMotor":
        """A motor fitted to its nameplate (catalogue) data.

        **Arguments:**

        - `power`: W at the shaft. - `line_voltage`: V, rms between lines, star connection.
        - `frequency`: Hz. - `speed`: rad/s of the shaft at full load; the pole pairs follow.
        - `power_factor`, `efficiency`: at full load, parts of one.
        - `breakdown_torque_ratio`, `starting_torque_ratio`, `starting_current_ratio`: parts of the
          full-load torque and current.
        - `switch_on`: s, when the whole voltage is switched on: a parameter, `"motor.voltage.time"`; left
          out, it is there from the start. For a soft start or a blackout replace the motor's `voltage`.

        One circuit with constant numbers cannot meet everything, above all not the starting values
        of a deep-bar rotor: a warning tells what is missed by over 3 %. All losses are taken as
        copper losses. Raises `InputError` where the data cannot be of one motor.
        """
        if switch_on is not None:
            switch_on = number("s")(switch_on, "InductionMotor.from_nameplate: switch_on")
        circuit, pole_pairs = equivalent_circuit(
            power,
            line_voltage,
            frequency,
            speed,
            power_factor,
            efficiency,
            breakdown_torque_ratio,
            starting_torque_ratio,
            starting_current_ratio,
        )
        peak = line_voltage * (2 / 3) ** 0.5
        voltage = peak if switch_on is None else Step(switch_on, peak)
        numbers = map(as_float64, circuit)
        return cls(*numbers, voltage=voltage, frequency=frequency, pole_pairs=pole_pairs)
