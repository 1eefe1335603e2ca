"""How many threads NumPy's and SciPy's linear algebra runs in."""

import functools
from collections.abc import Callable
from typing import Any, TypeVar

import threadpoolctl

F = TypeVar("F", bound=Callable[..., Any])


@functools.cache
def _blas() -> Any:
    return threadpoolctl.ThreadpoolController().select(user_api="blas")


def one_thread(function: F) -> F:
    """For matrices of some hundred rows, in which threads wait for each other longer than they work: a
    quarter of the processor time, and less wherever something else runs too."""

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        with _blas().limit(limits=1):
            return function(*args, **kwargs)

    return call  # pyright: ignore[reportReturnType]
