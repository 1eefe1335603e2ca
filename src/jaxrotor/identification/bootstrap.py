"""Are the stated uncertainties true? The identification repeated on synthetic data."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from ..core.arguments import number, whole
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from ..sensors.noise import Noise
from .estimated import known_from_each
from .fit import search
from .identification import Identification
from .simulated import records, records_and_slopes


@shows(coverage="", spread="")
class Replicas(NamedTuple):
    """Of each repetition: `values` (count, n) in the order of `paths`, the standard deviations `stated` with
    them, and whether the interval `covered` the truth, which is what was identified."""

    paths: tuple[str, ...]
    truth: Float[np.ndarray, " n"]
    values: Float[np.ndarray, "count n"]
    stated: Float[np.ndarray, "count n"]
    covered: Bool[np.ndarray, "count n"]

    @property
    def coverage(self) -> dict[str, float]:
        """The part of the intervals that cover the truth."""
        return dict(zip(self.paths, self.covered.mean(axis=0).tolist()))

    @property
    def spread(self) -> dict[str, float]:
        """Standard deviation over the repetitions, as part of the stated one (root mean square)."""
        real = self.values.std(axis=0, ddof=1)
        return dict(zip(self.paths, (real / np.sqrt((self.stated**2).mean(axis=0))).tolist()))


@takes(count=whole(1), level=number(above=0.0, below=1.0), iterations=whole(1))
def bootstrap(
    found: Identification, count: int = 200, seed: int = 0, level: float = 0.95, iterations: int = 8
) -> Replicas:
    """Takes what was identified for the truth, makes `count` records of it with fresh noise of each channel's
    own kind and size, and identifies all of them in one batch, from the truth as start.

    Raises `InputError` where a parameter cannot be seen at all. Source: Efron & Tibshirani, An Introduction
    to the Bootstrap (1993), ch. 6 (the parametric bootstrap).
    """
    if found.blind:
        raise InputError(f"the data cannot see {', '.join(found.blind[0])}: hold it, then repeat")
    problem, space = found.problem, found.space
    truth = jnp.asarray(found.u)
    keys = jax.random.split(jax.random.key(seed), (count, len(problem.signals)))
    clean = records(problem.simulated, truth)
    channels = problem.simulated.bench.channels
    times = [t for run in problem.simulated.runs for t in run.times]
    data = []
    for i, (signal, fit, record) in enumerate(zip(problem.signals, found.channels, clean)):
        noise = channels[signal.channel].noise
        if noise is None or not float(noise.std) > 0:
            noise = Noise(jnp.asarray(fit.std))
        interval = jnp.median(jnp.diff(times[i]))

        def noisy(key, record=record, noise=noise, interval=interval):
            return noise.added(key, record, interval)

        there = jnp.where(jnp.isfinite(record), record, 0.0)
        data.append(jnp.where(signal.valid > 0, jax.vmap(noisy)(keys[:, i]), there))
    fits = search(problem, jnp.tile(truth, (count, 1)), iterations, data=tuple(data))
    u = jnp.stack([fit.u for fit in fits])
    simulated, slopes = records_and_slopes(problem.simulated, u)
    stated, covered = [], []
    for k, own in enumerate(known_from_each(problem, tuple(data), u, simulated, slopes)):
        du = np.asarray(jax.jacfwd(space.values)(u[k])).diagonal()
        stated.append(np.abs(du) * own.std)
        covered.append(np.abs(np.asarray(u[k] - truth)) <= own.reach(level))
    return Replicas(
        space.paths,
        np.asarray(space.values(truth)),
        np.asarray(space.values(u)),
        np.array(stated),
        np.array(covered),
    )
