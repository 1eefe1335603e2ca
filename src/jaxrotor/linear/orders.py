"""Vibration at so many times the speed, under what turns with the shaft: unbalance, engine orders."""

import warnings
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..core.arguments import names, numbers
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from ..core.picked import block
from ..core.protocol import Nominal
from ..core.quick import traced
from ..core.result_text import shows
from ..machine.field import relative_field
from ..machine.machine import Machine
from ..machine.speed_ratios import is_geared
from ..machine.system import assemble_both
from ..machine.wiring import unknown
from ..simulation.condensing import may_condense
from ..simulation.state import State, to_flat
from .condensing import condensed_below
from .coordinates import coordinate_order, internal_order
from .excess import excess
from .forced import amplitudes
from .instant import ratio_of
from .linearise import check_linearized, holding, linearize
from .observe import outputs_of, sensitivity
from .poles import beside_poles, nearly_unbounded, poles_of
from .response import POWER, FrequencyResponse, Kind, as_complex, as_names, check_kind, solve
from .shafts import driven_station, joined_with, line_of
from .whirling import refuse_whirl_dependent

# Orders are multiples of a half: what repeats in two turns, as a four-stroke engine does.
_TURNS = 2
# Angles in these at which the forces are looked at: of anything, and where rotors alone excite.
_ANY, _SMOOTH = 256, 32


@shows(speeds="rad/s")
class OrderResponse(eqx.Module):
    """Steady vibration at each order: `values` (speed, order, output), complex; the motion is the sum over
    the orders of Re(value e^(i order phi)), phi the angle of the shaft. `speeds`: rad/s. `orders`: per turn.
    `units`: of each output, SI."""

    speeds: Float[Array, " s"]
    values: Complex[Array, "s k outputs"]
    orders: tuple[float, ...] = eqx.field(static=True)
    outputs: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)

    @property
    def magnitude(self) -> Float[Array, "s k outputs"]:
        return jnp.abs(self.values)

    @property
    def peak(self) -> Float[Array, "s outputs"]:
        """The largest of all orders together within two turns."""
        angles = jnp.linspace(0, 2 * np.pi * _TURNS, 720, endpoint=False)
        waves = jnp.exp(1j * jnp.asarray(self.orders)[:, None] * angles)
        return jnp.max(jnp.abs(jnp.einsum("sko,ka->sao", self.values, waves).real), axis=1)


@takes(outputs=names, speeds=numbers("rad/s"))
def unbalance_response(
    machine: Machine,
    outputs: str | Sequence[str],
    speeds: Any,
    kind: Kind = "receptance",
    at: Any = "equilibrium",
    shaft: str | None = None,
) -> FrequencyResponse:
    """Steady synchronous vibration of `outputs` at `speeds` (rad/s) under the machine's own unbalance.

    The forces are those of the vector field itself: what a turn of the unbalanced machine in the steady
    state of the balanced one has at once per turn (so static and dynamic unbalance, imperfections and any
    part that turns with the shaft count alike). The motion is Re(value e^(i phi)), phi the shaft's angle.

    Where an undamped mode is excited at its own frequency the response is inf, with a warning.

    `outputs`: as for `frequency_response`. `shaft`: where shafts turn at different speeds, a station of
    the one whose unbalance is meant; its own speed is then the frequency. By default the driven one.
    Raises `InputError` for a name that the machine does not have, and for speeds that are not finite.
    """
    check_kind(kind)
    found = _at_orders(machine, outputs, speeds, (1.0,), at, shaft)
    # JAX would compile these for each number of speeds
    xp: Any = jnp if traced(found.values, found.speeds) else np
    values, rates = xp.asarray(found.values)[:, 0], 1j * xp.asarray(found.speeds)[:, None]
    with np.errstate(invalid="ignore"):  # what has no bound stays as it is
        values = xp.where(xp.isinf(values), values, values * rates ** POWER[kind])
    return FrequencyResponse(
        found.speeds, jnp.asarray(values), found.outputs, (), kind, found.units
    )


@takes(outputs=names, speeds=numbers("rad/s"), orders=numbers())
def order_response(
    machine: Machine,
    outputs: str | Sequence[str],
    speeds: Any,
    orders: Sequence[float],
    at: Any = "equilibrium",
    shaft: str | None = None,
) -> OrderResponse:
    """Steady vibration of `outputs` at `orders` (halves and whole numbers of periods in a turn), under all
    that turns with the shaft: engine harmonics, transmission errors, unbalance. With an `EngineTorque` and
    `"shaft.torque"` out it is the forced torsional vibration over speed, order by order.

    Everything else as for `unbalance_response`. The torsional dynamics are those of the mean torque.
    Raises `InputError` for orders that are no positive multiples of one half, and for what
    `unbalance_response` refuses.
    """
    for order in orders:
        if not (order > 0 and float(2 * order).is_integer()):
            raise InputError(f"orders are multiples of one half, positive, but one is {order!r}")
    return _at_orders(machine, outputs, speeds, tuple(map(float, orders)), at, shaft)


