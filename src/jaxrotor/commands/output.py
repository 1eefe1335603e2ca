"""Figures and tables, written whole or not at all."""

import csv
from pathlib import Path
from typing import Any

from ..core.files import written_whole


def save_figure(figure: Any, path: Path) -> None:
    with written_whole(path) as file:
        figure.savefig(file, dpi=150, format="png", bbox_inches="tight")


def save_table(path: Path, header: list[str], rows: list[list[str]]) -> None:
    with written_whole(path) as file, open(file, "w", newline="") as lines:
        csv.writer(lines).writerows([header, *rows])
