"""Compiled programs kept on disk, so that another process need not compile them again."""

import hashlib
import os
import platform
import time
from pathlib import Path
from typing import Any

from .arguments import number, path
from .errors import InputError
from .gate import takes

# Bytes that the folder may hold, unless somebody says otherwise.
_LIMIT = 2**30
# What a killed process left half written is older than this, s.
_STALE = 60.0


@takes(folder=path, limit=number("bytes", above=0.0))
def enable_cache(folder: str | Path | None = None, limit: float = _LIMIT) -> Path:
    """Keeps compiled programs on disk from now on: what one process compiled, the next one loads. Call it
    before anything runs. The command line does by itself (`JAXROTOR_CACHE=off` in the environment stops it).

    - `folder`: by default one for this processor in the user's folder for caches. Several processes may
      share it.
    - `limit`: bytes; beyond it what was not used for longest goes.

    A folder that JAX was given already (`JAX_COMPILATION_CACHE_DIR`) stays, with its own limits. **Returns**
    the folder in use. Raises `InputError` where it cannot be written to.
    """
    import jax

    known = jax_setting("jax_compilation_cache_dir")
    if known and folder is None:
        return Path(known)
    place = Path(folder) if folder is not None else _default_folder()
    try:
        place.mkdir(parents=True, exist_ok=True)
        _clean(place)
        probe = place / f".probe-{os.getpid()}"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise InputError(
            f"folder: `{place}` cannot be written to ({error.strerror}): name another one"
        ) from None
    jax.config.update("jax_compilation_cache_max_size", int(limit))
    # a hundred small programs cost as much as a large one
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", 0)
    jax.config.update("jax_compilation_cache_dir", str(place))
    return place


def jax_setting(name: str) -> Any:
    """Of `jax.config`, whose attributes no type checker knows."""
    import jax

    return getattr(jax.config, name)


def enable_for_commands() -> None:
    """The cache of the command line: where it cannot be had, it is done without."""
    if os.environ.get("JAXROTOR_CACHE", "").lower() in ("off", "0", "no", "false"):
        return
    try:
        enable_cache()
    except InputError:
        pass


def _default_folder() -> Path:
    """One for each kind of processor: programs of another may hold instructions that this one has not."""
    import platformdirs

    kind = hashlib.sha256(_processor().encode()).hexdigest()[:8]
    return Path(platformdirs.user_cache_dir("jaxrotor", appauthor=False)) / f"programs-{kind}"


def _processor() -> str:
    """What tells processors apart: their instructions, where the system says them."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line for line in lines if line.startswith(("flags", "Features")))
    except (OSError, StopIteration):
        return f"{platform.machine()} {platform.processor()}"


def _clean(place: Path) -> None:
    """A program is written before its time of use: where that is missing, the writer was killed, and JAX
    would stumble over the rest for ever."""
    old = time.time() - _STALE
    for program in place.glob("*-cache"):
        used = program.with_name(program.name.removesuffix("-cache") + "-atime")
        try:
            if not used.exists() and program.stat().st_mtime < old:
                program.unlink()
        except OSError:  # another process was first
            pass


def cache_in_use() -> dict[str, Any]:
    """Folder, bytes that it holds, and limit; empty where there is none."""
    known = jax_setting("jax_compilation_cache_dir")
    if not known:
        return {}
    held = sum(x.stat().st_size for x in Path(known).glob("*-cache"))
    limit = jax_setting("jax_compilation_cache_max_size")
    return {"folder": known, "bytes": held, "limit": None if limit < 0 else limit}
