"""Options of the compiler for the programs that we compile. Its versions know them or not; one that stands
in XLA_FLAGS is the user's."""

import functools
import os
from collections.abc import Callable
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from .notice import compiling

_NUMBER = np.zeros(())
F = TypeVar("F", bound=Callable[..., Any])

# Programs of few runs: compiled in a quarter of the time, to run at half the speed. (What LLVM is told of
# which arrays do not overlap grows with the square of their number, and here nothing is made of it.)
_QUICK = {
    "xla_backend_optimization_level": 0,
    "xla_cpu_use_fusion_emitters": False,
    "xla_llvm_enable_alias_scope_metadata": False,
    "xla_llvm_enable_noalias_metadata": False,
}
# What runs over and over: compiled in half to two thirds of the time, and as fast.
_LIGHT = {
    "xla_backend_optimization_level": 2,
    "xla_cpu_use_fusion_emitters": False,
    "xla_llvm_disable_expensive_passes": True,
}

# A loop of so many operations (reverse mode through a stiff solver) takes LLVM minutes, for its passes go
# through all of it time and again; without them, a tenth, and it runs at a third of the speed.
_LARGE = 12_000


def _known(options: dict[str, Any]) -> dict[str, Any]:
    """Those that this XLA takes and nobody has set."""
    flags = os.environ.get("XLA_FLAGS", "")
    asked = {name: value for name, value in options.items() if name not in flags}
    if _takes(**asked):
        return asked
    return {name: value for name, value in asked.items() if _takes(**{name: value})}


@functools.cache
def _takes(**options: Any) -> bool:
    try:
        jax.jit(jnp.negative, compiler_options=options)(0.0)
    except jax.errors.JaxRuntimeError:
        return False
    return True


def traced(*given: Any) -> bool:
    """Whether these are values that a program is being traced with, or that is derived by, or one is being
    traced all around: then there are no numbers, and options, which are for whole programs, do not go."""
    # an operation on no tracer at all is one where a program is being traced all around
    return any(isinstance(x, Tracer) for x in (*jax.tree.leaves(given), jax.lax.neg(_NUMBER)))


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
    return _compiled(function, _LIGHT, _QUICK)


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


class _Other(Exception):
    """The program is of the other size."""


def _compiled(function: F, options: dict[str, Any], of_large: dict[str, Any] | None = None) -> F:
    """`of_large`: the options where a loop of the program is large, which is seen when it has been traced."""
    plain = eqx.filter_jit(function)
    large = False  # as the last one was

    @functools.cache
    def own(large: bool) -> Any:
        known = _known(of_large if large and of_large else options)
        if not known:
            return plain
        more: Any = {"compiler_options": known}
        if of_large is None:
            return eqx.filter_jit(function, **more)

        def measured(*args: Any, **kwargs: Any) -> Any:
            program = eqx.filter_make_jaxpr(plain)(*args, **kwargs)[0]
            if (largest_loop(program.jaxpr) >= _LARGE) != large:
                raise _Other
            return plain(*args, **kwargs)  # traced once, for both sizes

        # nothing else of it: a module's fields would come along
        measured.__name__ = getattr(function, "__name__", "program")
        return eqx.filter_jit(measured, **more)

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        nonlocal large
        if traced(args, kwargs):
            return plain(*args, **kwargs)
        first = large
        for size in (first, not first):
            try:
                found = own(size)(*args, **kwargs)
            except _Other:
                continue
            large = size
            return found

    return call  # pyright: ignore[reportReturnType]


def largest_loop(jaxpr: Any) -> int:
    """Operations in the largest of the outermost loops, those of inner programs among them."""
    size = functools.cache(lambda inner: sum(1 + sum(map(size, _within(e))) for e in inner.eqns))

    def largest(eqn) -> int:
        count = size if eqn.primitive.name in ("scan", "while") else largest_loop
        return max(map(count, _within(eqn)), default=0)

    return max(map(largest, jaxpr.eqns), default=0)


def _within(eqn: Any) -> list[Any]:
    """The programs in an operation's parameters."""
    held = jax.tree.leaves(eqn.params, is_leaf=lambda x: hasattr(x, "eqns"))
    return [getattr(x, "jaxpr", x) for x in held if hasattr(x, "eqns")]
