"""How compiling and running grow with a line: a rotor on a finite-element shaft of more and more stations,
reduced (component mode synthesis) and full, by ROSS's Newmark method and by SUNDIALS' IDA (banded). Each row
is a process of its own without any compiled program kept. Prints a table; nothing is asserted
(docs/benchmarks.md has one)."""

import argparse
import json
import resource
import subprocess
import sys
import time

import jax
import numpy as np

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402
from machine import header  # noqa: E402
from record import record  # noqa: E402

import jaxrotor as jr  # noqa: E402
from jaxrotor.machine.layout import count_of_free  # noqa: E402

RATE = 2000.0  # Hz


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


def once(stations: int, full: bool) -> dict:
    """Everything of one machine, in a process of its own."""
    found: dict = {"stations": stations}

    def timed(name, f):
        began = time.perf_counter()
        result = jax.block_until_ready(f())
        found[name] = time.perf_counter() - began
        return result

    machine = line(stations)
    if full:
        machine = machine.full()
    else:
        machine = timed("reduce", lambda: machine.reduced(0.5 * RATE, speed=200.0))
    plan = timed("plan", lambda: jr.plan(machine, 10.0, RATE))
    found["states"] = 2 * count_of_free(machine)

    def run(seconds):
        return jr.simulate(machine, seconds, RATE, step=plan, progress=False).y

    first = timed("first", lambda: run(10.0)) is not None
    assert first
    timed("ten", lambda: run(10.0))
    found["step"] = found["ten"] / (10.0 * RATE * plan.substeps)

    def peak(mass):
        run = jr.simulate(machine.set({"disc.mass": mass}), 1.0, RATE, step=plan)
        return jnp.max(run["disc"].x)

    slope = jr.jit(jax.grad(peak))
    mass = jnp.asarray(8.0)
    timed("first gradient", lambda: slope(mass))
    timed("gradient", lambda: slope(mass))
    found["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return found


def ross_newmark(stations: int) -> dict:
    """ROSS's Newmark at a constant 200 rad/s, 10 s with the steps of the run-up above."""
    import ross

    steel = ross.Material("steel", rho=7850, E=2.1e11, G_s=8.1e10)
    n = stations - 1
    shafts = [
        ross.ShaftElement(0.6 / n, 0, 0.03, material=steel, beta=1e-5, alpha=2.0) for _ in range(n)
    ]
    disc = ross.DiskElement(n // 2, 8.0, 0.022, 0.04)
    bearings = [ross.BearingElement(k, 1e7, 1e3) for k in (0, n)]
    rotor = ross.Rotor(shafts, [disc], bearings)
    t = np.arange(0.0, 10.0, 1.0 / RATE)
    force = np.zeros((t.size, rotor.ndof))
    for c, wave in ((0, np.cos), (1, np.sin)):
        force[:, rotor.number_dof * (n // 2) + c] = 8.0 * 1e-4 * 200.0**2 * wave(200.0 * t)
    began = time.perf_counter()
    rotor.run_time_response(200.0, force, t, method="newmark")
    return {"stations": stations, "ten": time.perf_counter() - began, "states": 2 * rotor.ndof}


def ida_banded(stations: int, rtol: float = 1e-6) -> dict:
    """SUNDIALS' IDA with a banded Jacobian on the same matrices, `M q'' + (C + w G) q' + K q = F(t)`: CVODE's
    right side would be full, by the inverse of M. Same run-up; `off`: how far the disc's path is from
    jaxrotor's."""
    import scipy.sparse
    from sksundae.ida import IDA

    machine = line(stations).full()
    still, turning = (jr.linearize(machine, w) for w in (0.0, 200.0))
    M, C, K = (scipy.sparse.csr_array(_cleaned(x)) for x in (still.M, still.C, still.K))
    G = scipy.sparse.csr_array(_cleaned((turning.G - still.G) / 200.0))
    n = M.shape[0]
    turns = np.array([c == "phi" for _, c in still.coordinates], float)
    wound = still.coordinates.index(("disc", "phi"))
    inertia = M @ turns
    drag = 2.0 * (inertia - 0.04 * (np.arange(n) == wound))  # of the shaft alone
    at = [still.coordinates.index(("disc", c)) for c in "xy"]
    # along the line, each coordinate beside its rate
    along = {name: k for k, name in enumerate(_along(machine))}
    order = np.array(sorted(range(n), key=lambda i: along[still.coordinates[i][0]]))
    q, v = np.argsort(order) * 2, np.argsort(order) * 2 + 1
    pairs = scipy.sparse.coo_array(abs(M) + abs(C) + abs(K) + abs(G))
    band = int(np.max(np.abs(q[pairs.row] - q[pairs.col]))) + 1

    def motion(t):
        s = np.pi * min(t, 0.5) / 0.5
        speed = 100.0 * (1 - np.cos(s))
        angle = 100.0 * (min(t, 0.5) - 0.5 / np.pi * np.sin(s)) + 200.0 * max(t - 0.5, 0.0)
        return angle, speed, 100.0 * np.pi / 0.5 * np.sin(s)

    def residual(t, y, yp, res):
        angle, speed, faster = motion(t)
        rates = y[v]
        left = M @ yp[v] + C @ rates + speed * (G @ rates) + K @ y[q]
        left += inertia * faster + drag * speed
        # the shaft winds up between drive and disc
        angle, speed, faster = angle + y[q[wound]], speed + rates[wound], faster + yp[v[wound]]
        force = 8.0 * 1e-4 * (speed**2 - 1j * faster) * np.exp(1j * angle)
        left[at[0]] -= force.real
        left[at[1]] -= force.imag
        res[q], res[v] = yp[q] - rates, left

    times = np.linspace(0.0, 10.0, int(10 * RATE) + 1)
    y0, yp0 = np.zeros(2 * n), np.zeros(2 * n)
    solver = IDA(
        residual,
        rtol=rtol,
        atol=1e-12,
        linsolver="band",
        lband=band,
        uband=band,
        max_num_steps=10**7,
    )
    began = time.perf_counter()
    solution = solver.solve(times, y0, yp0)
    took = time.perf_counter() - began
    run = jr.simulate(machine.reduced(0.5 * RATE, speed=200.0), 10.0, RATE, progress=False)
    theirs = solution.y[:, q[at]]
    ours = np.stack([run["disc"].x, run["disc"].y], axis=1)
    off = float(np.abs(theirs - ours).max() / np.abs(ours).max())
    return {"stations": stations, "ten": took, "states": 2 * n, "off": off}


def _cleaned(X) -> np.ndarray:
    """Without the rounding of an inverse."""
    X = np.asarray(X)
    size = np.sqrt(np.abs(np.diagonal(X)))
    size = np.where(size > 0, size, size.max())
    return np.where(np.abs(X) > 1e-12 * size * size[:, None], X, 0.0)


def _along(machine: jr.Machine) -> list[str]:
    inner = [s for s in machine.wiring.stations if "." in s]
    left, right = ([s for s in inner if s.startswith(f"shaft {k}.")] for k in (1, 2))
    return ["left", *left, "disc", *right]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stations", type=int, nargs="+", default=[10, 20, 50, 100, 200])
    parser.add_argument("--full", type=int, nargs="*", default=[10, 20, 50])
    parser.add_argument("--ross", type=int, nargs="*", default=[20, 100])
    parser.add_argument("--ida", type=int, nargs="*", default=[20, 100])
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        kind, stations = given.one[0], int(given.one[1])
        peers = {"ross": ross_newmark, "ida": ida_banded}
        found = peers[kind](stations) if kind in peers else once(stations, kind == "full")
        print(json.dumps(found))
        return
    print(f"JAX {jax.__version__}; 10 s, run up in 0.5 s; {RATE:g} samples a second; seconds")
    columns = (
        ("stations", 1, "d"), ("states", 1, "d"), ("reduce", 1, ".1f"), ("plan", 1, ".1f"),
        ("first", 1, ".1f"), ("ten", 1, ".2f"), ("step", 1e6, ".0f"),
        ("first gradient", 1, ".1f"), ("gradient", 1, ".2f"), ("memory", 1, ".0f"), ("off", 1, ".0e"),
    )  # fmt: skip
    print("            " + "".join(f"{name:>16}" for name, _, _ in columns))
    rows = {}
    kinds = ("reduced", given.stations), ("full", given.full), ("ross", given.ross)
    for kind, sizes in (*kinds, ("ida", given.ida)):
        for stations in sizes:
            command = [sys.executable, __file__, "--one", kind, str(stations)]
            out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
            found = rows[kind, stations] = json.loads(out.splitlines()[-1])
            row = (
                f"{found[name] * scale:{form}}" if name in found else ""
                for name, scale, form in columns
            )
            print(f"{kind:12}" + "".join(f"{x:>16}" for x in row), flush=True)
    pairs = {
        f"{peer} / reduced, {n} stations": (found["ten"], rows["reduced", n]["ten"])
        for (peer, n), found in rows.items()
        if peer != "reduced" and ("reduced", n) in rows
    }
    if ("reduced", 20) in rows and ("reduced", 200) in rows:
        pairs["20 / 200 stations, reduced"] = tuple(rows["reduced", n]["ten"] for n in (20, 200))
    ratios = {name: one / other for name, (one, other) in pairs.items()}
    kept = [dict(kind=kind) | found for (kind, _), found in rows.items()]
    record("growth", header("ross-rotordynamics", "scikit-sundae"), ratios, kept)


if __name__ == "__main__":
    main()
