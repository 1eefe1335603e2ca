"""Sweeps in a store: stopped, killed, resumed, refused; on many devices, in many processes.

Run as a program, this file is the child that is killed: `python test_sweep_stores.py MODE STORE LOG ...`.
"""

import errno
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
import zarr

import jaxrotor as jr
from jaxrotor.plot.sweep import percentile_bands
from jaxrotor.sweeps import engine
from jaxrotor.sweeps.store import Store

CASES, CHUNK = 40, 2
# Of the test; twenty were tried by hand.
KILLS = int(os.environ.get("SWEEP_KILLS", "5"))


class Swing(jr.objectives.AbstractMeasure):
    """A user's own, of the main program where the child is one: a worker knows it only by its code."""

    unit: str = eqx.field(static=True, default="m")

    def __call__(self, response):
        return jnp.ptp(response["rotor"].x)


def asked(**changes):
    """A rotor on springs: quickly traced, quickly run."""
    machine = jr.Machine(
        {
            "rotor": jr.Rotor(2.0, 0.018, 0.010, unbalance=jr.Unbalance(1e-4, inclination=0.01)),
            "springs": jr.LinearSupport(
                [4e4, 5e4, 4e4, 90.0, 90.0, 0], [40.0, 40, 40, 0.1, 0.1, 0]
            ),
            "ring": jr.TorsionalDamper(1e-6, 1e-6),
        },
        {"springs": "rotor", "ring": "rotor"},
    )
    return {
        "machine": machine,
        "parameters": {
            "rotor.unbalance.eccentricity": np.linspace(1e-5, 2e-4, CASES),
            "springs.stiffness[0]": np.linspace(3e4, 6e4, CASES),
        },
        "outputs": {
            "peak": jr.objectives.PeakValue(jr.sensors.Radial("rotor")),
            "x": jr.sweeps.TimeSeries(jr.sensors.ProximityProbe("rotor", 0.0), every=2),
            "swing": Swing(),
            "ring": jr.objectives.PeakValue(jr.sensors.Signal("ring", "torque")),
        },
        "t_end": 0.03,
        "sample_rate": 1000.0,
        "initial": "undeformed",
        "speed": 150.0,
        "step": jr.Plan(1, 6, 75.0, 150.0, 0.0, 0.0),
        "chunk": CHUNK,
        **changes,
    }


# The children


def child(mode, store, log, *more):
    """Each chunk that is written leaves its number in the log."""
    write = Store.write

    def slowly(self, number, rows, values):
        time.sleep(float(os.environ.get("SWEEP_PAUSE", "0")))
        write(self, number, rows, values)
        with open(log, "a") as out:
            out.write(f"{number}\n")

    Store.write = slowly
    if mode == "dask":
        return on_dask(store)
    if mode == "distributed":
        import jax

        port, index = more
        jax.config.update("jax_cpu_collectives_implementation", "gloo")
        jax.distributed.initialize(f"127.0.0.1:{port}", 2, int(index))
    found = jr.sweep(**asked(), store=store)
    assert np.all(np.isfinite(found["peak"]))


def on_dask(store):
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        Client(cluster) as client,
    ):
        pids = list(client.run(os.getpid).values())
        write, count = Store.write, []

        def killing(self, number, rows, values):
            write(self, number, rows, values)
            count.append(number)
            if len(count) == 4:
                os.kill(pids[0], signal.SIGKILL)

        Store.write = killing
        jr.sweep(**asked(), store=store, client=client)
        print("workers:", len(set(pids) - set(client.run(os.getpid).values())), "lost")


