"""Figures and tables, written whole or not at all."""

import csv
from pathlib import Path
from typing import Any

from ..core.files import written_whole


def save_figure(drawn: Any, path: Path) -> None:
    """The figure of the axes that a picture returned; closed then."""
    from ..plot.style import close, figure_of

    figure = figure_of(drawn)
    with written_whole(path) as file:
        figure.savefig(file, dpi=150, format="png", bbox_inches="tight")
    close([figure])


def save_table(path: Path, header: list[str], rows: list[list[str]]) -> None:
    with written_whole(path) as file, open(file, "w", newline="") as lines:
        csv.writer(lines).writerows([header, *rows])
