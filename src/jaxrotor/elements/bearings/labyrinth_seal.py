"""Labyrinth seals of gas: eyes of impellers, shaft ends, balance pistons of compressors and turbines."""

from collections.abc import Iterator
from typing import Any, ClassVar, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import number, numbers, whole
from ...core.errors import refuse
from ...core.gate import takes
from ...core.parameter import parameter, problems
from ...core.part import option
from ...core.protocol import AbstractAttachment, Motion, Prepared, Signalling, Vec6
from ...core.quick import quickly_compiled
from ...core.result_text import shows
from .bulk_flow import Coefficients
from .gap_faults import wide_gap
from .labyrinth_flow import Chambers, Labyrinth, chambers, gas_coefficients, swirl, vermes
from .seal_curve import SealCurve, seal_curve, seal_forces, square
from .support import SpeedDependentSupport, in_six
from .whirl_dependent import WhirlDependentSupport

_ROWS = numbers("rad/s", least=0.0, fewest=2, rising=True)


@shows(stiffness="N/m", damping="N*s/m", leakage="kg/s", pressures="Pa", swirl="m/s")
class LabyrinthPoint(NamedTuple):
    """A labyrinth at one speed: the force on the rotor near the middle is `-stiffness d - damping d'`, rows
    and columns (x, y), each `[[direct, cross], [-cross, direct]]`.

    `stiffness`: (2, 2) N/m, `damping`: (2, 2) N·s/m. `leakage`: kg/s; `pressures`: Pa, and `swirl`: velocity
    around the seal, m/s, both of the chambers from the inlet on, (teeth - 1,).
    """

    stiffness: Float[Array, "2 2"]
    damping: Float[Array, "2 2"]
    leakage: Array
    pressures: Float[Array, " n"]
    swirl: Float[Array, " n"]


