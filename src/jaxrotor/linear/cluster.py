"""Eigenvalues that come together: what of them stays smooth, and the slowest decay of all."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from ..core.arguments import complex_number, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from ..core.result_text import shows
from .linearise import LinearModel
from .matrix_equations import balance
from .response import as_complex

_NODES = 128  # of the trapezoid rule
_APART = 0.65  # radius of the cluster by the distance of the next eigenvalue: 0.65^(128/2) is 1e-12
_WIDE = 0.4  # of that distance, the circle round a cluster that is a point: not where resolvents are large


@shows(mean="1/s", spread="1/s^2")
class Cluster(NamedTuple):
    """`mean`: of the eigenvalues, 1/s. `spread`: the mean of their squared distances (complex squares, not
    sizes) from it, 1/s²; 0 where they are one. Of two eigenvalues it is their half distance squared."""

    mean: Complex[Array, ""]
    spread: Complex[Array, ""]


@takes(near=complex_number, count=whole(1))
def pole_cluster(model: LinearModel, near: Any, count: int = 2) -> Cluster:
    """Mean and spread of the `count` eigenvalues of a linear model nearest to `near` (complex, 1/s).

    Where eigenvalues coalesce, single ones have no derivatives (they part like a square root) and often no
    full set of eigenvectors; both of these are smooth functions of every parameter all the same, with exact
    derivatives of any order in both modes: power sums by the spectral projector, the integral of the
    resolvent round a circle that holds the cluster and nothing else. Raises `InputError` where the next
    eigenvalue is nearly as near as the cluster's own (NaN under `jit`). A machine's slowest poles coincide
    where its stability is greatest: ask for `spread` 0 there, and for the least `mean`. Sources: Kato,
    Perturbation Theory for Linear Operators (1966), sec. II.2; Trefethen & Weideman, SIAM Review 56 (2014)
    385.
    """
    size = model.A.shape[0]
    if not 1 <= count <= size:
        raise InputError(f"count must be from 1 to {size}, all eigenvalues, but is {count!r}")
    cluster, ratio = _cluster(model.A, jnp.asarray(near, complex), count)
    numbers = known(ratio)
    if numbers is not None and not numbers < _APART:
        raise InputError(
            f"near: the {count} eigenvalues nearest to {near:.6g} 1/s are no cluster apart: the next one is "
            "about as near to them as they are to one another: take another count"
        )
    return cluster


@takes()
def decay_rate(model: LinearModel) -> Float[Array, ""]:
    """Minus the largest real part of all eigenvalues, 1/s: every free motion dies away at least like
    exp(-rate t). A free spin gives 0, instability less.

    Not smooth where another eigenvalue takes over (the derivative is that of one of them), and where the
    slowest ones coalesce its slope grows without bound: use `pole_cluster` there. Raises `InputError`
    where `model` is no `LinearModel`.
    """
    return -model.growth


@eqx.filter_jit
def _cluster(A: Array, near: Array, count: int) -> tuple[Cluster, Float[Array, ""]]:
    d = A.shape[0]
    scale = balance(A)
    A = A * scale[None, :] / scale[:, None]
    values = jnp.linalg.eigvals(jax.lax.stop_gradient(A))
    nearest = values[jnp.argsort(jnp.abs(values - near))]
    centre = jnp.mean(nearest[:count])
    away = jnp.abs(nearest - centre)
    inside = jnp.max(away[:count])
    # all of them: any circle beyond them will do
    outside = jnp.min(away[count:]) if count < d else 4 * inside + jnp.abs(centre) + 1.0
    ratio = inside / outside
    radius = jnp.maximum(jnp.sqrt(inside * outside), _WIDE * outside)

    def moments(turn):
        """Of 1, (z - centre) and its square with the resolvent's trace, at one node of the rule."""
        step = radius * jnp.exp(2j * jnp.pi * turn)
        matrix = (centre + step) * jnp.eye(d) - as_complex(A)
        return step ** jnp.arange(1, 4) * jnp.trace(jnp.linalg.inv(matrix))

    # half a step off the real axis, where eigenvalues are; one after the other (docs/solving.md)
    turns = (jnp.arange(_NODES) + 0.5) / _NODES
    _, first, second = jnp.mean(jax.lax.map(moments, turns), axis=0) / count
    apart = ratio < _APART
    mean = jnp.where(apart, centre + first, jnp.nan)
    spread = jnp.where(apart, second - first**2, jnp.nan)
    return Cluster(mean, spread), ratio
