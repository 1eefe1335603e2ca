"""Any solver of diffrax, its step adapted, through given samples and known jumps."""

from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..machine.machine import Machine
from ..machine.system import System
from ..protocol import NonSmooth
from .controller import adapting
from .grid import Ticking
from .progress import hand_over, handing
from .rosenbrock import Rosenbrock

_MOST_STEPS = 2**22


def is_smooth(machine: Machine) -> bool:
    """Whether no part of it, nor a law inside one, kinks, sticks or stiffens with its state."""
    parts = jax.tree.leaves(machine, is_leaf=lambda x: isinstance(x, NonSmooth))
    return not any(isinstance(part, NonSmooth) for part in parts)


def solver_for(machine: Machine, solver: Any) -> Any:
    """`solver`; where none is given, the one for stiff forces if the machine has such, else none."""
    return Rosenbrock() if solver is None and not is_smooth(machine) else solver


def tolerances(system: System, rtol: Any, atol: Any, extra: int = 0) -> tuple[Array, Array]:
    """Relative and absolute tolerance of each entry of the state; `extra` more entries follow it.

    The angle of a line that no drive leads grows for ever, so a share of it means nothing: `rtol` counts
    in rad there.
    """
    free = np.array(system.layout.free, int)
    n, states = free.size, system.n_states() + extra
    led = system.ground or any(
        m >= 0 for g in system.layout.stations for row in g.motions for m in row
    )
    angle = np.zeros(n) if led else (free // system.layout.n_mass == 5).astype(float)
    relative = jnp.concatenate([rtol * (1 - angle), jnp.full(n + states, rtol)])
    return relative, jnp.concatenate([atol + rtol * angle, jnp.full(n + states, atol)])


def adaptive_samples(
    solver: diffrax.AbstractSolver,
    terms: diffrax.AbstractTerm,
    samples: Float[Array, " nt"],
    jumps: Float[Array, " j"],
    y0: Float[Array, " d"],
    args: Any,
    rtol: Any,
    atol: Any,
    step: Any = None,
    adjoint: diffrax.AbstractAdjoint | None = None,
    told: bool = False,
    ticking: Ticking | None = None,
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
        saved = dict(fn=handing) if told else {}
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
