"""How far resonances must stay from the speeds at which a machine runs, and how far they do."""

from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.arguments import number, whole
from ..core.doors import plot_door
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from ..machine.machine import Machine
from .amplification import HALF_POWER, Resonances, place_of, resonances_of
from .finding import Assessment, Finding
from .placed import excited, several, words_of

SOURCE = "API RP 684 SP6.8.2.10, as read in ross-report (analysis.py)"
_RPM = number("rad/s", above=0.0)
_PART = number("%", least=0.0)


@takes(factor=None, most_below=_PART, most_above=_PART, least_factor=number(above=1.5))
def required_margins(
    factor: Any, most_below: Any = 16.0, most_above: Any = 26.0, least_factor: Any = 2.5
) -> Float[Array, "2"]:
    """Separation margins, % of the running speed, that a resonance of this amplification factor must keep
    below the least and above the greatest running speed: min(16, 17 (1 - 1/(AF - 1.5))) and
    min(26, 10 + 17 (1 - 1/(AF - 1.5))); none for factors below `least_factor`, which count as critically
    damped. Raises `InputError` for limits that are none. Source: API RP 684 SP6.8.2.10 / API 617, as read in
    ross-report."""
    factor = jnp.asarray(factor, float)
    damped = factor < least_factor
    part = 17.0 * (1 - 1 / (jnp.where(damped, least_factor, factor) - 1.5))
    both = jnp.stack([jnp.minimum(most_below, part), jnp.minimum(most_above, 10.0 + part)])
    return jnp.where(damped, 0.0, both)


@takes(critical=None, least=None, greatest=None)
def actual_margin(critical: Any, least: Any, greatest: Any) -> Float[Array, ""]:
    """How far a critical speed is from the running speeds from `least` to `greatest` (one unit for all), in %
    of the nearer of these: below 100 (least - critical)/least, above 100 (critical - greatest)/greatest.
    Negative between them: what is missing to the nearer end. 14 000 against 20 000 has 30 %. Raises
    `InputError` for what is no number."""
    critical, least, greatest = (jnp.asarray(x, float) for x in (critical, least, greatest))
    return 100 * jnp.maximum((least - critical) / least, (critical - greatest) / greatest)


class SeparationCheck(eqx.Module):
    """What each probe's resonances are, and the margins that they keep. `findings` are those of
    `assessment`; `least` and `greatest`: the running speeds, rad/s."""

    resonances: tuple[Resonances, ...]
    assessment: Assessment
    least: Float[Array, ""]
    greatest: Float[Array, ""]

    plot = plot_door()

    @property
    def met(self) -> Array:
        return self.assessment.met

    def __repr__(self) -> str:
        return repr(self.assessment)


@takes(
    least=_RPM,
    greatest=_RPM,
    probes=None,
    unbalance=None,
    start=_RPM,
    stop=_RPM,
    count=whole(1),
    points=whole(5),
    most_below=_PART,
    most_above=_PART,
    least_factor=number(above=1.5),
    drop=number(above=0.0, below=1.0),
)
def separation_margins(
    machine: Machine,
    probes: Any,
    least: float,
    greatest: float,
    unbalance: Any = None,
    *,
    start: float | None = None,
    stop: float | None = None,
    count: int | None = None,
    points: int = 201,
    most_below: Any = 16.0,
    most_above: Any = 26.0,
    least_factor: Any = 2.5,
    drop: Any = HALF_POWER,
    at: Any = "equilibrium",
) -> SeparationCheck:
    """Amplification factor and separation margin of each resonance that `probes` read from `start` (default:
    a twentieth of `least`) to `stop` (default: twice `greatest`), against the running speeds from `least`
    to `greatest`, rad/s.

    `probes`: one or several, as for `resonances`, whose other arguments these are. Margins in %: see
    `actual_margin` and `required_margins`, whose limits are arguments. A resonance between the running speeds
    has a negative margin and is not met, unless it counts as critically damped: then it is told for
    information. Where the factor is not known (no flank falls far enough) the caps of the margins count.
    `count`: the highest so many peaks of each probe; needed under `jit`. Differentiable in both modes. Raises
    `InputError` as `resonances` does, and where `least` lies above `greatest`.
    """
    if least > greatest:
        raise InputError(
            f"least and greatest must not fall, but are {least:g} and {greatest:g} rad/s"
        )
    begin = 0.05 * least if start is None else start
    end = 2.0 * greatest if stop is None else stop
    limits = most_below, most_above, least_factor
    asked = several(probes)
    run, seen = excited(machine, unbalance, asked, end, at)
    words = [words_of(probe) for probe in asked]
    found = resonances_of(run, seen, words, (begin, end), drop, count, points)
    findings = [f for one in found for f in _findings(one, least, greatest, limits)]
    return SeparationCheck(
        tuple(found), Assessment(tuple(findings)), jnp.asarray(least), jnp.asarray(greatest)
    )


def _findings(one: Resonances, least: Any, greatest: Any, limits: tuple) -> Iterator[Finding]:
    factors = one.factors
    for k in range(factors.shape[0]):
        words = place_of(one, k)
        if not words:
            continue
        speed, factor = one.speeds[k], factors[k]
        nothing = jnp.asarray(jnp.nan)
        yield Finding(
            "amplification factor",
            words,
            factor,
            nothing,
            "for information",
            "",
            SOURCE.replace("10", "1"),
        )
        # no factor: as if it were sharp
        lost = jnp.isnan(factor)
        required = required_margins(jnp.where(lost, 1e9, factor), *limits)
        below = (least - speed) / least > (speed - greatest) / greatest
        margin = actual_margin(speed, least, greatest)
        limit = jnp.where(below, *required)
        damped = (factor < limits[2]) & ~lost
        told = known(damped)
        if told is not None and told:
            words = f"{words}; factor below {float(limits[2]):g}"
            yield Finding(
                "separation margin", words, margin, nothing, "for information", "%", SOURCE
            )
            continue
        # in a program it is not known which: then nothing is asked of what is damped or is no peak
        free = damped | jnp.isnan(speed)
        limit = jnp.where(free, -jnp.inf, limit)
        margin = jnp.where(jnp.isnan(speed), 0.0, margin)
        yield Finding("separation margin", words, margin, limit, "at least", "%", SOURCE)
