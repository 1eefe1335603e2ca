"""The machine itself: a side view to scale."""

from collections import deque

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, FancyArrowPatch, Polygon, Rectangle

from ..core.protocol import AbstractConnector, AbstractPrescribed, Composite
from ..elements.bearings.self_aligning import SelfAligningBearing
from ..elements.rotors.body import RigidBody
from ..elements.rotors.node import Node
from ..elements.rotors.rotor import Rotor
from ..machine.machine import Machine
from .style import COLOURS, GREY, Given, figure

_STEEL = "#C9D3DC"
# Length given to a connection that has none, as part of the mean of those that have.
_SCHEMATIC = 1.0
# Words of attachments: rows below each other, their height, and the room for shafts' above (points).
_ROWS, _ROW, _ABOVE = 4, 12.0, 28.0


def positions(machine: Machine) -> dict[str, tuple[float, int]]:
    """station -> (z in m, lane): along the line from the first station; each branch gets a lane.
    Stations inside a composite stand where its pieces meet."""
    own = machine.wiring.stations[: len(machine.stations)]
    joined: dict[str, list[tuple[str, float | None, int]]] = {s: [] for s in own}
    lengths = [_length(c) for c in machine.connectors]
    given = [x for x in lengths if x is not None]
    unknown = _SCHEMATIC * float(np.mean(given)) if given else 0.1
    for connector, ends, length in zip(machine.connectors, machine.wiring.ends, lengths):
        if isinstance(connector, AbstractConnector):
            (a, _), (b, _) = ends
            names = machine.wiring.stations[a], machine.wiring.stations[b]
            joined[names[0]].append((names[1], length, 1))
            joined[names[1]].append((names[0], length, -1))
    placed: dict[str, tuple[float, int]] = {}
    lanes = 0
    for first in own:
        if first in placed:
            continue
        placed[first] = (0.0, lanes)
        queue = deque([first])
        while queue:
            here = queue.popleft()
            z, lane = placed[here]
            taken: set[int] = {s for n, _, s in joined[here] if n in placed}
            for name, length, sense in joined[here]:
                if name in placed:
                    continue
                if sense in taken:
                    lanes += 1
                    lane_here = lanes
                else:
                    lane_here = lane
                taken.add(sense)
                placed[name] = (z + sense * (unknown if length is None else length), lane_here)
                queue.append(name)
        lanes += 1
    for i, (connector, ends) in enumerate(zip(machine.connectors, machine.wiring.ends)):
        if isinstance(connector, Composite):
            (a, lane), (b, _) = (placed[own[end]] for end, _ in ends)
            parts = np.repeat(_sections(connector.length), connector.elements)  # pyright: ignore
            along = a + (b - a) * np.cumsum(parts) / (np.sum(parts))
            first = machine.wiring.inner[i]
            for k in range(connector.inner):
                placed[machine.wiring.stations[first + k]] = (float(along[k]), lane)
    least = min(z for z, _ in placed.values())
    return {name: (z - least, lane) for name, (z, lane) in placed.items()}


def _length(connector) -> float | None:
    length = getattr(connector, "length", None)
    return None if length is None else float(np.sum(_sections(length)))


def _sections(value) -> np.ndarray:
    """A number, or one for each section of a stepped shaft, as a list."""
    return np.atleast_1d(np.asarray(value, float))


def _disc(station: Rotor | RigidBody) -> tuple[float, float]:
    """Radius and width of the disc with this mass and these inertias, m."""
    if isinstance(station, Rotor):
        m, jp, jt = station.mass, station.polar_inertia, station.transverse_inertia
    else:
        J = np.asarray(station.tensor())
        m, jp, jt = station.mass, J[2, 2], (J[0, 0] + J[1, 1]) / 2
    m, jp, jt = (float(np.asarray(x)) for x in (m, jp, jt))
    radius = np.sqrt(2 * jp / m)
    return radius, np.sqrt(max(0.0, 12 * jt / m - 3 * radius**2))


