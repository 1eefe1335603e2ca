"""Newton's step of a large machine, of which laws touch few coordinates: all others are eliminated order by
order.

The Jacobian by the touched coordinates is that of each instant. By all others it is the mean over a few
instants, constant (it varies with the tilts alone), so that orders do not mix. What is left of the balance is
exact, and so is the motion; only the steps towards it are a little other ones. With A0 the part in which
orders do not mix, one block an order, and D E' what touched columns E add to it, `(A0 + D E')^-1 = A0^-1 -
A0^-1 D (1 + E' A0^-1 D)^-1 E' A0^-1` (Woodbury): as in harmonic balance condensed to the nonlinear
coordinates (Krack & Gross, Harmonic Balance for Nonlinear Vibration Problems, 2019).
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..machine.field import n_free
from ..machine.system import System
from .balance import beside, states_of
from .bordered import scaled_solution
from .picked_slopes import columns_of, in_place, picked_slopes
from .waves import Waves

# Instants over which columns that no law touches are averaged.
_MEAN = 4

Solve = Callable[[Array, Array, Array], Array]


def eliminated(
    system: System,
    coefficients: Float[Array, "w m"],
    speed: Array,
    waves: Waves,
    touched: tuple[int, ...],
) -> tuple[Float[Array, " s"], Solve]:
    """What is left of the balance, row after row, and what solves for a step: of a spring that holds the mean
    coordinates, the plane's normal (s + 1,) and right sides (s + 1, r)."""
    n, m, N = n_free(system), coefficients.shape[1], waves.samples
    basis, D = waves.at(waves.angles), waves.derivative
    rated = basis @ D
    mine, rest = columns_of(n, m, touched)
    y = states_of(coefficients, speed, n, basis, waves)
    d = y.shape[1]
    grown = jnp.zeros_like(y).at[:, n : 2 * n].set(rated @ coefficients[:, :n])
    few = (np.arange(_MEAN) * N) // _MEAN
    instants = np.concatenate([np.tile(np.arange(N), 1 + mine.size), np.repeat(few, rest.size)])
    columns = np.concatenate([np.full(N, d), np.repeat(mine, N), np.tile(rest, _MEAN)])
    values, found = picked_slopes(
        system, (jnp.asarray(waves.angles), y, speed), (instants, columns), grown, N
    )
    given, found = values[:N, n:], found[:, n:]
    of_speed, own = found[:N], found[N : N * (1 + mine.size)].reshape(mine.size, N, m)
    others = jnp.mean(found[N * (1 + mine.size) :].reshape(_MEAN, rest.size, m), axis=0)
    mean = jnp.mean(own, axis=1)
    J = in_place((mean.T, others.T), (mine, rest))

    u, z = D @ D @ coefficients[:, :n], D @ coefficients[:, n:]
    left = beside(speed**2 * u, speed * z) - waves.from_samples @ given
    by_speed = beside(2 * speed * u, z) - waves.from_samples @ of_speed

    # order by order, and what mixes them
    turning = 1j * speed * waves.orders[:, None]
    inertia = jnp.concatenate(
        [turning**2 * np.ones(n), turning * np.ones(m - n)], axis=1
    )  # (K + 1, m)
    blocks = -(J[:, :n] + turning[..., None] * J[:, n : 2 * n])
    if m > n:
        states = jnp.broadcast_to(-J[:, 2 * n :] + 0j, (len(waves.orders), m, m - n))
        blocks = jnp.concatenate([blocks, states], axis=-1)
    blocks = blocks + inertia[..., None] * np.eye(m)
    own = (own - mean[:, None]).transpose(1, 2, 0)  # (N, m, columns)
    t_u = sum(i < n for i in touched)
    mixed = _mixed(own[..., :t_u], basis, waves) + speed * _mixed(
        own[..., t_u : 2 * t_u], rated, waves
    )
    if len(touched) > t_u:
        mixed = jnp.concatenate([mixed, _mixed(own[..., 2 * t_u :], basis, waves)], axis=-1)
    width = waves.count * len(touched)
    mixed = -mixed.reshape(len(waves.orders), m, width)
    places = (np.arange(waves.count)[:, None] * m + np.array(touched, int)).ravel()

    def solve(held: Array, plane: Array, right: Array) -> Array:
        held_blocks = blocks.at[0, np.arange(n), np.arange(n)].add(held)
        sides = jnp.concatenate([by_speed.ravel()[:, None], right[:-1]], axis=1)
        sides = _by_order(sides.reshape(waves.count, m, -1))
        both = jnp.concatenate([mixed, sides], axis=-1)
        # one after the other: batched calls of LAPACK side by side can deadlock (docs/solving.md)
        solved = jax.lax.map(lambda x: scaled_solution(*x), (held_blocks, both))
        solved = _by_row(solved).reshape(waves.count * m, -1)
        change, speeding, alone = solved[:, :width], solved[:, width], solved[:, width + 1 :]
        matrix = jnp.eye(width + 1).at[:width, :width].add(change[places])
        matrix = matrix.at[:width, -1].set(speeding[places])
        matrix = matrix.at[-1].set(
            jnp.append(-plane[:-1] @ change, plane[-1] - plane[:-1] @ speeding)
        )
        reduced = jnp.concatenate([alone[places], right[-1:] - plane[:-1] @ alone])
        found = scaled_solution(matrix, reduced)
        x = alone - change @ found[:-1] - speeding[:, None] * found[-1]
        return jnp.concatenate([x, found[-1:]])

    return left.ravel(), solve


def _mixed(slopes: Float[Array, "N m t"], wave: np.ndarray, waves: Waves) -> Any:
    """(K + 1, m, w, t): orders of the forces that each wave of touched coordinates makes."""
    N, m, t = slopes.shape
    into = _by_order(waves.from_samples)
    both = (into[:, None, :] * wave.T[None]).reshape(-1, N)
    flat = slopes.reshape(N, m * t)
    found = jax.lax.complex(both.real @ flat, both.imag @ flat)
    return found.reshape(len(waves.orders), waves.count, m, t).transpose(0, 2, 1, 3)


def _by_order(rows: Any) -> Complex[Any, "k ..."]:
    """Of mean, cosines and sines: complex amplitudes."""
    xp: Any = np if isinstance(rows, np.ndarray) else jnp
    return xp.concatenate([rows[:1] + 0j, rows[1::2] - 1j * rows[2::2]])


def _by_row(orders: Complex[Array, "k ..."]) -> Float[Array, "w ..."]:
    waved = jnp.stack([orders[1:].real, -orders[1:].imag], axis=1)
    return jnp.concatenate([orders[:1].real, waved.reshape(-1, *orders.shape[1:])])
