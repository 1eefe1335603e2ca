"""One kernel for a whole loop: XLA's CPU programs start each small operation apart, and a loop over the
steps of a small machine takes most of its time for that (jax issues 26145, 26021)."""

import os
import re
import sys
from importlib.util import find_spec
from pathlib import Path

_OPTION = "xla_cpu_small_while_loop_byte_threshold"
_FLAG = f"--xla_backend_extra_options={_OPTION}=1000000000"
# Versions of jaxlib that were seen to take it.
_KNOWN = ("0.10.", "0.11.")


def ask_for_one_kernel() -> None:
    """For this process, where it may still be asked and nobody has set such options. It changes no result."""
    flags = os.environ.get("XLA_FLAGS", "")
    if "xla_backend_extra_options" in flags or _backend_is_up():
        return
    if _jaxlib().startswith(_KNOWN):
        os.environ["XLA_FLAGS"] = f"{flags} {_FLAG}".strip()


def is_one_kernel() -> bool:
    """Whether it was asked for, by us or by the user."""
    return _OPTION in os.environ.get("XLA_FLAGS", "")


def _jaxlib() -> str:
    """Its version. (From its file: to ask for a package's data takes longer than all else here.)"""
    spec = find_spec("jaxlib")
    try:
        text = Path(spec.origin or "").with_name("version.py").read_text() if spec else ""
    except OSError:
        text = ""
    found = re.search(r'^_version = "([^"]+)"', text, re.MULTILINE)
    return found[1] if found else ""


def _backend_is_up() -> bool:
    """Once it is, its flags are read."""
    bridge = sys.modules.get("jax._src.xla_bridge")
    return bool(getattr(bridge, "_backends", None))
