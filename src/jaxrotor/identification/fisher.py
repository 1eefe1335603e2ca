"""What sensors would tell of unknowns before anything is recorded: Fisher information, differentiable.

Source: Pukelsheim, Optimal Design of Experiments (2006), sec. 1.18 and 3.10.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..core.arguments import mapping
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known, require_x64
from ..machine.machine import Machine
from ..search.instrumented import Instrumented
from ..search.space import Space
from ..search.unknown import as_unknowns
from ..sensors.channel import as_channels
from ..sensors.tracking_filter import TrackingFilter
from ..simulation.simulate import for_slopes, settled
from ..simulation.solver import is_planned
from .candidate_run import CandidateRun, as_candidate_runs
from .simulated import Run, Simulated, records_and_slopes


@dataclasses.dataclass(frozen=True)
class Bench:
    """A bench that could be built: the guess of a machine with every candidate, its unknowns at the guess."""

    instrumented: Instrumented
    space: Space
    runs: dict[str, CandidateRun]

    @property
    def sensors(self) -> tuple[str, ...]:
        return tuple(self.instrumented.channels)

    def simulated(self, name: str, reverse: bool) -> Simulated:
        """One run alone, every sensor at each of its samples. `reverse`: its slopes may be differentiated by
        reverse mode, where the solver knows it."""
        given = self.runs[name]
        machine = self.space.set(self.instrumented, self.space.starts).machine
        ready = settled(machine.set(given.conditions), given.simulation)
        if not (reverse and is_planned(ready.solver)):
            ready = for_slopes(ready, reverse=False)
        interval = 1.0 / ready.sample_rate
        times = jnp.arange(int(ready.t_end * ready.sample_rate + 1e-9) + 1) * interval
        # values between samples need one beyond the last
        ready = dataclasses.replace(ready, t_end=ready.t_end + 2 * interval)
        run = Run.of(dict.fromkeys(self.sensors, times), given.conditions, ready)
        return Simulated(self.instrumented, (run,), self.space)

    def slopes(self, name: str, reverse: bool = False) -> Iterator[tuple[Array, Array, Array]]:
        """Of each sensor in a run: instants (nt,) and records (nt,), and the slopes (nt, n) of these by each
        of the search's own coordinates, in standard deviations of its noise; 0 where there is no record."""
        simulated = self.simulated(name, reverse)
        found, slopes = records_and_slopes(simulated, jnp.zeros((1, len(self.space))))
        for sensor, t, record, slope in zip(
            self.sensors, simulated.runs[0].times, found, slopes, strict=True
        ):
            noise = self.instrumented.channels[sensor].noise
            assert noise is not None
            there = jnp.isfinite(record[0])
            yield t, record[0], jnp.where(there[:, None], slope[0], 0.0) / noise.std


def bench_of(machine: Machine, parameters: Any, sensors: Any, runs: Any) -> Bench:
    """Judged as far as it can be before anything runs; raises `InputError`."""
    require_x64()
    machine.check()
    if not sensors:
        raise InputError("sensors: name one at least, such as {'probe': jr.Channel(...)}")
    instrumented = Instrumented(machine, as_channels(dict(sensors)))
    instrumented.check()
    silent = [
        f"`{name}`: needs a noise, for how well a sensor tells depends on it: give its channel "
        "`noise=jr.sensors.Noise(std)`"
        for name, channel in instrumented.channels.items()
        if channel.noise is None or _is_zero(channel.noise.std)
    ]
    silent += [
        f"`{name}`: vectors of windows that overlap tell the same again: give its sensor as a Channel"
        for name, channel in instrumented.channels.items()
        if isinstance(channel, TrackingFilter)
    ]
    if silent:
        raise InputError(*silent)
    unknowns = as_unknowns(parameters)
    with jax.ensure_compile_time_eval():  # inside jit plain numbers stay known
        at_hand = _as_known(instrumented)
        for one in unknowns:
            if isinstance(at_hand.get(one.path), Tracer):
                raise InputError(
                    f"`{one.path}`: is an unknown and traced by jit or vmap, but its value must be known here"
                )
        space = Space.of(at_hand, unknowns)
    own = [
        instrumented.get(one.path) if one.start is None else jnp.asarray(one.start, float)
        for one in unknowns
    ]
    # derivatives by the guess of an unknown go through its start
    space = dataclasses.replace(space, starts=jnp.stack([jnp.asarray(x, float) for x in own]))
    begun = space.set(instrumented, space.starts).machine
    return Bench(instrumented, space, as_candidate_runs(runs, begun))


def _is_zero(std: Any) -> bool:
    number = known(std)
    return number is not None and not float(number) > 0


def _as_known(instrumented: Instrumented) -> Instrumented:
    """With the numbers behind what `grad` differentiates by."""

    def number(x: Any) -> Any:
        value = known(x)
        return x if value is None else jnp.asarray(value)

    return jax.tree.map(lambda x: number(x) if eqx.is_array(x) else x, instrumented)


@takes(sensors=mapping, runs=mapping)
def information(
    machine: Machine, parameters: Any, sensors: Mapping[str, Any], runs: Mapping[str, Any]
) -> Float[Array, "sensors runs n n"]:
    """Fisher information of each sensor in each run on `parameters`, at their values in `machine`, in SI
    units (1 over those of the two parameters). Sensors and runs of independent noise add up; the inverse of
    the sum is the covariance to be expected. Priors are not in it.

    Arguments are those of `experiment_design`; what it refuses raises `InputError`. It may be differentiated
    by whatever is put into them: a probe's angle, its noise, a speed, a trial mass in a run's `conditions`,
    the unknowns' own values:

        def blur(angle):
            told = jr.identification.information(machine, unknowns, {"probe": probe(angle)}, runs)
            return -jnp.linalg.slogdet(told.sum((0, 1)))[1]

        jax.grad(blur)(0.3)

    The exponential solvers know forward and reverse mode here; the adaptive ones forward mode alone
    (`jax.jacfwd`), and so does a simulation with `adjoint=diffrax.ForwardMode()`. Inside `jit` the runs need
    a `step`, and the unknowns' values must be known. `t_end` and `sample_rate` set how many samples there
    are: no derivative by them.
    """
    bench = bench_of(machine, parameters, sensors, runs)
    space = bench.space
    rate = jax.jacfwd(space.values)(jnp.zeros(len(space))).diagonal()
    found = []
    for name in bench.runs:
        slopes = (slope / rate for *_, slope in bench.slopes(name, reverse=True))
        found.append(jnp.stack([s.T @ s for s in slopes]))
    return jnp.stack(found, axis=1)


def broken(bench: Bench, name: str, sensor: str, t: Any, record: Any, slope: Any) -> str:
    """In words, what is wrong with a run of a sensor; empty where nothing is."""
    delay = float(getattr(bench.instrumented.channels[sensor], "delay", 0.0))
    reached = np.asarray(t) - delay
    last = float(np.asarray(t)[-1])
    expected = (reached >= 0) & (reached <= last)
    if np.isfinite(np.asarray(record)[expected]).all() and np.isfinite(np.asarray(slope)).all():
        return ""
    return f"run `{name}`: does not stay finite at `{sensor}`: give it a smaller `step`, or leave it out"
