"""Which pictures there are of which object: behind its `plot`, `response.plot.orbit("main")`.

The table names functions of this room whose first argument is the object. Everything else is made from it:
the methods with the functions' own arguments and docstrings, so that tab completion and `help` show them.
"""

import functools
import inspect
from collections.abc import Callable
from typing import Any

import xarray as xr

from ..core.gate import bound
from ..diagnostics.bifurcation import Bifurcation
from ..diagnostics.centreline import Centreline
from ..diagnostics.orbit import Orbit
from ..diagnostics.orders import OrderTrack
from ..diagnostics.poincare import PoincareSection
from ..diagnostics.spectra import FullSpectrum
from ..diagnostics.waterfall import Waterfall
from ..identification.experiment import ExperimentDesign
from ..identification.identification import Identification
from ..linear.campbell import Campbell
from ..linear.linearise import LinearModel
from ..linear.loops import ControlLoops
from ..linear.response import FrequencyResponse
from ..linear.supports import CriticalSpeedMap
from ..machine.machine import Machine
from ..optimization.optimum import Optimum
from ..periodic.branch import Branch
from ..simulation.response import Response
from ..standards.amplification import Resonances
from ..standards.separation import SeparationCheck
from ..standards.stability import StabilityChart
from ..standards.unbalance_cases import UnbalanceCase
from .design import search_history
from .diagnose import cascade, full_spectrum, order_tracks, waterfall_map
from .diagnosed import (
    run_cascade,
    run_centreline,
    run_full_spectrum,
    run_orbit,
    run_order_tracks,
    run_poincare,
    run_waterfall,
)
from .experiment import expected_stds
from .forces import bearing_forces
from .identification import channel_fits, correlations, costs, posteriors, profile_curves
from .linear import campbell_diagram, stability_map
from .loops import loop_bode, nyquist, sensitivity_curves
from .machine import draw_machine
from .maps import support_map
from .motion import inclinations, spin, vibration
from .orbits import bifurcation, centreline, orbits, poincare
from .paths import distances, trajectories
from .periodic import branch_amplitudes
from .quantities import over_time, spectrum
from .response import bode, polar
from .sensitivity import scatter_matrix, sensitivity_bars
from .shapes import mode_shapes, model_shapes
from .standards import (
    amplification_widths,
    placed_shape,
    response_margins,
    screening_chart,
    stability_curve,
)
from .style import closed_on_failure
from .sweep import distributions, grid_lines, grid_map, grid_over, percentile_bands
from .torsion import speed_differences, speed_spectrum, torques

# The first of each is drawn by `plot()` itself.
_PICTURES: dict[type, dict[str, Callable[..., Any]]] = {
    Machine: {"layout": draw_machine, "modes": mode_shapes},
    Response: {
        "over_time": over_time,
        "spectrum": spectrum,
        "orbit": run_orbit,
        "full_spectrum": run_full_spectrum,
        "waterfall": run_waterfall,
        "cascade": run_cascade,
        "orders": run_order_tracks,
        "centreline": run_centreline,
        "poincare": run_poincare,
        "spin": spin,
        "vibration": vibration,
        "inclinations": inclinations,
        "trajectories": trajectories,
        "distances": distances,
        "bearing_forces": bearing_forces,
        "torques": torques,
        "speed_differences": speed_differences,
        "speed_spectrum": speed_spectrum,
    },
    LinearModel: {"modes": model_shapes},
    Campbell: {"campbell": campbell_diagram, "stability": stability_map},
    FrequencyResponse: {"bode": bode, "polar": polar},
    CriticalSpeedMap: {"map": support_map},
    ControlLoops: {"sensitivity": sensitivity_curves, "nyquist": nyquist, "bode": loop_bode},
    Resonances: {"widths": amplification_widths},
    SeparationCheck: {"margins": response_margins},
    StabilityChart: {"curve": stability_curve, "screening": screening_chart},
    UnbalanceCase: {"shape": placed_shape},
    Orbit: {"orbit": orbits},
    Centreline: {"centreline": centreline},
    PoincareSection: {"section": poincare},
    Bifurcation: {"diagram": bifurcation},
    Branch: {"amplitudes": branch_amplitudes},
    FullSpectrum: {"spectrum": full_spectrum},
    Waterfall: {"waterfall": waterfall_map, "cascade": cascade},
    OrderTrack: {"orders": order_tracks},
    Identification: {
        "fits": channel_fits,
        "correlations": correlations,
        "costs": costs,
        "profiles": profile_curves,
        "posteriors": posteriors,
    },
    ExperimentDesign: {"stds": expected_stds},
    Optimum: {"history": search_history},
    xr.Dataset: {  # of a sweep, behind `dataset.jaxrotor`
        "distributions": distributions,
        "percentile_bands": percentile_bands,
        "grid_lines": grid_lines,
        "grid_map": grid_map,
        "grid_over": grid_over,
        "scatter_matrix": scatter_matrix,
        "sensitivity_bars": sensitivity_bars,
    },
}
_AXES = """`ax`: where to draw, axes of matplotlib: one, or as many as there are panels, in reading order;
left out, a new figure of pyplot. Returns the axes: one, or an array of them; `.figure` is theirs."""


