"""The machine itself: a side view to scale."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, FancyArrowPatch, Polygon, Rectangle

from ..core.protocol import AbstractConnector, AbstractPrescribed, Epicyclic, Geared
from ..elements.bearings.self_aligning import SelfAligningBearing
from ..elements.rotors.body import RigidBody
from ..elements.rotors.node import Node
from ..elements.rotors.rotor import Rotor
from ..machine.machine import Machine
from .lanes import (
    MOST_ROWS,
    NAME,
    NAME_ROW,
    ROW,
    SMALL,
    Drawing,
    attached,
    disc,
    laid_out,
    load_words,
    sections,
)
from .style import COLOURS, GREY, Given, figure

_STEEL = "#C9D3DC"
_WORDS = "#404040"


def draw_machine(machine: Machine, ax: Given | None = None) -> Axes:
    """Side view to scale: shafts with their diameters, rotors as discs of their mass and inertia,
    bearings on the ground, the drive, names, unbalance and a scale in mm. Branches, and what gears drive,
    stand in lanes below their line. Of very many parts those are named for which there is room."""
    words = {
        name: _shaft_words(name, connector)
        for name, connector in zip(machine.wiring.connectors, machine.connectors)
        if isinstance(connector, AbstractConnector)
    }
    drawing = laid_out(machine, words)
    panel = figure(1, 1, drawing.size, ax)[1][0, 0]
    thin = 0.008 * drawing.length
    for name, connector, ends in zip(
        machine.wiring.connectors, machine.connectors, machine.wiring.ends
    ):
        if isinstance(connector, AbstractConnector):
            ends = [machine.wiring.stations[s] for s, _ in ends]
            _draw_connection(panel, drawing, name, connector, ends, words[name])
        elif isinstance(connector, Epicyclic):
            z, levels = zip(*(drawing.at(machine.wiring.stations[s]) for s, _ in ends))
            panel.plot(z, levels, color=COLOURS[4], linewidth=2, zorder=1)
    thick = _shaft_radii(machine)
    for name, station in zip(machine.wiring.stations, machine.stations):
        _draw_station(panel, station, drawing, machine, name, thin)
        lane, (z, y) = drawing.lane(name), drawing.at(name)
        if isinstance(station, AbstractPrescribed):  # above its box
            z += 0.36 * drawing.tall * (-1 if drawing.leads(machine, name) else 1)
        if name not in lane.names:
            continue
        # in one height where there are several rows: only so none runs into another
        several = max(lane.names.values()) > 0
        top = max(_height(station, drawing.tall), thick.get(name, 0.0))
        top = lane.up if several else top
        panel.annotate(
            name,
            (z, y + top),
            xytext=(0, 4 + NAME_ROW * lane.names[name]),
            textcoords="offset points",
            ha="center",
            fontsize=NAME,
            fontweight="bold",
            annotation_clip=False,
            zorder=8,
            bbox=dict(facecolor="white", edgecolor="none", alpha=0.75, pad=0.6),
        )
    _draw_attachments(panel, machine, drawing)
    _draw_scale(panel, drawing)
    panel.set_aspect("equal")
    panel.set_xlim(drawing.left, drawing.right)
    panel.set_ylim(drawing.bottom, drawing.top)
    panel.axis("off")
    return panel


def _shaft_radii(machine: Machine) -> dict[str, float]:
    """station -> radius of the thickest shaft that ends there, m."""
    found: dict[str, float] = {}
    for connector, ends in zip(machine.connectors, machine.wiring.ends):
        if getattr(connector, "diameter", None) is not None:
            for station, _ in ends:
                name = machine.wiring.stations[station]
                found[name] = max(found.get(name, 0.0), 5e-4 * _diameters(connector)[1])
    return found


def _shaft_words(name: str, connector) -> str:
    if getattr(connector, "diameter", None) is None:
        return name
    least, most = _diameters(connector)
    across = f"Ø{least:.4g}" if least == most else f"Ø{least:.4g} to {most:.4g}"
    return f"{name}\n{1e3 * float(np.sum(sections(connector.length))):.4g} mm, {across}"


def _diameters(shaft) -> tuple[float, float]:
    """Least and greatest, mm."""
    end = getattr(shaft, "end_diameter", None)
    every = [sections(d) for d in (shaft.diameter, shaft.diameter if end is None else end)]
    return 1e3 * min(d.min() for d in every), 1e3 * max(d.max() for d in every)


def _draw_connection(ax, drawing: Drawing, name, connector, ends, words) -> None:
    (z0, y0), (z1, y1) = map(drawing.at, ends)
    lane = min((drawing.lane(e) for e in ends), key=lambda one: one.level)
    y = lane.level
    if y0 != y1:  # down to its own lane where it leaves the line
        leave = z0 if y0 > y1 else z1
        look = dict(color=COLOURS[4], linewidth=2) if isinstance(connector, Geared) else {}
        ax.plot([leave, leave], [y0, y1], **dict(color=GREY, linewidth=1.2) | look, zorder=1)
    ax.plot([z0, z1], [y, y], color=GREY, linewidth=0.6, linestyle=(0, (8, 3, 2, 3)), zorder=4)
    if getattr(connector, "diameter", None) is not None:
        _draw_shaft(ax, connector, z0, z1, y)
    else:
        ax.plot([z0, z1], [y, y], color=COLOURS[4], linewidth=2, zorder=1)
    if name not in lane.shafts:
        return
    ax.annotate(
        words,
        ((z0 + z1) / 2, y - lane.down),
        xytext=(0, -4 - ROW * lane.lines * lane.shafts[name]),
        textcoords="offset points",
        ha="center",
        va="top",
        fontsize=SMALL,
        color=_WORDS,
        annotation_clip=False,
    )


def _draw_shaft(ax, shaft, z0, z1, y) -> None:
    """Section by section, tapers included."""
    given = [shaft.length]
    for name in ("diameter", "inner_diameter"):
        end = getattr(shaft, f"end_{name}", None)
        given += [getattr(shaft, name), getattr(shaft, name) if end is None else end]
    lengths, *across = np.broadcast_arrays(*map(sections, given))
    at = z0 + (z1 - z0) * np.concatenate([[0], np.cumsum(lengths)]) / np.sum(lengths)
    for a, b, d0, d1, hole0, hole1 in zip(at, at[1:], *across):
        for widths, style in (
            ((d0, d1), dict(facecolor=_STEEL, edgecolor="black", lw=0.8)),
            ((hole0, hole1), dict(facecolor="white", edgecolor=GREY, lw=0.5)),
        ):
            if max(widths) > 0:
                first, last = (w / 2 for w in widths)
                corners = [(a, y - first), (b, y - last), (b, y + last), (a, y + first)]
                ax.add_patch(Polygon(corners, closed=True, **style))


def _height(station, tall: float) -> float:
    """How high above the axis a station is drawn."""
    if isinstance(station, (Rotor, RigidBody)):
        return disc(station)[0]
    if isinstance(station, Node):
        return 0.1 * tall
    if isinstance(station, AbstractPrescribed):
        return 0.45 * tall
    return 0.16 * 1.9 * tall if isinstance(station, SelfAligningBearing) else 0.25 * tall


def _draw_station(ax, station, drawing: Drawing, machine: Machine, name: str, thin: float) -> None:
    z, y = drawing.at(name)
    tall = drawing.tall
    if isinstance(station, (Rotor, RigidBody)):
        _draw_rotor(ax, station, z, y, tall, thin)
    elif isinstance(station, Node):  # a place on the shaft, without a body
        mark = Circle((z, y), 0.035 * tall, facecolor="white", edgecolor="black", lw=1.0, zorder=5)
        ax.add_patch(mark)
    elif isinstance(station, AbstractPrescribed):
        _draw_drive(ax, z, y, 0.45 * tall, drawing.leads(machine, name))
    elif isinstance(station, SelfAligningBearing):
        _draw_bearing(ax, z, y, tall)
    else:
        look: Any = dict(facecolor=COLOURS[5], edgecolor="black", zorder=3)
        ax.add_patch(Rectangle((z - thin, y - 0.25 * tall), 2 * thin, 0.5 * tall, **look))


def _draw_rotor(ax, station, z, y, tall, thin) -> None:
    radius, width = disc(station)
    width = max(width, thin)
    look: Any = dict(facecolor=COLOURS[0], alpha=0.75, edgecolor="black", lw=1.0, zorder=3)
    ax.add_patch(Rectangle((z - width / 2, y - radius), width, 2 * radius, **look))
    unbalance = getattr(station, "unbalance", None)
    if unbalance is not None and float(np.asarray(unbalance.eccentricity)) > 0:
        ax.add_patch(Circle((z, y + 0.82 * radius), 0.05 * tall, color=COLOURS[1], zorder=5))


def _draw_drive(ax, z, y, size, leads: bool) -> None:
    """To the left of the line that it begins, to the right of one that it ends."""
    z0 = z - 1.6 * size if leads else z
    look: Any = dict(facecolor="#E8E8E8", edgecolor="black", zorder=2)
    ax.add_patch(Rectangle((z0, y - size), 1.6 * size, 2 * size, **look))
    ax.add_patch(
        FancyArrowPatch(
            (z0 + 0.8 * size, y - 0.6 * size),
            (z0 + 0.8 * size, y + 0.6 * size),
            connectionstyle="arc3,rad=0.7",
            arrowstyle="-|>",
            mutation_scale=12,
            color=COLOURS[1],
            lw=1.5,
            zorder=5,
        )
    )


def _draw_bearing(ax, z, y, tall) -> None:
    size = 0.16 * tall
    for sign in (1, -1):
        look = dict(facecolor=COLOURS[2], edgecolor="black", zorder=4)
        ax.add_patch(Circle((z, y + sign * size), 0.8 * size, **look))
    foot = y - 0.95 * tall
    corners = [(z, y - 1.8 * size), (z - 1.6 * size, foot), (z + 1.6 * size, foot)]
    look = dict(facecolor="#D8EFE6", edgecolor="black", lw=0.8, zorder=2)
    ax.add_patch(Polygon(corners, closed=True, **look))
    half = 2.2 * size
    ax.plot([z - half, z + half], [foot, foot], color="black", lw=1.2)
    for s in np.linspace(-1, 1, 6):
        ax.plot(
            [z + s * half, z + s * half - 0.25 * half],
            [foot, foot - 0.3 * half],
            color="black",
            lw=0.6,
        )


def _draw_attachments(ax, machine: Machine, drawing: Drawing) -> None:
    # below the words of the shafts, in rows, so that none hides another
    hung = attached(machine)
    for name, kind, station in hung:
        (z, y), lane = drawing.at(station), drawing.lane(station)
        arrow = dict(arrowstyle="-|>", color=COLOURS[3], lw=0.8)
        ax.annotate(
            "",
            (z, y - 0.1 * drawing.tall),
            xytext=(z, y - lane.down),
            arrowprops=arrow,
            zorder=6,
        )
        if name not in lane.loads:
            continue
        shafts = (1 + max(lane.shafts.values(), default=-1)) * lane.lines * ROW
        ax.annotate(
            load_words(name, kind, len(hung) > 2 * MOST_ROWS),
            (z, y - lane.down),
            fontsize=SMALL,
            ha="center",
            va="top",
            xytext=(0, -7 - shafts - ROW * lane.loads[name]),
            textcoords="offset points",
            color=COLOURS[3],
            annotation_clip=False,
        )


def _draw_scale(ax, drawing: Drawing) -> None:
    length, y = drawing.length, drawing.bottom
    step = 10.0 ** np.floor(np.log10(length))
    step = next(s for s in (step / 2, step, 2 * step, 5 * step) if s >= length / 5)
    look = dict(ha="center", va="top", fontsize=9, xytext=(0, 14), textcoords="offset points")
    ends = dict(arrowstyle="|-|,widthA=0.3,widthB=0.3", shrinkA=0, shrinkB=0, lw=1.3)
    height = (drawing.top - drawing.bottom) * 18 / (72 * drawing.size[1])
    ax.annotate("", (0, y + height), xytext=(step, y + height), arrowprops=ends)
    ax.annotate(f"{1e3 * step:g} mm", (step / 2, y), annotation_clip=False, **look)
