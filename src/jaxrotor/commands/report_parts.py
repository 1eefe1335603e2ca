"""Chapters of a report that the assessment itself does not make: what reviewers look at first."""

from typing import Any

import numpy as np

from ..core.errors import InputError
from ..elements.bearings.support import LinearSupport, SpeedDependentSupport
from ..machine.axial import axial_positions
from ..pages.page import Figure, Table, Words
from ..standards.placed import placed_response
from ..study.assessed import Assessed
from ..study.study import Study

_MAP = np.geomspace(1e6, 1e10, 41)
_POINTS = 41


def static(study: Study) -> list[Any]:
    """Deflections at rest, and what each support bears."""
    from ..plot.placed import static_deflection
    from ..simulation.equilibrium import static_equilibrium

    machine = study.machine
    if not np.any(np.asarray(machine.gravity)):
        return [Words("No gravity is given: nothing deflects.")]
    told = machine.summary()
    if told.no_rest:
        return [Words(f"No static equilibrium: {told.no_rest}.")]
    places = axial_positions(machine)
    names = machine.wiring.stations
    state = static_equilibrium(machine)
    moved = np.asarray(state.position)[:, :2]
    z = [places[name] for name in names]
    supports = [
        places[machine.connections()[n][0].partition(".")[0]]
        for n in told.reactions
        if n in machine.connections()
    ]
    sizes = {name: np.hypot(*force[:2]) for name, force in told.reactions.items()}
    least = 1e-6 * max(sizes.values(), default=0.0)  # what is less is rounding
    rows = [
        (name, *(f"{x if abs(x) > least else 0.0:.5g}" for x in (*force[:2], sizes[name])))
        for name, force in told.reactions.items()
        if sizes[name] > least
    ]
    return [
        Figure("Static deflection", lambda: static_deflection(z, moved, supports)),
        Table(
            "Loads that the supports bear at rest", ("support", "x, N", "y, N", "in all, N"), rows
        ),
        Words(
            f"Rotor mass {told.mass:.5g} kg, centre of mass at z = {told.centre_of_gravity:.5g} m."
        ),
    ]


def support_map(study: Study) -> list[Any]:
    from ..linear.supports import critical_speed_map

    kinds = (LinearSupport, SpeedDependentSupport)
    names = [n for n, e in study.machine.elements().items() if isinstance(e, kinds)]
    asked = study.standards.bearings
    names = [n for n in names if asked is None or n in asked]
    if not names:
        return [Words("No linear or tabulated supports: a map of their stiffness is not drawn.")]
    try:
        found = critical_speed_map(study.machine, _MAP, names, progress=False)
    except InputError as error:
        return [Words(f"Not drawn: {error}.")]
    return [
        Figure("Undamped forward critical speeds over the stiffness of each support", found.plot)
    ]


def campbell(study: Study, top: float) -> list[Any]:
    from ..linear.campbell import campbell
    from ..linear.critical import critical_modes
    from ..plot.linear import campbell_diagram

    found = campbell(study.machine, np.linspace(0.0, top, _POINTS), 8, progress=False)
    met = {1.0: critical_modes(study.machine, 1.0, speeds=(0.0, top))}
    return [
        Figure(
            "Frequencies over speed, with the undamped critical speeds, and log decrement",
            lambda: campbell_diagram(found, (1.0,), met, "decrement"),
        )
    ]


def orbits(study: Study, found: Assessed) -> list[Any]:
    """Of the probes' stations, for each unbalance."""
    from ..plot.placed import whirl_orbits

    asked = study.standards
    names = list(
        dict.fromkeys(
            p[0] if isinstance(p, tuple) else p.rpartition(".")[0] or p for p in asked.probes
        )
    )
    parts = []
    for name, unbalance in found.unbalances.items():
        outputs = [f"{s}.{c}" for s in names for c in "xy"]
        seen = placed_response(study.machine, unbalance, outputs, [asked.greatest], at=asked.state)
        pairs = np.asarray(seen.values)[0].reshape(-1, 2)
        drawn = dict(zip(names, pairs))
        words = f"Orbits under the unbalance {name}" if name else "Orbits under the unbalance"
        parts.append(Figure(words, lambda drawn=drawn: whirl_orbits(drawn)))
    return parts
