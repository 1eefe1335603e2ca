"""One axis of a magnetic bearing: two electromagnets that pull against each other, or their linear law."""

import abc
from collections.abc import Iterator

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.part import Part
from ..laws.touch import area, depth

Scalar = Float[Array, ""]
Coils = Float[Array, "2"]

# Permeability of the vacuum, H/m: exact until 2019, and to 2e-10 since.
MU_0 = 4e-7 * 3.141592653589793


class AbstractMagnet(Part):
    """What pulls along one axis. `s`: m, how far the rotor is out of the middle; `coils`: what `coils` gives
    of the control current, the part of all currents that is alive being `share` (1; less after a failure).

    `energy` and `linkages` are what `force` follows from by virtual work, written without it.
    """

    @abc.abstractmethod
    def coils(self, control: Scalar, share: Scalar) -> Coils:
        """Currents of both coils, A, of the control current, A."""

    @abc.abstractmethod
    def force(self, s: Scalar, coils: Coils) -> Scalar:
        """On the rotor along the axis, N."""

    @abc.abstractmethod
    def energy(self, s: Scalar, coils: Coils) -> Scalar:
        """Stored in the field, J."""

    @abc.abstractmethod
    def linkages(self, s: Scalar, coils: Coils) -> Coils:
        """Flux linkages of the coils, Wb."""

    @abc.abstractmethod
    def heat(self, coils: Coils) -> Scalar:
        """W, in the coils' resistances."""

    @abc.abstractmethod
    def inductance(self) -> Scalar:
        """Of a coil, the rotor in the middle, H: by it a voltage limits how fast currents change."""

    @abc.abstractmethod
    def limit(self) -> Scalar | None:
        """The largest control current that the magnets are made for, A; `None` for any."""


class Electromagnets(AbstractMagnet):
    """Two electromagnets in differential driving: their currents are i0 + i and i0 - i, i0 = `bias`.

        F = k cos(pole_angle) ((i0 + i)²/(gap - s)² - (i0 - i)²/(gap + s)²),   k = mu0 turns² pole_area/4

    about the middle `ki i + ks s` with ki = 4 k i0 cos/gap² and ks = 4 k i0² cos/gap³, a stiffness that
    drives the rotor out (`linearised`).

    - `gap`: m, nominal. `turns`: of both poles of a magnet together. `pole_area`: m² of one pole.
    - `pole_angle`: rad, between a pole and its magnet's axis (22.5° with eight poles).
    - `saturation`: T; the flux density of a gap follows `mu0 turns i/(2 gap)` up to there, and stays: the
      pull of a magnet ends at `saturation² pole_area cos(pole_angle)/mu0`. The corner is rounded over `knee`
      of it, by which that grows by its square over 3. None by default.
    - `resistance`: ohm of a coil. `leakage`: H, of its inductance what does not depend on the gap.

    Iron is taken for free of losses, and of reluctance below saturation. Source: Schweitzer & Maslen (eds.),
    Magnetic Bearings (2009), sec. 4.2, the pull without saturation; the pull of a saturated pair from the
    energy of its field.
    """

    bias: Scalar = parameter("A", positive=True)
    gap: Scalar = parameter("m", positive=True)
    turns: Scalar = parameter(positive=True)
    pole_area: Scalar = parameter("m^2", positive=True)
    pole_angle: Scalar = parameter("rad", default=0.39269908169872414)
    saturation: Scalar | None = parameter("T", positive=True, optional=True, default=None)
    knee: Scalar = parameter(positive=True, default=0.1, label="part of the saturation")
    resistance: Scalar = parameter("ohm", nonnegative=True, default=0.0)
    leakage: Scalar = parameter("H", nonnegative=True, default=0.0)

    def faults(self) -> Iterator[str]:
        if not jnp.cos(self.pole_angle) > 0:
            yield f"pole_angle must be less than a right angle, but is {float(self.pole_angle):g} rad"
        if self.knee > 1:
            yield f"knee must be 1 at most, but is {float(self.knee):g}"
        if self.saturation is not None:
            flux = float(MU_0 * self.turns * self.bias / (2 * self.gap))
            if not flux < self.saturation:
                yield (
                    f"bias must leave its magnets below their saturation of {float(self.saturation):g} T, "
                    f"but has {flux:.3g} T in their gaps: no current would move the rotor; take a smaller one"
                )

    def coils(self, control: Scalar, share: Scalar) -> Coils:
        return share * jnp.stack([self.bias + control, self.bias - control])

    def _gaps(self, s: Scalar) -> Coils:
        return jnp.stack([self.gap - s, self.gap + s])

    def _flux(self, s: Scalar, coils: Coils) -> tuple[Coils, Coils, Coils]:
        """Of each magnet: the flux density that there would be without saturation, the one that there is, T,
        and its integral over the first, T²."""
        free = MU_0 * self.turns * jnp.abs(coils) / (2 * self._gaps(s))
        if self.saturation is None:
            return free, free, 0.5 * free**2
        over, width = free - self.saturation, self.knee * self.saturation
        return free, free - depth(over, width), 0.5 * free**2 - area(over, width)

    def _pole(self) -> Scalar:
        """m², both poles along the axis."""
        return 2 * self.pole_area * jnp.cos(self.pole_angle)

    def force(self, s: Scalar, coils: Coils) -> Scalar:
        free, flux, integral = self._flux(s, coils)
        pulls = self._pole() / MU_0 * (free * flux - integral)
        return pulls[0] - pulls[1]

    def energy(self, s: Scalar, coils: Coils) -> Scalar:
        """Of the linkages times the currents, the coenergy taken off: without saturation half of them."""
        _, _, integral = self._flux(s, coils)
        coenergy = self._pole() * self._gaps(s) / MU_0 * integral + 0.5 * self.leakage * coils**2
        return jnp.sum(self.linkages(s, coils) * coils - coenergy)

    def linkages(self, s: Scalar, coils: Coils) -> Coils:
        flux = jnp.sign(coils) * self._flux(s, coils)[1]
        return 0.5 * self._pole() * self.turns * flux + self.leakage * coils

    def heat(self, coils: Coils) -> Scalar:
        return self.resistance * jnp.sum(coils**2)

    def inductance(self) -> Scalar:
        return MU_0 * self.turns**2 * self._pole() / (4 * self.gap) + self.leakage

    def limit(self) -> Scalar | None:
        return self.bias

    def linearised(self) -> "LinearMagnet":
        """`LinearMagnet` of its ki and ks in the middle, without saturation."""
        k = MU_0 * self.turns**2 * self._pole() / 8
        current = 4 * k * self.bias / self.gap**2
        stiffness = 4 * k * self.bias**2 / self.gap**3
        return LinearMagnet(current, stiffness, self.bias, self.inductance(), self.resistance)


