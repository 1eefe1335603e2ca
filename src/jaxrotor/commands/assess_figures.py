"""The figures of an assessment: those that a reviewer expects."""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..study.assessed import Assessed
from ..study.study import Study
from ..study.torsional_checks import excitations_of
from .output import save_figure


def figures_of(study: Study, found: Assessed) -> Iterator[tuple[str, str, Callable[[], Any]]]:
    """(file name without its ending, caption, what draws it)."""
    from .. import plot

    for case in found.cases:
        yield (
            f"unbalance_{_plain(case.name)}",
            f"Mode shape {case.name} with the unbalance placed for it",
            lambda case=case: plot.placed_shape(case),
        )
    for name, check in found.separations.items():
        stem = f"response_{_plain(name)}" if name else "response"
        words = f", unbalance {name}" if name else ""
        yield (
            stem,
            f"Response to unbalance{words}: the running speeds, and at each resonance the margin to keep",
            lambda check=check: plot.response_margins(check),
        )
    if found.chart is not None:
        chart = found.chart
        yield (
            "stability",
            "Log decrement over the cross coupling applied",
            lambda: plot.stability_curve(chart),
        )
        if np.isfinite(float(chart.density)) and np.isfinite(float(chart.ratio)):
            yield (
                "screening",
                "Screening by mean gas density and critical speed ratio",
                lambda: plot.screening_chart(chart),
            )
    if found.torsional_speeds is not None and study.torsional is not None:
        speeds, asked = (
            found.torsional_speeds,
            replace(study.torsional, speeds=found.torsional_speeds),
        )
        excitations = excitations_of(study.machine, asked, speeds)
        count = sum(f.check == "torsional separation" for f in found.assessment.findings)
        yield (
            "interference",
            "Torsional natural frequencies across what excites them, with the bands to keep free",
            lambda: plot.torsional_interference(
                study.machine, speeds, excitations, None, asked.margin, max(count, 1)
            ),
        )


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", name.removeprefix("for ")).strip("_")


def save_figures(study: Study, found: Assessed, folder: Path) -> None:
    for stem, _, draw in figures_of(study, found):
        save_figure(draw(), folder / f"{stem}.png")
