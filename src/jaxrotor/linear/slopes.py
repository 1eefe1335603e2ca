"""How numbers that follow from a linear model change with every parameter of the machine: one reverse sweep
through the vector field for each, without the derivatives of the matrices."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..core.notice import muted
from ..core.quick import quickly_compiled
from ..integrators.newton import FREE_MOTION
from ..machine.field import n_free
from ..machine.machine import Machine
from ..machine.system import assemble
from ..simulation.state import State
from .coordinates import coordinate_order, internal_order
from .instant import Prepared, field_and_loads, prepare
from .linearise import LinearModel, models_at
from .steady import Steady, steady


class Form(NamedTuple):
    """`Re(left (A right + B force))` of the linear model at `speed`, rad/s: complex vectors (d,), (d,), (n,)
    in the model's order. What `right`, `force` and `left` are made from counts as constant: the first change
    of a response, or of an eigenvalue, is that of such a form."""

    speed: float
    left: np.ndarray
    right: np.ndarray
    force: np.ndarray


class _There(NamedTuple):
    """Where the field is looked at: the flat state, the forces that hold it, and what their adjoints are made
    from."""

    speed: np.ndarray
    y: np.ndarray
    held: np.ndarray
    by_force: np.ndarray  # (n, n)
    by_state: np.ndarray  # (n, d)
    settling: np.ndarray  # (n + k, d)


def slopes_of(
    machine: Machine,
    forms: Sequence[Form],
    at: Any,
    step: Callable[[int], None] = lambda k: None,
) -> list[Machine]:
    """Of each form, its derivatives by every parameter, as a machine that holds them (`None` for what is no
    number). The steady state follows the machine. `step` is told how many are done."""
    prepared = prepare(machine)
    order = np.asarray(coordinate_order(machine)[2], int)
    places: dict[float, _There] = {}
    found = []
    for k, form in enumerate(forms):
        if form.speed not in places:
            places[form.speed] = _looked_at(prepared, form.speed, at)
        there = places[form.speed]
        whole = np.asarray(internal_order(order, len(there.y)), int)
        left, right, force = (np.asarray(x, complex) for x in form[1:])
        left, right = (_put(x, whole) for x in (left, right))
        rows = [
            jnp.asarray(g(x)) for x in (left, right, _put(force, order)) for g in (np.real, np.imag)
        ]
        with muted(k > 0):  # it is compiled then
            found.append(_swept(machine, jax.tree.map(jnp.asarray, there), rows))
        step(k + 1)
    return found


def _put(x: np.ndarray, order: np.ndarray) -> np.ndarray:
    out = np.zeros(len(order), complex)
    out[order] = x
    return out


def _looked_at(prepared: Prepared, speed: float, at: Any) -> _There:
    there: Steady = steady(prepared, speed, at)
    found, n, d = there.at, n_free(prepared.system), len(there.y)
    by_force = -np.linalg.inv(found.B[n : 2 * n]).T
    settling = np.zeros((len(found.loads), d))
    if isinstance(at, State):  # it is given, and held by nothing
        by_force = np.zeros_like(by_force)
    elif at == "equilibrium":
        settling[:, np.r_[:n, 2 * n : d]] = _settling(prepared, found, n, d)
    return _There(np.float64(speed), there.y, there.held, by_force, found.A[n : 2 * n], settling)  # pyright: ignore[reportArgumentType]


def _settling(prepared: Prepared, found: Any, n: int, d: int) -> np.ndarray:
    """What a slope by the sought part of the state weighs of the loads' slopes."""
    slope = found.pull[:, np.r_[:n, 2 * n : d]].copy()
    kept = np.eye(len(slope))
    if prepared.turning is not None:  # a free line's common turning stays
        free = np.asarray(prepared.turning[0])
        kept[:n, :n] -= free
        slope[:n] -= free @ slope[:n]
        slope[:n, :n] += free
    rows = np.abs(slope).max(1, initial=0.0)
    rows[rows == 0] = 1.0
    columns = np.abs(slope / rows[:, None]).max(0, initial=0.0)
    columns[columns == 0] = 1.0
    inverse = np.linalg.pinv(slope / rows[:, None] / columns, rcond=FREE_MOTION)
    return -kept.T @ (inverse / columns[:, None] / rows).T


@quickly_compiled
def _swept(machine: Machine, there: _There, rows: list) -> Machine:
    d = there.y.size
    left, other_left, right, other_right, force, other_force = rows

    still, numbers = eqx.partition(machine, eqx.is_inexact_array)
    # assembled once, for all that follows
    system, pulled, fixed = jax.vjp(
        lambda still: eqx.partition(
            assemble(eqx.combine(still, numbers), nominal=True), eqx.is_inexact_array
        ),
        still,
        has_aux=True,
    )

    def field(system, y, held):
        whole = eqx.combine(system, fixed)
        reference = (whole.reference(jnp.zeros(()))[0], there.speed, jnp.zeros(()))
        return field_and_loads(whole, y, reference, held)

    def form(system, y, held):
        moved = jax.vmap(
            lambda x, f: jax.jvp(lambda *p: field(system, *p), (y, held), (x, f))[1][:d]
        )
        real, imaginary = moved(jnp.stack([right, other_right]), jnp.stack([force, other_force]))
        return left @ real - other_left @ imaginary

    by_system, by_y, by_held = jax.grad(form, argnums=(0, 1, 2))(system, there.y, there.held)
    n = there.held.size
    pushed = there.by_force @ by_held
    settled = there.settling @ (by_y + there.by_state.T @ pushed)

    def conditions(system):
        out = field(system, there.y, there.held)
        return pushed @ out[n : 2 * n] + settled @ out[d:]

    (found,) = pulled(jax.tree.map(jnp.add, by_system, jax.grad(conditions)(system)))
    return found


def model_numbers(machine: Machine, speed: float, at: Any) -> LinearModel:
    """`linearize`, with NumPy's arrays."""
    return models_at(machine, at)(float(speed))
