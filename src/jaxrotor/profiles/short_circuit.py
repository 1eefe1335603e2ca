"""Air-gap torques of electrical machines whose supply fails: short circuit, and reclosing."""

from collections.abc import Iterator

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.arguments import number, positive
from ..core.gate import takes
from ..core.parameter import parameter
from .schedule import AbstractSchedule

Scalar = Float[Array, ""]


@takes(
    power=positive("V*A"),
    synchronous_speed=positive("rad/s"),
    reactance=positive(),
    voltage=number(least=0.0),
)
def short_circuit_amplitude(
    power: float, synchronous_speed: float, reactance: float, voltage: float = 1.0
) -> Scalar:
    """Amplitude of the air-gap torque at a short circuit at the terminals, N·m: `(P/Ns) v²/x''`.

    - `power`: rated apparent power, V·A. - `synchronous_speed`: of the shaft, rad/s.
    - `reactance`: subtransient reactance x'', per unit; of an induction machine its locked-rotor one; with
      a network before it the sum of both. - `voltage`: per unit.

    From the flux that the shorted winding holds, `3/2 p Psi²/L''`, in per unit. Raises `InputError` for what
    is not positive.
    """
    return jnp.asarray(power / synchronous_speed * voltage**2 / reactance)


class ShortCircuit(AbstractSchedule):
    """The torque of a synchronous or induction machine whose terminals are shorted at `time` (s):

        T = mean - fundamental e^(-s/decay) sin(w s) - second e^(-s/second_decay) sin(2 w s),
        mean = after + (before - after) e^(-s/mean_decay),  s = t - time,  w = 2 pi frequency (Hz).

    Levels in the unit of what it drives, N·m for a `Torque` on the rotor of the machine; positive ones brake
    forward turning in the first swing. With `short_circuit_amplitude` T1, of a machine with round rotor (x''
    alike in both axes), shorted at the worst instant:

    - three phases: `fundamental` T1, `second` 0, `decay` T T''/(T + T''), with T the time constant of the
      armature and T'' that of the rotor's flux;
    - two phases (line to line): `fundamental` T1, `second` -T1/2, `second_decay` half of T'': the first
      peak is 3 sqrt(3)/4 of T1. The worst instant is the zero of the voltage between both lines.

    `three_phase` and `two_phase` write them so. `before`, `after`: the steady torque before, and what is
    left (losses; 0 where the machine is cut off). Other sources give the same form with numbers of their
    own. Source: constant flux linkage; the parts (steady, line frequency, twice that, all damped) as in
    Kirschbaum, Trans. AIEE 64 (1945) 65, known from its abstract; their sizes are derived, and checked with
    the flux equations in tests/test_short_circuit.py.
    """

    time: Scalar = parameter("s")
    frequency: Scalar = parameter("Hz")
    fundamental: Scalar = parameter()
    second: Scalar = parameter(default=0.0)
    decay: Scalar = parameter("s", positive=True, default=0.1)
    second_decay: Scalar | None = parameter("s", positive=True, optional=True, default=None)
    before: Scalar = parameter(default=0.0)
    after: Scalar = parameter(default=0.0)
    mean_decay: Scalar = parameter("s", positive=True, default=0.1)

    def value(self, t: Scalar) -> Scalar:
        late = t >= self.time
        s = jnp.where(late, t - self.time, 0.0)
        mean = self.after + (self.before - self.after) * jnp.exp(-s / self.mean_decay)
        slow = self.decay if self.second_decay is None else self.second_decay
        swing = _swing(s, self.frequency, (self.fundamental, self.second), (self.decay, slow))
        return jnp.where(late, mean - swing, self.before)

    def jumps(self) -> Float[Array, " n"]:
        return self.time[None]

    def top_frequency(self) -> Scalar:
        return 2 * jnp.pi * jnp.abs(self.frequency) * jnp.where(self.second == 0, 1.0, 2.0)

    @classmethod
    @takes()
    def three_phase(
        cls,
        time: float,
        frequency: float,
        amplitude: float,
        decay: float = 0.1,
        before: float = 0.0,
    ) -> "ShortCircuit":
        """All phases shorted at once. `time`: s. `frequency`: of the line, Hz. `amplitude`: of
        `short_circuit_amplitude`. `decay`: s. `before`: the torque until then. Raises `InputError` for what
        is no number."""
        return cls(time, frequency, amplitude, 0.0, decay, before=before, mean_decay=decay)

    @classmethod
    @takes()
    def two_phase(
        cls,
        time: float,
        frequency: float,
        amplitude: float,
        decay: float = 0.1,
        second_decay: float | None = None,
        before: float = 0.0,
    ) -> "ShortCircuit":
        """Two lines shorted, at the zero of the voltage between them. As `three_phase`. Raises `InputError`
        for what is no number."""
        second = -0.5 * jnp.asarray(amplitude, float)
        return cls(
            time, frequency, amplitude, second, decay, second_decay, before=before, mean_decay=decay
        )