def _at_orders(machine, outputs, speeds, orders, at, shaft) -> OrderResponse:
    outputs = as_names(outputs)
    speeds = jnp.atleast_1d(jnp.asarray(speeds, float))
    machine.check()
    geared = is_geared(machine)
    if geared or any(order != 1.0 for order in orders):
        refuse_whirl_dependent(machine, "an order other than the first, or a machine with gears,")
    if shaft is not None and shaft not in machine.wiring.stations:
        raise InputError(f"shaft: {unknown('station', shaft, machine.wiring.stations)}")
    top = known(speeds)
    if top is not None and may_condense(machine):
        highest = float(np.abs(top).max(initial=0.0)) * max(orders)
        if geared and shaft is not None:
            highest *= ratio_of(machine, shaft)
        machine = condensed_below(machine, highest, at)
    found = outputs_of(machine, coordinate_order(machine)[3], outputs)
    if geared:
        machine = _only(machine, _members(machine, shaft))
    machine = _without_what_laps(machine)
    turn_at = machine.wiring.stations.index(shaft) if geared and shaft is not None else None
    least = _SMOOTH if _only_rotors_turn(machine) else _ANY
    count = max(least, 8 * _TURNS * int(np.ceil(max(orders))))
    angles = 2 * np.pi * _TURNS * np.arange(count) / count
    given = (machine, _only(machine, frozenset()), found, speeds, orders, turn_at, at, angles)
    if traced(machine, speeds, at):
        values = _amplitudes(*given)
    else:
        check_linearized(at)
        values = jnp.asarray(amplitudes(*given))
    numbers = known(values)
    if numbers is not None and np.any(np.isinf(numbers)):
        s, k, _ = np.argwhere(np.isinf(numbers))[0]
        warnings.warn(
            f"the response to order {orders[k]:g} at {float(speeds[s]):.6g} rad/s has no bound, for an "
            f"undamped mode is "
            "excited at its own frequency: it is given as inf; leave that speed out, or damp the machine",
            stacklevel=3,
        )
    units = tuple(o.unit for o in found)
    return OrderResponse(speeds, values, orders, outputs, units)


@eqx.filter_jit
def _amplitudes(machine: Machine, balanced, outputs, speeds, orders, turn_at, at, angles) -> Array:
    """`amplitudes` with derivatives."""
    zero = jnp.zeros(())
    actual, nominal = assemble_both(machine)
    order = coordinate_order(machine)[2]
    turn = jnp.ones(()) if turn_at is None else nominal.turns()[turn_at]

    def one(speed):
        model = linearize(machine, speed, at)
        y = to_flat(model.state, nominal, (nominal.reference(zero)[0], speed, zero))
        held = None
        if not isinstance(at, State):
            back = np.argsort(order)
            M = block(model.M, back, back)
            own = relative_field(zero, y, nominal, (zero, speed, zero))
            held = holding(nominal, own, M)
        pair = (machine, actual), (balanced, nominal)

        # one after the other: batched LAPACK calls side by side can deadlock (docs/solving.md)
        forces, direct = jax.lax.map(
            lambda angle: excess(pair, outputs, y, (angle / turn, speed, zero), held), angles
        )
        C = sensitivity(balanced, outputs, nominal, y, (zero, speed, zero))
        sorted_rows = internal_order(order, C.shape[1])
        C, forces = C[:, sorted_rows], forces[:, sorted_rows]

        def at_order(k):
            share = 2 / len(angles) * jnp.exp(-1j * k * angles)
            force, w = share @ as_complex(forces), k * turn * speed
            whirl = solve(model.A, w, force)

            def response(s):
                return as_complex(C) @ solve(model.A, s, force)

            found = jax.lax.cond(
                nearly_unbounded(model.A, w, whirl, force),
                lambda: beside_poles(response, poles_of(model.A, model.M), w),
                lambda: as_complex(C) @ whirl,
            )
            return found + share @ as_complex(direct)

        return jnp.stack([at_order(k) for k in orders])

    return jax.lax.map(one, speeds)


def _only_rotors_turn(machine: Machine) -> bool:
    """Whether no connector excites: what unbalance makes is of order 1, and a trifle of the next."""

    def round_(part: Nominal) -> bool:
        own, left = jax.tree.leaves(part), jax.tree.leaves(part.nominal())
        return len(own) == len(left) and all(a is b for a, b in zip(own, left))

    return all(round_(c) for c in machine.connectors if isinstance(c, Nominal))


def _members(machine: Machine, shaft: str | None) -> frozenset[str]:
    """Names of the elements on the shaft that `shaft` stands on: what is reached without passing gears."""
    stations = machine.wiring.stations
    start = stations.index(shaft) if shaft is not None else driven_station(machine)
    reached = joined_with(machine, start)
    names = {stations[s] for s, port in reached if s < len(machine.stations) and not port}
    for name, ends in zip(machine.wiring.connectors, machine.wiring.ends):
        if line_of(machine, ends[0]) in reached:  # a gear pair's error belongs to its gear a
            names.add(name)
    return frozenset(names)


def _without_what_laps(machine: Machine) -> Machine:
    """Without what repeats with something else than a shaft's turns, such as a motor's slip."""

    kept = tuple(
        c.nominal() if isinstance(c, Nominal) and not c.once_per_turn else c
        for c in machine.connectors
    )
    if all(a is b for a, b in zip(kept, machine.connectors)):
        return machine
    return eqx.tree_at(lambda m: m.connectors, machine, kept)


def _only(machine: Machine, names: frozenset[str]) -> Machine:
    """All but `names` balanced."""

    def kept(parts, known):
        return tuple(
            part.nominal() if isinstance(part, Nominal) and name not in names else part
            for name, part in zip(known, parts)
        )

    return eqx.tree_at(
        lambda m: (m.stations, m.connectors),
        machine,
        (
            kept(machine.stations, machine.wiring.stations),
            kept(machine.connectors, machine.wiring.connectors),
        ),
    )
