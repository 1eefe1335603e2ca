"""A line of stations on a shaft whose drawing is given."""

from collections.abc import Mapping
from typing import Any

from ...core.arguments import choice, mapping, positive, text
from ...core.errors import InputError
from ...core.gate import takes
from ...core.parameter import known
from ...core.protocol import AbstractElement, AbstractStation
from ..rotors.node import Node
from ..rotors.rotor import Rotor
from .finite import FiniteElementShaft
from .profile import Between, Rows, as_profile, rows_or_file, within


@takes(
    profile=None,
    stations=mapping,
    name=text,
    between=choice("cones", "cylinders"),
    longest=positive("m"),
)
def line_from_profile(
    profile: Rows,
    stations: Mapping[str, tuple[float, AbstractStation]],
    name: str = "shaft",
    between: Between = "cones",
    longest: float | None = None,
    **options: Any,
) -> dict[str, AbstractElement]:
    """The elements of `Machine.in_line` for a shaft that is drawn as a `profile` and carries `stations`.

    **Arguments:**

    - `profile`, `between`, `longest`, `options`: as for `FiniteElementShaft.from_profile`.
    - `stations`: name -> (position in m, the station). An end of the profile where none stands gets a
      `Node`, `"shaft left end"` or `"shaft right end"`. A `Rotor` with `ends` takes up its own length.
    - `name`: of the pieces of shaft between, `"shaft 1"`, `"shaft 2"`, ...

    Raises `InputError` for a station off the profile, two at one place, and what `from_profile` refuses.
    """
    rows = rows_or_file(profile)
    checked = as_profile(rows)
    placed: list[tuple[float, str, Any]] = []
    for key, given in stations.items():
        if (
            not isinstance(given, tuple)
            or len(given) != 2
            or not isinstance(given[1], AbstractStation)
        ):
            raise InputError(
                f"stations: `{key}` must be (position in m, a station), but is {given!r}"
            )
        placed.append(
            (within(checked, given[0], f"stations: the position of `{key}`"), key, given[1])
        )
    low, high = float(checked.positions[0]), float(checked.positions[-1])
    ends = [(low, f"{name} left end"), (high, f"{name} right end")]
    for at, key in ends:
        if not any(abs(at - z) <= 1e-9 * (high - low) for z, _, _ in placed):
            placed.append((at, key, Node()))
    placed.sort(key=lambda one: one[0])
    found: dict[str, AbstractElement] = {}
    for k, (at, key, station) in enumerate(placed):
        if k:
            before, other, beside = placed[k - 1]
            start, stop = before + _reach(beside)[1], at - _reach(station)[0]
            if not stop - start > 1e-9 * (high - low):
                raise InputError(
                    f"stations: `{other}` at {before:g} m and `{key}` at {at:g} m leave no shaft between them"
                )
            shaft = f"{name} {k}" if len(placed) > 2 else name
            found[shaft] = FiniteElementShaft.from_profile(
                rows, start, stop, between, longest, **options
            )
        if key in found:
            raise InputError(f"stations: `{key}` is the name of a piece of shaft too: rename it")
        found[key] = station
    return found


def _reach(station: Any) -> tuple[float, float]:
    """How far it reaches to the left and to the right, m."""
    ends = station.ends if isinstance(station, Rotor) else None
    if ends is None:
        return 0.0, 0.0
    numbers = known(ends)
    if numbers is None:
        raise InputError(
            "stations: the ends of a Rotor must be numbers, but are being traced: build the line outside of "
            "`jit`"
        )
    return float(numbers[0]), float(numbers[1])
