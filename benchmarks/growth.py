"""How compiling and running grow with a line: a rotor on a finite-element shaft of more and more
stations. Prints a table; nothing is asserted (docs/benchmarks.md has a run of it)."""

import argparse
import time

import equinox as eqx
import jax
import numpy as np

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402

import jaxrotor as jr  # noqa: E402
from jaxrotor.machine.field import vector_field
from jaxrotor.machine.system import assemble


def line(stations: int) -> jr.Machine:
    """So many stations in all: bearing, shaft, disc, shaft, driven end."""
    left = (stations - 3) // 2
    right = stations - 3 - left

    def shaft(inner):
        return jr.FiniteElementShaft(
            length=0.3, diameter=0.03, elements=inner + 1, rayleigh=(2.0, 1e-5)
        )

    return jr.Machine.in_line(
        {
            "left": jr.Node(),
            "shaft 1": shaft(left),
            "disc": jr.Rotor(8.0, 0.04, 0.022, unbalance=jr.Unbalance(1e-4)),
            "shaft 2": shaft(right),
            "drive": jr.PrescribedSpin(jr.CosineRamp(speed=200.0, duration=0.5)),
        },
        attachments={
            "bearing": (jr.LinearSupport([1e7, 1e7, 0, 0, 0, 0], [1e3, 1e3, 0, 0, 0, 0]), "left")
        },
    )


def operations(jaxpr) -> int:
    """Operations of a jaxpr and of those inside it."""
    inside = (
        sub.jaxpr if hasattr(sub, "jaxpr") else sub
        for eqn in jaxpr.eqns
        for value in eqn.params.values()
        for sub in (value if isinstance(value, (tuple, list)) else (value,))
        if hasattr(sub, "eqns") or hasattr(sub, "jaxpr")
    )
    return len(jaxpr.eqns) + sum(operations(sub) for sub in inside)


def best(f, repeat: int = 3) -> float:
    times = []
    for _ in range(repeat):
        began = time.perf_counter()
        jax.block_until_ready(f())
        times.append(time.perf_counter() - began)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stations", type=int, nargs="+", default=[5, 10, 20, 40, 80])
    parser.add_argument("--samples", type=int, default=200)
    given = parser.parse_args()
    print(f"JAX {jax.__version__}, {jax.devices()[0].platform}; one run of {given.samples} samples")
    print(
        "stations  states  operations in the field  field, us  compile run, s  prepare, s  "
        "per step, us"
    )
    rate = 1000.0
    for stations in given.stations:
        machine = line(stations)
        plan = jr.Plan(4, 6, 100.0, 200.0, np.nan, np.nan)

        def run(samples, machine=machine, plan=plan):
            return jr.simulate(
                machine, samples / rate, rate, initial="undeformed", step=plan, progress=False
            ).y

        system = eqx.filter_jit(assemble)(machine)
        y = jnp.zeros(2 * len(system.layout.free))
        count = operations(
            jax.make_jaxpr(lambda t, y, s: vector_field(t, y, s))(0.0, y, system).jaxpr
        )

        @eqx.filter_jit
        def many(y, system):
            def body(i, y):
                return y + 1e-12 * vector_field(1e-3 * i, y, system)

            return jax.lax.fori_loop(0, 1000, body, y)

        jax.block_until_ready(many(y, system))
        field = best(lambda y=y, system=system: many(y, system)) / 1000

        began = time.perf_counter()
        run(given.samples)
        compiled = time.perf_counter() - began
        whole = best(lambda: run(given.samples), 2)
        run(2)
        short = best(lambda: run(2), 2)
        compiled -= whole
        step = (whole - short) / (4 * (given.samples - 2))
        print(
            f"{stations:8d}{y.size:8d}{count:25d}{1e6 * field:11.1f}{compiled:16.1f}{short:12.2f}"
            f"{1e6 * step:14.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
