"""Control loops of magnetic bearings, opened at their sensors: sensitivity, open and closed loop."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..core.arguments import names, number, numbers
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from ..core.quick import quickly_compiled, traced
from ..core.readable import amount
from ..core.result_text import HERTZ, shows
from ..core.threads import one_thread
from ..elements.control.magnetic import MagneticBearing
from ..machine.field import relative_field
from ..machine.machine import Machine
from ..machine.system import assemble
from ..machine.wiring import unknown
from ..simulation.state import State, to_flat
from .coordinates import coordinate_order, internal_order
from .linearise import check_linearized, linearize_checked
from .matrix_equations import stable
from .observe import outputs_of, sensitivity
from .resolvent import resolvent
from .response import as_complex, solve
from .transfer import Transfer, met

AXES = ("v", "w")


@shows(frequencies=HERTZ)
class ControlLoops(eqx.Module):
    """Loops of magnetic bearings over `frequencies` (f,), rad/s, each opened where its sensor's signal enters
    the controller, L being the product of all that stands around it, with the sign by which 1 + L = 0 is the
    limit of stability.

    `matrix` (f, n, n): what reaches the controllers of a disturbance added to each of n sensors,
    `S = (1 + L)^-1`. `axes`: "bearing.v", "bearing.w", ... of its rows.
    """

    frequencies: Float[Array, " f"]
    matrix: Complex[Array, "f n n"]
    axes: tuple[str, ...] = eqx.field(static=True)

    plot = plot_door()

    @property
    def sensitivity(self) -> Complex[Array, "f n"]:
        """1/(1 + L) of each axis, all others closed: what ISO 14839-3 judges."""
        return jnp.diagonal(self.matrix, axis1=-2, axis2=-1)

    @property
    def open_loop(self) -> Complex[Array, "f n"]:
        """L of each axis, all others closed."""
        return 1.0 / self.sensitivity - 1.0

    @property
    def closed_loop(self) -> Complex[Array, "f n"]:
        """L/(1 + L) of each axis, all others closed: from the setpoint to what is measured."""
        return 1.0 - self.sensitivity

    @property
    def largest(self) -> Float[Array, " f"]:
        """The largest singular value of `matrix`: of disturbances of all sensors together, the worst."""
        return jnp.linalg.norm(self.matrix, ord=2, axis=(-2, -1))

    @property
    def decibels(self) -> Float[Array, "f n"]:
        """Of the sensitivity."""
        return 20 * jnp.log10(jnp.abs(self.sensitivity))


class Opened(NamedTuple):
    """The closed machine's `x' = A x + E d`, d (m) being added to what sensors measure, `C x` (m): one row
    and column for each of `axes`. `n`: how many coordinates x begins with."""

    A: Float[Array, "d d"]
    E: Float[Array, "d n"]
    C: Float[Array, "n d"]
    n: int
    axes: tuple[str, ...]

    def axis(self, k: int) -> Transfer:
        """From the disturbance of one axis to its own sensor."""
        return Transfer(self.A, self.E[:, k], self.C[k])


def opened(machine: Machine, bearings: Sequence[str], speed: Any, at: Any) -> Opened:
    """The loops of these bearings. Raises `InputError` for an unstable machine."""
    check_linearized(at)
    machine.check()
    axes = tuple(f"{name}.{axis}" for name in bearings for axis in AXES)
    model = linearize_checked(machine, jnp.asarray(speed, float), at)
    E, C = channels(machine, tuple(bearings), model.state, jnp.asarray(speed, float))
    found = Opened(model.A, E, C, model.M.shape[0], axes)
    for k, axis in enumerate(axes):
        dies = known(stable(met(found.axis(k)).A))
        if dies is not None and not dies:
            raise InputError(
                f"`{axis}`: the closed loop is not stable at {amount(speed, 'rad/s')}: its sensitivity tells "
                "nothing; look at `jr.linearize` for what grows"
            )
    return found


@quickly_compiled
def channels(
    machine: Machine, bearings: tuple[str, ...], state: State, speed: Array
) -> tuple[Float[Array, "d n"], Float[Array, "n d"]]:
    """E and C of `Opened` in a state: how the rates change with what is added to what sensors measure (as
    with the setpoint, against it), and what they measure of it."""
    labels = coordinate_order(machine)[3]
    signals = tuple(f"{name}.measured_{axis}" for name in bearings for axis in AXES)
    outputs = outputs_of(machine, labels, signals)
    zero, size = jnp.zeros(()), len(AXES)
    system = assemble(machine, nominal=True)
    reference = (system.reference(zero)[0], speed, zero)
    y = to_flat(state, system, reference)

    def rates(d):
        paths = [f"{name}.setpoint" for name in bearings]
        parts = [machine.get(p) - d[size * k : size * (k + 1)] for k, p in enumerate(paths)]
        disturbed = assemble(machine.set(dict(zip(paths, parts))), nominal=True)
        return relative_field(zero, y, disturbed, reference)

    E = jax.jacfwd(rates)(jnp.zeros(size * len(bearings)))
    C = sensitivity(machine, outputs, system, y, reference)
    order = internal_order(coordinate_order(machine)[2], E.shape[0])
    return E[order], C[:, order]


def magnetic_bearings(machine: Machine) -> tuple[str, ...]:
    return tuple(n for n, part in machine.elements().items() if isinstance(part, MagneticBearing))


@takes(frequencies=numbers("rad/s", above=0.0), bearings=names, speed=number("rad/s"))
def control_loops(
    machine: Machine,
    frequencies: Any,
    speed: Any = 0.0,
    bearings: str | Sequence[str] | None = None,
    at: Any = "equilibrium",
) -> ControlLoops:
    """Sensitivity, open-loop and closed-loop transfer functions of magnetic bearings, the machine turning at
    `speed` (rad/s): from its linear model, in which all loops are closed.

    `frequencies`: rad/s. `bearings`: names of `MagneticBearing`s whose axes are opened, one by one and all
    together; by default all. What is beside them stays closed. The peak of a sensitivity, with its zone and
    its gradient: `jr.standards.peak_sensitivity`, `loop_sensitivity`.

    Differentiable in both modes, and by `jax.vmap`. Raises `InputError` for names of other parts, and where
    the closed loop is not stable. Source: ISO 14839-3 (the sensitivity of each axis), Skogestad &
    Postlethwaite, Multivariable Feedback Control, sec. 3.3 (singular values).
    """
    frequencies = jnp.atleast_1d(jnp.asarray(frequencies, float))
    every = magnetic_bearings(machine)
    asked = every if bearings is None else (bearings,) if isinstance(bearings, str) else bearings
    for name in asked:
        if name not in every:
            raise InputError(f"bearings: {unknown('magnetic bearing', name, every)}")
    if not asked:
        raise InputError(
            "bearings: the machine has no MagneticBearing, whose loops could be opened"
        )
    found = opened(machine, tuple(asked), speed, at)
    look = _matrices if traced(found.A, found.E, found.C, frequencies) else _matrices_numbers
    return ControlLoops(frequencies, look(found, frequencies), found.axes)


@eqx.filter_jit
def _matrices(found: Opened, frequencies: Array) -> Complex[Array, "f n n"]:
    A, E, C, n, axes = found

    def one(w):
        return jnp.eye(len(axes)) + as_complex(C) @ solve(A, w, E)

    # one after the other: batched LAPACK calls side by side can deadlock (docs/solving.md)
    return jax.lax.map(one, frequencies)


@one_thread
def _matrices_numbers(found: Opened, frequencies: Array) -> Complex[Array, "f n n"]:
    A, E, C = (np.asarray(x) for x in found[:3])
    eye = np.eye(len(found.axes))
    each = [eye + C @ resolvent(A, found.n, 1j * w, E) for w in np.asarray(frequencies)]
    return jnp.asarray(np.stack(each))
