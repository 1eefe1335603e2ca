"""Of which degree a traced function is in some of its arguments, where it is a polynomial of them.

Told by the program, operation by operation, so that it holds everywhere: a table's bump between two speeds
that somebody tried is seen. What is told is a bound: terms that cancel, or that are multiplied by zeros,
count.
"""

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import numpy as np

# Sums of their operands, or the same numbers in other places.
_LINEAR = frozenset(
    "add sub neg add_any concatenate pad slice reshape transpose broadcast_in_dim squeeze reduce_sum "
    "expand_dims convert_element_type copy copy_p rev cumsum stack unstack split real imag conj mul_zero "
    "reduce_precision device_put optimization_barrier".split()
)
_PRODUCTS = frozenset(("mul", "dot_general"))
# Of their first operand, in places told by others; the updates of a scatter are its last operand.
_PLACED = {
    "gather": 1,
    "dynamic_slice": 1,
    "scatter": 2,
    "scatter-add": 2,
    "dynamic_update_slice": 2,
}


def degree(function: Callable[..., Any], arguments: Sequence[Any], given: Sequence[float]) -> Any:
    """The degrees of the arrays that `function(*arguments)` returns, as a tree like theirs; `inf` where one
    is no polynomial. `given`: of the arguments and all their arrays, 0 where one is a constant."""
    dynamic, static = eqx.partition(tuple(arguments), eqx.is_array)
    closed, shape = jax.make_jaxpr(
        lambda dynamic: function(*eqx.combine(dynamic, static)), return_shape=True
    )(dynamic)
    inside = [d for d, one in zip(given, dynamic) for _ in jax.tree.leaves(one)]
    return jax.tree.unflatten(jax.tree.structure(shape), _of(closed.jaxpr, inside))


def _of(jaxpr: Any, given: Sequence[float], constants: Sequence[float] = ()) -> list[float]:
    known: dict[Any, float] = dict(zip(jaxpr.invars, given))
    known |= dict(zip(jaxpr.constvars, constants or [0.0] * len(jaxpr.constvars)))

    def read(atom: Any) -> float:
        return known.get(atom, 0.0) if not hasattr(atom, "val") else 0.0

    for equation in jaxpr.eqns:
        inside = [read(atom) for atom in equation.invars]
        count = len(equation.outvars)
        found = _step(equation, inside) if any(inside) else [0.0] * count
        known |= dict(zip(equation.outvars, found))
    return [read(atom) for atom in jaxpr.outvars]


def _step(equation: Any, given: list[float]) -> list[float]:
    name, params, count = equation.primitive.name, equation.params, len(equation.outvars)
    for key in ("jaxpr", "call_jaxpr", "fun_jaxpr"):
        inner = params.get(key)
        if inner is not None and name not in ("scan", "while", "cond"):
            return _of(getattr(inner, "jaxpr", inner), given)
    one = np.inf
    if name in _LINEAR:
        one = max(given)
    elif name in _PRODUCTS:
        one = sum(given)
    elif name == "div" and not given[1]:
        one = given[0]
    elif name in ("integer_pow", "square"):
        power = params.get("y", 2)
        one = power * given[0] if power >= 0 else np.inf
    elif name == "select_n" and not given[0]:
        one = max(given[1:])
    elif name in _PLACED:
        one = _placed(name, given)
    elif name == "triangular_solve" and not given[0]:
        one = given[1]
    elif name == "custom_linear_solve":
        right = given[-count:]  # the matrix stands before it
        one = max(right) if not any(given[:-count]) else np.inf
    return [one] * count


def _placed(name: str, given: list[float]) -> float:
    if _PLACED[name] == 1:
        return given[0] if not any(given[1:]) else np.inf
    places, updates = (
        (given[1], given[2]) if name.startswith("scatter") else (max(given[2:]), given[1])
    )
    return max(given[0], updates) if not places else np.inf
