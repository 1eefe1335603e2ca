"""Planetary gears: sun, carrier and ring, with the planets between them."""

from collections.abc import Iterator
from functools import partial
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...core.parameter import parameter
from ...core.protocol import (
    AbstractAttachment,
    Energetic,
    Epicyclic,
    Motion,
    Nominal,
    Signalling,
    Stateful,
    Timed,
    Vec6,
)
from .tooth_mesh import ToothMesh

# Angles of the sun, the carrier, the ring and a planet.
Angles = Float[Array, "4"]


class _Teeth(NamedTuple):
    """A mesh with all planets: how flanks press and the mesh angle goes by the angles; `each`, (n,): how far
    flanks press and how fast, mesh angles and their rates, and the law's states."""

    mesh: ToothMesh
    by: Angles
    turn: Angles
    each: tuple[Array, ...]


class PlanetaryGear(AbstractAttachment, Epicyclic, Energetic, Stateful, Timed, Nominal, Signalling):
    """Planets that turn on a carrier, in mesh with a sun and a ring with teeth inside: torsion alone.

    It joins three stations, given as (sun, carrier, ring), whose axis is the same; hold what stands still
    (the ring as a rule) by `fixed`, its `reaction` is then what the housing bears. Each planet turns by
    itself, on a pin that is rigid: n planets add n degrees of freedom. Exact for any turning; it
    neither moves its stations across the axis nor answers to that.

    **Arguments:**

    - `teeth`: of sun, planet and ring. `sun_radius`: of the sun's base circle, m; the others' follow by the
      teeth. `planet_inertia`: of one planet about its pin, kg·m²; the planets' masses count in the inertia
      of the carrier, n m r² with r the pins' circle.
    - `sun_mesh`, `ring_mesh`: what the teeth answer. Mesh angles are `z_s (phi_s - phi_c - p)` and
      `z_r (phi_r - phi_c - p)` of a planet at p: so the planets' meshes are phased by their positions, and
      the ring's against the sun's by the phases given.
    - `positions`: of the planets on the carrier, rad. Teeth must fit: `(z_s + z_r)` times what two planets
      lie apart must be whole turns.

    Teeth answer to `delta_s = r_s phi_s + r_p phi_p - (r_s + r_p) phi_c - e` and
    `delta_r = r_r phi_r - r_p phi_p - (r_r - r_p) phi_c - e`, r the base radii, and press where a sun that
    leads with +phi drives the carrier. The internal states are, of each planet, the first of these without
    its error and its rate; then those of the laws. Energy and torques as of `GearMesh`, of each mesh.
    Signals: the forces of each planet's teeth, and how fast the planets turn. Teeth whose stiffness
    varies much and rings fast may need a `step` shorter than `plan` finds from still gears.

    Source: Kahraman, J. Sound Vib. 173 (1994) 125 (the torsional model); Parker & Lin, Mech. Mach. Theory 39
    (2004) 1125 (phasing).
    """

    teeth: Float[Array, "3"] = parameter(positive=True, shapes=((3,),))
    sun_radius: Float[Array, ""] = parameter("m", positive=True)
    planet_inertia: Float[Array, ""] = parameter("kg*m^2", positive=True)
    sun_mesh: ToothMesh
    ring_mesh: ToothMesh
    positions: Float[Array, " n"] = parameter(
        "rad", shapes=((None,),), default=(0.0, 2 * np.pi / 3, 4 * np.pi / 3)
    )

    signals: ClassVar[dict[str, str]] = {
        "sun_tooth_forces": "N",
        "ring_tooth_forces": "N",
        "planet_speeds": "rad/s",
    }

    def faults(self) -> Iterator[str]:
        sun, planet, ring = (float(z) for z in self.teeth)
        if not abs(ring - sun - 2 * planet) <= 0.05 * ring:
            yield (
                f"teeth must fill the ring, z_r = z_s + 2 z_p or nearly, but are {sun:g}, {planet:g} and "
                f"{ring:g}: give those of sun, planet and ring"
            )
            return
        at = np.asarray(self.positions)
        if not at.size:
            yield "positions must tell one planet at least, but is empty"
            return
        turns = (sun + ring) * (at - at[0]) / (2 * np.pi)
        off = np.abs(turns - np.round(turns))
        if off.max() > 1e-3:
            k = int(off.argmax())
            nearest = at[0] + 2 * np.pi * np.round(turns[k]) / (sun + ring)
            yield (
                f"positions must be where the teeth fit, but planet {k} at {at[k]:.6g} rad is not: the "
                f"nearest place is {nearest:.6g} rad"
            )

    def ratio(self) -> Float[Array, ""]:
        return self.teeth[0] / (self.teeth[0] + self.teeth[2])

    def balance(self) -> Float[Array, "3"]:
        sun, _, ring = self.teeth
        return jnp.stack([sun, -(sun + ring), ring])

    def _radii(self) -> Float[Array, "3"]:
        return self.sun_radius * self.teeth / self.teeth[0]

    def _by(self) -> tuple[tuple[Angles, Angles], tuple[Angles, Angles]]:
        """Of the sun's and of the ring's mesh: how far flanks press, and the mesh angle, by the angles."""
        (s, p, r), (z_s, _, z_r) = self._radii(), self.teeth
        none = jnp.zeros_like(s)
        sun = jnp.stack([s, -(s + p), none, p]), z_s * jnp.array([1.0, -1, 0, 0])
        ring = jnp.stack([none, p - r, r, -p]), z_r * jnp.array([0.0, -1, 1, 0])
        return sun, ring

    def _turns(self, motions: tuple[Motion, ...], state: Any) -> tuple[Array, Array]:
        """Angles and speeds of sun, carrier, ring and planet, (n, 4)."""
        s, p, _ = self._radii()
        n = self.positions.shape[0]

        def one(x: Array, w: Array) -> Array:
            # the state is how far the sun's flanks press: small, where the planet's own angle grows
            planet = (w - s * x[0] + (s + p) * x[1]) / p
            return jnp.stack([*jnp.broadcast_to(x[:, None], (3, n)), planet], axis=1)

        q, v = (jnp.stack([m[i][5] for m in motions]) for i in (0, 1))
        return one(q, state[:n]), one(v, state[n : 2 * n])

    def _meshes(self, motions: tuple[Motion, ...], state: Any) -> Iterator[_Teeth]:
        n = self.positions.shape[0]
        q, v = self._turns(motions, state)
        by, turn = zip(*self._by())
        # the ring's without the sun's large angles
        both = (by[0] + by[1])[:3]
        press = state[:n], q[:, :3] @ both - state[:n]
        rates = state[n : 2 * n], v[:, :3] @ both - state[n : 2 * n]
        first = 2 * n
        for k, mesh in enumerate((self.sun_mesh, self.ring_mesh)):
            count = mesh.law.initial().shape[0]
            own = state[first : first + n * count].reshape(n, count)
            first += n * count
            angle = q @ turn[k] - self.teeth[2 * k] * self.positions
            yield _Teeth(mesh, by[k], turn[k], (press[k], rates[k], angle, v @ turn[k], own))

    def _pushed(self, t: Array, motions: tuple[Motion, ...], state: Any) -> list[tuple]:
        """Of each mesh, and what its teeth do: N, and J on its mesh angle."""
        return [
            (teeth, *jax.vmap(partial(teeth.mesh.force_and_torque, t))(*teeth.each))
            for teeth in self._meshes(motions, state)
        ]

    def _torques(self, t: Array, motions: tuple[Motion, ...], state: Any) -> Float[Array, "n 4"]:
        """On sun, carrier, ring and planet, N·m, by each planet."""
        sun, ring = (
            torque[:, None] * teeth.turn - force[:, None] * teeth.by
            for teeth, force, torque in self._pushed(t, motions, state)
        )
        return sun + ring

    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...]:
        on = jnp.sum(self._torques(t, motions, state), axis=0)
        return tuple(jnp.zeros(6).at[5].set(on[k]) for k in range(3))

    def initial(self) -> Array:
        n = self.positions.shape[0]
        laws = [
            jnp.tile(mesh.law.initial(), (n, 1)).ravel() for mesh in (self.sun_mesh, self.ring_mesh)
        ]
        return jnp.concatenate([jnp.zeros(2 * n), *laws])

    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Array:
        n = self.positions.shape[0]
        s, p, _ = self._radii()
        planet = self._torques(t, motions, state)[:, 3] / self.planet_inertia
        press = s * accelerations[0][5] - (s + p) * accelerations[1][5] + p * planet
        laws = [
            jax.vmap(partial(teeth.mesh.rates, t))(*teeth.each).ravel()
            for teeth in self._meshes(motions, state)
        ]
        return jnp.concatenate([state[n : 2 * n], press, *laws])

    def times(self) -> Array:
        return jnp.concatenate([self.sun_mesh.law.times(), self.ring_mesh.law.times()])

    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        spins = self._turns(motions, state)[1][:, 3]
        total = 0.5 * self.planet_inertia * jnp.sum(spins**2)
        for teeth in self._meshes(motions, state):
            total = total + jnp.sum(jax.vmap(partial(teeth.mesh.energy, t))(*teeth.each))
        return total

    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        sun, ring = (
            jnp.sum(jax.vmap(partial(teeth.mesh.power_lost, t))(*teeth.each))
            for teeth in self._meshes(motions, state)
        )
        return sun + ring

    def nominal(self) -> "PlanetaryGear":
        """Without transmission error, and of the mean stiffness."""
        meshes = self.sun_mesh.nominal(), self.ring_mesh.nominal()
        return eqx.tree_at(lambda g: (g.sun_mesh, g.ring_mesh), self, meshes)

    def sun_tooth_forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, " n"]:
        """Along the line of action, N: positive where the sun drives with +phi."""
        return self._pushed(t, motions, state)[0][1]

    def ring_tooth_forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, " n"]:
        """The same of the ring's teeth, N."""
        return self._pushed(t, motions, state)[1][1]

    def planet_speeds(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> Float[Array, " n"]:
        """Of each planet against the housing, rad/s."""
        return self._turns(motions, state)[1][:, 3]
