"""The picture of a part, drawn from the object that its example on the page has made: a machine from the
side, a law as force over displacement, a schedule or a motion over time."""

import io
from typing import Any

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import jaxrotor as jr
from jaxrotor.plot.style import COLOURS

SIZE = (5.6, 2.4)  # inches


def png(thing: Any) -> bytes:
    """Of a machine, law, schedule, motion, or axes that the example has drawn on."""
    if isinstance(thing, jr.Machine):
        axes = jr.plot.draw_machine(thing)
    elif isinstance(thing, jr.elements.AbstractLaw):
        axes = _law(thing)
    elif isinstance(thing, (jr.profiles.AbstractSchedule, jr.profiles.AbstractMotion)):
        axes = _over_time(thing)
    elif isinstance(thing, Axes):
        axes = thing
    else:
        raise TypeError(f"no picture of a {type(thing).__name__}")
    kept = io.BytesIO()
    axes.figure.savefig(kept, format="png", dpi=90, bbox_inches="tight")  # pyright: ignore
    plt.close("all")
    return kept.getvalue()


def _panel(x: str, y: str) -> Axes:
    axes = plt.subplots(figsize=SIZE, layout="constrained")[1]
    axes.set(xlabel=x, ylabel=y)
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    return axes


def _law(law: Any, turns: int = 2, count: int = 4000) -> Axes:
    """Force over displacement in slow harmonic motion: a twentieth of a radian to and fro, once in 2 s."""
    reach, rate = 0.05, np.pi
    t = jnp.linspace(0.0, turns * 2 * np.pi / rate, count)
    x, v = reach * jnp.sin(rate * t), reach * rate * jnp.cos(rate * t)
    step = t[1] - t[0]

    def advance(state: Any, seen: Any) -> tuple[Any, Any]:
        force = law.force(*seen, state)
        middle = state + 0.5 * step * law.rates(*seen, state)
        return state + step * law.rates(*seen, middle), force

    force = jax.lax.scan(advance, law.initial(), (t, x, v))[1]
    last = slice(count // turns, None)  # the first turn is the way in
    axes = _panel("displacement, rad", "torque, N·m")
    axes.plot(np.asarray(x[last]), np.asarray(force[last]), color=COLOURS[0])
    return axes


def _over_time(thing: Any) -> Axes:
    """The value of a schedule, or the speed of a motion, around where it changes."""
    jumps = np.asarray(thing.jumps())
    jumps = jumps[np.isfinite(jumps)]
    end = 1.25 * float(jumps.max()) if jumps.size and jumps.max() > 0 else 1.0
    t = np.linspace(0.0, end, 801)
    if isinstance(thing, jr.profiles.AbstractMotion):
        axes = _panel("time, s", "speed, rad/s")
        seen = jax.vmap(jax.grad(lambda s: thing.position(s)))(jnp.asarray(t))
    else:
        axes = _panel("time, s", "value")
        seen = jax.vmap(thing.value)(jnp.asarray(t))
    axes.plot(t, np.asarray(seen), color=COLOURS[0])
    return axes
