"""The fitted method on jaxrotor's own machines: error over step, order, and linearisations.

A prototype of the solver to come. Machines of configs/ are run by the exponentially fitted Adams method (one
evaluation a step, history carried over each change of linearisation), and compared with today's solver (two
evaluations, one linearisation) at a much shorter step: the error of the worst coordinate, as part of its
peak, as `jaxrotor.plan` counts it. Steps are told in samples and in radians of the top speed.

    python benchmarks/ladder.py [--orders k ...] [--steps s ...] [--fit f ...] [--sets n ...] [config ...]
"""

import argparse
import itertools
from fractions import Fraction
from functools import partial
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp
import numpy as np

import jaxrotor as jr
from jaxrotor.integrators.fitted import Ladder, begin, run_blocks
from jaxrotor.integrators.step_times import held_within
from jaxrotor.machine.field import jacobian, n_free, vector_field
from jaxrotor.machine.system import assemble, jump_times
from jaxrotor.simulation.run_error import _speed as line_speed, share_of_peaks

CONFIGS = Path(__file__).parents[1] / "configs"
MACHINES = {
    "two_rotor_startup": 3.0,
    "friswell_two_disc": 3.6,
    "overhung_fan": 2.5,
    "geared_train": 1.0,
}
BLOCK, FITS = 50, 61
STEPS = tuple(Fraction(x) for x in ("2", "3/2", "1", "1/2", "1/3", "1/4", "1/5"))
REFERENCE = 16  # steps a sample of today's solver


@partial(jax.jit, static_argnames=("order", "sets", "steps"))
def piece(machine, y0, t0, t1, h, top, fit, order, sets, steps):
    """The states after each step of one smooth piece of the run, from t0."""
    system, balanced = assemble(machine), assemble(machine, nominal=True)
    speeds = jnp.linspace(0.0, 1.0, sets) * top
    A = jax.lax.map(lambda w: jacobian(balanced, w), speeds)

    def field(t, y):
        inside = jnp.stack([jnp.nextafter(t0, jnp.inf), jnp.nextafter(t1, -jnp.inf)])
        return vector_field(held_within(inside, t), y, system)

    def speed(t, y):
        given = system.reference(t + 0.5 * BLOCK * h)[1] - system.reference(t)[1]
        return line_speed(t, y, system) + given

    now = speed(t0, y0)
    fits = jnp.linspace(0.0, 1.0, FITS) * top
    ladder = Ladder.of(speeds, A, h, order, n_free(system), now, fit, fits)
    first, history = begin(field, ladder, t0, y0)
    blocks = max(1, -(-(steps - order + 1) // BLOCK))
    rest, _ = run_blocks(
        field, ladder, speed, t0 + (order - 1) * h, blocks, BLOCK, first[-1], history
    )
    return jnp.concatenate([first, rest])[:steps]


def run(machine, y0, ends, interval, share, top, order, fit, sets):
    """The states at every sample that is a step too, and how many samples lie between them."""
    h = interval * float(share)
    states, y = [np.asarray(y0)[None]], jnp.asarray(y0)
    for t0, t1 in zip(ends, ends[1:]):
        steps = round((t1 - t0) / h)
        if abs(steps * h - (t1 - t0)) > 1e-9:
            return np.full((1, y.size), np.nan), share.numerator  # a jump lies within a step
        found = piece(machine, y, t0, t1, h, top, fit, order, sets, steps)
        states.append(np.asarray(found))
        y = found[-1]
    return np.concatenate(states)[:: share.denominator], share.numerator


def table(name, orders, shares, fits, counts):
    study = jr.load(CONFIGS / f"{name}.toml")
    machine, t_end = study.machine, MACHINES.get(name, study.simulation.t_end)
    rate = study.simulation.sample_rate
    system = assemble(machine)
    ends = sorted({0.0, t_end, *(float(t) for t in jump_times(system) if 0 < t < t_end)})
    n = n_free(system)
    # a line without a drive finds its speed itself
    top = float(study.simulation.speed or 0.0) or jr.plan(machine, t_end, rate).top_speed or 100.0
    for _ in range(3):
        settings = jr.Plan(REFERENCE, 6, 0.5 * top, top, float("nan"), float("nan"))
        response = jr.simulate(
            machine, t_end, rate, initial=study.simulation.initial, step=settings, progress=False
        )
        y = np.asarray(response.y)
        speeds = np.asarray(jax.vmap(lambda t, y: line_speed(t, y, system))(response.t, response.y))
        if np.abs(speeds).max() <= 1.05 * top:
            break
        top = float(np.abs(speeds).max())
    sense = np.sign(speeds[np.abs(speeds).argmax()])
    print(
        f"\n{name}: {y.shape[1]} states, {t_end} s, top speed {top:.0f} rad/s, samples at {rate:g} Hz"
    )
    interval = 1.0 / rate
    print("order fit sets " + "".join(f"{s!s:>9}" for s in shares) + "  samples a step")
    print(
        "          " + "".join(f"{float(s) * interval * top:9.2f}" for s in shares) + "  rad a step"
    )
    for order in orders:
        for fit, sets in itertools.product(fits, counts):
            row = []
            for share in shares:
                found, skip = run(
                    machine, y[0], ends, interval, share, sense * top, order, fit, sets
                )
                want = y[::skip]
                count = min(len(found), len(want))
                error = np.abs(found[:count] - want[:count])[:, :n].max(axis=0)
                row.append(
                    float(share_of_peaks(jnp.asarray(error), np.abs(y[:, :n]).max(axis=0), system))
                )
            print(
                f"{order:5} {fit:4g} {sets:4}" + "".join(f"{e:9.1e}" for e in row),
                flush=True,
            )


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("config", nargs="*", default=list(MACHINES))
    parser.add_argument("--orders", type=int, nargs="+", default=[6, 5, 4])
    parser.add_argument("--steps", type=Fraction, nargs="+", default=STEPS, help="in samples")
    parser.add_argument(
        "--fit", type=float, nargs="+", default=[1.0, 0.0], help="times the speed; 0: powers alone"
    )
    parser.add_argument("--sets", type=int, nargs="+", default=[4], help="linearisations")
    asked = parser.parse_args()
    for name in asked.config:
        table(name, asked.orders, asked.steps, asked.fit, asked.sets)


if __name__ == "__main__":
    main()