class Pictures:
    """What can be drawn of an object. Called, it draws the first of them."""

    _names: tuple[str, ...] = ()

    def __init__(self, owner: Any):
        self._owner = owner

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return getattr(self, self._names[0])(*args, **kwargs)

    def __dir__(self) -> list[str]:
        return list(self._names)

    def __repr__(self) -> str:
        lines = [f"pictures of {_a(type(self._owner))}:"]
        for name in self._names:
            method = getattr(type(self), name)
            known = [p for p in inspect.signature(method).parameters if p != "self"]
            lines.append(f"  {name}({', '.join(known)})")
            lines.append(f"      {_first_sentence(method.__doc__)}")
        return "\n".join(lines)


def pictures(owner: Any) -> Pictures:
    """The pictures of an object, `owner.plot`."""
    return _face(next(kind for kind in type(owner).__mro__ if kind in _PICTURES))(owner)


@functools.cache
def _face(kind: type) -> type[Pictures]:
    """The class of what stands behind `plot` of these objects: a method for each picture."""
    drawn = _PICTURES[kind]
    methods = {name: _method(kind, name, draw) for name, draw in drawn.items()}
    words = f"What can be drawn of {_a(kind)}. Called, it draws `{next(iter(drawn))}`."
    about = {"__doc__": words, "__module__": __name__, "_names": tuple(drawn)}
    return type(f"PicturesOf{kind.__name__}", (Pictures,), methods | about)


def _method(kind: type, name: str, draw: Callable[..., Any]) -> Callable[..., Any]:
    signature = inspect.signature(draw)
    _, *rest = signature.parameters.values()
    # what `ax` may be is said in words below
    rest = [p.replace(annotation=p.empty) if p.name == "ax" else p for p in rest]
    asked = signature.replace(parameters=rest)

    def method(self: Pictures, *args: Any, **kwargs: Any) -> Any:
        given = bound(name, asked, args, kwargs)
        with closed_on_failure():
            return draw(self._owner, *given.args, **given.kwargs)

    own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    method.__name__, method.__qualname__ = name, f"PicturesOf{kind.__name__}.{name}"
    method.__doc__ = f"{inspect.getdoc(draw)}\n\n{_AXES}\n"
    method.__signature__ = signature.replace(parameters=[own, *rest])  # pyright: ignore
    return method


def _a(kind: type) -> str:
    return f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"


def _first_sentence(words: str | None) -> str:
    text = " ".join((words or "").split("\n\n")[0].split())
    sentence = text.partition(". ")[0].partition(": ")[0].rstrip(".")
    return sentence if len(sentence) <= 92 else sentence[:89] + "..."