def draw_machine(machine: Machine, ax: Given | None = None) -> Axes:
    """Side view to scale: shafts with their diameters, rotors as discs of their mass and inertia,
    bearings on the ground, the drive, names, unbalance and a scale in mm."""
    where = positions(machine)
    discs = [_disc(s) for s in machine.stations if isinstance(s, (Rotor, RigidBody))]
    tall = max([r for r, _ in discs], default=0.02)
    length = max(max(z for z, _ in where.values()), tall)
    lanes = max(lane for _, lane in where.values()) + 1
    pitch = 3.6 * tall
    left, right = -0.12 * length - 0.3 * tall, 1.14 * length + 0.3 * tall
    for name, station in zip(machine.wiring.stations, machine.stations):
        if isinstance(station, (Rotor, RigidBody)):
            reach = _disc(station)[1] / 2 + 0.02 * length
            left, right = min(left, where[name][0] - reach), max(right, where[name][0] + reach)
    wide, high = right - left, (lanes - 1) * pitch + 3.3 * tall
    rows = min(_ROWS, len(_attached(machine)))
    words = (_ABOVE + _ROW * rows) / 72 if rows else 0.0  # inches
    width = 10.0 if high < 0.75 * wide else 7.5 * wide / high
    panel = figure(1, 1, (width, max(2.5, width * high / wide + words)), ax)[1][0, 0]
    if ax is not None:
        width = panel.bbox.width / panel.figure.dpi
    below = words * wide / width  # m
    thin = 0.008 * length

    def at(name):
        z, lane = where[name]
        return z, -lane * pitch

    for name, connector, ends in zip(
        machine.wiring.connectors, machine.connectors, machine.wiring.ends
    ):
        if isinstance(connector, AbstractConnector):
            (z0, y0), (z1, y1) = (at(machine.wiring.stations[s]) for s, _ in ends)
            _draw_connection(panel, name, connector, z0, y0, z1, y1, tall)
    for name, station in zip(machine.wiring.stations, machine.stations):
        z, y = at(name)
        top = _draw_station(panel, station, z, y, tall, thin)
        panel.annotate(
            name,
            (z, y + top),
            xytext=(0, 6),
            textcoords="offset points",
            ha="left" if isinstance(station, AbstractPrescribed) else "center",
            fontsize=10,
            fontweight="bold",
            annotation_clip=False,
        )
    _draw_attachments(panel, machine, at, tall)
    _draw_scale(panel, length, -(lanes - 1) * pitch - 1.62 * tall - below, tall)
    panel.set_aspect("equal")
    panel.set_xlim(left, right)
    panel.set_ylim(-(lanes - 1) * pitch - 1.95 * tall - below, 1.35 * tall)
    panel.axis("off")
    return panel


def _draw_connection(ax, name, connector, z0, y0, z1, y1, tall) -> None:
    d = getattr(connector, "diameter", None)
    ax.plot([z0, z1], [y0, y1], color=GREY, linewidth=0.6, linestyle=(0, (8, 3, 2, 3)), zorder=4)
    if d is None or y0 != y1:
        ax.plot([z0, z1], [y0, y1], color=COLOURS[4], linewidth=2, zorder=1)
        words = name
    else:
        words = f"{name}\n{1e3 * abs(z1 - z0):.4g} mm, {_draw_shaft(ax, connector, z0, z1, y0)}"
    ax.annotate(
        words,
        ((z0 + z1) / 2, (y0 + y1) / 2 - 1.12 * tall),
        ha="center",
        va="top",
        fontsize=8,
        color="#404040",
    )


def _draw_shaft(ax, shaft, z0, z1, y) -> str:
    """Draws it section by section, tapers included; returns its diameters in words."""
    end = getattr(shaft, "end_diameter", None)
    given = (shaft.length, shaft.diameter, shaft.diameter if end is None else end)
    lengths, left, right, inner = np.broadcast_arrays(
        *map(_sections, (*given, shaft.inner_diameter))
    )
    at = z0 + (z1 - z0) * np.concatenate([[0], np.cumsum(lengths)]) / np.sum(lengths)
    for a, b, d0, d1, hole in zip(at, at[1:], left, right, inner):
        for widths, style in (
            ((d0, d1), dict(facecolor=_STEEL, edgecolor="black", lw=0.8)),
            ((hole, hole), dict(facecolor="white", edgecolor=GREY, lw=0.5)),
        ):
            if max(widths) > 0:
                first, last = (w / 2 for w in widths)
                corners = [(a, y - first), (b, y - last), (b, y + last), (a, y + first)]
                ax.add_patch(Polygon(corners, closed=True, **style))
    least, most = 1e3 * min(left.min(), right.min()), 1e3 * max(left.max(), right.max())
    return f"Ø{most:.4g}" if least == most else f"Ø{least:.4g} to {most:.4g}"


