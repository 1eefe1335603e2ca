"""What jaxrotor runs on."""

import os
import platform
from typing import Any

from .cache import cache_in_use, jax_setting
from .one_kernel import is_one_kernel
from .version import installed_version


def show_config() -> dict[str, Any]:
    """What is in force: versions, devices, 64-bit floats, the folder of compiled programs, how loops are
    compiled (docs/solving.md), and XLA's flags.
    Printed by rows, and returned as a dict."""
    import jax

    cache = cache_in_use()
    words = "none: jr.enable_cache() keeps compiled programs for the next process"
    if cache:
        limit = "no limit" if cache["limit"] is None else f"of {cache['limit'] / 2**20:.0f} MiB"
        words = f"{cache['folder']}, {cache['bytes'] / 2**20:.1f} MiB {limit}"
    x64 = bool(jax_setting("jax_enable_x64"))
    found = {
        "jaxrotor": installed_version(),
        "JAX": jax.__version__,
        "Python": platform.python_version(),
        "devices": ", ".join(str(d) for d in jax.devices()),
        "64-bit floats": "on" if x64 else 'off: jax.config.update("jax_enable_x64", True)',
        "cache": words,
        "loops": "one kernel each" if is_one_kernel() else "a kernel for each operation",
        "XLA_FLAGS": os.environ.get("XLA_FLAGS", ""),
    }
    for name, value in found.items():
        print(f"{name:<14}{value or '-'}")
    return found
