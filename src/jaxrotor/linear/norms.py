"""How large a transfer function is: its H2 norm, its highest peaks, its H-infinity norm."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from ..machine.machine import Machine
from .matrix_equations import lyapunov, stable
from .transfer import Peaks, Transfer, highest, level, met, transfer


@takes(speed=number("rad/s"))
def h2_norm(
    machine: Machine,
    input: str,
    output: str,
    speed: Any = 0.0,
    at: Any = "equilibrium",
    torsion: bool = False,
) -> Float[Array, ""]:
    """H2 norm of the transfer function from the force (N) or moment (N·m) `input`, `"disc.phi"`, to
    `output`, both as for `frequency_response`: the RMS output under white noise of unit two-sided spectral
    density per Hz, and the L2 norm of the impulse response. sqrt(c P c') with A P + P A' + b b' = 0; its
    square is also the integral of |G|² over all angular frequencies by 2 pi.

    Every motion that meets `input` and `output` must die out (a free spin does not): else `InputError`, and
    infinity under `jit`. `torsion`: the twisting alone counts, all other coordinates held. Exact derivatives
    in both modes (but of a motion that is now left out, none by what would let it take part: a viscous
    damper's `stiffness` at 0).
    """
    G = met(transfer(machine, input, output, speed, at, torsion))
    dies = stable(G.A)
    _refuse_unstable(dies, input, output, "H2")
    return _h2(G, dies)


@eqx.filter_jit
def _h2(G: Transfer, dies: Array) -> Array:
    A, b, c = G
    # where the norm is infinite, derivatives must still be numbers
    A = jnp.where(dies, A, -jnp.eye(A.shape[0]))
    square = c @ lyapunov(A, jnp.outer(b, b)) @ c
    met = square > 0
    return jnp.where(dies, jnp.where(met, jnp.sqrt(jnp.where(met, square, 1.0)), 0.0), jnp.inf)


@takes(
    start=number("rad/s"),
    stop=number("rad/s"),
    count=whole(1),
    points=whole(2),
    speed=number("rad/s"),
)
def response_peaks(
    machine: Machine,
    input: str,
    output: str,
    start: float,
    stop: float,
    count: int = 2,
    points: int = 201,
    speed: Any = 0.0,
    at: Any = "equilibrium",
    torsion: bool = False,
) -> Peaks:
    """The `count` highest peaks of |output per input| between `start` and `stop` (rad/s), by rising
    frequency; where there are fewer, the highest is told again. `input`, `output`: as for
    `frequency_response`; `torsion`: as for `h2_norm`.

    A scan of `points` frequencies, and some more beside the least damped eigenvalues, finds them, and a
    Newton step ends the search for each. Derivatives are exact in both modes, of the magnitudes those at the
    peaks (stationary there). In order of frequency, not of height, they stay smooth where two peaks are
    equally high: a minimax design constrains each. Raises `InputError` where there is no peak (NaN under
    `jit`).
    """
    if count < 1 or points < 5:
        raise InputError(
            f"count must be 1 and points 5 at least, but they are {count} and {points}: take more"
        )
    if not 0 <= start < stop:
        raise InputError(
            f"start and stop must be rising and not negative, but are {start:g} and {stop:g} rad/s"
        )
    G = transfer(machine, input, output, speed, at, torsion)
    peaks = highest(G, jnp.linspace(start, stop, points), count)
    first = known(peaks.magnitudes)
    if first is not None and not np.isfinite(first).all():
        raise InputError(
            f"`{output}` by `{input}` has no peak between {start:g} and {stop:g} rad/s: ask for another range"
        )
    return peaks


@takes(speed=number("rad/s"), points=whole(2))
def h_infinity_norm(
    machine: Machine,
    input: str,
    output: str,
    points: int = 401,
    speed: Any = 0.0,
    at: Any = "equilibrium",
    torsion: bool = False,
) -> Float[Array, ""]:
    """The largest |output per input| over all frequencies: at a peak or at rest. Arguments and refusals as
    for `h2_norm`; the scan for peaks covers `points` frequencies from far below the slowest to far above the
    quickest eigenvalue. Where two peaks are equally high its derivative is the mean of theirs: use
    `response_peaks` there. Raises `InputError` where the norm is infinite, as `h2_norm` does.
    """
    G = met(transfer(machine, input, output, speed, at, torsion))
    dies = stable(G.A)
    _refuse_unstable(dies, input, output, "H-infinity")
    return _h_infinity(G, dies, points)


@eqx.filter_jit
def _h_infinity(G: Transfer, dies: Array, points: int) -> Array:
    A, b, c = G
    G = Transfer(jnp.where(dies, A, -jnp.eye(A.shape[0])), b, c)
    size = jnp.abs(jnp.linalg.eigvals(jax.lax.stop_gradient(G.A)))
    grid = jnp.geomspace(0.01 * jnp.min(size), 10.0 * jnp.max(size), points)
    rest = jnp.exp(level(G, jnp.zeros(())))
    peaks = highest(G, grid, 2).magnitudes
    largest = jnp.max(jnp.append(jnp.where(jnp.isnan(peaks), 0.0, peaks), rest))
    return jnp.where(dies, largest, jnp.inf)


def _refuse_unstable(dies: Array, input: str, output: str, norm: str) -> None:
    numbers = known(dies)
    if numbers is not None and not numbers:
        raise InputError(
            f"`{output}` by `{input}`: the {norm} norm is infinite, for a motion of this machine does not "
            "die out: damp it, hold it with `fixed`, or take torsion=True where it is none of twisting"
        )
