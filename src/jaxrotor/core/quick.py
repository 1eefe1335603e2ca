"""Options of the compiler for the programs that we compile. Its versions know them or not; one that stands
in XLA_FLAGS is the user's."""

import functools
import os
from collections.abc import Callable
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer

from .notice import compiling

F = TypeVar("F", bound=Callable[..., Any])

# Programs of few runs: compiled in a quarter of the time, to run at half the speed.
_QUICK = {"xla_backend_optimization_level": 0, "xla_cpu_use_fusion_emitters": False}
# What runs over and over: compiled in half to two thirds of the time, and as fast.
_LIGHT = {
    "xla_backend_optimization_level": 2,
    "xla_cpu_use_fusion_emitters": False,
    "xla_llvm_disable_expensive_passes": True,
}


@functools.cache
def _known(name: str, value: Any) -> bool:
    """Whether this XLA takes it, and nobody has set it."""
    if name in os.environ.get("XLA_FLAGS", ""):
        return False
    try:
        jax.jit(jnp.negative, compiler_options={name: value})(0.0)
    except jax.errors.JaxRuntimeError:
        return False
    return True


def traced(*given: Any) -> bool:
    """Whether these are values that a program is being traced with, or that is derived by, or one is being
    traced all around: then there are no numbers, and options, which are for whole programs, do not go."""
    return any(isinstance(x, Tracer) for x in (*jax.tree.leaves(given), jnp.zeros(())))


def quickly_compiled(function: F) -> F:
    """`eqx.filter_jit` for a program of few runs. Within another program it is a part of that one, compiled
    as that one is."""
    run = _compiled(function, _QUICK)

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        with compiling():
            return run(*args, **kwargs)

    return call  # pyright: ignore[reportReturnType]


def lightly_compiled(function: F) -> F:
    """`eqx.filter_jit` for a program that runs often. Within another program as `quickly_compiled`."""
    return _compiled(function, _LIGHT)


def jit(function: F) -> F:
    """Compiles `function` as a whole, with options of XLA that suit machines: a gradient takes two thirds of
    the time that `jax.jit` takes to compile it, a batch half, and both run as fast.

    `jr.jit(eqx.filter_value_and_grad(peak))(machine)`. Machines and all that holds arrays may be arguments;
    another value in an array, or another float, compiles nothing anew, while whole numbers and strings are
    part of the program (as for `eqx.filter_jit`). Put it around the whole: inside another program, or under
    `grad` or `vmap`, there are no options. One that stands in `XLA_FLAGS`, or that this XLA does not know, is
    left alone.
    """
    light = lightly_compiled(function)

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        args, kwargs = jax.tree.map(
            lambda x: jnp.asarray(x, float) if type(x) is float else x, (args, kwargs)
        )
        return light(*args, **kwargs)

    return call  # pyright: ignore[reportReturnType]


def _compiled(function: F, options: dict[str, Any]) -> F:
    plain = eqx.filter_jit(function)

    @functools.cache
    def own() -> Any:
        known = {name: value for name, value in options.items() if _known(name, value)}
        more: Any = {"compiler_options": known} if known else {}
        return eqx.filter_jit(function, **more) if known else plain

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        return (plain if traced(args, kwargs) else own())(*args, **kwargs)

    return call  # pyright: ignore[reportReturnType]
