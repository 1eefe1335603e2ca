"""A linearly implicit method for stiff forces: one Jacobian and one inverse a step, no Newton iteration."""

from collections.abc import Callable
from typing import Any, ClassVar

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from . import rodas5p as tableau
from .elimination import solver_of

Scalar = Float[Array, ""]
Vector = Float[Array, " d"]
Terms = diffrax.AbstractTerm[Any, Any]


class _Dense(diffrax.AbstractLocalInterpolation):
    """The state within a step, of order four."""

    t0: Any
    t1: Any
    y0: Vector
    y1: Vector
    bend: Float[Array, "3 d"]

    def evaluate(self, t0, t1=None, left: bool = True):
        if t1 is not None:
            return self.evaluate(t1) - self.evaluate(t0)
        length = self.t1 - self.t0
        s = (t0 - self.t0) / jnp.where(length == 0, 1.0, length)
        h = self.bend
        return (1 - s) * self.y0 + s * (self.y1 + (1 - s) * (h[0] + s * (h[1] + s * h[2])))


class Rosenbrock(diffrax.AbstractAdaptiveSolver[None]):
    """Rodas5P (Steinebach 2023): fifth order, L-stable, for machines whose forces stiffen with the state:
    contact, fluid films, backlash.

    Each step takes the exact Jacobian of the vector field once, eight evaluations, and one inverse of the
    size of the rates and internal states alone: coordinates are eliminated by `u' = s`. No iteration can
    fail to converge. `y(s)` within a step is of order four. Made for `jr.simulate(...,
    solver=jr.Rosenbrock())`, where `rtol` and `atol` choose the step, or `step` fixes it; its vector field
    is a machine's.
    """

    term_structure: ClassVar[type[Terms]] = diffrax.AbstractTerm
    interpolation_cls: ClassVar[Callable[..., _Dense]] = _Dense

    def order(self, terms: Terms) -> int:
        return 5

    def init(
        self,
        terms: Terms,
        t0: Scalar,
        t1: Scalar,
        y0: Vector,
        args: Any,
    ) -> None:
        return None

    def at_rest(self, y: Vector) -> dict[str, Array]:
        """What the state within a step is told by, of a step that goes nowhere."""
        return dict(y0=y, y1=y, bend=jnp.zeros((3, y.shape[0])))

    def func(
        self,
        terms: Terms,
        t0: Scalar,
        y0: Vector,
        args: Any,
    ) -> Any:
        return terms.vf(t0, y0, args)

    def step(
        self,
        terms: Terms,
        t0: Scalar,
        t1: Scalar,
        y0: Vector,
        args: Any,
        solver_state: None,
        made_jump: Any,
    ) -> tuple[Array, Array, dict[str, Any], None, diffrax.RESULTS]:
        h = jnp.asarray(t1 - t0)
        n = len(args.layout.free)
        d = y0.shape[0]

        def field(ty: Array) -> Array:
            return terms.vf(ty[0], ty[1:], args)  # pyright: ignore[reportReturnType]

        # One tangent after another: side by side their products would be a library's, and several times
        # slower at the size of a machine.
        first, tangent = jax.linearize(field, jnp.concatenate([jnp.asarray(t0)[None], y0]))
        slopes = jax.lax.map(tangent, jnp.eye(d + 1))
        by_time, J = slopes[0], slopes[1:].T
        solve = _eliminated(J, h, n)

        # a loop, for the field's program stands in it once
        def stage(increments, row):
            own, A, C, time, share = row
            at = jnp.where(time == 1, t1, t0 + time * h)  # the sum may round onto a jump behind t1
            value: Any = terms.vf(at, y0 + A @ increments, args)
            found = solve(value + C @ increments / h + share * h * by_time)
            return increments + own[:, None] * found, None  # a scatter would split the kernel

        began = solve(first + tableau.DT[0] * h * by_time)
        increments = jnp.concatenate([began[None], jnp.zeros((7, d))])
        rows = (np.eye(8), tableau.A, tableau.C, tableau.TIMES, tableau.DT)
        increments, _ = jax.lax.scan(stage, increments, jax.tree.map(lambda x: x[1:], rows))
        y1 = y0 + tableau.A[7] @ increments + increments[7]
        # row by row: a product of two matrices would be a library's, and split the kernel
        bend = jnp.stack([row @ increments for row in tableau.DENSE])
        dense = dict(y0=y0, y1=y1, bend=bend)
        return y1, increments[7], dense, None, diffrax.RESULTS.successful


def _eliminated(J: Float[Array, "d d"], h: Array, n: int) -> Callable[[Array], Array]:
    """`(1/(gamma h) - J)^-1`, where the first n rows of J say `u' = s`, s the next n entries."""
    g = tableau.GAMMA * h
    lower = J[n:]
    stiff, rest = lower[:, :n], lower[:, n:]
    size = rest.shape[1]
    matrix = jnp.eye(size) / g - rest - g * jnp.pad(stiff, ((0, 0), (0, size - n)))
    rates = solver_of(matrix)

    def solve(right):
        first, others = right[:n], right[n:]
        others = rates(others + g * (stiff @ first))
        return jnp.concatenate([g * (first + others[:n]), others])

    return solve
