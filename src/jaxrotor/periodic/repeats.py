"""Which machines have motions that repeat with the turns of their shaft."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..core.errors import InputError
from ..core.protocol import Sampled, Timed
from ..core.quick import quickly_compiled
from ..machine.field import initial_states, n_free, relative_field
from ..machine.machine import Machine
from ..machine.system import System
from .waves import Waves

# A force that differs by more than this part of itself after a period does not repeat.
_SAME = 1e-8
# Sizes of the deviations at which that is looked at, m and rad.
_SIZES = (0.0, 1e-8, 1e-6, 1e-4)
# Times at which they are compared with those at 0, s.
_TIMES = np.geomspace(1e-4, 1e4, 64)


def refuse_not_driven(machine: Machine) -> None:
    """Raises `InputError` where nothing holds the speed, or a controller samples."""
    if not machine.is_driven:
        raise InputError(
            "`machine`: must have a drive that holds its speed, but nothing prescribes its spin: prescribe "
            "phi of a station by ConstantSpeed, or end the line in a PrescribedSpin"
        )
    for name, part in machine.elements().items():
        if isinstance(part, Sampled):
            raise InputError(
                f"`{name}`: samples by its own clock, so that no motion repeats with the turns of the "
                "shaft: use its continuous law here"
            )


def refuse_other_periods(system: System, speed: float, waves: Waves) -> None:
    """Raises `InputError` where the forces depend on the clock, or do not repeat after the turns asked
    for."""
    clock, missed = map(np.asarray, _missed(system, jax.device_put(np.float64(speed)), waves))
    if not clock <= _SAME:
        raise InputError(
            "`machine`: some force or given motion depends on the clock (a schedule, a second drive, a "
            "controller's set point), but steady motion is looked for that repeats with the turns of the "
            "shaft: make it constant, or simulate"
        )
    if not missed <= _SAME:
        after = "a turn" if waves.turns == 1 else f"{waves.turns} turns"
        raise InputError(
            f"`machine`: its forces do not repeat after {after} of the drive (gears, balls or blades that "
            "pass at another rate): give as `turns` after how many they do, or simulate"
        )


@quickly_compiled
def _missed(system: System, speed: Array, waves: Waves) -> tuple[Array, Array]:
    """By what part of their size the rates differ at other times, and after a period; infinite where the
    clock makes some force jump."""
    n, zero = n_free(system), jnp.zeros(())
    rest = jnp.concatenate([jnp.zeros(2 * n), initial_states(system)])
    count = len(_TIMES)
    random = np.random.default_rng(0).normal(size=(count, 2 * n))
    sizes = np.resize(_SIZES, count)[:, None]
    scale = jnp.ones(2 * n).at[n:].set(jnp.abs(speed))
    y = rest + jnp.pad(sizes * random * scale, ((0, 0), (0, rest.size - 2 * n)))
    angles = jnp.asarray(2 * np.pi * np.arange(count) / count + 0.1)
    times = jnp.asarray(_TIMES)

    def rates(given):
        t, angle, y = given
        return relative_field(t, y, system, (angle, speed, zero))[n:]

    ahead = angles + 2 * np.pi * waves.turns
    still = jnp.zeros(count)
    given = jnp.stack([still, still, times]), jnp.stack([angles, ahead, angles]), jnp.stack([y] * 3)
    now, after, later = jax.lax.map(jax.vmap(rates), given)
    size = jnp.nanmax(jnp.abs(now), axis=0) + 1e-30
    clock, missed = (jnp.nanmax(jnp.abs(x - now) / size) for x in (later, after))
    # not those of the drive, in whose place the speed stands
    for actor in system.actors:
        if isinstance(actor.element, Timed):
            jumps = actor.call("times")
            clock = jnp.where(jnp.any((jumps > 0) & jnp.isfinite(jumps)), jnp.inf, clock)
    return clock, missed
