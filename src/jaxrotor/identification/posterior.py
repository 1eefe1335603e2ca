"""The whole posterior of the parameters, by NUTS: for intervals that are neither straight nor small."""

import dataclasses
import sys
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from tqdm import tqdm

from ..core.arguments import whole
from ..core.errors import InputError, MissingExtraError
from ..core.gate import takes
from ..core.quick import lightly_compiled
from ..search.space import Space
from .identification import Identification
from .problem import Problem, residual_and_slopes
from .simulated import records_and_slopes

# A trajectory has up to two to this many steps; where it starts to adapt its step.
_DOUBLINGS, _STEP = 6, 0.5


@dataclasses.dataclass(frozen=True)
class Posterior:
    """`draws`: path -> (chains, draws), SI, angles within pi of their estimate. `r_hat`: path -> Gelman and
    Rubin's factor, near 1 where the chains agree. `effective`: path -> number of independent draws that these
    are worth. `divergent`: draws at which the sampler lost its way; there should be none."""

    draws: dict[str, Float[np.ndarray, "chains draws"]]
    r_hat: dict[str, float]
    effective: dict[str, float]
    divergent: int
    units: tuple[str, ...]

    @property
    def mean(self) -> dict[str, float]:
        return {path: float(x.mean()) for path, x in self.draws.items()}

    @property
    def std(self) -> dict[str, float]:
        return {path: float(x.std(ddof=1)) for path, x in self.draws.items()}

    def intervals(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """With as many draws below as above. Raises `InputError` where `level` is not between 0 and 1."""
        if not 0 < level < 1:
            raise InputError(f"level must be between 0 and 1, but is {level!r}")
        ends = (0.5 - 0.5 * level, 0.5 + 0.5 * level)
        return {path: tuple(np.quantile(x, ends).tolist()) for path, x in self.draws.items()}

    def __str__(self) -> str:
        width = max(len(path) for path in self.draws)
        lines = [f"{'parameter':{width}}  {'mean':>13}  {'std':>10}  {'r_hat':>6}  95 % interval"]
        for (path, (low, high)), unit in zip(self.intervals().items(), self.units):
            lines.append(
                f"{path:{width}}  {self.mean[path]:13.6g}  {self.std[path]:10.3g}  "
                f"{self.r_hat[path]:6.3f}  {low:.6g} to {high:.6g} {unit}"
            )
        if self.divergent:
            lines.append(
                f"! {self.divergent} draws diverged: take more `warmup`, or other transforms"
            )
        if max(self.r_hat.values()) > 1.05:
            lines.append("! the chains do not agree: take more `warmup` and `draws`")
        return "\n".join(lines)

    __repr__ = __str__


@takes(draws=whole(4), warmup=whole(0), chains=whole(1))
def posterior(
    found: Identification,
    draws: int = 1000,
    *,
    warmup: int = 200,
    chains: int = 4,
    seed: int = 0,
    progress: bool | None = None,
) -> Posterior:
    """Draws from the posterior by BlackJAX's No-U-Turn sampler, started at what was identified (extra
    `posterior`). Each draw costs some four simulations with their slopes; the chains run in one batch.

    Priors are those of the unknowns. Without one, a positive parameter is even in its logarithm, a bounded
    one between its bounds, an angle and a free one in itself. Where the noise was not given, its size is
    held at what was identified.

    Raises `InputError` where the data cannot see a parameter that has no prior: its posterior has no end;
    `MissingExtraError` where BlackJAX is not installed.

    Source: Hoffman & Gelman, JMLR 15 (2014) 1593.
    """
    try:
        from blackjax.adaptation.step_size import dual_averaging_adaptation
        from blackjax.diagnostics import effective_sample_size, potential_scale_reduction
    except ImportError:
        raise MissingExtraError(
            "the posterior needs BlackJAX: pip install 'jaxrotor[posterior]'"
        ) from None
    for name, value, least in (("draws", draws, 4), ("warmup", warmup, 1), ("chains", chains, 2)):
        if value < least:
            raise InputError(f"{name} must be {least} or more, but is {value}")
    if found.blind:
        raise InputError(
            f"the data cannot see {', '.join(found.blind[0])}: its posterior has no end: hold it, or give it "
            "a prior"
        )
    space = found.space
    target = _Target(
        found.problem,
        jnp.asarray(found.u),
        jnp.asarray(np.linalg.cholesky(found.knowledge.covariance)),
        jnp.asarray(found.knowledge.scale),
    )
    first, key = jax.random.split(jax.random.key(seed))
    states = _begin(target, jax.random.normal(first, (chains, len(space))))
    start, update, final = dual_averaging_adaptation(0.8)
    adapted, step = start(_STEP), jnp.asarray(_STEP, float)
    z, divergent = [], 0
    for i in tqdm(
        range(warmup + draws),
        unit="draw",
        file=sys.stderr,
        leave=False,
        disable=None if progress is None else not progress,
    ):
        key, own = jax.random.split(key)
        states, accepted, lost = _advance(target, own, states, step)
        if i < warmup:
            adapted = update(adapted, accepted)
            step = jnp.exp(adapted.log_step_size) if i < warmup - 1 else final(adapted)
        else:
            z.append(np.asarray(states.position))
            divergent += int(lost)
    values = np.asarray(space.values(target.place(np.stack(z, axis=1)))) + found.turns
    r_hat, effective = (
        dict(zip(space.paths, np.atleast_1d(f(values)).tolist()))
        for f in (potential_scale_reduction, effective_sample_size)
    )
    return Posterior(
        {path: values[..., i] for i, path in enumerate(space.paths)},
        r_hat,
        effective,
        divergent,
        found.units,
    )


@lightly_compiled
def _begin(target: "_Target", z: Float[Array, "chains n"]) -> Any:
    from blackjax.mcmc import nuts

    return _strong(jax.vmap(lambda z: nuts.init(z, target))(z))


@lightly_compiled
def _advance(target: "_Target", key: Array, states: Any, step: Float[Array, ""]):
    """A draw of each chain; their mean acceptance, and how many diverged."""
    from blackjax.mcmc import nuts

    kernel: Any = nuts.build_kernel()
    unit = jnp.ones_like(target.middle)

    def one(key, state):
        return kernel(key, state, target, step, unit, _DOUBLINGS)

    keys = jax.random.split(key, states.logdensity.shape[0])
    states, info = jax.vmap(one)(keys, states)
    return _strong(states), info.acceptance_rate.mean(), info.is_divergent.sum()


def _strong(states: Any) -> Any:
    """Of one type before and after a draw, or the second draw would compile all anew."""
    return jax.tree.map(lambda x: jax.lax.convert_element_type(x, x.dtype), states)


class _Target(eqx.Module):
    """Logarithm of the posterior's density, in coordinates in which it is about a standard normal one."""

    problem: Problem
    middle: Float[Array, " n"]
    root: Float[Array, "n n"]
    scale: Float[Array, ""]

    def place(self, z: Any) -> Float[Array, "*b n"]:
        return self.middle + jnp.asarray(z) @ self.root.T

    def __call__(self, z: Float[Array, " n"]) -> Float[Array, ""]:
        u = self.place(z)
        return _volume(self.problem.space, u) - _cost(u, self.problem) / self.scale**2


@eqx.filter_custom_vjp
def _cost(u: Float[Array, " n"], problem: Problem) -> Float[Array, ""]:
    """Half the sum of squares; its slopes by forward mode, as everywhere in the search."""
    return _cost_and_slope(u, problem)[0]


def _cost_and_slope(u, problem):
    found, slopes = jax.tree.map(lambda x: x[0], records_and_slopes(problem.simulated, u[None]))
    r, J = residual_and_slopes(problem, u, found, slopes)
    cost = 0.5 * jnp.sum(r**2)
    # a run that leaves the finite numbers is infinitely improbable
    fine = jnp.isfinite(cost)
    return jnp.where(fine, cost, jnp.inf), jnp.where(fine, r @ J, 0.0)


@_cost.def_fwd
def _(perturbed, u, problem):
    del perturbed
    return _cost_and_slope(u, problem)


@_cost.def_bwd
def _(slope, cotangent, perturbed, u, problem):
    del perturbed, u, problem
    return cotangent * slope


def _volume(space: Space, u: Float[Array, " n"]) -> Float[Array, ""]:
    """Logarithm of how much parameter there is to a u, for those whose density is told in themselves."""
    even = [i for i, kind in enumerate(space.kinds) if kind == "bounded" or i in space.with_prior]
    slopes = jnp.diagonal(jax.jacfwd(space.values)(u))
    return jnp.sum(jnp.log(jnp.abs(slopes))[np.array(even, int)])
