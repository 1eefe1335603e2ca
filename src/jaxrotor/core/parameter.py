"""Physical parameters: fields of elements that carry their unit and their bounds.

A parameter is converted to a float64 array (a Python float would be a compile-time constant, and
every new value a new compilation) and is checked, with the element's name, when a machine is put
together. The same unit serves study files, tables and plots.
"""

import dataclasses
import functools
import typing
from collections.abc import Iterator, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array

from .arguments import real_array, short
from .errors import InputError
from .gate import takes

X64_REMEDY = (
    "jaxrotor needs 64-bit floats, but JAX is set to 32 bits: call "
    '`jax.config.update("jax_enable_x64", True)` before anything else, or set the '
    "environment variable JAX_ENABLE_X64=1"
)


def require_x64() -> None:
    """Raises `InputError` where JAX would silently compute in 32 bits."""
    if not jax.config.jax_enable_x64:  # pyright: ignore[reportAttributeAccessIssue]
        raise InputError(X64_REMEDY)


def as_float64(value: Any) -> Any:
    """A float64 array; what is no number (a truth value, a date, a complex one) is left as it is, for
    `problems` to name."""
    require_x64()
    if value is None or isinstance(value, (str, bytes, dict, eqx.Module)):
        return value
    try:
        if any(isinstance(x, Tracer) for x in jax.tree.leaves(value)):
            return jnp.asarray(value, dtype=jnp.float64)
        found = real_array(value)
        if found is None:
            return value
        with jax.ensure_compile_time_eval():  # inside jit a plain number stays a known number
            if isinstance(value, Array):
                return jnp.asarray(value, dtype=jnp.float64)
            # (`jnp.asarray` would compile a program for each new shape)
            return jax.device_put(np.asarray(found, np.float64))
    except (TypeError, ValueError):
        return value


@takes()
def parameter(
    unit: str = "",
    *,
    positive: bool = False,
    nonnegative: bool = False,
    shapes: Sequence[tuple[int | None, ...]] = ((),),
    optional: bool = False,
    label: str = "",
    units: Sequence[str] = (),
    times: str = "",
    **kwargs: Any,
) -> Any:
    """A field that holds a physical parameter.

    **Arguments:**

    - `unit`: SI unit, as pint reads it; empty for a pure number.
    - `positive`, `nonnegative`: bounds on every entry.
    - `shapes`: allowed shapes; `None` stands for any length.
    - `optional`: whether `None` is allowed (filled in later, or absent).
    - `label`: a few words on its meaning, for messages and documentation.
    - `times`: of a schedule's parameter, the unit by which it exceeds what the schedule drives: "s" for
      an impulse.
    - `units`: units of the entries of a short list, where they differ: `("1/s", "s")`.

    Raises `InputError` for an argument of another kind.
    """
    metadata = dict(
        unit=unit,
        positive=positive,
        nonnegative=nonnegative,
        shapes=tuple(shapes),
        optional=optional,
        label=label,
        units=tuple(units),
        times=times,
    )
    return eqx.field(converter=as_float64, metadata=metadata, **kwargs)


def parameter_fields(module: eqx.Module) -> Iterator[tuple[dataclasses.Field, Any]]:
    """The parameters of one module (not of those nested in it), with their values."""
    for field in dataclasses.fields(module):  # pyright: ignore[reportArgumentType]
        if "unit" in field.metadata:
            yield field, getattr(module, field.name)


def known(value: Any) -> np.ndarray | None:
    """The numbers behind `value`; `None` where `jit` or `vmap` traces it.

    Under `grad` alone they are known. No JAX operation touches what is known already: inside `jit`
    it would be traced from then on.
    """
    if isinstance(value, Tracer):
        value = jax.lax.stop_gradient(value)
        if isinstance(value, Tracer):
            return None
    return np.asarray(value)


def numbers(value: Any) -> np.ndarray:
    """The numbers behind a value that is known to be concrete."""
    found = known(value)
    assert found is not None, "traced where numbers are needed"
    return found


def is_concrete(value: Any) -> bool:
    """Whether the numbers are known: false for what `jit` or `vmap` traces."""
    return not isinstance(value, Tracer) or known(value) is not None


def straight_unit(unit: str) -> str:
    """The unit along a line of what is declared about an axis: N*m/rad becomes N/m."""
    return unit.replace("N*m", "N").replace("rad", "m")


