"""Slopes of six numbers at each node by six at each: (6, 6, nodes, nodes), [by which, of which, ...] as
matrices stand; and of six of each by six of its own, (6, 6, nodes)."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.picked import picked, placed_columns

Between = Float[Array, "6 6 m m"]
Local = Float[Array, "6 6 m"]


def between(X: Float[Array, "n n"], nodes: int) -> Between:
    """Of a matrix with coordinates first, of the first so many nodes."""
    n = X.shape[0] // 6
    return X.reshape(6, n, 6, n)[:, :nodes, :, :nodes].transpose(0, 2, 1, 3)


def by_itself(own: Local) -> Between:
    return own[..., None] * np.eye(own.shape[-1])


def on_rows(own: Local, X: Between) -> Between:
    """`own @ X`. (Sums of products: a library's would split the loop around it into many kernels.)"""
    parts = [own[:, i, None, :, None] * X[None, i] for i in range(6)]
    return sum(parts[1:], parts[0])


def placed_between(
    own: Float[Array, "i j members"],
    rows: tuple[int, ...],
    columns: tuple[int, ...],
    nodes: int,
) -> Float[Array, "i j m m"]:
    """Zeros, and each member's slopes added at the nodes of its rows and columns; those beyond `nodes` are
    left out."""
    inside = [k for k, pair in enumerate(zip(rows, columns)) if max(pair) < nodes]
    at = [rows[k] * nodes + columns[k] for k in inside]
    own = picked(own, inside)
    return placed_columns(own, at, nodes * nodes).reshape(*own.shape[:-1], nodes, nodes)


def free_of(X: Between, free: tuple[int, ...]) -> Float[Array, "f f"]:
    """Of the free coordinates, by flat positions `c nodes + node`."""
    m = X.shape[-1]
    flat = X.transpose(0, 2, 1, 3).reshape(6 * m, 6 * m)
    if len(free) == 6 * m:
        return flat
    return picked(picked(flat, free).T, free).T


def spread_between(X: Float[Array, "k k"], at: tuple[int, ...], nodes: int) -> Between:
    """Of a matrix node by node, of the nodes `at` among so many."""
    k = len(at)
    rows = np.array(at)
    X = X.reshape(k, 6, k, 6).transpose(1, 3, 0, 2)
    return jnp.zeros((6, 6, nodes, nodes)).at[:, :, rows[:, None], rows].set(X)
