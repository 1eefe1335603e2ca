"""What a check says: a number, its limit, and whether that is met."""

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Bool, Float

from ..core.parameter import known
from ..core.readable import amount
from ..core.result_text import table_of


class Finding(eqx.Module):
    """One number beside its limit; both may be differentiated.

    `check`: what is looked at ("separation margin"). `place`: where ("critical 1, 3210 rpm"). `value`,
    `limit`: in `unit`, which pint reads ("" for a pure number). `sense`: how the value shall lie to its
    limit; "for information" where there is none (`limit` is NaN then). `source`: edition and clause, or where
    the rule was read.
    """

    check: str = eqx.field(static=True)
    place: str = eqx.field(static=True)
    value: Float[Array, ""]
    limit: Float[Array, ""]
    sense: Literal["at least", "at most", "for information"] = eqx.field(static=True)
    unit: str = eqx.field(static=True)
    source: str = eqx.field(static=True)

    @property
    def room(self) -> Float[Array, ""]:
        """What is left to the limit, in `unit`: positive where it is met, NaN where there is none. The number
        to differentiate: "which dimension buys the missing 2 %"."""
        away = self.value - self.limit
        return -away if self.sense == "at most" else away

    @property
    def met(self) -> Bool[Array, ""]:
        """Whether the value lies as it shall. A value that is no number never does."""
        if self.sense == "for information":
            return jnp.isfinite(self.value)
        return self.room >= 0

    def __repr__(self) -> str:
        value, limit, met = (known(x) for x in (self.value, self.limit, self.met))
        if value is None or limit is None or met is None:
            return f"Finding({self.check}, {self.place}: traced)"
        bound = (
            "" if self.sense == "for information" else f", {self.sense} {_said(limit, self.unit)}"
        )
        verdict = "" if not bound else " (met)" if met else " (NOT met)"
        return f"Finding({self.check}, {self.place}: {_said(value, self.unit)}{bound}{verdict})"


class Assessment(eqx.Module):
    """The findings of one or several checks, in the order of the field."""

    findings: tuple[Finding, ...]

    @property
    def met(self) -> Bool[Array, ""]:
        """Whether all of them are."""
        return jnp.all(jnp.stack([finding.met for finding in self.findings] or [jnp.asarray(True)]))

    def __add__(self, other: "Assessment") -> "Assessment":
        return Assessment(self.findings + other.findings)

    def __repr__(self) -> str:
        if any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(self.findings)):
            return f"Assessment of {len(self.findings)} findings (traced)"
        rows = [("check", "where", "value", "limit", "verdict", "source")]
        for one in self.findings:
            told = one.sense == "for information"
            limit = "-" if told else f"{one.sense} {_said(known(one.limit), one.unit)}"
            verdict = "-" if told else "met" if bool(one.met) else "NOT MET"
            rows.append(
                (
                    one.check,
                    one.place,
                    _said(known(one.value), one.unit),
                    limit,
                    verdict,
                    one.source,
                )
            )
        return table_of(rows)


def _said(value: object, unit: str) -> str:
    return amount(value, unit, digits=4)
