"""A check as a measure of the machine, to minimise or to bound."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..core.errors import InputError
from ..machine.machine import Machine
from ..objectives.machine_measures import AbstractMachineMeasure
from .finding import Assessment

_FAR = -1e3  # what has no limit is as far from it as this


class Shortfall(AbstractMachineMeasure):
    """By how much each finding of a check misses its limit, in the finding's unit: negative where it is met.
    `Shortfall(check) <= 0.0` is a constraint of `jr.optimize`, `Shortfall(check) <= -2.0` leaves some room.

    `check`: a function of the machine that returns an `Assessment`, or what holds one as `assessment`:
    `lambda m: separation_margins(m, "disc", 300.0, 500.0, count=2)`. It is compiled, so that it must give the
    same findings for every machine: `count` where a check has one.
    """

    check: Callable[[Machine], Any] = eqx.field(static=True)
    unit: ClassVar[str] = ""

    def __call__(self, machine: Machine) -> Float[Array, " n"]:
        found = self.check(machine)
        found = getattr(found, "assessment", found)
        if not isinstance(found, Assessment):
            raise InputError(
                f"check must return an Assessment, but returns a {type(found).__name__}"
            )
        bound = [one for one in found.findings if one.sense != "for information"]
        if not bound:
            raise InputError("check: none of its findings has a limit")
        return jnp.stack([jnp.where(jnp.isfinite(one.limit), -one.room, _FAR) for one in bound])
