"""How finely a shaft is cut, so that it vibrates up to a frequency as it would whole."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from ...core.errors import InputError
from .beam import shear_coefficient
from .segment import MOST_ELEMENTS

# Of natural frequencies, what the cutting may add.
MESH_ERROR = 1e-3
# Of a wave with kh radians in an element: (kh)^4 over the one in bending, (kh)^2 over the other elsewhere.
_CUBIC, _LINEAR = 1440, 24


class _Waves(NamedTuple):
    """Of each section: its `length` (m), and at a frequency, where it is thinnest, the radians of wave in a
    metre, of `bending` and of the shorter of torsion's and axial ones; `yielding`: of a bending wave's
    compliance, what shear adds to 1."""

    length: np.ndarray
    bending: np.ndarray
    straight: np.ndarray
    yielding: np.ndarray


def mesh_error(shaft: Any, elements: int, up_to: float) -> float:
    """By what part finite elements raise a natural frequency at `up_to` (Hz), `elements` in each section: the
    worst of bending, torsion and axial waves, with `kh` radians of a wave in an element.

    Cubic elements with their own mass raise a bending frequency by (kh)^4/1440, linear ones a torsional or
    axial one by (kh)^2/24: Strang & Fix, An Analysis of the Finite Element Method (1973), ch. 6. The shear
    angle is the same all along an element, which adds (kh)^2/24 times its share k^2 EI/(kappa G A).
    """
    waves = _waves(shaft, 2 * np.pi * up_to)
    bent, straight = (waves.length / elements * k for k in (waves.bending, waves.straight))
    error = bent**4 / _CUBIC + waves.yielding * bent**2 / _LINEAR
    return float(np.max(np.maximum(error, straight**2 / _LINEAR)))


def elements_for(shaft: Any, up_to: float | None) -> int:
    """The fewest in each section whose `mesh_error` is below `MESH_ERROR`. Raises `InputError` where there is
    no frequency, or where the dimensions are no numbers yet."""
    if up_to is None:
        raise InputError(
            '`FiniteElementShaft`: elements="auto" needs the highest frequency that matters: give up_to=... '
            "in Hz"
        )
    if any(isinstance(x, Tracer) for x in jax.tree.leaves(shaft)):
        raise InputError(
            '`FiniteElementShaft`: elements="auto" needs dimensions that are numbers, but they are being '
            "traced: build the shaft outside of `jit` and `grad`, and change it by machine.set"
        )
    waves = _waves(shaft, 2 * np.pi * up_to)
    linear, quartic = waves.yielding / _LINEAR, 1 / _CUBIC
    with np.errstate(all="ignore"):
        # (kh)^2 of an element that just serves, in bending
        square = 2 * MESH_ERROR / (linear + np.sqrt(linear**2 + 4 * quartic * MESH_ERROR))
        bent, straight = (
            waves.bending / np.sqrt(square),
            waves.straight / np.sqrt(_LINEAR * MESH_ERROR),
        )
        needed = waves.length * np.maximum(bent, straight)
    most = float(np.max(needed))
    if not np.isfinite(most):  # of dimensions that cannot be, which the machine refuses by name
        return 1
    if most > MOST_ELEMENTS:
        raise InputError(
            f"`FiniteElementShaft`: up_to = {up_to:g} Hz would need {most:.0f} elements, more than "
            f"{MOST_ELEMENTS}: lower it"
        )
    return max(1, int(np.ceil(most)))


def _waves(shaft: Any, w: float) -> _Waves:
    """At `w` rad/s."""
    m = shaft.material
    given: Any = (
        *(m.youngs_modulus, m.shear_modulus, m.density),
        *(shaft.length, shaft.diameter, shaft.inner_diameter),
    )
    E, G, rho, length, outer, inside = (np.asarray(x, float) for x in given)
    if shaft.end_diameter is not None:
        outer = np.minimum(outer, np.asarray(shaft.end_diameter, float))
    if shaft.end_inner_diameter is not None:
        inside = np.minimum(inside, np.asarray(shaft.end_inner_diameter, float))
    with np.errstate(all="ignore"):
        gyration = (outer**2 + inside**2) / 16  # I/A, m^2
        kappa: Any = np.asarray(shear_coefficient(*map(jnp.asarray, (E, G, inside / outer))))
        soft = E / (kappa * G) if shaft.shear else 0.0
        rotary = 1.0 if shaft.rotary_inertia else 0.0
        # Timoshenko's beam: r² k⁴ - q r² (rotary + soft) k² - q (1 - q r² rotary soft) = 0, q = ρ w²/E
        q = rho * w**2 / E
        half = q * (rotary + soft) / 2
        k2 = half + np.sqrt(half**2 + q / gyration * (1 - q * gyration * rotary * soft))
        straight = w * np.sqrt(rho / np.minimum(E, G))
        found = length, np.sqrt(k2), straight, k2 * gyration * soft
    shape = np.broadcast_shapes(*(np.shape(x) for x in found))
    return _Waves(*(np.broadcast_to(x, shape) for x in found))
