"""Before anything imports JAX: 64-bit floats, compiled code kept between runs. And the code blocks of
the README and the docs, run as tests."""

import gc
import os
import sys
from importlib.metadata import version
from pathlib import Path

os.environ["JAX_ENABLE_X64"] = "1"
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(Path(__file__).parent / ".cache" / "jax"))
# Even the smallest: single operations are a fifth of all compiling, the same in every file.
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
os.environ.setdefault("JAX_PLATFORMS", "cpu")
# OpenBLAS's threads spin while they wait for each other: a tenth of the time of machines of many stations.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Nor have XLA's, which wait for each other at every loop, while the other cores have tests of their own.
os.environ.setdefault("NPROC", "1")
# XLA and LLVM make and free small objects by the million: kept by the thread, they are a twentieth quicker to
# have again. (Read when a process begins, so by the workers; no other C library knows it.)
os.environ.setdefault("GLIBC_TUNABLES", "glibc.malloc.tcache_count=60000")
# Nearly all of the tests' time is compiling: quick code that runs at half the speed takes a quarter of it.
# Pieces compiled side by side cost more in all, and the other cores have tests of their own.
QUICK = (
    "--xla_backend_optimization_level=0 --xla_cpu_opt_preset=CPU_OPT_PRESET_FAST_COMPILE "
    "--xla_cpu_parallel_codegen_split_count=1 "
    # what LLVM is told of arrays that do not overlap grows with the square of their number
    "--xla_llvm_enable_alias_scope_metadata=false --xla_llvm_enable_noalias_metadata=false"
)
if version("jaxlib").startswith(
    "0.10."
):  # later ones end the process at a flag that they do not know
    QUICK += " --xla_cpu_use_fusion_emitters=false"
os.environ.setdefault("XLA_FLAGS", QUICK)
os.environ.setdefault("MPLBACKEND", "Agg")

import jax
import pytest
from sybil import Sybil
from sybil.parsers.markdown import PythonCodeBlockParser


def close_pictures(*_):
    """Figures end with the test or the page that opened them: matplotlib warns of the twenty-first open one,
    whoever made them."""
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


# The six steps run as notebooks, which have the pages' own code (tests/test_notebooks.py).
pytest_collect_file = Sybil(
    parsers=[PythonCodeBlockParser()],
    patterns=["*.md"],
    excludes=["docs/start/?-*.md"],
    teardown=close_pictures,
).pytest()

# Tracing makes so many objects that looking through all of them time and again takes a twentieth of the time.
gc.freeze()
gc.set_threshold(200_000, 20, 20)


# Files of more than half a minute, the longest first: begun last, one of them keeps a single core busy alone.
LONG = """
condensation ross identify linear magnetic_bearings sweep control fitted uncertainty more_configs
shafts_with_mass state_parts shaft_loads configs sweep_cli slopes_by_parts bearings sweep_stores coefficients
shaft_defects identify_cli torsion jumps optimize_cli periodic long_steps design_experiments dense_output
assess critical periodic_shafts measures order_tracked experiment_design seals identify_experiments rk4_rig
reference shaken_machines contact standards faulty_records linear_numbers optimize couplings short_circuit
wheel gear_teeth run_error laws tracing published gears gradients torsional_standards batch_last planetary
information mesh governed_config torsional_command diagnose notebooks energy pads pages
""".split()


def pytest_collection_modifyitems(items):
    rank = {f"test_{name}": i for i, name in enumerate(LONG)}
    items.sort(key=lambda item: rank.get(item.path.stem, len(rank)))


@pytest.fixture(autouse=True)
def close_figures():
    yield
    close_pictures()


@pytest.fixture(autouse=True, scope="module")
def forget_compiled_programs():
    """A file's programs serve that file alone. Kept, they add up to gigabytes and to tens of thousands of
    memory maps in a worker, which dies at the kernel's limit of 65530."""
    yield
    jax.clear_caches()
