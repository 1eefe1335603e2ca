"""The figures that a study asks for: `[[figures]]`."""

from typing import Any

from ..core.units import factor, known_unit, shown
from ..machine.machine import Machine
from .diagnosis import Diagnosis, check_diagnosis, file_stem
from .mistakes import Faults, guess
from .quantities import quantities, split
from .settings import Section, read_section


class Figure(Section):
    """Quantities `y` over time or over another quantity `x`, each as `"part.quantity"`.

    There is a panel for each unit. `units` are those to draw in; what fits none is drawn in SI, with
    a prefix that suits it. `name` is that of the file, without its ending; left out it follows from
    the title.
    """

    title: str
    y: tuple[str, ...]
    x: str = "t"
    name: str | None = None
    units: tuple[str, ...] = ()

    @property
    def stem(self) -> str:
        """The name of the file without its ending."""
        return file_stem(self.name or self.title)


def read_figures(tables: Any, faults: Faults) -> tuple[Figure | Diagnosis, ...]:
    """The figures whose tables are sound."""
    if not isinstance(tables, list):
        faults.add("figures", f"must be a list, but is {shown(tables)}: write [[figures]] tables")
        return ()
    found: dict[str, Figure | Diagnosis] = {}
    for i, table in enumerate(tables):
        place = _place(i, table.get("title") if isinstance(table, dict) else None)
        kind = Diagnosis if isinstance(table, dict) and "kind" in table else Figure
        figure = read_section(kind, place, table, faults, "[figures]")
        if figure is None:
            continue
        if not figure.stem:
            faults.add(place, 'needs a file name, but its title has no letter: write name = "..."')
        elif figure.stem in found:
            faults.add(
                place, f'would be written to "{figure.stem}.png" like another: give it a name'
            )
        elif isinstance(figure, Figure) and not figure.y:
            faults.add(place, 'y must name a quantity at least, but is empty: write y = ["main.x"]')
        else:
            found[figure.stem] = figure
    return tuple(found.values())


def check_figures(
    figures: tuple[Figure | Diagnosis, ...], machine: Machine, faults: Faults
) -> None:
    """Whether the machine has what they show."""
    known = quantities(machine) if figures else {}
    for i, figure in enumerate(figures):
        place, units = _place(i, figure.title), []
        if isinstance(figure, Diagnosis):
            check_diagnosis(figure, place, machine, faults)
            continue
        paths = [("x", figure.x)] if figure.x != "t" else []
        paths += [(f"y[{k}]", path) for k, path in enumerate(figure.y)]
        for key, path in paths:
            part, quantity = split(path)
            if not part:
                faults.add(
                    place, f'{key} must be "part.quantity", but is {shown(path)}: {_for(known)}'
                )
            elif part not in known:
                faults.add(place, f'{key} names no part "{part}"{guess(part, known)}')
            elif quantity not in known[part]:
                have = known[part]
                faults.add(
                    place, f'{key}: "{part}" has no quantity "{quantity}"{guess(quantity, have)}'
                )
            else:
                units.append(known[part][quantity])
        for unit in figure.units:
            if not known_unit(unit):
                faults.add(place, f'units has the unknown unit "{unit}": write one such as "mm"')
            elif len(units) == len(paths) and not any(fits(unit, u) for u in units):
                listed = ", ".join(f"`{u}`" for u in dict.fromkeys(units))
                faults.add(place, f'units has "{unit}", but all is in {listed}: remove it')


def fits(unit: str, own: str) -> bool:
    """Whether a quantity in `own` can be drawn in `unit`."""
    return factor(own, unit) is not None


def _place(i: int, title: Any) -> str:
    return f'figures "{title}"' if isinstance(title, str) else f"figures, entry {i + 1}"


def _for(known: dict[str, dict[str, str]]) -> str:
    part = next(iter(known))
    return f'write "t" for the time, or one such as "{part}.{next(iter(known[part]), "torque")}"'
