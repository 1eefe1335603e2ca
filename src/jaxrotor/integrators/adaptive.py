"""Any solver of diffrax, its step adapted, through given samples and known jumps."""

from typing import Any, Protocol

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .controller import adapting
from .progress import hand_over, handing

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
) -> tuple[Float[Array, "nt d"], Array]:
    """States at the samples, NaN from where the solver gave up, and the number of steps. `step`: a
    fixed length (s) in place of the tolerances. `told`: the samples are handed over while they come."""
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
    options: dict[str, Any] = {} if adjoint is None else dict(adjoint=adjoint)
    # a function of its own within the program: solver and adjoint go through their loops many times
    field = jax.jit(terms.vf)
    terms = diffrax.ODETerm(lambda t, y, args: field(t, y, args))  # pyright: ignore

    def solve(start, end, y, saveat):
        return diffrax.diffeqsolve(
            terms,
            solver,
            start,
            end,
            step,
            y,
            args,
            saveat=saveat,
            stepsize_controller=controller,
            max_steps=_MOST_STEPS,
            throw=False,
            **options,
        )

    if ticking is None:
        saved: dict[str, Any] = dict(fn=handing) if told else {}
        solution = solve(samples[0], samples[-1], y0, diffrax.SaveAt(ts=samples, **saved))
        states, steps = solution.ys, solution.stats["num_steps"]
    else:  # afresh from one instant of the grid to the next
        times, due = ticking.fine(samples), jnp.asarray(ticking.due)

        sampled = np.arange(times.size) % ticking.refine == 0

        def interval(y, x):
            start, end, now, sample = x
            solution = solve(start, end, y, diffrax.SaveAt(t1=True))
            y = ticking.tick(end, solution.ys[0], now)  # pyright: ignore
            if told:
                hand_over(end, y[None], sample[None])
            return y, (y, solution.stats["num_steps"])

        y0 = ticking.tick(samples[0], y0, due[0])
        if told:
            hand_over(times[0], y0[None], jnp.ones(1, bool))
        xs = (times[:-1], times[1:], due[1:], jnp.asarray(sampled[1:]))
        _, (states, counts) = jax.lax.scan(interval, y0, xs)
        states = jnp.concatenate([y0[None], states])[:: ticking.refine]
        steps = jnp.sum(counts)
    return jnp.where(jnp.isfinite(states), states, jnp.nan), steps  # pyright: ignore
