"""Any solver of diffrax, its step adapted, through given samples and known jumps."""

from typing import Any, NamedTuple, Protocol

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .controller import adapting
from .progress import hand_over, handing, part_length
from .rosenbrock import Rosenbrock, SlopedField, Slopes
from .stepping import Stepping

_MOST_STEPS = 2**22


class Clocks(Protocol):
    """The instants at which sampling controllers may tick, `refine` to a sample interval; which clocks
    are due at each, (instants, clocks); and what a tick makes of the state."""

    refine: int
    due: np.ndarray

    def fine(self, samples: Float[Array, " nt"]) -> Float[Array, " n"]: ...

    def tick(self, t: Any, y: Array, due: Any) -> Array: ...


def adaptive_samples(
    solver: diffrax.AbstractSolver[Any],
    terms: diffrax.AbstractTerm[Any, Any],
    samples: Float[Array, " nt"],
    jumps: Float[Array, " j"],
    y0: Float[Array, " d"],
    args: Any,
    rtol: Any,
    atol: Any,
    step: Any = None,
    adjoint: diffrax.AbstractAdjoint | None = None,
    told: bool = False,
    ticking: Clocks | None = None,
    slopes: Slopes | None = None,
) -> tuple[Float[Array, "nt d"], Array]:
    """States at the samples, NaN from where the solver gave up, and the number of steps. `step`: a
    fixed length (s) in place of the tolerances. `told`: the samples are handed over while they come.
    `slopes`: as of `SlopedField`, where `Rosenbrock` shall take them."""
    if step is None:
        controller: Any = adapting(rtol, atol)
    else:
        controller = diffrax.ConstantStepSize()
    if jumps.size:
        if step is not None:  # only an adaptive controller can be made to land on the jumps
            # back to the full step at once: a step grown from a short one has that one's derivative, enlarged
            controller = adapting(0.0, 1e300, dtmax=step, factormax=1e30)
        inside = (jumps > samples[0]) & (jumps < samples[-1])
        controller = diffrax.ClipStepSizeController(
            controller, jump_ts=jnp.sort(jnp.where(inside, jumps, samples[-1] + 1.0))
        )
    # a function of its own within the program: solver and adjoint go through their loops many times
    field = jax.jit(terms.vf)
    plain: Any = lambda t, y, args: field(t, y, args)  # noqa: E731
    terms = diffrax.ODETerm(plain if slopes is None else SlopedField(plain, slopes))
    if isinstance(solver, Rosenbrock) and isinstance(adjoint, _OUR_ADJOINTS):
        run: Any = _Stepped(solver, terms, controller, step, args, adjoint)
    else:
        run = _Solved(solver, terms, controller, step, args, adjoint)
    if ticking is None:
        states, steps = run.through(samples, y0, told)
    else:  # afresh from one instant of the grid to the next
        states, steps = _ticked(run, ticking, samples, y0, told)
    return jnp.where(jnp.isfinite(states), states, jnp.nan), steps


# Those whose derivatives the stiff solver's own loop takes.
_OUR_ADJOINTS = (type(None), diffrax.ForwardMode, diffrax.RecursiveCheckpointAdjoint)


class _Stepped(NamedTuple):
    """By a loop of our own."""

    solver: Any
    terms: Any
    controller: Any
    step: Any
    args: Any
    adjoint: Any

    def through(self, samples: Array, y: Array, told: bool = False) -> tuple[Array, Array]:
        stepping = Stepping(
            self.solver,
            self.terms,
            self.args,
            self.controller.wrap(1),
            samples[-1],
            _MOST_STEPS,
            not isinstance(self.adjoint, diffrax.ForwardMode),
        )
        # a first step that is too long is tried again, a fifth of it
        first = samples[1] - samples[0] if self.step is None else self.step
        at = stepping.begin(samples[0], y, jax.lax.stop_gradient(first))
        at, states = stepping.march(at, samples, hand_over if told else None)
        return states, at.steps

    def to(self, start: Array, end: Array, y: Array) -> tuple[Array, Array]:
        states, steps = self.through(jnp.stack([start, end]), y)
        return states[1], steps


class _Solved(NamedTuple):
    """By diffrax."""

    solver: Any
    terms: Any
    controller: Any
    step: Any
    args: Any
    adjoint: Any

    def _solve(self, start, end, y, saveat):
        options: dict[str, Any] = {} if self.adjoint is None else dict(adjoint=self.adjoint)
        solution = diffrax.diffeqsolve(
            self.terms,
            self.solver,
            start,
            end,
            self.step,
            y,
            self.args,
            saveat=saveat,
            stepsize_controller=self.controller,
            max_steps=_MOST_STEPS,
            throw=False,
            **options,
        )
        ys: Any = solution.ys
        return ys, solution.stats["num_steps"]

    def through(self, samples: Array, y: Array, told: bool = False) -> tuple[Array, Array]:
        saved: dict[str, Any] = dict(fn=handing) if told else {}
        return self._solve(samples[0], samples[-1], y, diffrax.SaveAt(ts=samples, **saved))

    def to(self, start: Array, end: Array, y: Array) -> tuple[Array, Array]:
        states, steps = self._solve(start, end, y, diffrax.SaveAt(t1=True))
        return states[0], steps


def _ticked(run: Any, ticking: Clocks, samples: Array, y0: Array, told: bool):
    times, due = ticking.fine(samples), jnp.asarray(ticking.due)
    sampled = np.arange(times.size) % ticking.refine == 0

    def interval(y, x):
        start, end, now, real = x
        there, count = run.to(start, end, y)
        y = jnp.where(real, ticking.tick(end, there, now), y)
        return y, (y, jnp.where(real, count, 0))

    def part(y, x):
        xs, sampled = x
        y, (states, counts) = jax.lax.scan(interval, y, xs)
        if told:
            hand_over(xs[1][-1], states, sampled)
        return y, (states, counts)

    y0 = ticking.tick(samples[0], y0, due[0])
    if told:
        hand_over(times[0], y0[None], jnp.ones(1, bool))
    count = times.size - 1
    length = part_length(count) if told else count
    index = np.arange(-(-count // length) * length).reshape(-1, length)
    real, at = index < count, np.minimum(index, count - 1)
    xs = (times[:-1][at], times[1:][at], due[1:][at], jnp.asarray(real))
    _, (states, counts) = jax.lax.scan(part, y0, (xs, jnp.asarray(sampled[1:][at] & real)))
    states = states.reshape(-1, y0.size)[:count]
    return jnp.concatenate([y0[None], states])[:: ticking.refine], jnp.sum(counts)
