"""The free coordinates of a machine: in the vector field's order, and in a person's."""

import numpy as np

from ..core.errors import InputError
from ..core.kinematics import COORDINATES
from ..machine.layout import layout_of
from ..machine.lineup import by_structure, structure_of
from ..machine.machine import Machine


@by_structure
def coordinate_order(
    machine: Machine,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[tuple[str, str], ...]]:
    """Of the free coordinates as the vector field has them: component and internal station of each; the
    order in which a person lists them, station by station; and their names in that order."""
    layout = layout_of(machine)
    component, station = np.divmod(np.array(layout.free, int), layout.n_mass)
    place = np.argsort(np.array(layout.internal))[station]  # the user's number of each station
    order = np.lexsort((component, place))
    names = structure_of(machine).wiring.stations
    labels = tuple((names[place[i]], COORDINATES[component[i]]) for i in order)
    return component, station, order, labels


def internal_order(order: np.ndarray, size: int) -> np.ndarray:
    """Where the entries of a state as a person lists them stand in the vector field's."""
    n = order.size
    return np.concatenate([order, n + order, np.arange(2 * n, size)])


def row_of(labels: tuple[tuple[str, str], ...], place: str) -> int:
    """Row of `"main.y"`; raises `InputError`."""
    station, _, coordinate = place.rpartition(".")
    if (station, coordinate) not in labels:
        known = sorted({s for s, _ in labels})
        if station in known and coordinate in COORDINATES:
            raise InputError(f"`{place}`: {coordinate} of `{station}` is held, it cannot move")
        raise InputError(
            f"`{place}`: no such coordinate: write station.coordinate with one of the stations "
            f"{', '.join(known)} and one of {', '.join(COORDINATES)}"
        )
    return labels.index((station, coordinate))
