"""A linearly implicit method for stiff forces: one Jacobian and one inverse a step, no Newton iteration."""

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.elimination import inverse
from . import rodas5p as tableau

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
        h, n = jnp.asarray(t1 - t0), len(args.layout.free)
        d = y0.shape[0]
        slopes = _slopes(terms, t0, y0, args, n)
        # The elimination is not differentiated: what derivatives a stage has are those of its equation.
        known = jax.lax.stop_gradient((slopes, tableau.GAMMA * h))
        solve = _StageEquation(*known)

        # a loop, for the field's program stands in it once
        def stage(increments, row):
            own, A, C, time, share = row
            at = jnp.where(time == 1, t1, t0 + time * h)  # the sum may round onto a jump behind t1
            value: Any = terms.vf(at, y0 + A @ increments, args)
            right = slopes.times_mass(value + C @ increments / h)
            right = jnp.concatenate([(share * h)[None], right])

            def left(x):
                k = x[1:]
                pull = slopes.times_mass(k / (tableau.GAMMA * h)) - slopes.along(k)
                return jnp.concatenate([x[:1], pull - x[0] * slopes.by_time])

            found = jax.lax.custom_linear_solve(left, right, solve, solve.transposed)
            return increments + own[:, None] * found[1:], None  # a scatter would split the kernel

        rows = (np.eye(8), tableau.A, tableau.C, tableau.TIMES, tableau.DT)
        increments, _ = jax.lax.scan(stage, jnp.zeros((8, d)), rows)
        y1 = y0 + tableau.A[7] @ increments + increments[7]
        # row by row: a product of two matrices would be a library's, and split the kernel
        bend = jnp.stack([row @ increments for row in tableau.DENSE])
        dense = dict(y0=y0, y1=y1, bend=bend)
        return y1, increments[7], dense, None, diffrax.RESULTS.successful


# Of a field at (t, y): E, B and c, as of `SlopedField`.
Slopes = Callable[[Array, Array], tuple[Array, Array, Array]]


class SlopedField(eqx.Module):
    """A vector field whose slopes are known by less than a tangent for each state. `slopes(t, y)` gives E, B
    and c: as time and state change by t' and y', the rates k below the coordinates', for whose rows are
    `u' = s`, change by k' of `E k' = B y' + c t'`."""

    field: Callable[..., Any]
    slopes: Slopes

    def __call__(self, t: Any, y: Any, args: Any) -> Any:
        return self.field(t, y, args)


class _Slopes(NamedTuple):
    """Of the field: `mass` (none: one) times it changes as `[s, below (u, s, z)]` with the state and as
    `by_time` with the time."""

    below: Float[Array, "r d"]
    mass: Float[Array, "r r"] | None
    by_time: Vector

    @property
    def coordinates(self) -> int:
        return self.below.shape[1] - self.below.shape[0]

    def times_mass(self, x: Vector) -> Vector:
        if self.mass is None:
            return x
        n = self.coordinates
        return jnp.concatenate([x[:n], self.mass @ x[n:]])

    def along(self, x: Vector) -> Vector:
        n = self.coordinates
        return jnp.concatenate([x[n : 2 * n], self.below @ x])


def _slopes(terms: Terms, t: Any, y: Vector, args: Any, n: int) -> _Slopes:
    known = terms.vector_field if isinstance(terms, diffrax.ODETerm) else None
    if isinstance(known, SlopedField):
        mass, below, by_time = known.slopes(t, y)
        return _Slopes(below, mass, jnp.concatenate([jnp.zeros(n), by_time]))

    def field(ty: Array) -> Array:
        return terms.vf(ty[0], ty[1:], args)  # pyright: ignore[reportReturnType]

    _, tangent = jax.linearize(field, jnp.concatenate([jnp.asarray(t)[None], y]))
    # One tangent after another: side by side their products would be a library's, and several times
    # slower at the size of a machine.
    by_each = jax.lax.map(tangent, jnp.eye(y.size + 1))
    return _Slopes(by_each[1:, n:].T, None, by_each[0])


class _StageEquation:
    """Solves `mass k/g - J k - s by_time = b` for k, where s is known: for `(s, k)`, given `(s, b)`.

    The first n rows of J say `u' = s`, s the next n entries: what is inverted is of the size of the rates
    and internal states alone.
    """

    def __init__(self, slopes: _Slopes, g: Array):
        self.n, self.g, self.by_time = slopes.coordinates, g, slopes.by_time
        n = self.n
        self.stiff, rest = slopes.below[:, :n], slopes.below[:, n:]
        size = rest.shape[1]
        padded = jnp.pad(self.stiff, ((0, 0), (0, size - n)))
        mass = jnp.eye(size) if slopes.mass is None else slopes.mass
        self.inverse = inverse(mass / self.g - rest - self.g * padded)

    def __call__(self, _, right: Array) -> Array:
        n, g = self.n, self.g
        b = right[1:] + right[0] * self.by_time
        first = b[:n]
        others = self.inverse @ (b[n:] + g * (self.stiff @ first))
        return jnp.concatenate([right[:1], g * (first + others[:n]), others])

    def transposed(self, _, right: Array) -> Array:
        n, g = self.n, self.g
        first, others = right[1 : n + 1], right[n + 1 :]
        others = (others + g * jnp.pad(first, (0, others.size - n))) @ self.inverse
        first = g * (first + others @ self.stiff)
        b = jnp.concatenate([first, others])
        return jnp.concatenate([right[:1] + b @ self.by_time, b])
