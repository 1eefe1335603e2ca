"""Matrices of parts that do not mix: what bends, what twists and what is axial of most lines."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .picked import picked

Places = tuple[tuple[int, ...], ...]


class BlockMatrix(eqx.Module):
    """`blocks` of `rows` and `columns` of a matrix that has nothing elsewhere. Every row is in one block."""

    blocks: tuple[Array, ...]
    rows: Places = eqx.field(static=True)
    columns: Places = eqx.field(static=True)

    def __matmul__(self, x: Float[Array, " n"]) -> Float[Array, " m"]:
        found = [block @ picked(x, own) for block, own in zip(self.blocks, self.columns)]
        return picked(jnp.concatenate(found), np.argsort(np.concatenate(self.rows)))

    @property
    def dense(self) -> Float[Array, "m n"]:
        shape = tuple(sum(len(own) for own in places) for places in (self.rows, self.columns))
        whole = jnp.zeros(shape)
        for block, rows, columns in zip(self.blocks, self.rows, self.columns):
            whole = whole.at[np.ix_(rows, columns)].set(block)
        return whole


def independent(matrices: Float[np.ndarray, "a d d"], least: int) -> Places:
    """The parts that none of the matrices mixes, each in order; those of fewer rows than `least` are one."""
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(np.any(matrices != 0.0, axis=0), directed=False)
    few = np.bincount(label, minlength=count) < least
    label = np.where(few[label], count, label)
    return tuple(tuple(np.flatnonzero(label == own).tolist()) for own in np.unique(label))


def sub_block(matrix: Any, rows: Sequence[int], columns: Sequence[int]) -> Any:
    """`matrix[..., rows, columns]` of each row and each column."""
    if isinstance(matrix, np.ndarray):
        return matrix[..., np.asarray(rows, int)[:, None], np.asarray(columns, int)]
    return jnp.swapaxes(picked(jnp.swapaxes(picked(matrix, columns), -1, -2), rows), -1, -2)
