"""Linear analysis of an overhung fan of 9 stations, each in a process of its own without any compiled
program kept: processor seconds of the whole process until the first answer, and of a later call; and ROSS's.
Prints a table; nothing is asserted (docs/benchmarks.md has a run of it)."""

import argparse
import json
import os
import subprocess
import sys
import time
import warnings

import numpy as np

RPM = np.pi / 30
DIAMETER = 0.12
# name -> length, elements: the shaft from the wheel on
PIECES = {"overhang": (0.35, 3), "shaft": (0.9, 4), "stub": (0.15, 1)}
WHEEL = (85.0, 9.0, 4.8)  # mass, polar, transverse
BEARING, PEDESTAL = (3e8, 3e4), (150.0, 6e8, 4e4)  # stiffness, damping; mass, stiffness, damping
UNBALANCE = 85.0 * 4e-5
SPEEDS = {
    "campbell": np.linspace(0.0, 500.0, 61),
    "response": np.linspace(1.0, 500.0, 600),
    "order": np.linspace(1.0, 500.0, 100),
}
OUTPUTS = ("wheel.x", "wheel.y")
STEEL = dict(E=2.1e11, G_s=8.1e10, rho=7850.0)


def fan():
    """58 coordinates: 9 stations on the shaft, 2 pedestals that move along x and y."""
    import jaxrotor as jr

    def shaft(name):
        length, elements = PIECES[name]
        return jr.FiniteElementShaft(length, DIAMETER, elements=elements, rayleigh=(0.0, 1e-6))

    k, c = BEARING
    link = np.kron([[1, -1], [-1, 1]], np.diag([1.0, 1, 1, 0, 0, 0]))
    mass, k_foot, c_foot = PEDESTAL
    elements = {
        "wheel": jr.Rotor(*WHEEL, unbalance=jr.Unbalance(UNBALANCE / WHEEL[0])),
        "front": jr.Node(),
        "rear": jr.Node(),
        "motor": jr.Node(),
        **{name: shaft(name) for name in PIECES},
    }
    connections = {
        "overhang": ("wheel", "front"),
        "shaft": ("front", "rear"),
        "stub": ("rear", "motor"),
    }
    for end in ("front", "rear"):
        elements |= {
            f"{end} foot": jr.Node(),
            f"{end} mass": jr.AddedInertia(mass),
            f"{end} bearing": jr.ElasticMatrix(k * link, c * link),
            f"{end} base": jr.LinearSupport([k_foot, k_foot] + [0] * 4, [c_foot, c_foot] + [0] * 4),
        }
        connections |= {
            f"{end} mass": f"{end} foot",
            f"{end} bearing": (end, f"{end} foot"),
            f"{end} base": f"{end} foot",
        }
    held = {f"{end} foot": ("z", "psi", "theta", "phi") for end in ("front", "rear")}
    return jr.Machine(elements, connections, (0.0, -9.81, 0.0), held)


def of_ross():
    import ross

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        steel = ross.Material("steel", **STEEL)
        lengths = [length / n for length, n in PIECES.values() for _ in range(n)]
        shafts = [
            ross.ShaftElement(
                x, 0.0, DIAMETER, material=steel, beta=1e-6, shear_method_calc="cowper"
            )
            for x in lengths
        ]
        mass, polar, transverse = WHEEL
        disks = [ross.DiskElement(0, mass, transverse, polar)]
        (k, c), (foot, k_foot, c_foot) = BEARING, PEDESTAL
        bearings, masses = [], []
        for n, link in ((3, 9), (7, 10)):
            bearings.append(ross.BearingElement(n, k, c, kzz=k, czz=c, n_link=link))
            bearings.append(ross.BearingElement(link, k_foot, c_foot, kzz=1e12))
            masses.append(ross.PointMass(link, foot))
        return ross.Rotor(shafts, disks, bearings, masses)


def compressor():
    import ross

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return ross.compressor_example()


