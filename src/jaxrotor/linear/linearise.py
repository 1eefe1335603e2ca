"""The machine made linear about a steady state, from its own vector field."""

from collections.abc import Callable
from functools import cached_property
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..core.arguments import number, short
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import require_x64
from ..core.picked import block
from ..core.quick import traced
from ..core.result_text import shows
from ..machine.field import initial_states, n_free, on_nodes, relative_field
from ..machine.lineup import structure_of
from ..machine.machine import Machine
from ..machine.system import System, assemble
from ..simulation.equilibrium import running
from ..simulation.state import State, from_flat, to_flat
from .coordinates import coordinate_order, internal_order, row_of
from .eigen import eigensystem, eigensystem_numbers
from .instant import prepare
from .over_speed import OverSpeed
from .steady import Steady, steady
from .whirling import whirl_dependent

# A rounding in every product of a sum, and some to spare.
_ROUNDING = 4 * float(np.finfo(float).eps)
# Imaginary parts below this part of an eigenvalue are the rounding of two real ones.
_REAL = 1e-6


@shows(without=("state", "of_whirl"), speed="rad/s", spins="rad/s")
class LinearModel(eqx.Module):
    """Small motions about a steady state: `M q'' + (C + G) q' + K q = F`, and with the elements' internal
    states `x' = A x + B F`, x = (q, q', internal).

    - `M`, `C`, `G`, `K`: (n, n) over the free coordinates, SI. C is the symmetric, G the skew part of
      what multiplies q': G holds the gyroscopic moments (and a seal's or film's cross damping). K need not
      be symmetric. Internal states are held still in these four.
    - `A`: (d, d), `B`: (d, n). `speed`: rad/s. `state`: the steady state, as the user sees it.
    - `coordinates`: (station, coordinate) of each row; `spins`: speed of that station, rad/s (behind gears
      another than `speed`).
    - `of_whirl`: names of the supports with coefficients over whirl frequency; here those of the spin's.

    A pytree: `jax.vmap` over speeds or parameters and derivatives in both modes work.
    """

    M: Float[Array, "n n"]
    C: Float[Array, "n n"]
    G: Float[Array, "n n"]
    K: Float[Array, "n n"]
    A: Float[Array, "d d"]
    B: Float[Array, "d n"]
    speed: Float[Array, ""]
    spins: Float[Array, " n"]
    state: State
    coordinates: tuple[tuple[str, str], ...] = eqx.field(static=True)
    of_whirl: tuple[str, ...] = eqx.field(static=True, default=())

    plot = plot_door()

    @cached_property
    def _system(self) -> tuple[Array, Array, Array, Array]:
        """Eigenvalues with the right and left eigenvectors: first those that oscillate (one of each pair), by
        rising size; and which do."""
        if traced(self):
            values, right, left = eigensystem(self.A)
            swings = jax.lax.stop_gradient(oscillating(self.A, self.M, values, right))
            order = jnp.argsort(jnp.where(swings, jnp.abs(values), jnp.inf))
            return values[order], right[:, order], left[order], swings[order]
        A, M = np.asarray(self.A), np.asarray(self.M)
        values, right, left = eigensystem_numbers(A)
        swings = oscillating(A, M, values, right)
        order = np.argsort(np.where(swings, np.abs(values), np.inf), kind="stable")
        found = values[order], right[:, order], left[order], swings[order]
        values, right, left, swings = map(jnp.asarray, found)
        return values, right, left, swings

    @property
    def eigenvalues(self) -> Complex[Array, " d"]:
        """1/s: those with positive imaginary part by rising natural frequency, then all others."""
        return self._system[0]

    def _upper(self) -> tuple[Complex[Array, " n"], Array]:
        """The first n eigenvalues, and which oscillate; the others are replaced by i, for safety."""
        found = self.eigenvalues[: self.M.shape[0]]
        moving = self._system[3][: self.M.shape[0]]
        return jnp.where(moving, found, 1j), moving

    @property
    def natural_frequencies(self) -> Float[Array, " n"]:
        """|lambda| of the oscillating modes, rad/s, rising; 0 stands for what does not oscillate (a free
        spin, an overdamped motion), at the end."""
        found, moving = self._upper()
        return jnp.where(moving, jnp.abs(found), 0.0)

    @property
    def damped_frequencies(self) -> Float[Array, " n"]:
        """Im lambda, rad/s, in the same order."""
        found, moving = self._upper()
        return jnp.where(moving, found.imag, 0.0)

    @property
    def damping_ratios(self) -> Float[Array, " n"]:
        """`-Re lambda / |lambda|`, in the same order; negative is unstable."""
        found, moving = self._upper()
        return jnp.where(moving, -found.real / jnp.abs(found), 0.0)

    @property
    def log_decrements(self) -> Float[Array, " n"]:
        """`-2 pi Re lambda / Im lambda`, in the same order."""
        found, moving = self._upper()
        return jnp.where(moving, -2 * jnp.pi * found.real / found.imag, 0.0)

    @property
    def mode_shapes(self) -> Complex[Array, "n m"]:
        """Columns over `coordinates`, in the same order; the largest entry is 1."""
        n = self.M.shape[0]
        shapes = self._system[1][:n, :n]
        largest = jnp.argmax(jnp.abs(shapes), axis=0)
        return shapes / jnp.take_along_axis(shapes, largest[None], axis=0)

    @property
    def growth(self) -> Float[Array, ""]:
        """The largest real part, 1/s: positive is unstable. A free spin gives 0."""
        return jnp.max(self.eigenvalues.real)

    def row(self, place: str) -> int:
        """Row of `"main.y"` among the free coordinates; raises `InputError`."""
        return row_of(self.coordinates, place)