def run_child(*arguments, pause=0.0, flags="", wait=True):
    environment = {**os.environ, "JAX_ENABLE_X64": "1", "SWEEP_PAUSE": str(pause)}
    environment["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {flags}"
    process = subprocess.Popen(
        [sys.executable, __file__, *map(str, arguments)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    return ended(process) if wait else process


def ended(process):
    words, _ = process.communicate(timeout=300)
    assert process.returncode == 0, words
    return words


def files(store):
    return {
        str(path.relative_to(store)): path.read_bytes()
        for path in sorted(Path(store).rglob("*"))
        if path.is_file() and not path.name.endswith(".partial")
    }


def numbers(path):
    return [int(line) for line in path.read_text().split()] if path.exists() else []


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A sweep that nothing disturbed, its folder and its log."""
    path = tmp_path_factory.mktemp("whole") / "store"
    run_child("sweep", path, path.with_name("log"))
    assert numbers(path.with_name("log")) == list(range(CASES // CHUNK))
    return path


def assert_same(store, whole, rtol=0.0):
    a, b = (xr.open_zarr(path, consolidated=False, chunks=None).load() for path in (store, whole))
    a, b = (
        x.isel(case=x["case"].values >= 0).sortby("case").drop_vars(["done", "checksum"])
        for x in (a, b)
    )
    assert set(a) == set(b)
    for name in a:
        scale = np.nanmax(np.abs(b[name].values), initial=0.0)
        np.testing.assert_allclose(a[name], b[name], rtol=rtol, atol=rtol * scale, err_msg=name)


# Stopped and resumed


def test_stopped_looked_at_resumed_and_complete(tmp_path, monkeypatch, whole):
    path, write, seen = tmp_path / "some" / "store", Store.write, []

    def stopping(self, number, rows, values):
        if number == 3:
            raise KeyboardInterrupt
        write(self, number, rows, values)
        # read while it grows, and drawn
        looked = xr.open_zarr(path, consolidated=False, chunks=None)
        assert looked["ring"].attrs["units"] == "N*m"
        ax = percentile_bands(looked, "x")
        np.testing.assert_allclose(
            ax.lines[0].get_ydata() / ax.lines[0].get_ydata()[5],
            np.median(looked["x"].values[: 2 * (number + 1)], axis=0)
            / np.median(looked["x"].values[: 2 * (number + 1), 5]),
            rtol=1e-9,
        )
        seen.append(int(np.isfinite(looked["peak"]).sum()))
        assert looked["done"].values.sum() == number + 1

    monkeypatch.setattr(Store, "write", stopping)
    with pytest.raises(KeyboardInterrupt):
        jr.sweep(**asked(), store=path)
    assert seen == [2, 4, 6]
    run = []

    def counting(setup, values, steps, computed=engine.computed):
        run.append(values["rotor.unbalance.eccentricity"][0])
        return computed(setup, values, steps)

    monkeypatch.setattr(Store, "write", write)
    monkeypatch.setattr(engine, "computed", counting)
    # the size of the chunks is the store's
    found = jr.sweep(**asked(chunk=None), store=path)
    np.testing.assert_allclose(run, np.linspace(1e-5, 2e-4, CASES)[6::2])
    assert_same(path, whole, 1e-9)
    # in memory, and again from the store without a run
    kept = jr.sweep(**asked())
    run.clear()
    began = time.perf_counter()
    again = jr.sweep(**asked(), store=str(path))
    assert not run and time.perf_counter() - began < 2.0
    for other in (found, again):
        assert other.attrs["cases"] == kept.attrs["cases"] and list(other) == list(kept)
        for name in kept:
            np.testing.assert_array_equal(other[name], kept[name])
    for dropped in ("jaxrotor_sweep", "no_step"):
        assert dropped not in again.attrs


def test_killed_again_and_again(tmp_path, whole):
    """SIGKILL at random moments; in the end all is as an undisturbed sweep writes it, byte by byte."""
    path, log = tmp_path / "store", tmp_path / "log"
    dice = random.Random(7)
    done = path / "done" / "c"
    for kill in range(KILLS):
        process = run_child("sweep", path, log, pause=0.05, wait=False)
        before = len(list(done.glob("*"))) if done.exists() else 0
        left = CASES // CHUNK - before
        target = before + dice.randrange(max(1, min(left, 2 * left // (KILLS - kill) + 1)))
        while process.poll() is None and (
            not done.exists() or len(list(done.glob("[0-9]*"))) < target
        ):
            time.sleep(0.002)
        time.sleep(dice.uniform(0, 0.12))
        process.kill()
        process.communicate()
    run_child("sweep", path, log)
    assert files(path) == files(whole)
    wrote = numbers(log)
    assert len(wrote) == len(set(wrote)) and len(wrote) >= CASES // CHUNK - KILLS


def test_what_died_while_it_was_made_is_made_anew(tmp_path, whole):
    path = tmp_path / "store"
    path.mkdir()  # an empty folder of this name is no matter
    (tmp_path / ".store.being_made" / "case").mkdir(parents=True)
    (tmp_path / ".store.being_made" / "zarr.json").write_text("{")
    jr.sweep(**asked(), store=path)
    assert_same(path, whole, 1e-9)
    assert [p.name for p in tmp_path.iterdir()] == ["store"]


def _flip(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0x55
    path.write_bytes(data)


def _cut(path):
    path.write_bytes(path.read_bytes()[:-3])


@pytest.mark.parametrize("harm", [Path.unlink, _flip, _cut, lambda path: path.write_bytes(b"")])
@pytest.mark.parametrize("place", ["peak/c/3", "x/c/5/0", "checksum/c/7", "done/c/2"])
def test_a_damaged_chunk_is_run_again(tmp_path, whole, harm, place, capfd):
    path = tmp_path / "store"
    shutil.copytree(whole, path)
    harm(path / place)
    jr.sweep(**asked(), store=path)
    # without its mark a chunk is one that was never written
    unmarked = place.startswith("done") and harm is Path.unlink
    assert ("1 chunks were damaged" in capfd.readouterr().err) != unmarked
    assert_same(path, whole, 1e-9)
    jr.sweep(**asked(), store=path)  # and is whole then
    assert "damaged" not in capfd.readouterr().err


@pytest.mark.parametrize("harm", [Path.unlink, _flip, _cut, lambda path: path.write_bytes(b"")])
@pytest.mark.parametrize(
    "place",
    ["springs.stiffness[0]/c/0", "case/c/0", "peak/zarr.json", "zarr.json"],
)
def test_a_store_whose_questions_are_damaged_is_refused(tmp_path, whole, harm, place):
    path = tmp_path / "store"
    shutil.copytree(whole, path)
    harm(path / place)
    with pytest.raises(
        (jr.StoreError, jr.InputError),
        match="is a damaged store|is no store of a sweep|another sweep",
    ):
        jr.sweep(**asked(), store=path)


# Refused


@pytest.mark.parametrize(
    "changes, sentence",
    [
        (
            dict(parameters={"rotor.mass": np.ones(CASES)}),
            "holds another sweep, of different cases",
        ),
        (
            dict(outputs={"peak": jr.objectives.PeakValue(jr.sensors.Radial("rotor"))}),
            "of different outputs",
        ),
        (dict(speed=151.0), "of different run"),
        (dict(step=1e-3), "of different run"),
        (dict(sample_rate=1001.0), "of different run"),
        (dict(solver=jr.Rosenbrock(), step=1e-3, rtol=1e-6), "of different run"),
        (dict(resume=False), "is there already"),
        (dict(machine="heavier"), "of different machine"),
        (dict(machine="heavier", speed=1.0), "of different machine, run"),
    ],
)
def test_the_store_of_another_sweep_is_refused(whole, changes, sentence):
    before = files(whole)
    if "machine" in changes:
        changes = changes | {"machine": asked()["machine"].set({"rotor.mass": 2.1})}
    with pytest.raises(jr.InputError, match=sentence) as caught:
        jr.sweep(**asked(**changes), store=whole)
    assert str(whole) in str(caught.value) and "\n" not in str(caught.value)
    assert files(whole) == before


def test_what_is_no_store_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "other").mkdir()
    zarr.open_group(tmp_path / "other" / "group", mode="w")
    (tmp_path / "torn").mkdir()
    (tmp_path / "torn" / "zarr.json").write_text('{"zarr_format"')
    for name in (".", "notes.txt", "other", "other/group", "torn"):
        with pytest.raises(jr.StoreError, match="is no store of a sweep: choose another folder"):
            jr.sweep(**asked(), store=tmp_path / name)
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_without_zarr(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "zarr", None)
    with pytest.raises(jr.MissingExtraError, match=r'pip install "jaxrotor\[sweep\]"'):
        jr.sweep(**asked(), store=tmp_path / "store")


@pytest.mark.parametrize(
    "number, sentence",
    [
        (errno.ENOSPC, "the disk is full: make room, then resume"),
        (errno.EACCES, "it may not be written to"),
        (errno.EROFS, "it lies on a read-only disk"),
        (errno.EIO, "Input/output error"),
    ],
)
def test_a_disk_that_refuses(tmp_path, monkeypatch, number, sentence, whole):
    """While the store is made, and while it is written; then it goes on."""
    from zarr.storage import _local

    path, put, room = tmp_path / "store", _local._put, [0]

    def full(*arguments, **named):
        room[0] -= 1
        if room[0] < 0:
            raise OSError(number, os.strerror(number), str(path))
        return put(*arguments, **named)

    monkeypatch.setattr(_local, "_put", full)
    with pytest.raises(jr.StoreError, match=sentence) as caught:
        jr.sweep(**asked(), store=path)
    assert "before is whole" not in str(caught.value)
    assert not list(tmp_path.iterdir())
    room[0] = 75
    with pytest.raises(jr.StoreError, match=sentence) as caught:
        jr.sweep(**asked(), store=path)
    assert "what was written before is whole" in str(caught.value)
    looked = xr.open_zarr(path, consolidated=False, chunks=None)
    done = looked["done"].values
    assert 0 < done.sum() < done.size
    assert np.isfinite(looked["peak"].values.reshape(-1, CHUNK)[done == 1]).all()
    if number == errno.ENOSPC:
        room[0] = 10**6
        jr.sweep(**asked(), store=path)
        assert_same(path, whole, 1e-9)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written_to(tmp_path):
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(jr.StoreError, match="it may not be written to"):
            jr.sweep(**asked(), store=tmp_path / "store")
    finally:
        tmp_path.chmod(0o700)


# Many hands


def test_eight_devices(tmp_path, whole):
    path, log = tmp_path / "store", tmp_path / "log"
    run_child("sweep", path, log, flags="--xla_force_host_platform_device_count=8")
    assert numbers(log) == list(range(CASES // 8))
    assert_same(path, whole, 1e-9)


def test_two_processes_share_the_chunks(tmp_path, whole):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    path, logs = tmp_path / "store", [tmp_path / "log 0", tmp_path / "log 1"]
    both = [
        run_child("distributed", path, log, port, index, wait=False)
        for index, log in enumerate(logs)
    ]
    for process in both:
        ended(process)
    assert [numbers(log) for log in logs] == [list(range(k, CASES // CHUNK, 2)) for k in (0, 1)]
    assert files(path) == files(whole)


def test_a_worker_of_dask_dies(tmp_path, whole):
    path, log = tmp_path / "store", tmp_path / "log"
    assert "workers: 1 lost" in run_child("dask", path, log)
    assert sorted(numbers(log)) == list(range(CASES // CHUNK))
    assert files(path) == files(whole)


if __name__ == "__main__":
    child(*sys.argv[1:])
