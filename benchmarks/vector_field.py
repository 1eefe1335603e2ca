"""What one evaluation of the vector field costs: jaxrotor beside equations written by hand.

Both are compiled into the same loop (`lax.scan`), each evaluation acting on the state that the one
before left, so that nothing can be hoisted. First the two must agree.

    python benchmarks/vector_field.py
"""

import re
import time

import jax

jax.config.update("jax_enable_x64", True)

import handwritten  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402
from figures import STATIONS  # noqa: E402
from machine import header, two_rotors  # noqa: E402
from record import record  # noqa: E402

from jaxrotor.machine.field import vector_field
from jaxrotor.machine.system import assemble

EVALUATIONS = 100_000
REPEATS = 7
AGREEMENT = 1e-10


def random_state(rng):
    """(2, 6, 4): positions and rates, measured from the drive."""
    q = rng.normal(size=(6, 4)) * np.array([1e-4, 1e-4, 1e-4, 1e-2, 1e-2, 1e-2])[:, None]
    v = rng.normal(size=(6, 4)) * np.array([0.1, 0.1, 0.1, 10.0, 10.0, 10.0])[:, None]
    return np.stack([q, v])


def disagreement(machine, by_hand, order):
    """Largest difference of an acceleration, as a part of its largest value over the states tried."""
    system = assemble(machine)
    ours = jax.jit(lambda t, y: vector_field(t, y, system))
    hand = jax.jit(by_hand)
    rng = np.random.default_rng(0)
    pairs = []
    for t in np.linspace(0.0, 3.0, 31):  # speed 0 to 1000 rad/s
        state = random_state(rng)
        a = np.asarray(ours(t, state[:, :, order].ravel())).reshape(2, 6, 4)
        b = np.asarray(hand(t, state.ravel())).reshape(2, 6, 4)[:, :, order]
        pairs.append((a[1], b[1]))
    a, b = np.array(pairs).swapaxes(0, 1)
    return np.max(np.abs(a - b).max(0) / np.abs(b).max(0))


def loop(field):
    """`EVALUATIONS` evaluations of `field(t, y, args)` in one compiled loop."""

    def run(y, args):
        def one(y, t):
            return y + 1e-12 * field(t, y, args), None

        return jax.lax.scan(one, y, jnp.linspace(0.0, 3.0, EVALUATIONS))[0]

    return jax.jit(run)


def measure(runs):
    """Compile time (s) and best µs per evaluation of each; the runs take turns, as timings drift."""
    compiled, seconds, best = [], [], [np.inf] * len(runs)
    for function, args in runs:
        start = time.perf_counter()
        compiled.append(function.lower(*args).compile())
        seconds.append(time.perf_counter() - start)
    for _ in range(REPEATS):
        for i, (call, (_, args)) in enumerate(zip(compiled, runs)):
            start = time.perf_counter()
            assert bool(jnp.all(jnp.isfinite(call(*args))))
            best[i] = min(best[i], (time.perf_counter() - start) / EVALUATIONS * 1e6)
    return [(s, b, _instructions(c)) for s, b, c in zip(seconds, best, compiled)]


def _instructions(compiled):
    """Instructions in the loop's body, which is what XLA on the CPU charges for, and how many sines,
    cosines and tanh are worked out in it (fusion repeats them)."""
    text = compiled.as_text()
    parts = {m[1]: m[0] for m in re.finditer(r"^%([\w.\-]+) \(.*?^}", text, re.M | re.S)}
    body = parts[re.search(r"body=%([\w.\-]+)", text)[1]]
    free = {"parameter", "constant", "get-tuple-element", "tuple", "bitcast"}
    count = sum(m[1] not in free for m in re.finditer(r"= [^(]*?\)? ?([\w\-]+)\(", body))
    called = re.findall(r"calls=%([\w.\-]+)", body)
    return count, sum(len(re.findall(r" (?:sine|cosine|tanh)\(", parts[c])) for c in called)


def main():
    print(words := header("diffrax", "equinox"))
    machine = two_rotors()
    names = [
        machine.wiring.stations[m] for g in assemble(machine).layout.stations for m in g.members
    ]
    order = [STATIONS.index(n) for n in names]
    by_hand = handwritten.field()

    difference = disagreement(machine, by_hand, order)
    print(f"largest relative difference of the accelerations: {difference:.1e}")
    assert difference < AGREEMENT

    y = random_state(np.random.default_rng(1))
    ours = jnp.asarray(y[:, :, order].ravel())
    y, figures = jnp.asarray(y.ravel()), jax.tree.map(jnp.asarray, handwritten.FIGURES)
    inputs = {
        "by hand": (loop(lambda t, y, _: by_hand(t, y)), (y, None)),
        "by hand, figures traced": (loop(by_hand), (y, figures)),
        "jaxrotor": (loop(vector_field), (ours, assemble(machine))),
    }
    results = measure(list(inputs.values()))
    print(
        f"\n{'vector field':26}{'compile s':>10}{'us each':>9}{'instructions':>14}{'sin cos':>9}{'ratio':>7}"
    )
    for name, (seconds, us, (count, trig)) in zip(inputs, results):
        print(f"{name:26}{seconds:10.2f}{us:9.2f}{count:14d}{trig:9d}{us / results[0][1]:7.2f}")
    ratios = {"by hand, figures traced / jaxrotor": results[1][1] / results[2][1]}
    record("vector_field", words, ratios, [(n, *r) for n, r in zip(inputs, results)])


if __name__ == "__main__":
    main()
