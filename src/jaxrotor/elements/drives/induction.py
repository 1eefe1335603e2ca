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
    shorted, a Ramp of both starts softly. At the start all fluxes are zero. No saturation, iron
    loss or skin effect. Signals: `current` (A, peak of the stator's phase current) and `torque`.
    Source: Krause, Wasynczuk & Sudhoff, Analysis of Electric Machinery and Drive Systems, ch. 4.
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
        i = self._currents(state)
        ds, qs, dr, qr = state
        return jnp.stack(
            [
                self.voltage.value(t) - self.stator_resistance * i[0] + turn * qs,
                -self.stator_resistance * i[1] - turn * ds,
                -self.rotor_resistance * i[2] + slip * qr,
                -self.rotor_resistance * i[3] - slip * dr,
            ]
        )

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return about_axis(self.torque(t, motions, state))

    def times(self) -> Float[Array, " n"]:
        return jnp.concatenate([self.voltage.jumps(), self.frequency.jumps()])

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
        return 1.5 * self.voltage.value(t) * self._currents(state)[0]

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
