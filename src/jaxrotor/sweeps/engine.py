"""Who runs the chunks: this process with all its devices, several processes, or workers of Dask."""

import abc
import functools
from collections.abc import Generator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh

from ..core.errors import InputError, JaxrotorError
from .batch import Outcome, Setup, run_batch, run_sharded, solves_as_it_runs, with_steps

# Chunks under way at a time for each worker of a cluster: one runs, one waits.
_AHEAD = 2

Task = tuple[int, dict[str, np.ndarray], int]


class Engine(abc.ABC):
    """`width`: machines of a chunk are a multiple of it. `leads`: whether this process makes the store.
    `alone`: whether it sees all results."""

    width: int
    leads: bool
    alone: bool

    @abc.abstractmethod
    def mine(self, number: int) -> bool:
        """Whether this process runs that chunk."""

    @abc.abstractmethod
    def meet(self, where: str) -> None:
        """Waits for the other processes."""

    @abc.abstractmethod
    def run(
        self, setup: Setup, tasks: Sequence[Task]
    ) -> Generator[tuple[int, Outcome], None, None]:
        """Each task's number and outcome, in any order."""


class LocalEngine(Engine):
    """The batch axis is sharded over the local devices; each process of `jax.distributed` takes every so
    manieth chunk."""

    def __init__(self):
        self.width = jax.local_device_count()
        self.leads = jax.process_index() == 0
        self.alone = jax.process_count() == 1

    def mine(self, number: int) -> bool:
        return number % jax.process_count() == jax.process_index()

    def meet(self, where: str) -> None:
        if not self.alone:
            from jax.experimental import multihost_utils

            multihost_utils.sync_global_devices(f"jaxrotor sweep: {where}")

    def run(self, setup: Setup, tasks: Sequence[Task]):
        for number, values, steps in tasks:
            yield number, computed(setup, values, steps)


class DaskEngine(Engine):
    """Chunks are tasks of a `distributed.Client`: a worker that dies has its chunk run by another."""

    width, leads, alone = 1, True, True

    def __init__(self, client: Any):
        self.client = client

    def mine(self, number: int) -> bool:
        return True

    def meet(self, where: str) -> None:
        pass

    def run(self, setup: Setup, tasks: Sequence[Task]):
        import cloudpickle
        from distributed import as_completed

        # packed, for a worker knows of 64-bit floats only once our code runs there; and as the result of a
        # task, for that is made anew where the workers that held it died
        packed = cloudpickle.dumps(_as_numpy(setup))
        shared = self.client.submit(_same, packed, pure=False)
        waiting = iter(tasks)
        under_way: dict[Any, int] = {}

        def submit() -> list[Any]:
            """As many as there are workers for; more may have come."""
            room = _AHEAD * max(1, len(self.client.nthreads())) - len(under_way)
            found = []
            for number, values, steps in (task for _, task in zip(range(room), waiting)):
                future = self.client.submit(_on_worker, shared, values, steps, pure=False)
                under_way[future] = number
                found.append(future)
            return found

        try:
            done = as_completed(submit())
            for future in done:
                yield under_way.pop(future), self._result(future)
                done.update(submit())
        finally:
            # no more work for a sweep that was stopped
            self.client.cancel(list(under_way))

    def _result(self, future: Any) -> Outcome:
        from distributed import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise JaxrotorError(
                f"client: the workers died of a chunk, one after the other ({error}): give them more memory, "
                "or take a smaller chunk"
            ) from error


def engine_for(client: Any) -> Engine:
    if client is None:
        return LocalEngine()
    if not all(hasattr(client, name) for name in ("submit", "cancel", "nthreads")):
        raise InputError(f"client must be a distributed.Client of Dask, but is {client!r}")
    if getattr(client, "asynchronous", False):
        raise InputError("client: is asynchronous: give one made with asynchronous=False")
    return DaskEngine(client)


def computed(setup: Setup, values: dict[str, np.ndarray], steps: int) -> Outcome:
    """A chunk on the devices of this process, as NumPy arrays."""
    setup = with_steps(setup, steps)
    devices = jax.local_devices()
    batch = {path: np.asarray(x) for path, x in values.items()}
    size = next(iter(batch.values())).size
    shared = devices[0].platform != "cpu" or not solves_as_it_runs(setup)
    if len(devices) > 1 and shared:
        # a chunk planned for other devices is filled up
        more = -size % len(devices)
        batch = {p: np.concatenate([x, np.repeat(x[-1], more)]) for p, x in batch.items()}
        found = run_sharded(
            setup, jax.tree.map(jnp.asarray, batch), Mesh(np.array(devices), ("case",))
        )
    else:
        found = run_batch(setup, jax.tree.map(jnp.asarray, batch))
    return jax.tree.map(lambda x: np.asarray(x)[:size], found)


def _as_numpy(setup: Setup) -> Setup:
    return jax.tree.map(lambda x: np.asarray(x) if isinstance(x, jax.Array) else x, setup)


def _same(packed: bytes) -> bytes:
    return packed


@functools.lru_cache(maxsize=2)
def _opened(packed: bytes) -> Setup:
    import cloudpickle

    setup = cloudpickle.loads(packed)
    return jax.tree.map(lambda x: jnp.asarray(x) if isinstance(x, np.ndarray) else x, setup)


def _on_worker(packed: bytes, values: dict[str, np.ndarray], steps: int) -> Outcome:
    jax.config.update("jax_enable_x64", True)
    return computed(_opened(packed), values, steps)