class LinearMagnet(AbstractMagnet):
    """`force = ki i + ks s`: ki = `current_stiffness` (N/A), ks = `displacement_stiffness` (N/m), of magnets
    positive: it drives the rotor out of the middle (in the literature often written as a negative stiffness).

    `control_limit`: A, the largest control current. `coil`: H, of each of both coils, by which an amplifier's
    voltage limits how fast their currents change, and `resistance`, ohm of each, which the bias is not
    counted to heat. As the bias fails with all currents, ki falls by its share and ks by the square of that.

    Source: Schweitzer & Maslen (eds.), Magnetic Bearings (2009), ch. 4.
    """

    current_stiffness: Scalar = parameter("N/A", positive=True)
    displacement_stiffness: Scalar = parameter("N/m")
    control_limit: Scalar | None = parameter("A", positive=True, optional=True, default=None)
    coil: Scalar = parameter("H", nonnegative=True, default=0.0)
    resistance: Scalar = parameter("ohm", nonnegative=True, default=0.0)

    def coils(self, control: Scalar, share: Scalar) -> Coils:
        """The bias, as a part of itself, and the control current, A."""
        return jnp.stack([share, share * control])

    def force(self, s: Scalar, coils: Coils) -> Scalar:
        bias, i = coils
        return bias * (self.current_stiffness * i + self.displacement_stiffness * bias * s)

    def energy(self, s: Scalar, coils: Coils) -> Scalar:
        """Less what the bias has in the middle, of which ki and ks tell nothing."""
        return 0.5 * jnp.sum(coils * self.linkages(s, coils))

    def linkages(self, s: Scalar, coils: Coils) -> Coils:
        """Of the bias too, Wb·A, for its current counts as 1."""
        bias, i = coils
        shared = self.current_stiffness * s
        return jnp.stack(
            [
                shared * i + self.displacement_stiffness * bias * s**2,
                shared * bias + 2 * self.coil * i,
            ]
        )

    def heat(self, coils: Coils) -> Scalar:
        return 2 * self.resistance * coils[1] ** 2

    def inductance(self) -> Scalar:
        return self.coil

    def limit(self) -> Scalar | None:
        return self.control_limit
