"""Annular seals of liquids in turbulent flow: neck rings, interstage seals, balance pistons."""

from collections.abc import Iterator
from typing import Any, ClassVar, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.arguments import number, numbers
from ...core.errors import InputError, refuse
from ...core.gate import takes
from ...core.parameter import known, parameter, problems
from ...core.protocol import (
    AbstractAttachment,
    Inertial,
    Motion,
    Prepared,
    Signalling,
    Tabulated,
    Vec6,
)
from ...core.quick import quickly_compiled
from ...core.result_text import shows
from .bulk_flow import (
    Coefficients,
    Gap,
    finite_coefficients,
    finite_flow,
    mean_reynolds,
    short_coefficients,
    short_flow,
)
from .gap_faults import wide_gap
from .seal_curve import SealCurve, seal_curve, seal_forces, seal_inertia, square
from .support import SpeedDependentSupport, in_six

# Reynolds number (2 V clearance/nu) below which a flow is not taken for turbulent; and one never reached.
_TURBULENT, _ANY = 2000.0, 1e9


@shows(
    stiffness="N/m",
    damping="N*s/m",
    mass="kg",
    leakage="kg/s",
    velocity="m/s",
)
class SealPoint(NamedTuple):
    """A seal at one speed: the force on the rotor near the middle is `-stiffness d - damping d' - mass d''`,
    rows and columns (x, y), each `[[direct, cross], [-cross, direct]]`.

    `stiffness`: (2, 2) N/m, `damping`: (2, 2) N·s/m, `mass`: (2, 2) kg. `leakage`: kg/s, `velocity`: along
    the seal, m/s, `reynolds_number`: 2 V clearance/nu, V the flow's at a swirl of half the rotor's speed.
    """

    stiffness: Float[Array, "2 2"]
    damping: Float[Array, "2 2"]
    mass: Float[Array, "2 2"]
    leakage: Array
    velocity: Array
    reynolds_number: Array