def oscillating(A: Any, M: Any, values: Any, vectors: Any) -> Any:
    """Which of the eigenvalues (m,), with eigenvectors (d, m), are those with Im > 0 of motions that some
    force drives back; of NumPy's or JAX's arrays. A free motion's double zero splits into anything up to
    the root of the rounding, but the forces in its shape cancel each other, whatever the scales of the
    machine."""
    return (values.imag > _REAL * abs(values)) & driven_back(A, M, vectors)


def driven_back(A: Any, M: Any, vectors: Any) -> Any:
    """Whether the forces in each of the eigenvectors (d, m) do work, beyond rounding."""
    n = M.shape[0]
    shapes, pull = vectors[:n], A[n : 2 * n]
    work = abs((shapes.conj() * (M @ (pull @ vectors))).sum(axis=0))
    parts = (abs(shapes) * (abs(M) @ (abs(pull) @ abs(vectors)))).sum(axis=0)
    return work > _ROUNDING * len(A) * parts


@takes(speed=number("rad/s"))
def linearize(
    machine: Machine,
    speed: Float[Array, ""] | float = 0.0,
    at: Literal["equilibrium", "undeformed"] | State = "equilibrium",
) -> LinearModel:
    """Small motions of `machine` turning at `speed` (rad/s), without what turns with the shaft
    (unbalance, imperfections, transmission errors).

    `at`: `"equilibrium"`, deflected under weight and steady loads with bearings at their working point at
    this speed (internal states too); `"undeformed"`; or a `State`, whose own speeds and accelerations
    then count. In the first two, forces from outside bear what is not in balance (drag on a free spin;
    weight, where undeformed). Everything comes from the vector field by automatic differentiation, so it
    holds for any component. Coefficients over whirl frequency are those of the spin's own: where each mode
    is to have its own, see `matched_modes`. Raises `InputError` for another `at`, and for a speed that is
    not finite.
    """
    check_linearized(at)
    machine.check()
    return linearize_checked(machine, jnp.asarray(speed, float), at)


def check_linearized(at: Any) -> None:
    """Raises `InputError` where nothing can be linearised about `at`."""
    require_x64()
    if isinstance(at, State) or (isinstance(at, str) and at in ("equilibrium", "undeformed")):
        return
    raise InputError(f'at must be "equilibrium", "undeformed" or a State, but is {short(at)}')


def linearize_checked(machine: Machine, speed, at) -> LinearModel:
    """`linearize` of what has been checked: for loops over speeds."""
    if traced(machine, speed, at):
        return _derivable(machine, speed, at)
    return model_of(machine, steady(prepare(machine), float(speed), at), float(speed))