def mine(task, machine):
    import jaxrotor as jr

    if task == "modes":
        return [m.frequency for m in jr.modes(jr.linearize(machine, 300.0), 12)]
    if task == "campbell":
        return jr.campbell(machine, SPEEDS[task]).frequencies[-1]
    if task == "critical":
        return np.asarray(jr.critical_speeds(machine, count=12))
    if task == "response":
        return np.asarray(jr.unbalance_response(machine, OUTPUTS, SPEEDS[task]).magnitude)[:, 0]
    if task == "order":
        found = jr.linear.order_response(machine, OUTPUTS, SPEEDS[task], (1.0, 2.0))
        return np.asarray(found.magnitude)[:, 0, 0]
    return [m.frequency for m in jr.torsional_modes(machine, 300.0, 4)]


def theirs(task, rotor):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if task == "modes":
            return np.abs(rotor.run_modal(300.0, num_modes=24).wd)[:12]
        if task == "campbell":
            return rotor.run_campbell(SPEEDS[task], frequencies=12).wd[-1]
        if task == "critical":
            return rotor.run_critical_speed(num_modes=24).wd()
        if task == "response":
            found = rotor.run_unbalance_response(0, UNBALANCE, 0.0, frequency=SPEEDS[task])
            return np.abs(found.forced_resp[0])
    raise ValueError(task)


def child(program, task):
    """Prints processor seconds: at the first answer, of the best of three later calls; and a few numbers."""
    subject, _, task = task.rpartition(" ")
    if program == "ross":
        work, made = theirs, compressor if subject else of_ross
    else:
        import jax

        jax.config.update("jax_enable_x64", True)
        work, made = mine, fan
        if subject:
            from jaxrotor.interop.ross import from_ross

            def made():
                return from_ross(compressor())

    subject = made()
    found = work(task, subject)
    first = sum(os.times()[:2])
    later = []
    for _ in range(3):
        if program == "ross":
            subject = made()  # a rotor of ROSS remembers the modes it was asked for
        began, start = sum(os.times()[:2]), time.perf_counter()
        work(task, subject)
        later.append((sum(os.times()[:2]) - began, time.perf_counter() - start))
    numbers = np.asarray(found, float).ravel()
    print(json.dumps([first, *np.min(later, axis=0), numbers[[0, len(numbers) // 2, -1]].tolist()]))


def fresh(program, task):
    """In a process of its own, without the cache of compiled programs."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("JAX_COMPILATION_CACHE")}
    environment |= {"JAXROTOR_CACHE": "off"}
    done = subprocess.run(
        [sys.executable, __file__, "--child", program, task],
        env=environment,
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise RuntimeError(done.stderr)
    *seconds, numbers = json.loads(done.stdout.strip().splitlines()[-1])
    return seconds, numbers


TASKS = ("modes", "campbell", "critical", "response", "order", "torsion", "compressor modes")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--child", nargs=2, help=argparse.SUPPRESS)
    parser.add_argument("--tasks", nargs="+", default=TASKS)
    parser.add_argument("--mine", action="store_true", help="without ROSS")
    given = parser.parse_args()
    if given.child:
        child(*given.child)
        return
    from machine import header
    from record import record

    print(machine := header(*(() if given.mine else ("ross-rotordynamics",))))
    ratios, rows = {}, []
    titles = ("", "first", "later", "later, wall", "ROSS: first", "later", "later, wall")
    print(f"| {' | '.join(titles)} |\n{'|---' * len(titles)}|")
    for task in given.tasks:
        mine_s, found = fresh("jaxrotor", task)
        row = [f"{x:.2f}" for x in mine_s] + [""] * 3
        if not given.mine and task not in ("order", "torsion"):
            ross_s, other = fresh("ross", task)
            row[3:] = [f"{x:.2f}" for x in ross_s]
            ratios[f"ROSS / jaxrotor, {task}, first"] = ross_s[0] / mine_s[0]
            ratios[f"ROSS / jaxrotor, {task}, later"] = ross_s[1] / mine_s[1]
        rows.append((task, row))
        print(f"| {task} | {' | '.join(row)} |", flush=True)
        if task in ("modes", "campbell") and not given.mine:
            gap = np.abs(np.array(found) / other - 1).max()
            print(f"the frequencies of {task} agree to {gap:.0e}", file=sys.stderr)
    record("linear", machine, ratios, rows)


if __name__ == "__main__":
    main()