def _draw_station(ax, station, z, y, tall, thin) -> float:
    """Returns how high above the axis the drawing reaches."""
    if isinstance(station, (Rotor, RigidBody)):
        radius, width = _disc(station)
        width = max(width, thin)
        ax.add_patch(
            Rectangle(
                (z - width / 2, y - radius),
                width,
                2 * radius,
                facecolor=COLOURS[0],
                alpha=0.75,
                edgecolor="black",
                lw=1.0,
                zorder=3,
            )
        )
        unbalance = getattr(station, "unbalance", None)
        if unbalance is not None and float(np.asarray(unbalance.eccentricity)) > 0:
            ax.add_patch(Circle((z, y + 0.82 * radius), 0.05 * tall, color=COLOURS[1], zorder=5))
        return radius
    if isinstance(station, Node):  # a place on the shaft, without a body
        mark = Circle((z, y), 0.035 * tall, facecolor="white", edgecolor="black", lw=1.0, zorder=5)
        ax.add_patch(mark)
        return 0.1 * tall
    if isinstance(station, AbstractPrescribed):
        size = 0.45 * tall
        ax.add_patch(
            Rectangle(
                (z, y - size),
                1.6 * size,
                2 * size,
                facecolor="#E8E8E8",
                edgecolor="black",
                zorder=2,
            )
        )
        ax.add_patch(
            FancyArrowPatch(
                (z + 0.8 * size, y - 0.6 * size),
                (z + 0.8 * size, y + 0.6 * size),
                connectionstyle="arc3,rad=0.7",
                arrowstyle="-|>",
                mutation_scale=12,
                color=COLOURS[1],
                lw=1.5,
                zorder=5,
            )
        )
        return size
    if isinstance(station, SelfAligningBearing):
        size = 0.16 * tall
        for sign in (1, -1):
            ax.add_patch(
                Circle(
                    (z, y + sign * size),
                    0.8 * size,
                    facecolor=COLOURS[2],
                    edgecolor="black",
                    zorder=4,
                )
            )
        foot = y - 0.95 * tall
        ax.add_patch(
            Polygon(
                [(z, y - 1.8 * size), (z - 1.6 * size, foot), (z + 1.6 * size, foot)],
                closed=True,
                facecolor="#D8EFE6",
                edgecolor="black",
                lw=0.8,
                zorder=2,
            )
        )
        _ground(ax, z, foot, 2.2 * size)
        return 1.9 * size
    ax.add_patch(
        Rectangle(
            (z - thin, y - 0.25 * tall),
            2 * thin,
            0.5 * tall,
            facecolor=COLOURS[5],
            edgecolor="black",
            zorder=3,
        )
    )
    return 0.25 * tall


def _ground(ax, z, foot, half) -> None:
    ax.plot([z - half, z + half], [foot, foot], color="black", lw=1.2)
    for s in np.linspace(-1, 1, 6):
        ax.plot(
            [z + s * half, z + s * half - 0.25 * half],
            [foot, foot - 0.3 * half],
            color="black",
            lw=0.6,
        )


def _attached(machine) -> list[tuple[str, str, str]]:
    """(name, kind, station) of every attachment."""
    return [
        (name, type(connector).__name__, machine.wiring.stations[ends[0][0]])
        for name, connector, ends in zip(
            machine.wiring.connectors, machine.connectors, machine.wiring.ends
        )
        if not isinstance(connector, AbstractConnector)
    ]


def _draw_attachments(ax, machine, at, tall) -> None:
    # below the names of the shafts, from left to right in rows, so that none hides another
    for k, (name, kind, station) in enumerate(sorted(_attached(machine), key=lambda a: at(a[2]))):
        z, y = at(station)
        ax.annotate(
            "",
            (z, y - 0.1 * tall),
            xytext=(z, y - 1.12 * tall),
            arrowprops=dict(arrowstyle="-|>", color=COLOURS[3], lw=0.8),
            zorder=6,
        )
        ax.annotate(
            f"{name} ({kind})",
            (z, y - 1.12 * tall),
            fontsize=8,
            ha="center",
            va="top",
            xytext=(0, -_ABOVE - _ROW * (k % _ROWS)),
            textcoords="offset points",
            color=COLOURS[3],
            annotation_clip=False,
        )


def _draw_scale(ax, length, y, tall) -> None:
    step = 10.0 ** np.floor(np.log10(length))
    step = next(s for s in (step / 2, step, 2 * step, 5 * step) if s >= length / 5)
    ax.plot([0, step], [y, y], color="black", lw=1.5)
    for z in (0, step):
        ax.plot([z, z], [y - 0.05 * tall, y + 0.05 * tall], color="black", lw=1.5)
    ax.annotate(
        f"{1e3 * step:g} mm",
        (step / 2, y),
        ha="center",
        va="top",
        fontsize=9,
        xytext=(0, -4),
        textcoords="offset points",
    )
