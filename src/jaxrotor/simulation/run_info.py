"""How a run was made, and what it says of its own error."""

import warnings
from typing import Any

import equinox as eqx
import numpy as np

from ..core.parameter import is_concrete, numbers

# A run by a step of the user's own is warned of from this error on, as part of a coordinate's peak.
_COARSE = 1e-2


class RunInfo(eqx.Module):
    """How a response was made."""

    solver: str = eqx.field(static=True)
    order: int | None = eqx.field(static=True, default=None)
    substeps: int | None = eqx.field(static=True, default=None)
    span: int | None = eqx.field(static=True, default=None)
    evaluations: int | None = eqx.field(static=True, default=None)
    initial: str = eqx.field(static=True, default="")
    step: Any = None
    linearised_at: Any = None
    planned_top_speed: Any = None
    pilot_error: Any = None
    tolerance: Any = None
    seconds: Any = None
    steps: Any = None
    error: Any = None
    steady_gap: Any = None


def steps_words(info: RunInfo) -> str:
    if (info.span or 1) > 1:
        return f"{info.span} samples a step"
    if info.substeps is None:
        return "adaptive steps a sample"
    return f"{info.substeps} step{'s' * (info.substeps != 1)} a sample"


def error_words(info: RunInfo) -> str:
    """Of a run whose own error is above its tolerance; else empty."""
    if info.error is None or not all(map(is_concrete, (info.error, info.tolerance, info.step))):
        return ""
    error, asked, step = (float(numbers(x)) for x in (info.error, info.tolerance, info.step))
    own = not asked > 0  # a step of the user's own comes without a tolerance
    if error <= (_COARSE if own else asked) or np.isnan(error):
        return ""
    limit = "" if own else f", where {asked:.1g} was asked for"
    return (
        f"the run's own estimate of its error is {error:.1g} of a coordinate's peak{limit}: the step, "
        f"{step:.3g} s, is too long for what happens in it; give a shorter one (step=...)"
        + (", or none" if own else "")
    )


def tell_error(info: RunInfo) -> None:
    """Warns of a run whose own error is above its tolerance."""
    if words := error_words(info):
        warnings.warn(words, stacklevel=3)
