"""Options of the command line that several commands share."""

import math
from typing import TYPE_CHECKING

from ..core.arguments import whole
from ..core.errors import InputError
from ..core.units import read

if TYPE_CHECKING:
    from ..study.study import Study

RPM = 30 / math.pi  # in a rad/s


def quantity_of(text: str | None, unit: str, option: str) -> float | None:
    """An option such as "3000 rpm", in `unit`."""
    if text is None:
        return None
    try:
        return float(read(text, unit))
    except ValueError as error:
        raise InputError(f"`{option}`: {error}") from None


def reach_of(study: "Study", top: str | None) -> float:
    """The highest speed, rad/s: as asked, else 1.2 of the drive's."""
    from ..simulation.prescribed import top_speed

    reach = quantity_of(top, "rad/s", "--to")
    if reach is None and study.simulation is not None:
        reach = 1.2 * top_speed(study.machine, study.settings.t_end, study.settings.speed)[1]
    if reach is None or not reach > 0:
        raise InputError(
            "`--to`: the highest speed must be positive, and this study's drive gives none: write "
            '--to "6000 rpm"'
        )
    return reach


def names_of(text: str) -> tuple[str, ...]:
    """Names between commas."""
    return tuple(x.strip() for x in text.split(","))


def study_name(study: "Study") -> str:
    """What the files say they were made from."""
    return str(study.path) if study.path is not None else study.name


def positive(count: int, option: str) -> int:
    return whole(1, 1_000_000)(count, f"`{option}`:")
