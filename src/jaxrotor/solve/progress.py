"""A progress bar on long runs, told from inside the compiled loop."""

import sys

import jax
from tqdm import tqdm

# Samples that a run may take before a bar is shown: about two seconds' worth.
_STEPS_A_SECOND = 80_000


class Meter:
    """Shows how far a run has come. Hashable and equal to any other of its pace: a new bar does not
    recompile."""

    def __init__(self, count: int):
        self.count, self.every = count, max(1, count // 200)
        self._bar: tqdm | None = None

    def __hash__(self):
        return hash((Meter, self.count))

    def __eq__(self, other):
        return isinstance(other, Meter) and other.count == self.count

    def __call__(self, i) -> None:
        """Called while tracing, with the traced number of the step."""
        jax.lax.cond(
            i % self.every == 0, lambda: jax.debug.callback(Meter._show, self.count, i), lambda: None
        )

    _current: "Meter | None" = None

    def __enter__(self):
        Meter._current = self
        return self

    @staticmethod
    def _show(count, i) -> None:
        meter = Meter._current
        if meter is None:
            return
        if meter._bar is None:
            meter._bar = tqdm(total=int(count), unit="sample", file=sys.stderr, leave=False)
        meter._bar.update(int(i) - meter._bar.n)

    def close(self) -> None:
        jax.effects_barrier()
        Meter._current = None
        if self._bar is not None:
            self._bar.update(self.count - self._bar.n)
            self._bar.close()
            self._bar = None


def meter(
    samples: int, exponential: bool, substeps: int | None, wanted: bool | None
) -> Meter | None:
    """A meter where one is wanted, or where the run will last and someone is looking."""
    if not exponential or wanted is False:
        return None
    lasting = samples * (substeps or 1) > 2 * _STEPS_A_SECOND
    if not (wanted or (lasting and sys.stderr.isatty())):
        return None
    return Meter(samples).__enter__()
