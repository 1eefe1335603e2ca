"""What Matyja & Łazarz (2014) observed on their two-rotor machine, looked for in a run."""

from typing import Any, NamedTuple

import numpy as np


class Observation(NamedTuple):
    """`paper`: what was observed there; `here`: what this run shows; `holds`: the verdict."""

    paper: str
    here: str
    holds: bool


def turn_mean(t: np.ndarray, values: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Mean over one turn around each sample (at most a tenth of a second)."""
    half = np.minimum(np.pi / np.maximum(np.abs(speed), 1.0), 0.05)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(t))])
    first, last = np.clip(t - half, t[0], t[-1]), np.clip(t + half, t[0], t[-1])
    return (np.interp(last, t, total) - np.interp(first, t, total)) / (last - first)


def amplitude(t: np.ndarray, values: np.ndarray, window: float = 0.05) -> np.ndarray:
    """Half the range of `values` within `window` seconds around each sample."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    n = max(3, int(window / (t[1] - t[0])))
    return 0.5 * (maximum_filter1d(values, n) - minimum_filter1d(values, n))


def falls_to(t: np.ndarray, size: np.ndarray, part: float) -> float:
    """Seconds from the peak of `size` until it stays below `part` of it; infinite if it does not."""
    k = int(np.argmax(size))
    above = np.flatnonzero(size[k:] > part * size[k])
    return float(t[k + above[-1] + 1] - t[k]) if k + above[-1] + 1 < len(t) else float("inf")


def observations(
    response: Any, main: str = "main", second: str = "second", drive: str = "end"
) -> list[Observation]:
    """The paper's observations with this run's numbers and verdicts.

    Thresholds: amplitudes are "comparable" within a factor of two, with peaks within 5 % of speed; a
    rotor "centres itself" when its mass centre ends nearer to its position at rest than its geometric
    centre, and nearer than 0.7 of its eccentricity; torsional vibration "dies out faster" when it falls
    to a third of its own peak earlier; rotors "brake" and "overrun" by the mean over a turn of
    phi' less the drive's within 0.15 s of the passage.
    """
    t = np.asarray(response.t)
    parts = {name: response[name] for name in (main, second)}
    q = {name: np.asarray(p.position) for name, p in parts.items()}
    speed = {name: np.asarray(p.speed) for name, p in parts.items()}
    radius = {name: 1e3 * np.hypot(x[:, 0], x[:, 1]) for name, x in q.items()}
    peak = {name: int(np.argmax(r)) for name, r in radius.items()}
    found = []

    a, b = radius[second][peak[second]], radius[main][peak[main]]
    at_a, at_b = speed[second][peak[second]], speed[main][peak[main]]
    found.append(
        Observation(
            "second's lateral amplitude is comparable with main's, with 1/50 of its unbalance",
            f"peaks {a:.3f} mm (second, at {at_a:.0f} rad/s) and {b:.3f} mm (main, at {at_b:.0f} rad/s)",
            bool(0.5 < a / b < 2.0 and abs(at_a - at_b) < 0.05 * at_b),
        )
    )
    centred = {}
    for name, part in parts.items():
        last = slice(-max(50, len(t) // 50), None)
        centre = np.asarray(part.mass_centre)[:, :2]
        axis = q[name][last, :2].mean(0)
        geometric = 1e3 * np.hypot(*(q[name][last, :2] - axis).T).mean()
        mass = 1e3 * np.hypot(*(centre[last] - axis).T).mean()
        start = 1e3 * np.hypot(*(centre[0] - q[name][0, :2]))
        centred[name] = (start, mass, geometric, mass < geometric and mass < 0.7 * start)
    start, mass, geometric, holds = centred[main]
    found.append(
        Observation(
            "main centres itself past the critical speed",
            f"mass centre {start:.2f} -> {mass:.2f} mm from the axis of whirl, geometric centre "
            f"{b:.2f} (peak) -> {geometric:.2f} mm",
            bool(holds),
        )
    )
    start, mass, geometric, holds = centred[second]
    found.append(
        Observation(
            "second does not",
            f"mass centre {start:.2f} -> {mass:.2f} mm, geometric centre {geometric:.2f} mm at the end",
            not holds,
        )
    )
    tilt = {name: np.abs(x[:, 3:5]).max() for name, x in q.items()}
    found.append(
        Observation(
            "second's tilts psi, theta are the larger",
            f"largest {1e3 * tilt[second]:.2f} mrad (second), {1e3 * tilt[main]:.2f} mrad (main)",
            bool(tilt[second] > tilt[main]),
        )
    )
    w = np.asarray(response[drive].speed)
    after = t > 0.1  # the start itself is a shock to a line at rest
    size = {name: amplitude(t, speed[name] - w)[after] for name in parts}
    third = {name: falls_to(t[after], s, 1 / 3) for name, s in size.items()}
    left = {name: s[-len(s) // 4 :].mean() / s.max() for name, s in size.items()}
    found.append(
        Observation(
            "torsional vibration of main dies out faster",
            f"to a third of its peak in {third[main]:.2f} s (main), {third[second]:.2f} s (second); "
            f"{100 * left[main]:.0f} % and {100 * left[second]:.0f} % of it stay",
            bool(third[main] < third[second]),
        )
    )
    rate = np.asarray(response[drive].velocity)[:, 5]
    before, behind = {}, {}
    for name, part in parts.items():
        mean = turn_mean(t, np.asarray(part.velocity)[:, 5] - rate, w)
        now = t[peak[name]]
        before[name] = mean[(t > now - 0.15) & (t <= now)].min()
        behind[name] = mean[(t >= now) & (t < now + 0.15)].max()
    found.append(
        Observation(
            "rotors brake while crossing the critical speed",
            f"phi' less the drive's, mean over a turn, falls to {before[main]:.4f} (main) and "
            f"{before[second]:.4f} rad/s (second) up to the peak",
            bool(before[main] < 0 and before[second] < 0),
        )
    )
    found.append(
        Observation(
            "then overrun the drive",
            f"and rises to {behind[main]:+.4f} (main) and {behind[second]:+.4f} rad/s (second) behind it",
            bool(behind[main] > 0 and behind[second] > 0),
        )
    )
    return found


def observation_table(found: list[Observation]) -> str:
    """For the terminal: the verdict, what the paper saw, what this run shows."""
    lines = []
    for o in found:
        lines += [f"[{'holds' if o.holds else 'FAILS'}] {o.paper}", f"        here: {o.here}"]
    return "\n".join(lines)