class Reclosing(AbstractSchedule):
    """A fault at `fault_time`, cleared at `clearing_time` by cutting the machine off, and reconnected at
    `reclosing_time` (s), when its voltage is `angle` (rad) ahead of the line's.

    Before: `before`. In the fault as `ShortCircuit` with `fundamental` = `amplitude` and `second`. Cut off:
    nothing. From the reclosing on, s after it:

        T = before (1 - e^(-s/mean_decay))
            + amplitude (2 sin(angle/2) cos(w s + angle/2) e^(-s/decay) - sin(angle) e^(-s/mean_decay)):

    the swing of the flux that the machine brings along, and the pull back into step; the worst angle is 120
    deg. `amplitude`: of `short_circuit_amplitude`, with the network's reactance. Levels in the unit of what
    it drives, N·m for a `Torque`. Source: constant flux linkage, both voltages alike; derived and checked
    with the flux equations in tests/test_short_circuit.py.
    """

    fault_time: Scalar = parameter("s")
    clearing_time: Scalar = parameter("s")
    reclosing_time: Scalar = parameter("s")
    frequency: Scalar = parameter("Hz")
    amplitude: Scalar = parameter()
    angle: Scalar = parameter("rad", default=2 * jnp.pi / 3)
    second: Scalar = parameter(default=0.0)
    decay: Scalar = parameter("s", positive=True, default=0.1)
    mean_decay: Scalar = parameter("s", positive=True, default=0.1)
    before: Scalar = parameter(default=0.0)

    def faults(self) -> Iterator[str]:
        times = ("fault_time", "clearing_time", "reclosing_time")
        for early, late in zip(times, times[1:]):
            if not getattr(self, late) > getattr(self, early):
                yield (
                    f"{late} must be after {early}, {float(getattr(self, early)):g} s, but is "
                    f"{float(getattr(self, late)):g} s"
                )

    def value(self, t: Scalar) -> Scalar:
        def since(time):
            return jnp.where(t >= time, t - time, 0.0)

        s = since(self.fault_time)
        levels, decays = (self.amplitude, self.second), (self.decay, self.decay)
        faulty = self.before * jnp.exp(-s / self.mean_decay)
        faulty -= _swing(s, self.frequency, levels, decays)
        s = since(self.reclosing_time)
        w, half = 2 * jnp.pi * self.frequency, 0.5 * self.angle
        swing = 2 * jnp.sin(half) * jnp.cos(w * s + half) * jnp.exp(-s / self.decay)
        pull = self.before + self.amplitude * jnp.sin(self.angle)
        back = self.before + self.amplitude * swing - pull * jnp.exp(-s / self.mean_decay)
        fault, cleared, closed = self.jumps()
        return jnp.where(
            t < fault,
            self.before,
            jnp.where(t < cleared, faulty, jnp.where(t < closed, 0.0, back)),
        )

    def jumps(self) -> Float[Array, " n"]:
        return jnp.stack([self.fault_time, self.clearing_time, self.reclosing_time])

    def top_frequency(self) -> Scalar:
        return 2 * jnp.pi * jnp.abs(self.frequency) * jnp.where(self.second == 0, 1.0, 2.0)


def _swing(s: Scalar, frequency: Scalar, levels: tuple, decays: tuple) -> Scalar:
    """Damped sines of the line's frequency and twice it, s seconds after they began."""
    w = 2 * jnp.pi * frequency
    return sum(
        (
            level * jnp.exp(-s / decay) * jnp.sin(order * w * s)
            for order, level, decay in zip((1, 2), levels, decays)
        ),
        jnp.zeros(()),
    )