class LabyrinthSeal(AbstractAttachment, Prepared, Signalling):
    """A labyrinth of straight teeth with a gas: stiffness, damping, and the cross-coupling by the swirl in
    its chambers, which drives compressors and turbines to whirl.

    Attached to a station, it acts between that and the ground, at the speed of the station; attached to
    `(station, rotor)` by the speed of the second, on which it does not act. The force is `-K q - C v` for
    small motions about the middle, with the coefficients of the present speed; tilting, axial force and
    drag about the axis are left out. Turning backward, the swirl does too.

    - `diameter` at the clearance, `clearance` (radial), `pitch` (from tooth to tooth), `height` of the teeth:
      m. `teeth`: how many, two at least. `on`: what they are on, `"stator"`, `"rotor"`, or `"both"`,
      interlocking, where no jet reaches the next tooth.
    - `inlet_pressure`, `outlet_pressure`: Pa, absolute. `temperature`: K. `gas_constant`: J/(kg K), 287.05
      for dry air; with the compressibility factor in it for a real gas. `viscosity` (dynamic): Pa·s.
      `heat_ratio`: of the heat capacities.
    - `preswirl`: circumferential velocity of the gas before the first tooth over that of the rotor's
      surface; less behind swirl brakes.
    - `flow_coefficient`: of each tooth. Left out it is Chaplygin's of sharp teeth, 0.61 to 0.74.
    - `carry_over`: factor by which the jet of the tooth before raises a tooth's flow. Left out, Vermes's, by
      the clearance over the pitch less `tooth_width` (at the tips, m). 1 with teeth on both.
    - `whirl`: frequency of the whirl that K and C are for, rad/s; left out that of the speed (synchronous).
      They depend on it, for the gas is compressible: `support` with `frequencies` has them over both, for
      modes each at its own.

    The leakage is Neumann's, at one temperature; where the pressure falls most the gas reaches Mach 1, and
    no more flows however low the pressure behind it. One control volume a chamber stands for its flow; no
    measured seal has been compared here. `support(speeds)` is a table of it. It keeps no account of its
    energy: its work counts as that of a load in the energy audit.

    Sources: Childs & Scharrer, J. Eng. Gas Turbines Power 108 (1986) 325, after Iwatsubo, NASA CP-2133
    (1980) 139; but for the carry-over: Vermes, J. Eng. Power 83 (1961) 161.
    """

    diameter: Float[Array, ""] = parameter("m", positive=True)
    clearance: Float[Array, ""] = parameter("m", positive=True)
    pitch: Float[Array, ""] = parameter("m", positive=True)
    height: Float[Array, ""] = parameter("m", positive=True)
    inlet_pressure: Float[Array, ""] = parameter("Pa", positive=True)
    outlet_pressure: Float[Array, ""] = parameter("Pa", positive=True)
    temperature: Float[Array, ""] = parameter("K", positive=True)
    gas_constant: Float[Array, ""] = parameter("J/(kg*K)", positive=True)
    viscosity: Float[Array, ""] = parameter("Pa*s", positive=True)
    heat_ratio: Float[Array, ""] = parameter(positive=True, default=1.4)
    preswirl: Float[Array, ""] = parameter(default=0.5)
    tooth_width: Float[Array, ""] = parameter("m", nonnegative=True, default=0.0)
    flow_coefficient: Float[Array, ""] | None = parameter(
        positive=True, optional=True, default=None
    )
    carry_over: Float[Array, ""] | None = parameter(positive=True, optional=True, default=None)
    whirl: Float[Array, ""] | None = parameter(
        "rad/s", nonnegative=True, optional=True, default=None
    )
    teeth: int = option(whole(2, 200), default=10)
    on: Literal["stator", "rotor", "both"] = eqx.field(static=True, default="stator")

    signals: ClassVar[dict[str, str]] = {"leakage": "kg/s"}

    def faults(self) -> Iterator[str]:
        yield from wide_gap(self.clearance, self.diameter, 0.05)
        if float(self.inlet_pressure) <= float(self.outlet_pressure):
            yield (
                f"inlet_pressure must be above outlet_pressure, but is {float(self.inlet_pressure):g} Pa "
                f"to {float(self.outlet_pressure):g} Pa"
            )
        if float(self.heat_ratio) <= 1:
            yield f"heat_ratio must be above 1, but is {float(self.heat_ratio):g}"
        if self.flow_coefficient is not None and float(self.flow_coefficient) > 1:
            yield f"flow_coefficient must be at most 1, but is {float(self.flow_coefficient):g}"
        if self.carry_over is not None and float(self.carry_over) < 1:
            yield f"carry_over must be at least 1, but is {float(self.carry_over):g}"
        if self.on == "both" and self.carry_over is not None:
            yield "carry_over must be left out where teeth are on both: it is 1"
        room = float(self.pitch) - float(self.tooth_width)
        if self.on != "both" and self.carry_over is None and room < 3 * float(self.clearance):
            yield (
                f"pitch must be larger than tooth_width by three clearances for Vermes's carry-over, but is "
                f"by {room:g} m, with a clearance of {float(self.clearance):g} m: give carry_over"
            )

    @takes(speed=number("rad/s"))
    def coefficients(self, speed: Float[Array, ""] | float) -> LabyrinthPoint:
        """At a speed of the rotor, rad/s. Differentiable.

        Raises `InputError` for parameters that a machine refuses too, and where the speed is not finite.
        """
        refuse(problems(self, "LabyrinthSeal"))
        return _point(self, jnp.asarray(speed, float))

    @takes(speeds=_ROWS, frequencies=_ROWS)
    def support(
        self, speeds: Float[Array, " n"] | Any, frequencies: Float[Array, " m"] | Any = None
    ) -> SpeedDependentSupport | WhirlDependentSupport:
        """A support with these coefficients at `speeds` (rad/s, from zero up), for runs and diagrams that
        ask for them often; with `frequencies` of the whirl (rad/s, from zero up) as well, for modes that are
        met each at its own. Differentiable.

        Raises `InputError` for parameters that a machine refuses too, and for fewer than two speeds or
        frequencies, or ones that do not rise from zero up.
        """
        refuse(problems(self, "LabyrinthSeal"))
        speeds = jnp.asarray(speeds, float)
        if frequencies is None:
            return SpeedDependentSupport(speeds, *_over_speeds(self, speeds))
        whirls = jnp.asarray(frequencies, float)
        return WhirlDependentSupport(speeds, whirls, *_over_both(self, speeds, whirls))

    def _labyrinth(self) -> Labyrinth:
        behind = self.carry_over
        if self.on == "both":
            behind = jnp.ones(())
        elif behind is None:
            behind = vermes(self.clearance, self.pitch, self.tooth_width)
        sides = self.height / self.pitch
        rotor, stator = {"stator": (0, 2), "rotor": (2, 0), "both": (1, 1)}[self.on]
        return Labyrinth(
            0.5 * self.diameter,
            self.clearance,
            self.pitch,
            self.height,
            self.inlet_pressure,
            self.outlet_pressure,
            self.gas_constant * self.temperature,
            self.viscosity,
            self.heat_ratio,
            jnp.full(self.teeth, behind).at[0].set(1.0),
            1 + rotor * sides,
            1 + stator * sides,
            self.flow_coefficient,
        )

    def _found(
        self, seal: Labyrinth, at: Chambers, speed: Array, whirl: Array | None = None
    ) -> tuple[Array, Coefficients]:
        """Velocities around the seal, and coefficients."""
        entry = self.preswirl * seal.radius * speed
        velocity = swirl(seal, at, entry, speed)
        if whirl is None:
            whirl = speed if self.whirl is None else self.whirl
        return velocity, gas_coefficients(seal, at, velocity, entry, speed, whirl)

    def prepared(self) -> SealCurve:
        return _curve(self)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        seal = self._labyrinth()
        return seal_forces(self._found(seal, chambers(seal), motions[-1][1][5])[1], motions)

    def leakage(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """What flows through, kg/s; the same at all speeds."""
        return _leakage(seal := self._labyrinth(), chambers(seal))


def _leakage(seal: Labyrinth, at: Chambers) -> Array:
    return 2 * jnp.pi * seal.radius * at.flow


@quickly_compiled
def _curve(labyrinth: LabyrinthSeal) -> SealCurve:
    """(A program of its own within a solve's: traced once, however often that asks for it.)"""
    seal = labyrinth._labyrinth()
    at = chambers(seal)
    # rows stand close near rest, where friction turns from linear to the power 1.75 of the speed; the last
    # are at eighteen times the speed of sound
    scale = seal.gas**0.5 / seal.radius / 600
    return seal_curve(lambda speed: labyrinth._found(seal, at, speed)[1], scale)


@quickly_compiled
def _point(labyrinth: LabyrinthSeal, speed: Array) -> LabyrinthPoint:
    seal = labyrinth._labyrinth()
    at = chambers(seal)
    velocity, found = labyrinth._found(seal, at, speed)
    return LabyrinthPoint(
        square(found.K, found.k),
        square(found.C, found.c),
        _leakage(seal, at),
        at.pressures,
        velocity,
    )


@quickly_compiled
def _over_speeds(labyrinth: LabyrinthSeal, speeds: Array) -> tuple[Array, Array]:
    """Stiffness and damping, (n, 6, 6)."""
    return _tables(labyrinth, speeds, None)


@quickly_compiled
def _over_both(labyrinth: LabyrinthSeal, speeds: Array, whirls: Array) -> tuple[Array, Array]:
    """(n, m, 6, 6)."""
    return jax.vmap(lambda whirl: _tables(labyrinth, speeds, whirl), out_axes=1)(whirls)


def _tables(labyrinth: LabyrinthSeal, speeds: Array, whirl: Array | None) -> tuple[Array, Array]:
    seal = labyrinth._labyrinth()
    at = chambers(seal)

    def one(speed: Array) -> tuple[Array, Array]:
        found = labyrinth._found(seal, at, speed, whirl)[1]
        return in_six(square(found.K, found.k)), in_six(square(found.C, found.c))

    return jax.lax.map(one, speeds)
