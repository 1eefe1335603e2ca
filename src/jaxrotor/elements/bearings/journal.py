"""Plain journal bearing and squeeze-film damper."""

from collections.abc import Iterator
from typing import Any, ClassVar, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix
from jaxtyping import Array, Float

from ...core.errors import InputError
from ...core.parameter import known, parameter
from ...core.protocol import AbstractAttachment, Energetic, Motion, NonSmooth, Signalling, Vec6
from ...core.result_text import shows
from ..laws.centres import pushed, relative
from .film import LENGTHS, finite_film, short_film
from .gap_faults import wide_gap

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(64)


@shows(eccentricity="m", stiffness="N/m", damping="N*s/m")
class WorkingPoint(NamedTuple):
    """Where a journal runs under a steady load, and the film's linear force for small motions about it:
    `-stiffness @ d - damping @ d'`, rows and columns (x, y).

    `eccentricity`: (2,) m, `stiffness`: (2, 2) N/m, `damping`: (2, 2) N·s/m.
    """

    eccentricity: Float[Array, "2"]
    stiffness: Float[Array, "2 2"]
    damping: Float[Array, "2 2"]


class AbstractFilm(AbstractAttachment, Energetic, Signalling, NonSmooth):
    """A film between a journal and the ground, or a second station around it."""

    diameter: eqx.AbstractVar[Array]
    length: eqx.AbstractVar[Array]
    clearance: eqx.AbstractVar[Array]
    viscosity: eqx.AbstractVar[Array]
    film: eqx.AbstractVar[str]
    theory: eqx.AbstractVar[str]

    signals: ClassVar[dict[str, str]] = {"film_force": "N", "eccentricity_ratio": ""}

    def faults(self) -> Iterator[str]:
        if self.film not in ("cavitated", "full"):
            yield f'film must be "cavitated" or "full", but is {self.film!r}'
        if self.theory not in ("short", "finite"):
            yield f'theory must be "short" or "finite", but is {self.theory!r}'
        slenderness = float(self.length) / float(self.diameter)
        if self.theory == "finite" and not LENGTHS[0] <= slenderness <= LENGTHS[1]:
            yield (
                f"length must be {LENGTHS[0]:g} to {LENGTHS[1]:g} diameters for the finite theory, but is "
                f'{slenderness:.3g}: take theory="short" for a shorter bearing, several for a longer one'
            )
        if self.theory == "finite" and self.film == "full":
            yield 'film must be "cavitated" for the finite theory: take theory="short" for a full film'
        yield from wide_gap(self.clearance, self.diameter, 0.1)

    def _scale(self) -> Array:
        return 0.5 * self.viscosity * self.diameter * (self.length / self.clearance) ** 3

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return jnp.zeros(())

    def eccentricity_ratio(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, ""]:
        """How far the journal (the ring) is from the centre, over the clearance."""
        e, _ = relative(motions)
        square = e @ e
        return (
            jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)
            / self.clearance
        )

    def force(self, e: Float[Array, "2"], w: Float[Array, "2"]) -> Float[Array, "2"]:
        """On the journal, N, at `e` (m) moving with `w` (m/s) less half of the surfaces' turning."""
        eps = e / self.clearance
        if self.theory == "finite":
            return self._scale() * finite_film(eps, w, self.length / self.diameter)
        return self._scale() * short_film(eps, w, self.film == "cavitated")

    def _squeezed(self, e, w) -> Array:
        """Power that the flow under pressure turns into heat, W, by quadrature over the short film."""
        if self.theory == "finite":
            return -self.force(e, w) @ w
        size = jnp.sqrt(w @ w)
        about = jnp.arctan2(jnp.where(size > 0, w[1], 0.0), jnp.where(size > 0, w[0], 1.0))
        whole = self.film == "full"
        span = jnp.pi if whole else jnp.pi / 2
        angles = about + span * jnp.asarray(_POINTS)
        n = jnp.stack([jnp.cos(angles), jnp.sin(angles)])
        flow = (w @ n) ** 2 / (1 - e @ n / self.clearance) ** 3
        return self._scale() * span * jnp.sum(_WEIGHTS * flow)


def _across(e: Array) -> Array:
    """z × e."""
    return jnp.stack([-e[1], e[0]])


