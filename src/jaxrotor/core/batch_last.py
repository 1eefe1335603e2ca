"""A batch along the last axis: members lie side by side, so that a processor reckons with several of them
in one instruction.

`jax.vmap` puts the batch first: a member's numbers are short rows then, too short for that. Here a traced
function is gone through operation by operation with the batch behind all axes; an operation that is not known
here goes by `jax.vmap`, to its order and back.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import lax
from jax.extend.core import ClosedJaxpr, Literal
from jaxtyping import Array

# Each number by itself.
_EACH = {
    *("add", "sub", "mul", "div", "rem", "max", "min", "pow", "atan2", "add_any"),
    *("neg", "abs", "sign", "floor", "integer_pow", "square", "sqrt", "rsqrt"),
    *("exp", "log", "expm1", "log1p", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"),
    *("lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not", "xor", "is_finite"),
    *("convert_element_type", "copy", "stop_gradient"),
}  # fmt: skip
# As they are, for they name axes that stand before the batch.
_BEFORE = {
    *("reduce_sum", "reduce_max", "reduce_min", "reduce_and", "reduce_or", "reduce_prod"),
    *("rev", "unstack", "split"),
}
# Functions within the function: the name of what they hold.
_CALLS = {
    "jit": "jaxpr",
    "pjit": "jaxpr",
    "closed_call": "call_jaxpr",
    "custom_jvp_call": "call_jaxpr",
}


class Value(NamedTuple):
    """`batched`: whether the members' own stand along its last axis, or it is the same for all."""

    array: Any
    batched: bool


def batch_last(closed: ClosedJaxpr, values: Sequence[Value], size: int) -> list[Value]:
    """What `closed` gives for `values` of `size` members."""
    jaxpr = closed.jaxpr
    known: dict[Any, Value] = {}

    def read(v: Any) -> Value:
        return Value(v.val, False) if isinstance(v, Literal) else known[v]

    known.update(zip(jaxpr.constvars, (Value(c, False) for c in closed.consts), strict=True))
    known.update(zip(jaxpr.invars, values, strict=True))
    for equation in jaxpr.eqns:
        given = [read(v) for v in equation.invars]
        known.update(zip(equation.outvars, _evaluated(equation, given, size), strict=True))
    return [read(v) for v in jaxpr.outvars]


def wide(value: Value, size: int) -> Array:
    """With the batch's axis."""
    array, batched = value
    if batched:
        return array
    return lax.broadcast_in_dim(array, (*jnp.shape(array), size), tuple(range(jnp.ndim(array))))


def _evaluated(equation: Any, given: list[Value], size: int) -> list[Value]:
    primitive, params = equation.primitive, equation.params
    inner = params.get(_CALLS.get(primitive.name, ""))
    if isinstance(inner, ClosedJaxpr):
        return batch_last(inner, given, size)
    batched = any(value.batched for value in given)
    if not batched:
        found = primitive.bind(*(value.array for value in given), **params)
    elif primitive.name in _EACH:
        shape = equation.outvars[0].aval.shape
        found = primitive.bind(*(_filled(value, shape, size) for value in given), **params)
    elif primitive.name in _BEFORE:
        found = primitive.bind(given[0].array, **params)
    else:
        own = _RULES.get(primitive.name)
        found = None if own is None else own(given, size, **params)
        if found is None:
            found = _by_vmap(primitive, given, size, params)
    several = found if primitive.multiple_results else [found]
    return [Value(array, batched) for array in several]


def _by_vmap(primitive: Any, given: list[Value], size: int, params: dict[str, Any]) -> Any:
    axes = tuple(-1 if value.batched else None for value in given)
    one = jax.vmap(
        lambda *own: primitive.bind(*own, **params), in_axes=axes, out_axes=-1, axis_size=size
    )
    return one(*(value.array for value in given))


def _filled(value: Value, shape: tuple[int, ...], size: int) -> Array:
    """Where a number stands for all of `shape`."""
    array, batched = value
    if jnp.ndim(array) == len(shape) + batched:
        return wide(value, size)
    return lax.broadcast_in_dim(array, (*shape, size), (len(shape),) if batched else ())


def _broadcast_in_dim(given, size, *, shape, broadcast_dimensions, **_):
    if len(given) > 1:
        return None
    return lax.broadcast_in_dim(given[0].array, (*shape, size), (*broadcast_dimensions, len(shape)))


def _reshape(given, size, *, new_sizes, dimensions, **_):
    if len(given) > 1 or dimensions is not None:
        return None
    return lax.reshape(given[0].array, (*new_sizes, size))


def _squeeze(given, size, *, dimensions):
    rank = jnp.ndim(given[0].array) - 1
    return lax.squeeze(given[0].array, [axis % rank for axis in dimensions])


def _slice(given, size, *, start_indices, limit_indices, strides):
    steps = None if strides is None else (*strides, 1)
    return lax.slice(given[0].array, (*start_indices, 0), (*limit_indices, size), steps)


def _concatenate(given, size, *, dimension):
    return lax.concatenate([wide(value, size) for value in given], dimension)


def _stack(given, size, *, axis):
    return jnp.stack([wide(value, size) for value in given], axis)


def _pad(given, size, *, padding_config):
    what, filling = given
    if filling.batched:
        return None
    return lax.pad(what.array, filling.array, (*padding_config, (0, 0, 0)))


def _transpose(given, size, *, permutation):
    return lax.transpose(given[0].array, (*permutation, len(permutation)))


def _select_n(given, size):
    which, *cases = given
    cases = [wide(case, size) for case in cases]
    if jnp.ndim(which.array) or which.batched:
        return lax.select_n(_filled(which, cases[0].shape[:-1], size), *cases)
    return lax.select_n(which.array, *cases)


def _dynamic_slice(given, size, *, slice_sizes):
    what, *at = given
    if any(index.batched for index in at):
        return None
    return lax.dynamic_slice(what.array, _before(at), (*slice_sizes, size))


def _dynamic_update_slice(given, size):
    what, new, *at = given
    if any(index.batched for index in at):
        return None
    return lax.dynamic_update_slice(wide(what, size), wide(new, size), _before(at))


def _before(at: list[Value]) -> list[Array]:
    """Where to begin, and at the first member."""
    indices = [jnp.asarray(index.array) for index in at]
    return [*indices, jnp.zeros_like(indices[0])]


def _dot_general(given, size, *, dimension_numbers, precision, preferred_element_type, **_):
    """One matrix for all members times their columns is one product of matrices."""
    (left, right), ((along, across), (rows, columns)) = given, dimension_numbers
    kinds = dict(precision=precision, preferred_element_type=preferred_element_type)
    if left.batched and right.batched:
        return None
    if right.batched:
        return lax.dot_general(left.array, right.array, dimension_numbers, **kinds)
    numbers = ((across, along), (columns, rows))
    found = lax.dot_general(right.array, left.array, numbers, **kinds)
    # axes of both, of the right, of the left, the batch's
    both, a = len(rows), jnp.ndim(right.array) - len(across)
    order = (*range(both), *range(a, found.ndim - 1), *range(both, a), found.ndim - 1)
    return lax.transpose(found, order)


_RULES: dict[str, Callable] = {
    rule.__name__[1:]: rule
    for rule in (
        _broadcast_in_dim,
        _reshape,
        _squeeze,
        _slice,
        _concatenate,
        _stack,
        _pad,
        _transpose,
        _select_n,
        _dynamic_slice,
        _dynamic_update_slice,
        _dot_general,
    )
}
