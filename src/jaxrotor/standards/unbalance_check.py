"""A response to applied unbalance against what probes and clearances allow."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import number, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import known
from ..core.quick import lightly_compiled, traced
from ..elements.bearings.journal import AbstractFilm
from ..machine.machine import Machine
from .amplification import HALF_POWER, readings, resonances_of
from .finding import Assessment, Finding
from .placed import Excited, Probe, Seen, excited, several, words_of
from .unbalance_cases import probe_limit, scale_factor

SOURCE = "API RP 684 SP6.8.2.11, as read in ross-report (analysis.py)"
CLEARANCE = "API 617/684, 75 % of the diametral clearance (as commonly restated, text not seen)"
_SPEED = number("rad/s", above=0.0)
_LEAST = 0.02  # of the greatest speed, from which amplitudes at clearances count


@takes(
    probes=None,
    least=_SPEED,
    greatest=_SPEED,
    unbalance=None,
    clearances=None,
    trip=_SPEED,
    share=number(above=0.0),
    most=number(above=0.0),
    limit=number("m", above=0.0),
    count=whole(1),
    points=whole(5),
)
def unbalance_response_check(
    machines: Machine | Mapping[str, Machine],
    probes: Any,
    least: float,
    greatest: float,
    unbalance: Any,
    clearances: Mapping[str, Any] | None = None,
    *,
    trip: float | None = None,
    limit: Any = None,
    share: Any = 0.75,
    most: Any = 6.0,
    count: int | None = None,
    points: int = 201,
    at: Any = "equilibrium",
) -> Assessment:
    """What an applied unbalance makes of probes and clearances.

    - `machines`: one, or a mapping name -> machine, such as one for the least and one for the greatest
      bearing clearance (`at_clearances`); all are looked at. - `probes`: as for `resonances`. - `unbalance`:
      what `unbalance_cases` found, or a mapping station -> kg·m.
    - First: the largest amplitude that any probe reads between the running speeds `least` and `greatest`
      (rad/s), peak to peak, is at most `limit`, by default `probe_limit(greatest)`.
    - Then: all amplitudes times `scale_factor` (`most` at most) take up at most `share` of the clearances up
      to the speed `trip`, by default `greatest`. `clearances`: station -> diametral clearance, m; films of
      journal bearings stand in it by themselves, with twice their radial clearance.

    Amplitudes at clearances are those of the orbit's long half axis. Exact derivatives in both modes, where
    the largest amplitude stays at the same speed and probe. `count`: peaks of each, needed under `jit`.
    Raises `InputError` as `resonances` does, and for clearances that are none.
    """
    return checked_response(
        machines, probes, least, greatest, unbalance, clearances,
        trip=trip, limit=limit, share=share, most=most, count=count, points=points, at=at,
    )[0]  # fmt: skip


class Largest(NamedTuple):
    """`amplitude`, m from the mean position, that `probe` of the machine `name` reads at `speed`, rad/s;
    `gap`: the diametral clearance there, m, NaN for a probe of vibration."""

    name: str
    probe: Probe
    amplitude: Array
    speed: Array
    gap: Array


def checked_response(
    machines: Machine | Mapping[str, Machine],
    probes: Any,
    least: float,
    greatest: float,
    unbalance: Any,
    clearances: Mapping[str, Any] | None,
    *,
    trip: float | None,
    limit: Any,
    share: Any,
    most: Any,
    count: int | None,
    points: int,
    at: Any,
) -> tuple[Assessment, tuple[Largest, ...]]:
    """`unbalance_response_check`, and of each machine where amplitudes are largest: that of all probes, then
    that of each clearance, in the order of the findings."""
    several_ = machines if isinstance(machines, Mapping) else {"": machines}
    if not several_ or not all(isinstance(m, Machine) for m in several_.values()):
        raise InputError(f"machines must be a Machine or a mapping of them, but is {machines!r}")
    if least > greatest:
        raise InputError(
            f"least and greatest must not fall, but are {least:g} and {greatest:g} rad/s"
        )
    end = greatest if trip is None else trip
    allowed = probe_limit(greatest) if limit is None else jnp.asarray(limit, float)
    asked = several(probes)
    findings: list[Finding] = []
    places: list[Largest] = []
    nothing = jnp.asarray(jnp.nan)
    for name, machine in several_.items():
        gaps = _gaps(machine, clearances)
        looks = (count, points, at)
        at_probes = _largest(machine, asked, least, greatest, unbalance, *looks)
        heights = jnp.stack([a for a, _ in at_probes])
        worst = 2 * jnp.max(heights)
        read = known(heights)
        if read is not None:
            k = int(np.argmax(read))
            places.append(Largest(name, asked[k], *at_probes[k], nothing))
        words = ", ".join(x for x in (name, _where(places[-1]) if read is not None else "") if x)
        findings.append(
            Finding("amplitude at probes, pp", words, worst, allowed, "at most", "m", SOURCE)
        )
        scale = scale_factor(allowed, worst, most)
        findings.append(
            Finding("scale factor", name, scale, nothing, "for information", "", SOURCE)
        )
        if gaps:
            found = _largest(machine, list(gaps), _LEAST * end, end, unbalance, *looks)
            findings += _against(name, gaps, [a for a, _ in found], scale, share)
            places += [Largest(name, s, *f, gap) for (s, gap), f in zip(gaps.items(), found)]
    return Assessment(tuple(findings)), tuple(places)


def _where(one: Largest) -> str:
    return f"{words_of(one.probe)}, {float(one.speed) * 30 / np.pi:.5g} rpm"


def _against(
    name: str, gaps: dict[str, Array], found: list[Array], scale, share
) -> Iterator[Finding]:
    for (station, gap), amplitude in zip(gaps.items(), found):
        words = ", ".join(x for x in (name, station) if x)
        yield Finding(
            "scaled amplitude in clearance, pp",
            words,
            2 * amplitude * scale,
            jnp.asarray(share * gap),
            "at most",
            "m",
            CLEARANCE,
        )


def _gaps(machine: Machine, given: Any) -> dict[str, Array]:
    """station -> diametral clearance."""
    found: dict[str, Array] = {}
    connections = machine.connections()
    for name, part in machine.elements().items():
        if isinstance(part, AbstractFilm):
            station = connections[name][0].partition(".")[0]
            gap = 2 * part.clearance
            found[station] = jnp.minimum(found[station], gap) if station in found else gap
    if given is not None and not isinstance(given, Mapping):
        raise InputError(f"clearances must be a mapping station -> m, but is {given!r}")
    for station, gap in (given or {}).items():
        gap = number("m", above=0.0)(gap, f"clearance at {station!r}")
        found[station] = jnp.asarray(gap, float)
    return found


def _largest(
    machine: Machine,
    probes: Sequence[Probe],
    start: float,
    stop: float,
    unbalance,
    count,
    points,
    at,
) -> list[tuple[Array, Array]]:
    """Of each probe, the largest amplitude from `start` to `stop`, at a peak or at an end, and the speed."""
    run, seen = excited(machine, unbalance, probes, stop, at)
    ends = jnp.asarray(np.unique([start, stop]))
    if start == stop:
        return [(jnp.max(_at(run, one, ends)), ends[0]) for one in seen]
    words = [words_of(p) for p in probes]
    peaks = resonances_of(run, seen, words, (start, stop), HALF_POWER, count, points)
    found = []
    for one, those in zip(seen, peaks):
        heights = jnp.where(jnp.isnan(those.amplitudes), 0.0, those.amplitudes)
        heights = jnp.concatenate([heights, _at(run, one, ends)])
        k = jnp.argmax(heights)
        found.append((heights[k], jnp.concatenate([those.speeds, ends])[k]))
    return found


def _at(run: Excited, seen: Seen, speeds: Array) -> Float[Array, " n"]:
    if traced(run, seen):
        return _amplitudes(run, seen, speeds)
    return jnp.asarray(readings(run, seen, np.asarray(speeds)))


@lightly_compiled
def _amplitudes(run: Excited, seen: Seen, speeds: Array) -> Array:
    return jnp.exp(jax.lax.map(lambda w: run.level(w, seen), speeds))
