"""What the weights of a run are mixed from, by programs that many machines have in common."""

import jax
import numpy as np
from jaxtyping import Float

from ..core.block_matrix import sub_block
from ..core.quick import lightly_compiled
from ..integrators.fitted_weights import Moments, Parts, turn_of
from ..integrators.ladder import RUNGS, Chains, chains_of

# Rows, of coordinates or of their rates, of which machines of fewer have weights by the same program.
_SIZES = (24, 48)


@lightly_compiled
def _chains(A, h, speeds, excitation, order: int, exact_rows: int) -> Chains:
    return chains_of(A, h, turn_of(speeds, h, excitation), order, exact_rows)


def known_chains(
    A: Float[np.ndarray, "s d d"],
    h: np.ndarray,
    speeds: np.ndarray,
    excitation: np.ndarray,
    order: int,
    parts: Parts,
) -> tuple[Chains, ...]:
    """As `chains_of`, of steps (s) at speeds and with an excitation (rad/s), however many, and of each part
    of the state: in NumPy's arrays. (The products of matrices that this takes go with the third power of
    their size.)"""
    return tuple(
        _of_part(sub_block(A, rows, rows), h, speeds, excitation, order, len(rows) - len(with_N))
        for rows, with_N in zip(parts.rows, parts.with_N)
    )


def _of_part(
    A: np.ndarray,
    h: np.ndarray,
    speeds: np.ndarray,
    excitation: np.ndarray,
    order: int,
    exact_rows: int,
) -> Chains:
    """By one program that makes as many at a time as a run has rungs. (`device_put`: `jnp.asarray` compiles a
    program for each new shape.) Small machines, and audits of them, have it in common: rows of zeros fill
    them up to a few sizes, of coordinates, and of what has an N."""
    rest = A.shape[1] - exact_rows
    exact, size = _size_for(exact_rows, rest)
    keep = np.concatenate([np.arange(exact_rows), exact + np.arange(rest)])
    filled = np.zeros((len(A), exact + size, exact + size))
    filled[:, keep[:, None], keep] = A
    count = len(h)
    many = np.minimum(np.arange(-(-count // RUNGS) * RUNGS), count - 1)
    found = []
    for at in many.reshape(-1, RUNGS):
        here = jax.device_put((filled[at], h[at], speeds[at], excitation))
        own = _chains(here[0], here[1], here[2], here[3], order, exact)
        found.append(jax.tree.map(np.asarray, own))

    def own_rows(moments: Moments) -> Moments:
        flow, mean = moments.flow, moments.mean
        return Moments(flow[..., keep[:, None], keep], mean[..., keep, :rest])

    whole = jax.tree.map(lambda *x: np.concatenate(x)[:count], *found)
    return Chains(own_rows(whole.regular), own_rows(whole.starting))


def _size_for(exact: int, rest: int) -> tuple[int, int]:
    """Of a program for so many rows, and for others near it."""
    size = next((x for x in _SIZES if x >= max(exact, rest)), None)
    return (exact, rest) if size is None else (size, size)
