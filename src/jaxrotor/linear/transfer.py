"""The transfer function from one force to one output, and where it is highest."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..core.errors import InputError
from ..core.result_text import HERTZ, shows
from ..machine.machine import Machine
from .coordinates import coordinate_order
from .linearise import check_linearized
from .observe import outputs_of
from .peak import stationary
from .response import as_complex, observed, solve
from .torsion import torsional
from .whirling import refuse_whirl_dependent

_SPARE = 2  # peaks refined beyond those asked for: which are the highest is known only then
_SHARP = 32  # eigenvalues, the least damped ones, beside which the scan looks closer
_HALVINGS = 30  # of a step of the scan, beside a peak


@shows(frequencies=HERTZ)
class Peaks(NamedTuple):
    """`frequencies`: rad/s, rising. `magnitudes`: of the output per N or N·m."""

    frequencies: Float[Array, " count"]
    magnitudes: Float[Array, " count"]


class Transfer(NamedTuple):
    """`c (s - A)^-1 b`."""

    A: Float[Array, "d d"]
    b: Float[Array, " d"]
    c: Float[Array, " d"]


def transfer(
    machine: Machine, input: str, output: str, speed: Any, at: Any, torsion: bool
) -> Transfer:
    """`input`, `output`: as for `frequency_response`; `torsion`: all but phi held. Raises `InputError`."""
    if torsion and not input.endswith(".phi"):
        raise InputError(
            f"`{input}`: with torsion=True only moments along phi act: take torsion=False"
        )
    check_linearized(at)
    machine.check()
    refuse_whirl_dependent(machine, "a model with inputs and outputs")
    outputs = outputs_of(machine, coordinate_order(machine)[3], (output,))
    model, C = observed(machine, outputs, speed, at)
    if torsion:
        n = model.M.shape[0]
        phi = np.array([i for i, (_, what) in enumerate(model.coordinates) if what == "phi"], int)
        model = torsional(model)
        C = C[:, np.concatenate([phi, n + phi, np.arange(2 * n, C.shape[1])])]
    return Transfer(model.A, model.B[:, model.row(input)], C[0])


@jax.jit
def met(G: Transfer) -> Transfer:
    """The same transfer function, in which states that the input does not reach, or the output does not see,
    die out by themselves: a viscous damper's angle, the bending of a line that is twisted. They are told by
    exact zeros, and derivatives by what would join them to the others are not counted."""
    A, b, c = G
    links, begin, end = ((x != 0).astype(float) for x in G)

    def spread(links, start):
        return jax.lax.fori_loop(0, start.size, lambda _, x: jnp.sign(x + links @ x), start)

    kept = spread(links, begin) * spread(links.T, end)
    quick = jax.lax.stop_gradient(jnp.sqrt(jnp.max(jnp.abs(A)))) + 1.0
    A = jnp.where(jnp.outer(kept, kept) > 0, A, -quick * jnp.diag(1 - kept))
    return Transfer(A, b * kept, c * kept)


def level(G: Transfer, w: Array) -> Float[Array, ""]:
    """log |G(i w)|."""
    A, b, c = G
    return jnp.log(jnp.abs(jnp.dot(as_complex(c), solve(A, w, b))))


@eqx.filter_jit
def highest(G: Transfer, grid: Float[Array, " points"], count: int) -> Peaks:
    """The `count` highest peaks within a rising grid of frequencies (rad/s); NaN where there is none."""
    still = jax.lax.stop_gradient(G)

    def rising(w):
        return jnp.stack(jax.jvp(lambda w: level(still, w), (w,), (jnp.ones_like(w),)))

    grid = jnp.sort(jnp.append(grid, _beside(jnp.linalg.eigvals(still.A), grid)))
    # one after the other: batched LAPACK calls side by side can deadlock (docs/solving.md)
    levels, slopes = jax.lax.map(rising, grid).T
    found = (slopes[:-1] > 0) & (slopes[1:] <= 0)
    between = jnp.maximum(levels[:-1], levels[1:])
    best = jnp.argsort(jnp.where(found, between, -jnp.inf), descending=True)[: count + _SPARE]

    def refined(i):
        near = _falling_zero(lambda w: rising(w)[1], grid[i], grid[i + 1])
        return stationary(lambda w: level(G, w), near)

    # where there are fewer, at the first one again: elsewhere derivatives may not be numbers
    where, heights = jax.lax.map(refined, jnp.where(found[best], best, best[0]))
    where, heights = (jnp.where(found[best], x, jnp.nan) for x in (where, heights))
    # NaN, no peak, comes last
    first = jnp.argsort(-heights)[:count]
    first = jnp.where(jnp.isnan(heights[first]), first[0], first)
    first = first[jnp.argsort(where[first])]
    return Peaks(where[first], heights[first])


def _beside(values: Complex[Array, " d"], grid: Array) -> Float[Array, " m"]:
    """Frequencies at and beside the resonances within the grid, which it might step over."""
    inside = (values.imag > grid[0]) & (values.imag < grid[-1])
    sharp = jnp.argsort(jnp.where(inside, jnp.abs(values.real), jnp.inf))[:_SHARP]
    width = jnp.array([-3.0, -1.0, 0.0, 1.0, 3.0])
    near = values.imag[sharp][:, None] + width * jnp.abs(values.real[sharp])[:, None]
    return jnp.clip(jnp.where(inside[sharp][:, None], near, grid[0]), grid[0], grid[-1]).ravel()


def _falling_zero(slope, low: Array, high: Array) -> Float[Array, ""]:
    """Where `slope`, positive at `low` and not at `high`, is zero, so nearly that one Newton step does the
    rest."""

    def once(_, ends):
        middle = 0.5 * (ends[0] + ends[1])
        up = slope(middle) > 0
        return jnp.where(up, middle, ends[0]), jnp.where(up, ends[1], middle)

    low, high = jax.lax.fori_loop(0, _HALVINGS, once, (low, high))
    return 0.5 * (low + high)
