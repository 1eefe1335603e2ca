"""Does each connector act at as many places as it is given, and has every station some inertia?"""

from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp

from ..core.errors import InputError
from ..core.kinematics import COORDINATES
from ..core.parameter import known
from ..core.protocol import (
    AbstractElement,
    Acting,
    Carried,
    Carrying,
    Linear,
    Lumping,
    Stateful,
    is_massive,
)
from ..core.quick import quickly_compiled
from .built import Built
from .lineup import Lineup


def check_ends(lineup: Lineup) -> None:
    """Asks each force law for its shapes, without computing anything."""
    wiring, member = lineup.wiring, 0
    for block in lineup.connectors:
        name, ends, element = wiring.connectors[member], wiring.ends[member], block.one()
        acts_at = _acts_at(element, len(ends))
        if acts_at != len(ends):
            raise InputError(
                f"`{name}`: a {type(element).__name__} acts at {acts_at} "
                f"{'station' if acts_at == 1 else 'stations'}, but {len(ends)} are given: name as many"
            )
        member += len(block)


def check_carried(lineup: Lineup) -> None:
    """A station without inertia of its own needs a shaft with mass beside it."""
    wiring, member, massive = lineup.wiring, 0, set()
    for block in lineup.connectors:
        if is_massive(block.one()):
            massive |= {s for k in range(len(block)) for s, _ in wiring.ends[member + k]}
        member += len(block)
    member = 0
    for block in lineup.stations:
        one = block.one()
        if isinstance(one, Carried) and jax.eval_shape(lambda s: s.own_mass(), one) is not None:
            for k in range(member, member + len(block)):
                name = wiring.stations[k]
                held = {h.coordinate for h in wiring.held if h.station == k}
                if k not in massive and len(held) < 6:
                    raise InputError(
                        f"`{name}`: has no mass of its own and no shaft with mass adjoins it: put "
                        "a FiniteElementShaft or RigidElementShaft beside it, or make it a Rotor"
                    )
        member += len(block)


def massless(machine: Built) -> Iterator[str]:
    """What stations without inertia of their own lack where no shaft with mass helps, in sentences."""
    wiring = machine.wiring
    for k, (name, station) in enumerate(zip(wiring.stations, machine.stations)):
        if not isinstance(station, Carried) or isinstance(station, Lumping):
            continue  # what is lumped is filled in later
        beside = [
            (c, [s for s, _ in ends].index(k))
            for c, ends in zip(machine.connectors, wiring.ends)
            if (isinstance(c, Carrying) or is_massive(c)) and any(s == k for s, _ in ends)
        ]
        if any(isinstance(c, Carrying) for c, _ in beside):
            continue
        inertia = _inertia(station, [(c, end) for c, end in beside if is_massive(c)])
        if inertia is None:
            continue
        inertia = known(inertia)
        held = {h.coordinate for h in wiring.held if h.station == k}
        bare = [c for i, c in enumerate(COORDINATES) if i not in held and inertia is not None]
        bare = [c for c in bare if not inertia[COORDINATES.index(c)] > 0]  # pyright: ignore
        if bare:
            yield (
                f"`{name}`: has no inertia along {', '.join(bare)}, but moves there: give its "
                "AddedInertia some (kg, kg*m^2), or hold these coordinates by `fixed`"
            )


@quickly_compiled
def _inertia(station: Any, added: Any) -> Any:
    """Along each coordinate, (6,); `None` where the station needs none, or where what is added has another
    number of ends: `check_ends` says so."""
    own = station.own_mass()
    parts = [jnp.diagonal(c.mass_matrix())[6 * end : 6 * end + 6] for c, end in added]
    if own is None or any(x.shape != (6,) for x in parts):
        return None
    return sum(parts, jnp.diagonal(own))


def _acts_at(element: AbstractElement, given: int) -> int | str:
    if isinstance(element, Linear):
        size = jax.eval_shape(lambda e: e.matrices(), element)[0].shape[0] // 6
        if size != given:
            return size
    if is_massive(element):
        size = jax.eval_shape(lambda e: e.mass_matrix(), element).shape[0] // 6
        if size != given:
            return size
    if not isinstance(element, Acting):
        return given
    six = jax.ShapeDtypeStruct((6,), jnp.float64)  # an array of zeros would be a program to compile
    motion = (six, six)
    state = None
    if isinstance(element, Stateful):
        state = jax.eval_shape(lambda e: e.initial(), element)
    try:
        forces = jax.eval_shape(
            lambda e, m, s: e.forces(jnp.zeros(()), m, s), element, (motion,) * given, state
        )
    except ValueError:  # unpacking another number of motions
        return "another number of"
    return given if forces is None else len(forces)
