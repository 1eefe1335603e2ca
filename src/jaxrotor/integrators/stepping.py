"""Adaptive steps of a one-step method through samples: a loop that XLA makes one kernel of.

`diffrax.diffeqsolve` does the same with any solver. It writes each sample by a scatter, which keeps its
loop from being one kernel (four times the time of a small machine), and knows no blocks of samples to hand
over. Its controllers serve here too.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from .progress import part_length
from .replay import replayed_while_loop
from .tangents import tangents_in_turn

# Samples that the loop fills at a time. Members of a batch wait for one another at the end of each block;
# each step looks at all samples of its block.
_BLOCK = 8


class Place(NamedTuple):
    """Where a march is. The next step is tried from `t` to `ahead`; `ended`: no step is short enough.
    `steps`: tried so far; `inside`: what the interpolation takes of the last step."""

    t: Float[Array, ""]
    ahead: Float[Array, ""]
    y: Float[Array, " d"]
    control: Any
    ended: Bool[Array, ""]
    steps: Int[Array, ""]
    inside: dict[str, Array]


class Stepping(NamedTuple):
    """`end`: the last instant, which a step lands on. `most`: steps, after which the march is given up.
    `reverse`: whether derivatives are taken in reverse mode, else in forward mode."""

    solver: Any
    terms: Any
    args: Any
    controller: Any
    end: Float[Array, ""]
    most: int
    reverse: bool

    def begin(self, t: Float[Array, ""], y: Float[Array, " d"], step: Any) -> Place:
        """`step`: the first one's length (s), where the controller chooses those that follow."""
        ahead, control = self.controller.init(
            self.terms,
            t,
            self.end,
            y,
            step,
            self.args,
            self.solver.func,
            self.solver.error_order(self.terms),
        )
        still = dict(t0=t, t1=t) | self.solver.at_rest(y)
        none = jnp.zeros((), int)
        control = jax.tree.map(jnp.asarray, control)
        return Place(t, jnp.minimum(ahead, self.end), y, control, none > 0, none, still)

    def attempt(self, at: Place) -> Place:
        """One step, kept or tried again shorter."""
        y, error, inside, _, _ = self.solver.step(
            self.terms, at.t, at.ahead, at.y, self.args, None, False
        )
        error = jnp.where(jnp.isnan(error), jnp.inf, error)
        order = self.solver.error_order(self.terms)
        kept, t, ahead, _, control, outcome = self.controller.adapt_step_size(
            at.t, at.ahead, at.y, y, self.args, error, order, at.control
        )
        t = jnp.minimum(t, self.end)
        # no last step that is too short for the clock
        near = jax.lax.stop_gradient(self.end) * (1 - 100 * 2.0**-52)
        landing = jnp.where(kept, self.end, t + 0.5 * (self.end - t))
        ahead = jnp.where(ahead > near, landing, ahead)
        inside = dict(t0=at.t, t1=at.ahead) | inside
        steps = at.steps + 1
        ended = (outcome != diffrax.RESULTS.successful) | (steps >= self.most)
        y, inside = jax.tree.map(
            lambda new, old: jnp.where(kept, new, old), (y, inside), (at.y, at.inside)
        )
        return Place(t, ahead, y, jax.tree.map(jnp.asarray, control), ended, steps, inside)

    def through(self, at: Place, samples: Float[Array, " m"]) -> tuple[Place, Float[Array, "m d"]]:
        """The states at `samples`, all behind those before; NaN from where the march ended."""

        def states(inside):
            return jax.vmap(self.solver.interpolation_cls(**inside).evaluate)(samples)

        def attempt(at, _):
            return self.attempt(at)

        if not self.reverse:
            attempt = tangents_in_turn(attempt)

        def body(carry):
            at, ys = carry
            now = attempt(at, None)
            # the last step's samples; that of a step which was not kept has had them
            new = (at.t < samples) & (samples <= now.t)
            return now, jnp.where(new[:, None], states(now.inside), ys)

        def going(carry):
            return ~carry[0].ended & (carry[0].t < samples[-1])

        ys = jnp.where((samples <= at.t)[:, None], states(at.inside), jnp.nan)
        loop = replayed_while_loop if self.reverse else jax.lax.while_loop
        return loop(going, body, (at, ys))

    def march(
        self,
        at: Place,
        samples: Float[Array, " n"],
        told: Callable[[Array, Array, Array], None] | None = None,
    ) -> tuple[Place, Float[Array, "n d"]]:
        """`told`: called in the traced loop at the end of each part, with its last instant, its states and
        which of them are samples."""
        n = samples.shape[0]
        block = min(_BLOCK, n)
        blocks = -(-n // block)
        length = blocks if told is None else -(-part_length(n) // block)  # in a part
        parts = -(-blocks // length)
        # beyond the end the last sample is filled again and again
        index = np.arange(parts * length * block).reshape(parts, length, block)

        def part(at, x):
            samples, real = x
            at, ys = jax.lax.scan(self.through, at, samples)
            ys = ys.reshape(-1, ys.shape[-1])
            if told is not None:
                told(samples[-1, -1], ys, real.ravel())
            return at, ys

        xs = (samples[np.minimum(index, n - 1)], jnp.asarray(index < n))
        at, ys = jax.lax.scan(part, at, xs)
        return at, ys.reshape(-1, ys.shape[-1])[:n]
