"""Unbalance of a rotor, in the words of the equations and in those of balancing."""

from collections.abc import Iterable
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from ...core.arguments import numbers, positive, short
from ...core.errors import InputError
from ...core.parameter import known, parameter
from ...core.part import Part


class Unbalance(Part):
    """Static and dynamic unbalance of a rotor, in the disc's own frame.

    Static: the mass centre lies `eccentricity` from the geometric centre, at `angle` from the disc's
    x axis. Dynamic: the principal axis is inclined to the disc's axis by `inclination`, about the
    in-plane axis at `inclination_angle`. Both turn with phi.

    `from_planes`, `from_masses` and `from_grade` make one from what a balancing machine or standard says.
    """

    eccentricity: Float[Array, ""] = parameter("m", nonnegative=True, default=0.0)
    angle: Float[Array, ""] = parameter("rad", default=0.0)
    inclination: Float[Array, ""] = parameter("rad", default=0.0)
    inclination_angle: Float[Array, ""] = parameter("rad", default=0.0)

    @classmethod
    def from_planes(
        cls,
        planes: Iterable[tuple[Any, Any, Any]],
        mass: Any,
        polar_inertia: Any,
        transverse_inertia: Any,
    ) -> "Unbalance":
        """From unbalances in correction planes: (amount in kg·m, angle in rad, z in m) of each, z along the
        axis from the geometric centre; 1 g·mm is 1e-6 kg·m. `mass`, `polar_inertia`, `transverse_inertia`:
        the rotor's, kg and kg·m².

        Their sum is the static unbalance `mass * eccentricity`; their moment about the geometric centre is
        the product of inertia `|Jt - Jp| sin(2 inclination)/2`. Differentiable.

        Raises `InputError` where the moment is more than any inclination of such a body has, as for a body
        with Jp = Jt. Source: ISO 21940-1 (resultant and moment unbalance); Rayleigh's principal axes.
        """
        rows = _rows(planes, 3, "planes")
        mass = positive("kg")(mass, "mass")
        amounts, angles, places = (jnp.asarray(x, float) for x in zip(*rows))
        turned = jnp.stack([jnp.cos(angles), jnp.sin(angles)])
        total = jnp.sum(amounts * turned, axis=1)
        moment = jnp.sum(amounts * places * turned, axis=1)
        gap = jnp.asarray(transverse_inertia, float) - jnp.asarray(polar_inertia, float)
        size = jnp.sqrt(jnp.where(jnp.any(moment != 0), jnp.sum(moment**2), 1.0))
        size = jnp.where(jnp.any(moment != 0), size, 0.0)
        share = 2 * size / jnp.where(gap == 0, 1.0, jnp.abs(gap))
        values = known(jnp.stack([share, gap, size]))
        if values is not None and float(values[2]) > 0 and (float(values[1]) == 0 or values[0] > 1):
            raise InputError(
                f"planes: a moment unbalance of {float(values[2]):.4g} kg*m^2 is more than a body can have "
                f"whose principal inertias differ by {abs(float(values[1])):.4g} kg*m^2: check the amounts "
                "(kg*m, not g*mm) and the inertias"
            )
        # I_xz = (Jp - Jt) n_x n_z = -sum m r z cos: the axis n leans by (gamma cos, gamma sin) about x, y
        sign = jnp.where(gap < 0, -1.0, 1.0)
        return cls(
            _length(total) / jnp.asarray(mass, float),
            _direction(total),
            0.5 * jnp.arcsin(share),
            _direction(sign * jnp.stack([-moment[1], moment[0]])),
        )

    def in_planes(
        self, places: tuple[Any, Any], mass: Any, polar_inertia: Any, transverse_inertia: Any
    ) -> Complex[Array, "2"]:
        """The same unbalance in two planes at `places` (z in m from the geometric centre): complex, kg·m,
        amount times e^(i angle). What is to be added there to balance the rotor is its negative. The inverse
        of `from_planes`. Differentiable. Raises `InputError` for planes at one place."""
        z = jnp.asarray(numbers("m", size=2)(places, "places"), float)
        where = known(z)
        if where is not None and where[0] == where[1]:
            raise InputError(
                f"places: both planes lie at {where[0]:g} m: two different ones are needed"
            )
        gap = jnp.asarray(transverse_inertia, float) - jnp.asarray(polar_inertia, float)
        total = jnp.asarray(mass, float) * self.eccentricity * jnp.exp(1j * self.angle)
        couple = -0.5j * gap * jnp.sin(2 * self.inclination) * jnp.exp(1j * self.inclination_angle)
        second = (couple - z[0] * total) / (z[1] - z[0])
        return jnp.stack([total - second, second])

    @classmethod
    def from_masses(
        cls,
        masses: Iterable[tuple[Any, Any, Any, Any]],
        mass: Any,
        polar_inertia: Any,
        transverse_inertia: Any,
    ) -> "Unbalance":
        """From small masses stuck on the rotor: (kg, radius in m, angle in rad, z in m) of each. Else as
        `from_planes`; what they add to the rotor's own mass and inertia is left out. Raises
        `InputError` for what is no list of four numbers each."""
        return cls.from_planes(
            [(m * r, angle, z) for m, r, angle, z in _rows(masses, 4, "masses")],
            mass,
            polar_inertia,
            transverse_inertia,
        )

    @classmethod
    def from_grade(cls, grade: Any, speed: Any, angle: Any = 0.0) -> "Unbalance":
        """The static unbalance that a balance quality grade permits: `grade` in mm/s (2.5 for G 2.5) at the
        highest speed of service, rad/s. Source: ISO 21940-11, `e_per * speed = G`."""
        grade = positive("mm/s")(grade, "grade")
        speed = positive("rad/s")(speed, "speed")
        return cls(1e-3 * jnp.asarray(grade, float) / speed, jnp.asarray(angle, float))


def _rows(given: Any, size: int, name: str) -> list:
    """Several rows of so many numbers."""
    rows = list(given) if isinstance(given, Iterable) and not isinstance(given, str) else []
    if not rows:
        raise InputError(f"{name} must be a list of {size} numbers each, but is {short(given)}")
    return [numbers(size=size)(row, f"{name}, entry {i + 1}") for i, row in enumerate(rows)]


def _length(v: Array) -> Array:
    some = jnp.any(v != 0)
    return jnp.where(some, jnp.sqrt(jnp.where(some, jnp.sum(v**2), 1.0)), 0.0)


def _direction(v: Array) -> Array:
    some = jnp.any(v != 0)
    return jnp.where(some, jnp.arctan2(jnp.where(some, v[1], 0.0), jnp.where(some, v[0], 1.0)), 0.0)
