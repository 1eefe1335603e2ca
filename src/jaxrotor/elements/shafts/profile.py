"""A shaft as its drawing tells it: rows of position, diameter and bore along the axis."""

import csv
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array

from ...core.arguments import path as path_like, real_array, short, text
from ...core.errors import InputError
from ...core.gate import takes
from ...core.parameter import known
from ...core.units import factor

Between = Literal["cones", "cylinders"]
_COLUMNS = ("position", "diameter", "bore")
_MEANT = {"inner_diameter": "bore", "outer_diameter": "diameter", "z": "position"}
# Of a shaft's length: positions closer than this are one.
_SAME = 1e-9


class Profile(NamedTuple):
    """Positions (m, known numbers, rising; two alike make a step), diameters and bores there."""

    positions: np.ndarray
    diameters: np.ndarray | Array
    bores: np.ndarray | Array


def as_profile(rows: Any, place: str = "profile") -> Profile:
    """Checked: raises `InputError`, which names the row."""
    try:
        given = [tuple(row) for row in rows]
    except TypeError:
        given = []
    if len(given) < 2 or any(len(row) not in (2, 3) for row in given):
        raise InputError(
            f"{place} must be two rows at least of (position, diameter) or (position, diameter, bore) in m, "
            f"but is {short(rows)}"
        )
    columns = [
        _column([row[i] if i < len(row) else 0.0 for row in given], f"{place}: each {name}")
        for i, name in enumerate(_COLUMNS)
    ]
    positions = columns[0]
    if not isinstance(positions, np.ndarray):
        raise InputError(
            f"{place}: positions must be numbers, but are being traced: build the shaft outside of `jit` and "
            "change its lengths by machine.set"
        )
    diameters, bores = (x if isinstance(x, np.ndarray) else known(x) for x in columns[1:])
    for k in range(len(given)):
        where = f"{place}, row {k + 1}"
        if not np.isfinite(positions[k]):
            raise InputError(f"{where}: position must be finite, but is {positions[k]:g}")
        if k and positions[k] < positions[k - 1]:
            raise InputError(
                f"{where}: positions must not fall, but {positions[k]:g} m follows {positions[k - 1]:g} m"
            )
        if k > 1 and positions[k] == positions[k - 2]:
            raise InputError(
                f"{where}: is the third at {positions[k]:g} m: two make a step, leave one out"
            )
        if diameters is not None and not 0 < diameters[k] < np.inf:
            raise InputError(f"{where}: diameter must be positive, but is {diameters[k]:g} m")
        if diameters is None or bores is None:
            continue
        if not 0 <= bores[k] < diameters[k]:
            raise InputError(
                f"{where}: bore must be smaller than the diameter and not negative, but is {bores[k]:g} "
                f"against "
                f"{diameters[k]:g} m"
            )
    if positions[0] == positions[-1]:
        raise InputError(f"{place} has no length: all rows stand at {positions[0]:g} m")
    return Profile(positions, *columns[1:])


def _column(values: list[Any], place: str) -> np.ndarray | Array:
    """NumPy's where all are known: inside `jit` JAX would trace them."""
    numbers = [known(x) if isinstance(x, Array) else x for x in values]
    if any(x is None for x in numbers):
        return jnp.stack([jnp.asarray(x, float) for x in values])
    found = real_array(numbers)
    if found is None or found.shape != (len(values),):
        raise InputError(f"{place} must be one number in m")
    if any(isinstance(x, Tracer) for x in values):  # derived by, with numbers behind
        return jnp.stack([jnp.asarray(x, float) for x in values])
    return found.astype(float)