class JournalBearing(AbstractFilm):
    """A plain cylindrical journal bearing, by the theory of the short film or of finite length.

    Attached to the journal's station it is fixed in the ground: `(bearing, "journal")`; with a housing or
    pedestal that moves, `(bearing, ("journal", "pedestal"))`. Only the centres count, not how the journal
    tilts.

    - `diameter`, `length`, `clearance`: m, the clearance radial. `viscosity`: Pa·s, at working temperature.
    - `film`: `"cavitated"`, pressure below ambient is cut off (Guembel), or `"full"`, which an oil under a
      high ambient pressure keeps.

    - `theory`: `"short"`, Ocvirk's closed form, for lengths up to a quarter of the diameter or so (at half
      of it and an eccentricity ratio of 0.6 it bears 37 % too much); `"finite"`, fitted to solutions of
      Reynolds' equation with its pressure cut off below ambient, for lengths of 0.1 to 1.25 diameters
      (within 4 % up to an eccentricity ratio of 0.95). Films that begin where pressure and slope vanish
      bear 1 to 20 % more.

    The film's shear brakes the journal (Petroff over the whole circumference), and half of the torque that
    the pressure has about the bearing's centre falls on either surface: so what whirl gains, the shaft's
    turning loses. At rest the film bears nothing: start turning, from `initial="running"`.
    NaN where the journal touches. Sources: Ocvirk, NACA TN 2808 (1952); Booker, J. Basic Eng. 87 (1965) 537;
    Szeri, Fluid Film Lubrication, 2nd ed. (2011), ch. 3; torques from the power balance of the film.
    """

    diameter: Float[Array, ""] = parameter("m", positive=True)
    length: Float[Array, ""] = parameter("m", positive=True)
    clearance: Float[Array, ""] = parameter("m", positive=True)
    viscosity: Float[Array, ""] = parameter("Pa*s", positive=True)
    film: Literal["cavitated", "full"] = eqx.field(static=True, default="cavitated")
    theory: Literal["short", "finite"] = eqx.field(static=True, default="short")

    def _motion(self, motions: tuple[Motion, ...]) -> tuple[Array, Array, Array]:
        """e, w and the speed of the surfaces against each other (rad/s)."""
        e, e_t = relative(motions)
        spins = [m[1][5] for m in motions] + [jnp.zeros_like(motions[0][1][5])]
        return e, e_t - 0.5 * (spins[0] + spins[1]) * _across(e), spins[0] - spins[1]

    def _drag(self, e: Array) -> Array:
        """N·m·s/rad."""
        eps = e / self.clearance
        gap = self.clearance * jnp.sqrt(1 - eps @ eps)
        return jnp.pi / 4 * self.viscosity * self.length * self.diameter**3 / gap

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        e, w, speed = self._motion(motions)
        f = self.force(e, w)
        shared, drag = 0.5 * jnp.sum(_across(e) * f), self._drag(e) * speed
        return pushed(motions, f, -drag - shared, drag - shared)

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        e, w, speed = self._motion(motions)
        return self._squeezed(e, w) + self._drag(e) * speed**2

    def film_force(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, "2"]:
        """On the journal, N: (x, y)."""
        e, w, _ = self._motion(motions)
        return self.force(e, w)

    def working_point(
        self, load: Float[Array, "2"] | tuple[float, float], speed: Float[Array, ""] | float
    ) -> WorkingPoint:
        """Equilibrium under a steady `load` (N, on the journal: (x, y)) at `speed` (rad/s, of the journal),
        with the eight coefficients by automatic differentiation. Differentiable.

        Raises `InputError` where load or speed is zero: then the journal has no place.
        """
        load, speed = jnp.asarray(load, float), jnp.asarray(speed, float)
        for name, value in (("load", load), ("speed", speed)):
            number = known(value)
            if number is not None and not (np.isfinite(number).all() and np.any(number != 0)):
                raise InputError(f"{name} must be finite and not zero, but is {number}")
        return _working_point(self, load, speed)


@eqx.filter_jit
def _working_point(bearing: JournalBearing, load: Array, speed: Array) -> WorkingPoint:
    def film(e, e_t):
        return bearing.force(e, e_t - 0.5 * speed * _across(e))

    still, size = jnp.zeros(2), jnp.sqrt(load @ load)

    def place(x):  # any x is inside the clearance
        return bearing.clearance * x / jnp.sqrt(1 + x @ x)

    def missing(x, _):
        # a film's force grows beyond all bounds towards the wall: its logarithm does not
        f = film(place(x), still)
        strength = jnp.sqrt(f @ f)
        turn = (f[0] * load[1] - f[1] * load[0]) / (strength * size)
        towards = -(f @ load) / (strength * size)
        return jnp.stack([jnp.log(strength / size), jnp.arctan2(turn, towards)])

    start = 0.5 * (load - jnp.sign(speed) * _across(-load)) / size
    found = optimistix.root_find(
        missing, optimistix.Dogleg(rtol=1e-12, atol=1e-12), start, max_steps=200, throw=False
    )
    e = place(found.value)
    K, C = (-jax.jacfwd(film, argnums=i)(e, still) for i in (0, 1))
    fine = found.result == optimistix.RESULTS.successful
    return WorkingPoint(*(jnp.where(fine, x, jnp.nan) for x in (e, K, C)))


class SqueezeFilmDamper(AbstractFilm):
    """A film around a ring that does not turn (an outer race held by a pin or a cage): it damps alone.

    Attached to the ring's station, or to `(ring, housing)`. Arguments as for `JournalBearing`; open ends.
    What centres the ring is a `LinearSupport` beside it. Sources: as of `JournalBearing`; Della Pietra &
    Adiletta, Shock and Vibration Digest 34 (2002) 3.
    """

    diameter: Float[Array, ""] = parameter("m", positive=True)
    length: Float[Array, ""] = parameter("m", positive=True)
    clearance: Float[Array, ""] = parameter("m", positive=True)
    viscosity: Float[Array, ""] = parameter("Pa*s", positive=True)
    film: Literal["cavitated", "full"] = eqx.field(static=True, default="cavitated")
    theory: Literal["short", "finite"] = eqx.field(static=True, default="short")

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        f = self.film_force(t, motions, state)
        zero = jnp.zeros_like(f[0])
        return pushed(motions, f, zero, zero)

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        return self._squeezed(*relative(motions))

    def film_force(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, "2"]:
        """On the ring, N: (x, y)."""
        return self.force(*relative(motions))
