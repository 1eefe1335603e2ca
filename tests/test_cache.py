"""Compiled programs on disk: loaded by the next process, bounded, a user's own folder left alone."""

import os
import subprocess
import sys
import time

import jax
import pytest

import jaxrotor as jr
from jaxrotor.core.cache import _clean

# Compiles programs of its own; prints how many were compiled, and how many loaded.
SCRIPT = """
import sys
import jax, jax.numpy as jnp
import jaxrotor as jr
counts = {"cache_hits": 0, "cache_misses": 0}
def count(event, **_):
    name = event.rpartition("/")[2]
    counts[name] = counts.get(name, 0) + 1
jax.monitoring.register_event_listener(count)
folder = jr.enable_cache(sys.argv[1], limit=float(sys.argv[2]))
for n in range(3, 9):
    jax.jit(lambda x: jnp.sin(x) @ x)(jnp.ones(n)).block_until_ready()
print(counts["cache_misses"], counts["cache_hits"])
"""


def programs(folder, limit):
    environment = {k: v for k, v in os.environ.items() if k != "JAX_COMPILATION_CACHE_DIR"}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(folder), str(limit)],
        capture_output=True,
        text=True,
        env=environment,
    )
    assert done.returncode == 0, done.stderr
    return tuple(map(int, done.stdout.split()))


def test_the_next_process_loads_and_the_folder_is_bounded(tmp_path):
    first, none = programs(tmp_path / "whole", 1e9)
    assert first >= 6 and none == 0
    assert programs(tmp_path / "whole", 1e9) == (0, first)
    held = sum(x.stat().st_size for x in (tmp_path / "whole").glob("*-cache"))
    programs(tmp_path / "small", 0.5 * held)
    assert 0 < sum(x.stat().st_size for x in (tmp_path / "small").glob("*-cache")) <= 0.5 * held


def test_what_a_killed_process_left_goes(tmp_path):
    whole, half, fresh = (tmp_path / f"{n}-cache" for n in ("whole", "half", "fresh"))
    for program in (whole, half, fresh):
        program.write_bytes(b"x")
    (tmp_path / "whole-atime").write_bytes(b"x")
    for program in (whole, half):
        os.utime(program, (time.time() - 1000.0,) * 2)
    _clean(tmp_path)
    assert whole.exists() and fresh.exists() and not half.exists()


def test_a_folder_of_ones_own_stays():
    known = jax.config.jax_compilation_cache_dir
    assert known and str(jr.enable_cache()) == known
    told = jr.show_config()
    assert known in told["cache"] and told["64-bit floats"] == "on"


def test_a_folder_that_cannot_be(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(jr.InputError, match="folder: `.*file.cache` cannot be written to"):
        jr.enable_cache(tmp_path / "file" / "cache")
    with pytest.raises(jr.InputError, match="limit must be positive"):
        jr.enable_cache(tmp_path, limit=0)
