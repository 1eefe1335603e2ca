"""Where a journal runs in a bearing of pads, and what it feels there."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...core.result_text import shows
from .pads import Flow, Pads, Place, Slopes


@shows(
    without=("full_stiffness", "full_damping", "pressures", "films", "angles", "forces"),
    eccentricity="m",
    attitude_angle="rad",
    stiffness="N/m",
    damping="N*s/m",
    tilts="rad",
    film="m",
    peak_pressure="Pa",
    leakage="m^3/s",
    power="W",
    viscosity="Pa*s",
)
class PadPoint(NamedTuple):
    """A bearing of pads under a steady load: the force on the journal for small motions is
    `-stiffness d - damping d'`, rows and columns (x, y).

    `eccentricity`: (2,) m, of the journal from the bearing's centre; `eccentricity_ratio` over the clearance;
    `attitude_angle`, rad, from the load to it in the sense of turning. `sommerfeld`: mu N L D (R/c)²/W, N in
    turns per second. `stiffness`: (2, 2) N/m, `damping`: (2, 2) N·s/m, of tilting pads in synchronous whirl.
    `full_stiffness`, `full_damping`: of the journal and the tilts of pads that are loaded (m and rad, N and
    N·m), of which the pads' moments vanish; of fixed pads the same as those. `tilts`: (p,) rad, of the pads,
    zero where they are fixed. `film`: the least height, m. `peak_pressure`, Pa. `leakage`: out of both ends,
    m³/s. `power`: what shear takes, W. `viscosity`: Pa·s, at which it runs.

    For each pad, from edge to edge (p, n + 1): `pressures` midway along the length, Pa, and `films`, m, at
    `angles`, rad from x towards y. `forces`: (p, 2) N, of each pad on the journal.
    """

    eccentricity: Float[Array, "2"]
    eccentricity_ratio: Array
    attitude_angle: Array
    sommerfeld: Array
    stiffness: Float[Array, "2 2"]
    damping: Float[Array, "2 2"]
    full_stiffness: Float[Array, "k k"]
    full_damping: Float[Array, "k k"]
    tilts: Float[Array, " p"]
    film: Array
    peak_pressure: Array
    leakage: Array
    power: Array
    viscosity: Array
    pressures: Float[Array, "p n"]
    films: Float[Array, "p n"]
    angles: Float[Array, "p n"]
    forces: Float[Array, "p 2"]


def pad_point(
    pads: Pads, load: Array, speed: Array, place: Place, felt: Slopes, full: Slopes, flow: Flow
) -> PadPoint:
    e, W = place.journal, jnp.sqrt(load @ load)
    ratio = jnp.sqrt(e @ e) / pads.unit
    sense = jnp.sign(speed)
    angle = sense * jnp.arctan2(load[0] * e[1] - load[1] * e[0], load @ e)
    turns = jnp.abs(speed) / (2 * jnp.pi)
    number = pads.viscosity * turns * pads.length * 2 * pads.radius * (pads.radius / pads.unit) ** 2
    return PadPoint(
        e,
        ratio,
        angle,
        number / W,
        *felt,
        *full,
        place.tilts,
        jnp.min(flow.films),
        jnp.max(flow.pressures),
        flow.leakage,
        flow.power,
        pads.viscosity,
        flow.pressures,
        flow.films,
        flow.angles,
        flow.forces,
    )
