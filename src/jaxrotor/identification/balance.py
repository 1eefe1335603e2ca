"""Balancing: by influence coefficients, by modes, and straight from an identified unbalance.

Vibrations and unbalances are complex: amplitude times e^(i angle), the angle in the direction of rotation
from the mark on the rotor, and that of a vibration negative where it lags. Source: Ehrich, Handbook of
Rotordynamics (1999), ch. 3; Rao, Mechanical Vibrations, sec. 9.4.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Complex, Float

from ..core.arguments import complex_array, listed, numbers, positive, real_array, short
from ..core.errors import InputError
from ..core.gate import takes
from ..core.result_text import shows
from ..search.instrumented import Instrumented
from .identification import Identification


@shows()
class Balance(NamedTuple):
    """`corrections`: (planes,) complex unbalance to be ADDED in each plane. `residual`: (measurements,)
    complex vibration that is predicted to remain. `residual_std`, `correction_std`: of their real and
    imaginary parts, where the scatter of the vibrations was given."""

    corrections: Complex[np.ndarray, " planes"]
    residual: Complex[np.ndarray, " measurements"]
    correction_std: Float[np.ndarray, " planes"] | None
    residual_std: Float[np.ndarray, " measurements"] | None


def _real(value: Any, place: str) -> np.ndarray:
    found = real_array(value)
    if found is None or not np.isfinite(found).all():
        raise InputError(f"{place} must be finite numbers, but is {short(value)}")
    return found


@takes(amplitude=_real, degrees=_real)
def phasor(amplitude: Any, degrees: Any) -> np.ndarray:
    """Complex numbers from amplitudes and angles in degrees. Raises `InputError` for what is no finite
    number."""
    return np.asarray(amplitude, float) * np.exp(1j * np.deg2rad(degrees))


def influence_coefficients(before: Any, trials: Any, with_trials: Any) -> np.ndarray:
    """Vibration per unit of unbalance, (measurements, planes).

    **Arguments:**

    - `before`: (m,) complex, vibration of the rotor as it is; a measurement is one probe at one speed.
    - `trials`: (p,) complex, the trial unbalance of each plane (any unit, corrections come in it).
    - `with_trials`: (p, m), vibration with the trial in that plane alone.

    Raises `InputError` where the shapes do not fit or a trial is zero.
    """
    before, trials = complex_array(before, "before"), complex_array(trials, "trials")
    after = complex_array(with_trials, "with_trials", 2)
    if after.shape != (trials.size, before.size):
        raise InputError(
            f"with_trials must be one row of {before.size} vibrations for each of the {trials.size} trials, "
            f"but has shape {after.shape}"
        )
    if not np.all(np.abs(trials) > 0):
        raise InputError(f"trial {int(np.argmin(np.abs(trials)))} is zero: it tells nothing")
    return ((after - before) / trials[:, None]).T


@takes(weights=numbers(above=0.0), std=positive())
def balance(
    before: Any, coefficients: Any, weights: Any = None, std: float | None = None
) -> Balance:
    """Corrections that leave the least vibration (weighed squares), in as many planes as `coefficients` has
    columns. As many measurements as planes: none is left.

    **Arguments:** `before`: (m,) complex. `coefficients`: (m, p). `weights`: (m,). `std`: scatter of the real
    and imaginary part of each measured vibration, for the uncertainty of what is found.

    Raises `InputError` for fewer measurements than planes, or planes that cannot be told apart.
    """
    before, C = complex_array(before, "before"), complex_array(coefficients, "coefficients", 2)
    if C.shape[0] != before.size:
        raise InputError(
            f"coefficients need a row for each of the {before.size} vibrations, but have {C.shape[0]}"
        )
    if C.shape[0] < C.shape[1]:
        raise InputError(
            f"{C.shape[0]} measurements cannot balance {C.shape[1]} planes: measure at further speeds, or "
            "correct in fewer planes"
        )
    if weights is not None and np.size(weights) != before.size:
        raise InputError(
            f"weights must be {before.size}, one for each vibration, but are {np.size(weights)}"
        )
    w = np.ones(before.size) if weights is None else np.sqrt(np.asarray(weights, float))
    weighed = w[:, None] * C
    s = np.linalg.svd(weighed / np.linalg.norm(weighed, axis=0), compute_uv=False)
    if s[-1] < 1e-8 * s[0]:
        raise InputError(
            "the planes act alike on all measurements, so no correction can be told: measure at another "
            "speed, or correct in fewer planes"
        )
    inverse = np.linalg.pinv(weighed) * w
    corrections = -inverse @ before
    left = np.eye(before.size) - C @ inverse
    if std is None:
        return Balance(corrections, before + C @ corrections, None, None)
    return Balance(
        corrections,
        before + C @ corrections,
        std * np.linalg.norm(inverse, axis=1),
        std * np.linalg.norm(left, axis=1),
    )


@takes(shapes=_real, planes=listed)
def modal_balance(shapes: Any, planes: Any, modal_unbalance: Any) -> Complex[np.ndarray, " planes"]:
    """Corrections (kg·m) that cancel the unbalance of so many modes and leave the others as little changed
    as can be (least squares).

    **Arguments:** `shapes`: (modes, planes) real deflection of each mode at the planes. `planes`: their names
    or places, for messages. `modal_unbalance`: (modes,) complex, sum of unbalance times shape, kg·m.

    Raises `InputError` for fewer planes than modes, or modes that the planes cannot tell apart.
    """
    S = np.atleast_2d(np.asarray(shapes, float))
    U = complex_array(modal_unbalance, "modal_unbalance")
    if S.shape != (U.size, len(planes)):
        raise InputError(
            f"shapes must be {U.size} modes by {len(planes)} planes, but have shape {S.shape}"
        )
    if U.size > len(planes):
        raise InputError(f"{U.size} modes need as many planes, but there are {len(planes)}")
    s = np.linalg.svd(S, compute_uv=False)
    if s[-1] < 1e-8 * s[0]:
        raise InputError(
            f"the planes {', '.join(map(str, planes))} lie where a mode does not move or two are alike: "
            "choose others"
        )
    return -np.linalg.pinv(S) @ U


@shows(unbalance="kg*m", std="kg*m", covariance="kg^2*m^2")
class Correction(NamedTuple):
    """Unbalance (kg·m, complex, angle on the rotor) to be ADDED in two planes. `std`: of the real and the
    imaginary part of each; so much is to be expected to remain. `covariance`: (4, 4), real parts first."""

    unbalance: Complex[np.ndarray, " 2"]
    std: Complex[np.ndarray, " 2"]
    covariance: Float[np.ndarray, "4 4"]

    def grade(self, mass: float, speed: float) -> float:
        """Balance quality grade (mm/s) to be expected once corrected, for the static unbalance: root mean
        square, of a rotor of `mass` (kg) at `speed` (rad/s)."""
        total = self.covariance[:2, :2].sum() + self.covariance[2:, 2:].sum()
        return 1e3 * float(np.sqrt(total)) / mass * speed


@takes(places=numbers("m", fewest=2))
def correction(found: Identification, rotor: str, places: tuple[float, float]) -> Correction:
    """What to add in two planes of `rotor` at `places` (z, m, from its geometric centre), from its identified
    unbalance, and how well that is known (the covariance of the identification, to first order).

    Raises `InputError` where the rotor has no unbalance, or the data cannot see it.
    """
    part = found.machine[rotor]
    if getattr(part, "unbalance", None) is None:
        raise InputError(f"`{rotor}`: is no rotor with an unbalance")
    lost = [p for d in found.blind for p in d if p.startswith(f"{rotor}.unbalance")]
    if lost:
        raise InputError(f"`{lost[0]}`: the data cannot see it, so no correction can be told")
    bench = Instrumented(found.machine, found.sensors)

    def planes(u):
        machine = found.space.placed(bench, u).machine
        unbalance, mass, polar, transverse = (
            machine.get(f"{rotor}.{name}")
            for name in ("unbalance", "mass", "polar_inertia", "transverse_inertia")
        )
        at = -unbalance.in_planes(places, mass, polar, transverse)
        return jnp.concatenate([at.real, at.imag])

    u = jnp.asarray(found.u)
    x, J = np.asarray(planes(u)), np.asarray(jax.jacfwd(planes)(u))
    finite = np.isfinite(found.knowledge.std)
    covariance = J[:, finite] @ found.knowledge.covariance[np.ix_(finite, finite)] @ J[:, finite].T
    s = np.sqrt(np.diag(covariance))
    return Correction(x[:2] + 1j * x[2:], s[:2] + 1j * s[2:], covariance)
