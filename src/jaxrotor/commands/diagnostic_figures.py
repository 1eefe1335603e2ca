"""Draws the diagnostic figures of a study."""

from collections.abc import Callable
from typing import Any

from ..core.errors import JaxrotorError
from ..plot import diagnosed
from ..plot.style import closed_on_failure, figure
from ..simulation.response import Response

_DRAW: dict[str, Callable[..., Any]] = {
    "full_spectrum": diagnosed.run_full_spectrum,
    "waterfall": diagnosed.run_waterfall,
    "cascade": diagnosed.run_cascade,
    "order_tracking": diagnosed.run_order_tracks,
    "orbit": diagnosed.run_orbit,
    "centreline": diagnosed.run_centreline,
    "poincare": diagnosed.run_poincare,
}


def diagnosis(response: Response, wanted: Any) -> Any:
    """The figure's axes; where the run does not allow it (a shaft that turns back, too few turns), a page
    that says why, so that the rest of the report is not lost."""
    more = {"orders": wanted.orders, "clearance": wanted.clearance}
    given = {name: value for name, value in more.items() if value is not None}
    of_x = ", x" if wanted.kind == "order_tracking" else ""
    title = f"{wanted.title}: {wanted.station}{of_x}"
    try:
        with closed_on_failure():
            return _DRAW[wanted.kind](response, wanted.station, wanted.start, title=title, **given)
    except JaxrotorError as error:
        _, axes = figure(1, 1, (9.0, 2.5))
        axes[0, 0].set_axis_off()
        axes[0, 0].set_title(wanted.title, fontsize=11, loc="left")
        words = f"Not drawn. {error}"
        axes[0, 0].text(0, 0.9, words, va="top", wrap=True, transform=axes[0, 0].transAxes)
        return axes[0, 0]
