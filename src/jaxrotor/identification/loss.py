"""How much a residual counts: squares, or losses that let no spike decide.

Each loss rho(r), of residuals in standard deviations, is searched as the squares of
sign(r) sqrt(2 rho(r)), which is r for small ones, so that all searches of squares serve it. The covariance of
what is found is that of an M-estimator: A^-1 B A^-1 of the mean slope and the mean square of psi = rho',
channel by channel, for one may hold spikes and another none.

Sources: Huber & Ronchetti, Robust Statistics (2009), sec. 4.5, 6.3, 7.3 and 7.6; Lange, Little & Taylor,
Journal of the American Statistical Association 84 (1989) 881 (Student's t with four degrees).
"""

from typing import Any, Literal, get_args

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..core.errors import InputError

Loss = Literal["squares", "huber", "student"]
LOSSES: tuple[str, ...] = get_args(Loss)

# Of white normal noise each uses 95 % (Huber) and 92 % (Student) of what squares would.
_HUBER = 1.345
_DEGREES = 4.0
# So many standard deviations of normal noise is the median of its size.
_MEDIAN = 0.674489750196082


def loss_number(name: Any) -> Int[Array, ""]:
    """Which of `LOSSES`: a leaf, so that another one compiles nothing. Raises `InputError`."""
    if name not in LOSSES:
        raise InputError(f"loss must be one of {', '.join(LOSSES)}, but is {name!r}")
    return jnp.asarray(LOSSES.index(name), jnp.int32)


def _squares(r: Array) -> tuple[Array, Array]:
    return r, jnp.ones_like(r)


def _huber(r: Array) -> tuple[Array, Array]:
    size = jnp.abs(r)
    far = size > _HUBER
    root = jnp.sqrt(2 * _HUBER * jnp.where(far, size, _HUBER) - _HUBER**2)
    return jnp.where(far, jnp.sign(r) * root, r), jnp.where(far, _HUBER / root, 1.0)


def _student(r: Array) -> tuple[Array, Array]:
    square = r**2 / _DEGREES
    near = square < 1e-8  # where the quotients below are 0/0, and to rounding the same as squares
    some = jnp.where(near, 1.0, square)
    ratio = jnp.where(near, 1.0, jnp.sqrt(jnp.log1p(some) / some))
    return r * ratio, jnp.where(near, 1.0, 1 / ((1 + some) * ratio))


def shaped(
    loss: Int[Array, ""], r: Float[Array, " m"]
) -> tuple[Float[Array, " m"], Float[Array, " m"]]:
    """What is squared in place of residuals `r`, and its slope by each."""
    return jax.lax.switch(loss, (_squares, _huber, _student), r)


def slope_and_square(loss: str, r: np.ndarray, lost: float) -> tuple[float, float]:
    """The mean slope and the mean square of psi over the residuals of one channel; `lost`: degrees of freedom
    that the parameters took from it."""
    if loss == "huber":
        psi, slope = np.clip(r, -_HUBER, _HUBER), (np.abs(r) < _HUBER).astype(float)
    else:
        heavy = 1 + r**2 / _DEGREES
        psi, slope = r / heavy, (1 - r**2 / _DEGREES) / heavy**2
    return max(float(slope.mean()), 1e-3), float(psi @ psi) / max(1.0, len(r) - lost)


def robust_size(r: np.ndarray) -> float:
    """The standard deviation of the most of `r`, by the median of their size."""
    return float(np.median(np.abs(r))) / _MEDIAN
