"""Rolling bearing: balls (or rollers) between two races, each a contact that only pushes."""

import abc
import math
from collections.abc import Iterator
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.arguments import number, whole
from ...core.parameter import parameter
from ...core.part import Part, as_tuple, option
from ...core.protocol import AbstractAttachment, Energetic, Motion, NonSmooth, Signalling, Vec6
from ..laws.centres import pushed, relative

# The contact of a ball with the race, of a roller with its track: Hertz's point and line contact.
POINT, LINE = 1.5, 10.0 / 9.0


class AbstractRaceDefect(Part):
    """A local defect: where it stands, a ball finds that much more room. To write your own, give `room`."""

    @abc.abstractmethod
    def room(self, ball: Array, number: Array, inner: Array, spin: Array) -> Array:
        """m, for balls at the angles `ball` (rad, fixed in space), `number` of each; `inner` is the inner
        race's angle, `spin` how far each ball has turned about its own axis."""


def _pit(angle: Array, width: Array, depth: Array) -> Array:
    """A smooth hollow about angle 0 (modulo a turn), `width` from edge to edge."""
    away = jnp.mod(angle + jnp.pi, 2 * jnp.pi) - jnp.pi
    inside = jnp.abs(away) < width / 2
    wave = 0.5 * (1 + jnp.cos(2 * jnp.pi * jnp.where(inside, away, 0.0) / width))
    return depth * jnp.where(inside, wave, 0.0)


class OuterRaceDefect(AbstractRaceDefect):
    """A pit in the outer race: `angle` (rad from x, the load zone is at -pi/2 under weight), `width` (rad,
    edge to edge), `depth` (m). Balls pass it at the ball-pass frequency of the outer race."""

    angle: Float[Array, ""] = parameter("rad")
    width: Float[Array, ""] = parameter("rad", positive=True)
    depth: Float[Array, ""] = parameter("m", nonnegative=True)

    def room(self, ball: Array, number: Array, inner: Array, spin: Array) -> Array:
        return _pit(ball - self.angle, self.width, self.depth)


class InnerRaceDefect(AbstractRaceDefect):
    """A pit in the inner race, which carries it round: `angle` (rad) from x where the journal's phi is 0."""

    angle: Float[Array, ""] = parameter("rad")
    width: Float[Array, ""] = parameter("rad", positive=True)
    depth: Float[Array, ""] = parameter("m", nonnegative=True)

    def room(self, ball: Array, number: Array, inner: Array, spin: Array) -> Array:
        return _pit(ball - inner - self.angle, self.width, self.depth)


class BallDefect(AbstractRaceDefect):
    """A flat on the first ball that meets the outer and the inner race in turn: `angle` (rad) of the ball's
    own turning where it meets the outer race, `width` (rad on the ball), `depth` (m)."""

    angle: Float[Array, ""] = parameter("rad")
    width: Float[Array, ""] = parameter("rad", positive=True)
    depth: Float[Array, ""] = parameter("m", nonnegative=True)

    def room(self, ball: Array, number: Array, inner: Array, spin: Array) -> Array:
        turned = spin - self.angle
        pits = _pit(turned, self.width, self.depth) + _pit(turned + jnp.pi, self.width, self.depth)
        return jnp.where(number == 0, pits, 0.0)


