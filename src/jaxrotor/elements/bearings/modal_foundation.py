"""A foundation by its modes."""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.parameter import parameter
from .base_motion import BaseMotion, carried
from .foundation import DAMPING, STIFFNESS, AbstractFoundation, ReadyFoundation, each
from .mounts import mount_faults


class ModalFoundation(AbstractFoundation):
    """A foundation, casing or floor by its m modes, from a finite-element program or a modal test, that
    carries one machine or several.

    Attached to n stations, in the order of `shapes`: (n, 3, m) the displacements x, y, z, or (n, 6, m) with
    the tilts psi, theta, phi, of the point under each station in each mode. `frequencies` in Hz, undamped,
    zero for a rigid motion; `damping_ratios` one for all or one each; `masses`, modal, kg for shapes without
    a unit: one, as of shapes that are scaled to mass, where left out. `stiffness` and `damping` of the
    mounts between stations and points: six numbers (x, y, z, psi, theta, phi), the same for all, or (n, 6),
    SI.

    `base`: how the ground moves. It takes `places` (n, 3), m, of the points from the origin about which the
    ground turns, and `participation` (m, 6): `shape' M r` of each mode with the structure's mass matrix and
    its rigid motions along x, y, z and about them (kg, kg·m): participation factor times modal mass.

    Modes beyond those given are left out, with what they yield statically. Source: Craig & Kurdila,
    Fundamentals of Structural Dynamics (2006), ch. 11, 17.
    """

    frequencies: Float[Array, " m"] = parameter("Hz", nonnegative=True, shapes=((None,),))
    damping_ratios: Float[Array, ""] | Float[Array, " m"] = parameter(
        nonnegative=True, shapes=((), (None,)), label="damping ratio"
    )
    shapes: Float[Array, "n 3 m"] | Float[Array, "n 6 m"] = parameter(
        shapes=((None, 3, None), (None, 6, None)), label="modal displacement"
    )
    stiffness: Float[Array, "6"] | Float[Array, "n 6"] = parameter(
        nonnegative=True, shapes=((6,), (None, 6)), units=STIFFNESS
    )
    damping: Float[Array, "6"] | Float[Array, "n 6"] = parameter(
        nonnegative=True, shapes=((6,), (None, 6)), default=(0.0,) * 6, units=DAMPING
    )
    masses: Float[Array, " m"] | None = parameter(
        "kg", positive=True, shapes=((None,),), optional=True, default=None
    )
    base: BaseMotion | None = None
    places: Float[Array, "n 3"] | None = parameter(
        "m", shapes=((None, 3),), optional=True, default=None
    )
    participation: Float[Array, "m 6"] | None = parameter(
        shapes=((None, 6),), optional=True, default=None, label="SI units"
    )

    def faults(self) -> Iterator[str]:
        points, modes = self.shapes.shape[0], self.frequencies.shape[0]
        for name, size in (
            ("damping_ratios", self.damping_ratios.shape or (modes,)),
            ("shapes", self.shapes.shape[2:]),
            ("masses", (modes,) if self.masses is None else self.masses.shape),
            ("participation", (modes,) if self.participation is None else self.participation.shape),
        ):
            if size[0] != modes:
                yield f"{name} must be given for each of the {modes} frequencies, but are for {size[0]}"
        if self.places is not None and self.places.shape[0] != points:
            yield f"places must have {points} rows, as shapes has, but has {self.places.shape[0]}"
        if self.base is not None and (self.places is None or self.participation is None):
            yield "places and participation are missing: what a moving base does to the modes"
        yield from mount_faults(points, self.stiffness, self.damping)

    def prepared(self) -> ReadyFoundation:
        points, modes = self.shapes.shape[0], self.frequencies.shape[0]
        m = jnp.ones(modes) if self.masses is None else self.masses
        w = 2 * jnp.pi * self.frequencies
        T = jnp.zeros((points, 6, 6))
        P = jnp.zeros((modes, 6)) if self.participation is None else self.participation
        return ReadyFoundation(
            jnp.diag(m),
            jnp.diag(1 / m),
            jnp.diag(2 * self.damping_ratios * w * m),
            jnp.diag(w**2 * m),
            jnp.pad(self.shapes, ((0, 0), (0, 6 - self.shapes.shape[1]), (0, 0))),
            T if self.places is None else jax.vmap(carried)(self.places),
            P,
            each(self.stiffness, points),
            each(self.damping, points),
            None if self.base is None else self.base.prepared(),
        )
