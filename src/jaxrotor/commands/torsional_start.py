"""The start of a study's own run as a torsional analysis sees it: torques, passages, damage."""

import sys
from typing import Any, NamedTuple

import numpy as np

from ..elements.drives.synchronous import SynchronousStart
from ..elements.drives.synchronous_machine import SynchronousMachine
from ..linear.torsion import TorsionalMode, torque_carriers
from ..standards.finding import Assessment
from ..standards.starts import shaft_torque, start_resonance, starts_allowed
from ..standards.torsional_life import stress_per_torque
from ..study.study import Study
from ..study.torsional import Torsional

# Samples a period below which crests are missed: ranges are then up to 1.2 % short.
_SAMPLES = 20
_MOST_PARTS = 5


class Start(NamedTuple):
    """`torques`: part -> (nt,), N·m; `speed` of `station`, rad/s; `passages`: what is met -> rad/s; `found`:
    peaks, damage and starts; `notes`: what to say beside."""

    t: np.ndarray
    torques: dict[str, np.ndarray]
    speed: np.ndarray
    station: str
    passages: dict[str, float]
    found: Assessment
    notes: list[str]


def start_of(
    study: Study, asked: Torsional, modes: list[TorsionalMode], quiet: bool
) -> Start | None:
    """Runs what [simulation] says; `None` where the study has none."""
    if study.simulation is None:
        return None
    machine = study.machine
    if not quiet:
        print(f"{study.title or study.name}: simulating the start", file=sys.stderr)
    response = study.run(progress=False if quiet else None)
    parts = [one.name for one in asked.shafts]
    carriers = [name for name, pair in torque_carriers(machine).items() if "torque" in pair]
    if not parts:
        parts = carriers
    torques = {name: np.asarray(shaft_torque(response, name)) for name in dict.fromkeys(parts)}
    if len(torques) > _MOST_PARTS:  # the most loaded ones
        kept = sorted(torques, key=lambda n: -np.abs(torques[n]).max())[:_MOST_PARTS]
        torques = {name: torques[name] for name in torques if name in kept}
    station, passages = _passages(study, modes)
    found = Assessment(())
    for one in asked.shafts:
        per = float(
            stress_per_torque(
                machine, one.name, one.curve, one.diameter, one.inner_diameter, one.concentration
            )
        )
        findings = starts_allowed(
            torques.get(one.name, np.asarray(shaft_torque(response, one.name))),
            one.curve,
            one.starts if one.starts is not None else 1.0,
            one.name,
            per,
        )
        if one.starts is None:  # told, but no number was asked for
            last = findings.findings[-1]
            told = last.__class__(
                last.check, last.place, last.value, findings.findings[0].limit,
                "for information", last.unit, last.source,
            )  # fmt: skip
            findings = Assessment((*findings.findings[:-1], told))
        found += findings
    rate = float(study.settings.sample_rate)
    notes = [
        f"`{name}`: {samples:.1f} samples a period of its torque's swings: crests are missed, so the "
        f'damage is too low; take sample_rate = "{np.ceil(rate * _SAMPLES / samples):.0f} Hz"'
        for name in dict.fromkeys(one.name for one in asked.shafts)
        if (samples := _samples_a_period(shaft_torque(response, name))) < _SAMPLES
    ]
    speed = np.asarray(response[station].speed)
    return Start(np.asarray(response.t), torques, speed, station, passages, found, notes)


def _samples_a_period(values: Any) -> float:
    """Of what swings fastest and counts: by its curvature over its slope, both as root mean squares."""
    first = np.diff(np.asarray(values, np.float64))
    slope = float(np.mean(np.square(first)))
    if not slope > 0:
        return np.inf
    ratio = 0.5 * np.sqrt(float(np.mean(np.square(np.diff(first)))) / slope)
    return np.pi / np.arcsin(np.clip(ratio, 1e-9, 1.0))


def _passages(study: Study, modes: list[TorsionalMode]) -> tuple[str, dict[str, float]]:
    """The station whose speed counts, and where the pulsation of a synchronous motor's start meets each
    mode."""
    machine = study.machine
    for name, element in machine.elements().items():
        if isinstance(element, (SynchronousStart, SynchronousMachine)):
            station = machine.connections()[name][0].partition(".")[0]
            ns = abs(float(element.synchronous_speed))
            f = ns * element.pole_pairs / (2 * np.pi)
            if ns == 0:  # an inverter starts it
                continue
            met = {m.name: float(start_resonance(m.frequency, ns, f)) for m in modes}
            return station, {mode: speed for mode, speed in met.items() if speed > 0}
    from ..linear.shafts import shafts_of

    return shafts_of(machine)[0][0], {}