class RollingBearing(AbstractAttachment, Energetic, Signalling, NonSmooth):
    """A ball or roller bearing under radial load: Hertz contacts with clearance, at the balls' moving places.

    Attached to the journal's station, or to `(journal, housing)`. Ball j stands at `theta_j`; it is
    squeezed by `d_j = e · n_j - clearance - room of defects` and pushes with `stiffness d_j^exponent` where
    d_j > 0. The cage turns by pure rolling, `(1 - s)/2` of the inner and `(1 + s)/2` of the outer race's
    angle with `s = ball_diameter cos(contact_angle)/pitch_diameter`: so the stiffness varies at the
    ball-pass frequency even without a defect. What that varying does, the spin feels (virtual work): no
    energy comes from nothing.

    - `balls`: how many. `stiffness`: N/m^1.5 of a ball's two contacts in series (`exponent` 1.5), or of a
      roller's, N/m^(10/9) (`exponent` 10/9).
    - `ball_diameter`, `pitch_diameter`: m; `contact_angle`: rad. `clearance`: m, radial (half of the
      diametral).
    - `damping`: N·s/m across. `defects`: any of `OuterRaceDefect`, `InnerRaceDefect`, `BallDefect`.

    Sources: Harris & Kotzalas, Rolling Bearing Analysis, 5th ed. (2006), chs. 7, 8; Fukata et al., JSME
    Int. J. 28 (1985) 899; McFadden & Smith, J. Sound Vib. 96 (1984) 69 (defects).
    """

    stiffness: Float[Array, ""] = parameter(positive=True, label="N/m^exponent")
    ball_diameter: Float[Array, ""] = parameter("m", positive=True)
    pitch_diameter: Float[Array, ""] = parameter("m", positive=True)
    clearance: Float[Array, ""] = parameter("m", nonnegative=True, default=0.0)
    contact_angle: Float[Array, ""] = parameter("rad", default=0.0)
    damping: Float[Array, ""] = parameter("N*s/m", nonnegative=True, default=0.0)
    first_ball: Float[Array, ""] = parameter("rad", default=0.0)
    defects: tuple[AbstractRaceDefect, ...] = eqx.field(converter=as_tuple, default=())
    balls: int = option(whole(3, 1000), default=8)
    # 1.5 for balls, 10/9 for rollers
    exponent: float = option(number(above=1.0), default=POINT)

    signals: ClassVar[dict[str, str]] = {"rolling_force": "N", "ball_loads": "N"}

    def faults(self) -> Iterator[str]:
        if float(self.ball_diameter) >= float(self.pitch_diameter):
            yield (
                f"ball_diameter must be smaller than pitch_diameter, but is "
                f"{float(self.ball_diameter):g} against {float(self.pitch_diameter):g} m"
            )
        room = float(self.pitch_diameter) * math.sin(math.pi / self.balls)  # between two centres
        if float(self.ball_diameter) > room:
            yield (
                f"balls must find room on the pitch circle, but {self.balls} balls of "
                f"{float(self.ball_diameter):g} m on one of {float(self.pitch_diameter):g} m overlap: "
                f"there each may have {room:.4g} m"
            )

    def _slenderness(self) -> Array:
        return self.ball_diameter / self.pitch_diameter * jnp.cos(self.contact_angle)

    def frequencies(self) -> dict[str, Array]:
        """Per turn of the shaft, outer race at rest: `"cage"`, `"outer"` and `"inner"` race ball pass,
        `"ball"` spin (a defect of a ball shows at twice that)."""
        s = self._slenderness()
        return {
            "cage": 0.5 * (1 - s),
            "outer": 0.5 * self.balls * (1 - s),
            "inner": 0.5 * self.balls * (1 + s),
            "ball": 0.5 * self.pitch_diameter / self.ball_diameter * (1 - s**2),
        }

    def _squeeze(self, e: Array, inner: Array, outer: Array) -> tuple[Array, Array]:
        """How far each ball is squeezed (m, negative: free) and its direction (2, balls)."""
        s = self._slenderness()
        number = jnp.arange(self.balls)
        cage = 0.5 * (1 - s) * inner + 0.5 * (1 + s) * outer
        at = cage + self.first_ball + 2 * jnp.pi * number / self.balls
        n = jnp.stack([jnp.cos(at), jnp.sin(at)])
        spin = 0.5 * self.pitch_diameter / self.ball_diameter * (1 - s**2) * (inner - outer)
        room = sum(
            (defect.room(at, number, inner, spin) for defect in self.defects),
            jnp.zeros(self.balls),
        )
        return e @ n - self.clearance - room, n

    def _loads(self, squeeze: Array) -> Array:
        touching = squeeze > 0
        return self.stiffness * jnp.where(
            touching, jnp.where(touching, squeeze, 1.0) ** self.exponent, 0.0
        )

    def _potential(self, e: Array, inner: Array, outer: Array) -> Array:
        squeeze, _ = self._squeeze(e, inner, outer)
        return jnp.sum(self._loads(squeeze) * squeeze) / (self.exponent + 1)

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        e, e_t = relative(motions)
        pull, inner, outer = jax.grad(self._potential, argnums=(0, 1, 2))(e, *_turned(motions))
        f = -pull - self.damping * e_t
        return pushed(motions, f, -inner, -outer)

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self._potential(relative(motions)[0], *_turned(motions))

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self.damping * jnp.sum(relative(motions)[1] ** 2)

    def ball_loads(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, " balls"]:
        """N, each ball's, positive."""
        return self._loads(self._squeeze(relative(motions)[0], *_turned(motions))[0])

    def rolling_force(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, "2"]:
        """On the journal, N: (x, y), without damping."""
        squeeze, n = self._squeeze(relative(motions)[0], *_turned(motions))
        return -n @ self._loads(squeeze)


def _turned(motions: tuple[Motion, ...]) -> tuple[Array, Array]:
    """Angles of the inner and the outer race."""
    inner = motions[0][0][5]
    return inner, motions[1][0][5] if len(motions) > 1 else jnp.zeros_like(inner)
