"""Who runs the chunks: this process with all its devices, several processes, or workers of Dask."""

import abc
from collections.abc import Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from ..errors import InputError
from ..solve.simulate import with_count
from .batch import Outcome, Setup, run_batch

# Chunks under way at a time for each worker of a cluster: one runs, one waits.
_AHEAD = 2

Task = tuple[int, dict[str, np.ndarray], int]


class Engine(abc.ABC):
    """`width`: machines of a chunk are a multiple of it. `leads`: whether this process makes the store."""

    width: int
    leads: bool

    @abc.abstractmethod
    def mine(self, number: int) -> bool:
        """Whether this process runs that chunk."""

    @abc.abstractmethod
    def meet(self, where: str) -> None:
        """Waits for the other processes."""

    @abc.abstractmethod
    def run(self, setup: Setup, tasks: Sequence[Task]) -> Iterator[tuple[int, Outcome]]:
        """Each task's number and outcome, in any order."""


class LocalEngine(Engine):
    """The batch axis is sharded over the local devices; each process of `jax.distributed` takes every so
    manieth chunk."""

    def __init__(self):
        self.width = jax.local_device_count()
        self.leads = jax.process_index() == 0

    def mine(self, number: int) -> bool:
        return number % jax.process_count() == jax.process_index()

    def meet(self, where: str) -> None:
        if jax.process_count() > 1:
            from jax.experimental import multihost_utils

            multihost_utils.sync_global_devices(f"jaxrotor sweep: {where}")

    def run(self, setup: Setup, tasks: Sequence[Task]) -> Iterator[tuple[int, Outcome]]:
        for number, values, steps in tasks:
            yield number, computed(setup, values, steps)


class DaskEngine(Engine):
    """Chunks are tasks of a `distributed.Client`: a worker that dies has its chunk run by another."""

    width, leads = 1, True

    def __init__(self, client: Any):
        self.client = client

    def mine(self, number: int) -> bool:
        return True

    def meet(self, where: str) -> None:
        pass

    def run(self, setup: Setup, tasks: Sequence[Task]) -> Iterator[tuple[int, Outcome]]:
        from distributed import as_completed

        shared = self.client.scatter(setup, broadcast=True)
        waiting = iter(tasks)
        under_way: dict[Any, int] = {}

        def submit():
            task = next(waiting, None)
            if task is None:
                return None
            future = self.client.submit(_on_worker, shared, task[1], task[2], pure=False, retries=3)
            under_way[future] = task[0]
            return future

        count = _AHEAD * max(1, len(self.client.scheduler_info()["workers"]))
        first = [f for f in (submit() for _ in range(count)) if f is not None]
        done = as_completed(first)
        for future in done:
            yield under_way.pop(future), future.result()
            another = submit()
            if another is not None:
                done.add(another)


def engine_for(client: Any) -> Engine:
    if client is None:
        return LocalEngine()
    if not (hasattr(client, "submit") and hasattr(client, "scatter")):
        raise InputError(f"client must be a distributed.Client of Dask, but is {client!r}")
    return DaskEngine(client)


def computed(setup: Setup, values: dict[str, np.ndarray], steps: int) -> Outcome:
    """A chunk on the devices of this process, as NumPy arrays."""
    if hasattr(setup.solver, "linear_part"):
        setup = _with_solver(setup, with_count(setup.solver, steps))
    devices = jax.local_devices()
    batch = {path: jnp.asarray(x) for path, x in values.items()}
    if len(devices) > 1:
        mesh = Mesh(np.array(devices), ("case",))
        batch = jax.device_put(batch, NamedSharding(mesh, PartitionSpec("case")))
    found = run_batch(setup, batch)
    return jax.tree.map(np.asarray, found)


def _with_solver(setup: Setup, solver: Any) -> Setup:
    import dataclasses

    return dataclasses.replace(setup, solver=solver)


def _on_worker(setup: Setup, values: dict[str, np.ndarray], steps: int) -> Outcome:
    jax.config.update("jax_enable_x64", True)
    return computed(setup, values, steps)
