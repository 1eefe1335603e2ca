"""Tooth stiffness by ISO 6336-1:2006, method B (clauses 9.3 and 9.4), for comparison with geometry's."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array

from ...core.result_text import shows


@shows(theoretical="N/m/m", single="N/m/m", mesh="N/m/m")
class IsoStiffness(NamedTuple):
    """Stiffness in the transverse plane, per face width, (N/m)/m (1 N/(mm um) is 1e9 of them): of a pair of
    teeth in theory, of a `single` pair (c'), and of the `mesh` (mean, c_gamma_alpha)."""

    theoretical: Array
    single: Array
    mesh: Array


def iso_stiffness(
    virtual: Array,
    shifts: Array,
    dedendum: Array,
    pressure: Array,
    helix: Array,
    contact_ratio: Array,
    modulus: Array,
) -> IsoStiffness:
    """Solid gears. `virtual`: teeth of the virtual spur gears; `dedendum`: mean of both, in modules; rad."""
    (z1, z2), (x1, x2) = virtual, shifts
    q = 0.04723 + 0.15551 / z1 + 0.25791 / z2 - 0.00635 * x1 - 0.11654 * x1 / z1
    q += -0.00193 * x2 - 0.24188 * x2 / z2 + 0.00529 * x1**2 + 0.00182 * x2**2
    theoretical = 1e9 / q * modulus / 206e9
    rack = (1 + 0.5 * (1.2 - dedendum)) * (1 - 0.02 * (20 - jnp.degrees(pressure)))
    single = 0.8 * theoretical * rack * jnp.cos(helix)
    return IsoStiffness(theoretical, single, single * (0.75 * contact_ratio + 0.25))