class AnnularSeal(AbstractAttachment, Prepared, Tabulated, Inertial, Signalling):
    """An annular seal with smooth or evenly rough walls and a liquid in turbulent flow: Lomakin's stiffness,
    damping, cross-coupling by the swirl, and the liquid's inertia.

    Attached to a station, it acts between that and the ground, at the speed of the station; attached to
    `(station, rotor)` by the speed of the second, on which it does not act. The force is
    `-K q - C v - M a` for small motions about the middle, with the coefficients of the present speed;
    tilting, axial force and drag about the axis are left out. Turning backward, the swirl does too.

    - `diameter`, `length`, `clearance` (radial): m. `viscosity` (dynamic): Pa·s. `density`: kg/m³.
    - `pressure_drop` over the seal, Pa, at rest; `pressure_rise`, Pa·s²/rad²: what it grows by with the speed
      squared, as a pump's head does. The drop is `pressure_drop + pressure_rise speed²`.
    - `preswirl`: circumferential velocity of the flow at the inlet over that of the rotor's surface. 0.5 is
      what walls alike bring the flow to in a long seal.
    - `inlet_loss`, over the dynamic pressure there; `exit_recovery`, the part of that of the exit that is
      gained back.
    - `friction`: n and m of Fanning's friction factor `n Re^m`, Re of the velocity against the wall and of
      twice the clearance: (0.079, -0.25), Blasius's, for smooth walls. Hirs's 0.066, with Re of the
      clearance itself, is 0.0785 here. `rotor_friction`: the rotor's, where its wall is another.

    - `theory`: `"finite"`, Childs's for seals of any length: the linear flow of a whirling rotor, solved
      along the seal at five frequencies of the whirl from zero to twice the speed, through which the
      constants are fitted. `"short"`, Childs's closed form (Black & Jenssen's at a preswirl of 0.5), as older
      analyses have it, for walls alike. It leaves out the inertia of what the whirl changes in the flow at
      the inlet: k and C of three seals, a tenth to a half as long as wide, come out 14 to 50 % above the
      finite ones, M at another size.

    A flow with a Reynolds number below 2000 is not turbulent: `coefficients` refuses it, a run through it
    says so and goes on with the turbulent law. `support(speeds)` is a table of it, for what is looked at over
    and over. It keeps no account of its energy: its work counts as that of a load in the energy audit.

    Sources: Childs, J. Lubr. Tech. 105 (1983) 429 and 437, and Turbomachinery Rotordynamics (1993), ch. 4;
    Black & Jenssen, ASME 71-WA/FE-38 (1971); Hirs, J. Lubr. Tech. 95 (1973) 137.
    """

    diameter: Float[Array, ""] = parameter("m", positive=True)
    length: Float[Array, ""] = parameter("m", positive=True)
    clearance: Float[Array, ""] = parameter("m", positive=True)
    pressure_drop: Float[Array, ""] = parameter("Pa", positive=True)
    viscosity: Float[Array, ""] = parameter("Pa*s", positive=True)
    density: Float[Array, ""] = parameter("kg/m^3", positive=True)
    preswirl: Float[Array, ""] = parameter(default=0.5)
    pressure_rise: Float[Array, ""] = parameter("Pa*s^2/rad^2", nonnegative=True, default=0.0)
    inlet_loss: Float[Array, ""] = parameter(nonnegative=True, default=0.1)
    exit_recovery: Float[Array, ""] = parameter(nonnegative=True, default=0.0)
    friction: Float[Array, "2"] = parameter(shapes=((2,),), default=(0.079, -0.25))
    rotor_friction: Float[Array, "2"] | None = parameter(
        shapes=((2,),), optional=True, default=None
    )
    theory: Literal["finite", "short"] = eqx.field(static=True, default="finite")

    signals: ClassVar[dict[str, str]] = {"leakage": "kg/s", "reynolds_number": ""}
    beyond: ClassVar[str] = (
        "its flow is turbulent from a Reynolds number of {first:.6g} on, but the run goes to {found}: the "
        "turbulent law is held there, though it says too little or too much; a larger pressure_drop or a "
        "start at a higher speed avoids it"
    )

    def faults(self) -> Iterator[str]:
        yield from wide_gap(self.clearance, self.diameter, 0.05)
        if float(self.exit_recovery) > 1:
            yield f"exit_recovery must be at most 1, but is {float(self.exit_recovery):g}"
        for name in ("friction", "rotor_friction"):
            law = getattr(self, name)
            if law is not None and not (law[0] > 0 and -1 < law[1] <= 0):
                yield (
                    f"{name} must be a positive n and an m between -1 and 0, as (0.079, -0.25), but is "
                    f"({law[0]:g}, {law[1]:g})"
                )
        if self.theory == "short" and (self.rotor_friction is not None or self.exit_recovery):
            yield (
                "rotor_friction and exit_recovery must be left out for the short theory, which has neither: "
                'take theory="finite"'
            )

    @takes(speed=number("rad/s"))
    def coefficients(self, speed: Float[Array, ""] | float) -> SealPoint:
        """At a speed of the rotor, rad/s. Differentiable.

        Raises `InputError` for parameters that a machine refuses too, where the speed is not finite, and
        where the flow is not turbulent.
        """
        refuse(problems(self, "AnnularSeal"))
        point = _point(self, jnp.asarray(speed, float))
        self._turbulent(point.reynolds_number, speed)
        return point

    @takes(speeds=numbers("rad/s", least=0.0, fewest=2, rising=True))
    def support(self, speeds: Float[Array, " n"] | Any) -> SpeedDependentSupport:
        """A support with these coefficients at `speeds` (rad/s, from zero up), for runs and diagrams that
        ask for them often. Differentiable.

        Raises `InputError` for parameters that a machine refuses too, for fewer than two speeds or ones
        that do not rise from zero up, and where the flow at one of them is not turbulent.
        """
        refuse(problems(self, "AnnularSeal"))
        speeds = jnp.asarray(speeds, float)
        found = _over_speeds(self, speeds)
        reynolds = known(found.reynolds_number)
        if reynolds is not None:
            least = int(np.argmin(reynolds))
            self._turbulent(found.reynolds_number[least], float(speeds[least]))
        tables = (in_six(x) for x in (found.stiffness, found.damping, found.mass))
        return SpeedDependentSupport(speeds, *tables)

    def _turbulent(self, reynolds: Array, speed: Any) -> None:
        number = known(reynolds)
        if number is not None and not number >= _TURBULENT:
            raise InputError(
                f"flow must be turbulent (a Reynolds number of {_TURBULENT:g} or more), but has "
                f"{float(number):.4g} at a speed of {float(speed):g} rad/s: a bearing of laminar flow is a "
                "JournalBearing; else a larger pressure_drop or clearance, or a higher speed"
            )

    def _gap(self, speed: Array) -> Gap:
        rotor = self.friction if self.rotor_friction is None else self.rotor_friction
        return Gap(
            0.5 * self.diameter,
            self.length,
            self.clearance,
            self.density,
            self.viscosity / self.density,
            self.inlet_loss,
            self.exit_recovery,
            self.preswirl,
            self.friction,
            rotor,
            (self.pressure_drop + self.pressure_rise * speed**2) / self.density,
            speed,
        )

    def _velocity(self, gap: Gap) -> Array:
        return short_flow(gap) if self.theory == "short" else finite_flow(gap)[0]

    def _found(self, speed: Array) -> tuple[Array, Coefficients]:
        """Axial velocity, and coefficients."""
        law = short_coefficients if self.theory == "short" else finite_coefficients
        return law(self._gap(speed))

    def prepared(self) -> SealCurve:
        still = self._gap(jnp.zeros(()))
        scale = self._velocity(still) / (still.length + still.radius)
        return seal_curve(lambda speed: self._found(speed)[1], scale)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        return seal_forces(self._found(motions[-1][1][5])[1], motions)

    def inertia(
        self, t: Float[Array, ""], motions: tuple[Motion, ...]
    ) -> Float[Array, "6 6"] | None:
        return seal_inertia(self._found(motions[-1][1][5])[1])

    def leakage(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """What flows through, kg/s."""
        gap = self._gap(motions[-1][1][5])
        return _mass_flow(gap, self._velocity(gap))

    def reynolds_number(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """2 V clearance/nu, V at a swirl of half the rotor's speed."""
        gap = self._gap(motions[-1][1][5])
        return mean_reynolds(gap, self._velocity(gap))

    def looked_up(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, str]:
        # at each sample of a run: w of a settled swirl, found in a sixtieth of the time
        gap = self._gap(motions[-1][1][5])
        return mean_reynolds(gap, short_flow(gap)), jnp.array([_TURBULENT, _ANY]), ""


def _mass_flow(gap: Gap, w: Array) -> Array:
    return 2 * jnp.pi * gap.radius * gap.clearance * gap.density * w


@quickly_compiled
def _point(seal: AnnularSeal, speed: Array) -> SealPoint:
    gap = seal._gap(speed)
    w, found = seal._found(speed)
    return SealPoint(
        square(found.K, found.k),
        square(found.C, found.c),
        square(found.M, found.m),
        _mass_flow(gap, w),
        w,
        mean_reynolds(gap, w),
    )


@quickly_compiled
def _over_speeds(seal: AnnularSeal, speeds: Array) -> SealPoint:
    return jax.lax.map(lambda speed: _point(seal, speed), speeds)
