"""Programs that run once or a few times: compiled in a quarter of the time, to run at half the speed."""

import functools
import os
from collections.abc import Callable
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer

F = TypeVar("F", bound=Callable[..., Any])

# Options of XLA. Its versions know them or not; one that stands in XLA_FLAGS is the user's.
_OPTIONS = {"xla_backend_optimization_level": 0, "xla_cpu_use_fusion_emitters": False}


@functools.cache
def _known() -> dict[str, Any]:
    """Those that this XLA takes and nobody has set."""
    found = {}
    for name, value in _OPTIONS.items():
        if name in os.environ.get("XLA_FLAGS", ""):
            continue
        try:
            jax.jit(jnp.negative, compiler_options={name: value})(0.0)
        except jax.errors.JaxRuntimeError:
            continue
        found[name] = value
    return found


def traced(*given: Any) -> bool:
    """Whether these are values that a program is being traced with, or that is derived by, or one is being
    traced all around: then there are no numbers, and XLA's options, which are for whole programs, do not
    go."""
    return any(isinstance(x, Tracer) for x in (*jax.tree.leaves(given), jnp.zeros(())))


def quickly_compiled(function: F) -> F:
    """`eqx.filter_jit` for a program of few runs. Within another program it is a part of that one, compiled
    as that one is."""
    plain = eqx.filter_jit(function)

    @functools.cache
    def quick() -> Any:
        options: Any = {"compiler_options": _known()} if _known() else {}
        return eqx.filter_jit(function, **options) if options else plain

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        return (plain if traced(args, kwargs) else quick())(*args, **kwargs)

    return call  # pyright: ignore[reportReturnType]
