"""An optimiser of optax, by its name."""

import inspect
from typing import Any

import jax
import jax.numpy as jnp
import optax

from ..core.units import shown
from .mistakes import Faults, guess


def read_optimiser(given: Any, faults: Faults) -> Any:
    """One of optax, by name, with its numbers."""
    place = "optimize.optimiser"
    known = {
        name: one
        for name, one in vars(optax).items()
        if inspect.isfunction(one) and "learning_rate" in inspect.signature(one).parameters
    }
    if not isinstance(given, dict) or not isinstance(given.get("kind"), str):
        faults.add(
            place,
            f'must be a table such as {{ kind = "adam", learning_rate = 0.02 }}, but is {shown(given)}: '
            "write that, or leave it out for BFGS",
        )
        return None
    make, own = known.get(given["kind"]), {k: v for k, v in given.items() if k != "kind"}
    if make is None:
        faults.add(
            place, f"there is no optimiser {shown(given['kind'])}{guess(given['kind'], known)}"
        )
        return None
    before = len(faults.sentences)
    faults.unknown_keys(place, own, inspect.signature(make).parameters)
    for key, value in own.items():
        if not isinstance(value, (bool, int, float)):
            faults.add(place, f"{key} must be a number, true or false, but is {shown(value)}")
    rate = own.get("learning_rate")
    if rate is None:
        faults.add(place, "learning_rate is missing: write learning_rate = 0.02")
    elif isinstance(rate, bool) or (isinstance(rate, (int, float)) and not rate > 0):
        faults.add(place, f"learning_rate must be positive, but is {shown(rate)}")
    if len(faults.sentences) > before:
        return None
    try:
        optimiser, x = make(**own), jnp.zeros(2)
        jax.eval_shape(lambda x: optimiser.update(x, optimiser.init(x), x), x)
    except (
        Exception
    ) as error:  # whatever optax raises for numbers that do not fit, or for a want of more
        faults.add(
            place,
            f"{given['kind']} cannot be used with slopes alone, or not with these numbers ({error}): take "
            'kind = "adam"',
        )
        return None
    return optimiser