def models_over_speed(
    machine: Machine, speeds: np.ndarray, at: Any
) -> Callable[[float], LinearModel]:
    """`linearize_checked` at any of the speeds, with NumPy's arrays, where no derivative is asked."""
    over = OverSpeed(machine, speeds, at)
    return lambda speed: _model(machine, over(float(speed)), float(speed))


def rates_over_speed(
    machine: Machine, speeds: np.ndarray, at: Any
) -> Callable[[float], tuple[np.ndarray, np.ndarray]]:
    """A and B of the same, sooner."""
    over = OverSpeed(machine, speeds, at)
    order = coordinate_order(machine)[2]

    def rates(speed: float) -> tuple[np.ndarray, np.ndarray]:
        A, B = over.rates(float(speed))
        whole = internal_order(order, len(A))
        return A[whole[:, None], whole], B[whole[:, None], order]

    return rates


def models_at(machine: Machine, at: Any) -> Callable[[float], LinearModel]:
    """The same, each speed by itself."""
    prepared = prepare(machine)
    return lambda speed: _model(machine, steady(prepared, float(speed), at), float(speed))


def model_of(machine: Machine, found: Steady, speed: float) -> LinearModel:
    """What was found as numbers, with JAX's arrays."""
    return jax.tree.map(jnp.asarray, _model(machine, found, speed))


def _model(machine: Machine, found: Steady, speed: float) -> LinearModel:
    at, n = found.at, len(found.M)
    D, K = -found.M @ at.A[n : 2 * n, n : 2 * n], -found.M @ at.A[n : 2 * n, :n]
    return _ordered(machine, found.M, D, K, at.A, at.B, np.float64(speed), at.state)


@eqx.filter_jit
def _derivable(machine: Machine, speed, at) -> LinearModel:
    """The same under a trace."""
    system = assemble(machine, nominal=True)
    zero = jnp.zeros(())
    reference = (system.reference(zero)[0], speed, zero)
    n = n_free(system)
    if isinstance(at, State):
        y = to_flat(at, system, reference)
    elif at == "equilibrium":
        y, _ = running(system, reference)
    else:
        y = jnp.concatenate([jnp.zeros(2 * n), initial_states(system)])

    def pushed(force):
        return relative_field(zero, y, system, reference, on_nodes(system, force))

    B, own = jax.jacfwd(lambda f: (pushed(f),) * 2, has_aux=True)(jnp.zeros(n))
    M = jnp.linalg.inv(B[n : 2 * n])
    M = M if system.inertial else 0.5 * (M + M.T)
    held = None if isinstance(at, State) else holding(system, own, M)
    A = jax.jacfwd(lambda y: relative_field(zero, y, system, reference, held))(y)
    D = -M @ A[n : 2 * n, n : 2 * n]
    K = -M @ A[n : 2 * n, :n]
    return _ordered(machine, M, D, K, A, B, speed, from_flat(zero, y, system, reference))


def _ordered(machine: Machine, M, D, K, A, B, speed, state: State) -> LinearModel:
    """From the vector field's order to a person's; of NumPy's or JAX's arrays. D is all that multiplies
    q'."""
    _, _, order, labels = coordinate_order(machine)
    whole = internal_order(order, A.shape[0])
    names = structure_of(machine).wiring.stations
    spins = state.velocity[np.array([names.index(s) for s, _ in labels], int), 5]
    M, D, K = (block(x, order, order) for x in (M, D, K))
    return LinearModel(
        M,
        0.5 * (D + D.T),
        0.5 * (D - D.T),
        K,
        block(A, whole, whole),
        block(B, whole, order),
        speed,
        spins,
        state,
        labels,
        whirl_dependent(machine),
    )


def holding(system: System, own: Float[Array, " d"], M: Array) -> Float[Array, "6 m"]:
    """Forces from outside that bear what would slow a steady state down or lift it off: `own` is the vector
    field there, in whose order `M` is too."""
    n = n_free(system)
    return on_nodes(system, -M @ own[n : 2 * n])
