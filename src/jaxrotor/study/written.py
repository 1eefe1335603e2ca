"""Figures, tables and summaries, written whole or not at all."""

import csv
import json
from pathlib import Path
from typing import Any

from ..files import written_whole


def save_figure(figure: Any, path: Path) -> None:
    with written_whole(path) as file:
        figure.savefig(file, dpi=150, format="png", bbox_inches="tight")


def save_table(path: Path, header: list[str], rows: list[list[str]]) -> None:
    with written_whole(path) as file, open(file, "w", newline="") as lines:
        csv.writer(lines).writerows([header, *rows])


def save_json(path: Path, summary: dict[str, Any]) -> None:
    with written_whole(path) as file:
        file.write_text(json.dumps(summary, indent=2) + "\n")