def sections_between(
    profile: Profile,
    start: float,
    stop: float,
    between: Between,
    longest: float | None,
) -> dict[str, Any]:
    """A shaft's dimensions from `start` to `stop` (m, within the profile), section by section."""
    at, same = profile.positions, _SAME * float(np.ptp(profile.positions))
    ends, lengths = [], []
    for k in range(len(at) - 1):
        low, high = max(at[k], start), min(at[k + 1], stop)
        if high - low <= same:
            continue
        count = 1 if longest is None else int(np.ceil((high - low) / longest * (1 - 1e-12)))
        edges = np.linspace(low, high, count + 1)
        shares = (edges - at[k]) / (at[k + 1] - at[k])
        for a, b in zip(shares, shares[1:]):
            ends.append((k, a, b))
        lengths += [(high - low) / count] * count

    def across(values: Any) -> tuple[Any, Any]:
        xp: Any = np if isinstance(values, np.ndarray) else jnp
        if between == "cylinders":
            return xp.stack([values[k] for k, _, _ in ends]), None
        left, right = (
            xp.stack([values[e[0]] * (1 - e[i]) + values[e[0] + 1] * e[i] for e in ends])
            for i in (1, 2)
        )
        straight = xp is np and np.allclose(left, right, rtol=1e-12, atol=0)
        return left, None if straight else right

    (outer, end_outer), (bore, end_bore) = map(across, (profile.diameters, profile.bores))
    return dict(
        length=np.array(lengths),
        diameter=outer,
        inner_diameter=bore,
        end_diameter=end_outer,
        end_inner_diameter=end_bore,
    )


def within(profile: Profile, position: Any, place: str) -> float:
    """A position on the profile, m; those at its very ends are drawn there."""
    low, high = float(profile.positions[0]), float(profile.positions[-1])
    try:
        found = float(position)
    except (TypeError, ValueError):
        raise InputError(f"{place} must be a number in m, but is {short(position)}") from None
    if not low - _SAME * (high - low) <= found <= high + _SAME * (high - low):
        raise InputError(
            f"{place} must lie on the profile, {low:g} to {high:g} m, but is {found:g} m"
        )
    return min(max(found, low), high)


@takes(file=path_like, unit=text)
def read_profile(file: str | os.PathLike[str], unit: str | None = None) -> np.ndarray:
    """The rows (position, diameter, bore), m, of a CSV file whose first line names its columns: `position`,
    `diameter` and, unless the shaft is solid, `bore`, each with its unit: `position [mm]`. Commas, semicolons
    or tabs between; lines that begin with # are passed over; further columns too.

    `unit`: that of columns which name none. Raises `InputError` where the file cannot be read so, with the
    line.
    """
    place = Path(file).name
    try:
        lines = Path(file).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"`{file}`: cannot be read as a profile: {error}") from None
    told = [(k + 1, line) for k, line in enumerate(lines) if line.strip() and line[0] != "#"]
    if len(told) < 3:
        raise InputError(
            f"`{place}`: needs a line of names and two rows at least: position, diameter, bore"
        )
    head = told[0][1]
    mark = next((m for m in (";", "\t") if m in head), ",")
    first, *rows = csv.reader([line for _, line in told], delimiter=mark)
    columns: dict[str, tuple[int, float]] = {}
    for i, title in enumerate(first):
        found = re.fullmatch(r"\s*([^\[\]()]+?)\s*(?:[\[(]([^\])]+)[\])])?\s*", title)
        name = found[1].lower().replace(" ", "_") if found else ""
        name = _MEANT.get(name, name)
        if found is None or name not in _COLUMNS:
            continue
        given = found[2] or unit
        size = None if given is None else factor(given, "m")
        if size is None:
            raise InputError(
                f"`{place}`: column {name} must name its unit of length, such as `{name} [mm]`, but is "
                f"`{title.strip()}`"
            )
        columns[name] = i, size
    for name in _COLUMNS[:2]:
        if name not in columns:
            raise InputError(
                f"`{place}`: has no column {name}: its first line is `{head}`, write "
                f"`position [mm]{mark} diameter [mm]`"
            )
    out = np.zeros((len(rows), 3))
    for j, ((line, _), row) in enumerate(zip(told[1:], rows)):
        for name, (i, size) in columns.items():
            written = row[i].strip() if i < len(row) else ""
            try:
                out[j, _COLUMNS.index(name)] = float(written.replace(",", ".")) * size
            except ValueError:
                raise InputError(
                    f"`{place}`, line {line}: {name} must be a number, but is `{written}`"
                ) from None
    as_profile(out, f"`{place}`")
    return out


def rows_or_file(given: Any) -> Any:
    """What stands for a profile: its rows, or the file that has them."""
    if isinstance(given, (str, os.PathLike)):
        return read_profile(given)
    return given


Rows = Sequence[Sequence[Any]] | np.ndarray | str | os.PathLike[str]
