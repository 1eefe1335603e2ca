"""The figures of a sweep."""

from collections.abc import Iterator
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from ..study.study import Study
from ..sweeps.sensitivity import rank_regression
from ..sweeps.statistics import numbers_of
from .sweep_summary import flat_of, weights_of


def figures_of(study: Study, found: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    """Name and figure, closed once it is taken."""
    from .. import plot
    from ..plot.style import close, figure_of

    asked = study.sweep
    limits, axes = asked.limits, list(asked.cases.axes)
    numbers = list(numbers_of(found, asked.outputs))
    series = [name for name in asked.outputs if name not in numbers]
    weights = weights_of(study, found)
    flat = flat_of(found)
    for path, x in asked.cases.values.items():
        flat[path] = ("case", x, {"units": asked.units[path]})
    own = flat if not asked.base else flat.isel(case=slice(0, 2 * asked.base))
    drawn: list[tuple[str, Any]] = []
    if numbers and len(axes) == 1:
        drawn.append(("lines", lambda: plot.grid_lines(found, numbers, limits)))
    elif numbers and len(axes) == 2:
        drawn.append(("map", lambda: plot.grid_map(found, numbers, limits)))
    elif numbers:
        drawn.append(("distributions", lambda: plot.distributions(own, numbers, limits)))
    if numbers and len(axes) not in (1, 2):
        ranks = rank_regression(own, numbers, asked.paths)
        drawn.append(
            ("scatter", lambda: plot.scatter_matrix(own, asked.paths, numbers, ranks, limits))
        )
    if weights is not None:
        drawn.append(("sensitivity", lambda: plot.sensitivity_bars(weights)))
    for name in series:
        if len(axes) == 1:
            drawn.append((name, lambda n=name: plot.grid_over(found, n, limits.get(n))))
        else:
            drawn.append((name, lambda n=name: plot.percentile_bands(own, n, limits.get(n))))
    for name, draw in drawn:
        fig = figure_of(draw())
        yield name, fig
        close([fig])