def nested(field: dataclasses.Field, value: Any) -> Iterator[tuple[str, eqx.Module]]:
    """The modules that a field holds, with their steps of a path: itself, or those of a tuple."""
    if isinstance(value, eqx.Module):
        yield field.name, value
    elif isinstance(value, tuple):
        for i, one in enumerate(value):
            if isinstance(one, eqx.Module):
                yield f"{field.name}.{i}", one


def problems(
    module: eqx.Module, place: str, prefix: str = "", straight: bool = False
) -> Iterator[str]:
    """Every fault in the parameters of `module` and of the modules nested in it. `straight`: units
    declared about an axis are meant along a line."""
    own = {field.name for field, _ in parameter_fields(module)}
    sound = True
    for field, value in parameter_fields(module):
        unit = field.metadata["unit"]
        unit = straight_unit(unit) if straight else unit
        for sentence in _faults(field, value, place, prefix + field.name, unit):
            sound = False
            yield sentence
    for field in dataclasses.fields(module):  # pyright: ignore[reportArgumentType]
        value = getattr(module, field.name)
        if "unit" not in field.metadata:
            for sentence in _misfits(module, field, value, place, prefix + field.name):
                sound = False
                yield sentence
        if field.name not in own:
            along = straight or field.metadata.get("straight", False)
            for name, part in nested(field, value):
                for sentence in problems(part, place, f"{prefix}{name}.", along):
                    sound = False
                    yield sentence
    if sound and hasattr(module, "faults") and all(is_concrete(x) for x in jax.tree.leaves(module)):
        with jax.ensure_compile_time_eval():
            for sentence in jax.tree.map(known, module).faults():
                yield f"`{place}`: {sentence}"


def _misfits(module, field, value, place: str, path: str) -> Iterator[str]:
    """Where a part belongs: is it one?"""
    allowed = _kinds(type(module)).get(field.name)
    if typing.get_origin(allowed) is tuple and isinstance(value, tuple):
        inner = typing.get_args(allowed)[0]
        for i, one in enumerate(value):
            yield from _misplaced(inner, field, one, place, f"{path}.{i}")
        return
    yield from _misplaced(allowed, field, value, place, path)


@functools.cache
def _kinds(kind: type) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def _misplaced(allowed, field, value, place: str, path: str) -> Iterator[str]:
    kinds = tuple(k for k in (typing.get_args(allowed) or (allowed,)) if isinstance(k, type))
    parts = tuple(k for k in kinds if issubclass(k, eqx.Module))
    if parts and not isinstance(value, kinds):
        names = [k.__name__ for p in parts for k in (p, *p.__subclasses__())]
        names = field.metadata.get("made_by", [n for n in names if not n.startswith("Abstract")])
        yield (
            f"`{place}`: {path} must be made by {', '.join(names)}, but is {short(value)} "
            f"({type(value).__name__})"
        )


def _faults(
    field: dataclasses.Field, value: Any, place: str, path: str, unit: str
) -> Iterator[str]:
    rule = field.metadata
    unit = f" {unit}" if unit else ""
    if value is None:
        if not rule["optional"]:
            yield f"`{place}`: {path} is missing: give a number{f' in{unit}' if unit else ''}"
        return
    if not isinstance(value, (Array, np.ndarray)):
        yield (
            f"`{place}`: {path} must be a number{f' in{unit}' if unit else ''}, but is "
            f"{short(value)} ({type(value).__name__})"
        )
        return
    shape = value.shape
    if not any(
        len(shape) == len(ok) and all(o is None or o == s for o, s in zip(ok, shape))
        for ok in rule["shapes"]
    ):
        wanted = " or ".join(_shape_words(ok) for ok in rule["shapes"])
        yield f"`{place}`: {path} must be {wanted}, but has shape {shape}"
        return
    found = known(value)
    if found is None:
        return
    found = found.ravel()
    for bad, words in (
        (~np.isfinite(found), "finite"),
        (found <= 0 if rule["positive"] else np.zeros(0, bool), "positive"),
        (found < 0 if rule["nonnegative"] else np.zeros(0, bool), "zero or positive"),
    ):
        if np.any(bad):
            yield f"`{place}`: {path} must be {words}, but is {found[bad][0]:g}{unit}"
            return


def _shape_words(shape: tuple[int | None, ...]) -> str:
    if shape == ():
        return "one number"
    if len(shape) == 1:
        return "a list of numbers" if shape[0] is None else f"{shape[0]} numbers"
    return " x ".join("n" if s is None else str(s) for s in shape) + " numbers"
