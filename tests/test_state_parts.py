"""Parts of the state that no linear term mixes: handed over by a plan to runs inside jit and under
derivatives, and found for all machines of a sweep."""

import dataclasses
import importlib

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.core.quick import quickly_compiled
from jaxrotor.machine.system import assemble
from jaxrotor.simulation import state_parts
from jaxrotor.simulation.run_setup import set_up
from jaxrotor.simulation.simulate import settled

sweeping = importlib.import_module("jaxrotor.sweeps.sweep")  # (`jr.sweep` is the function)
RUN = dict(t_end=0.05, sample_rate=1000.0)
KEYS = ("disc.mass", "shaft 2.diameter", "bearing.stiffness")


@pytest.fixture(autouse=True)
def small_ones_too(monkeypatch):
    monkeypatch.setattr(state_parts, "LARGE", 0)


def line() -> jr.Machine:
    """A disc between elements, driven at one end; a run-up that bends and twists it. 48 states."""

    def shaft(length):
        return jr.FiniteElementShaft(length, 0.02, elements=2, rayleigh=(2.0, 1e-5))

    return jr.Machine.in_line(
        {
            "left": jr.Node(),
            "shaft 1": shaft(0.2),
            "disc": jr.Rotor(8.0, 0.04, 0.022, unbalance=jr.Unbalance(1e-4)),
            "shaft 2": shaft(0.25),
            "drive": jr.PrescribedSpin(jr.CosineRamp(speed=150.0, duration=0.04)),
        },
        attachments={
            "bearing": (jr.LinearSupport([1e6, 2e6, 1e6, 0, 0, 0], [5e2] * 3 + [0] * 3), "left"),
        },
        gravity=(0.0, 0.0, 3.0),
    )


@pytest.fixture(scope="module")
def planned():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(state_parts, "LARGE", 0)
        machine = line()
        return machine, dataclasses.replace(jr.plan(machine, **RUN), substeps=6)


def kinds(machine, rows) -> set[str]:
    """The coordinates of a part, by name; each with its own rate."""
    layout = assemble(machine).layout
    names = [("x", "y", "z", "psi", "theta", "phi")[i // layout.n_mass] for i in layout.free]
    n = len(names)
    assert {r + n for r in rows if r < n} == {r for r in rows if r >= n}
    return {names[r % n] for r in rows}


def test_a_plan_tells_bending_from_the_rest(planned):
    machine, plan = planned
    found = [kinds(machine, rows) for rows in plan.parts.rows]
    assert sorted(map(sorted, found)) == [["phi", "z"], ["psi", "theta", "x", "y"]]
    assert len(sum(plan.parts.rows, ())) == 48


def test_another_value_has_the_same_plan(planned):
    machine, plan = planned
    other = jr.plan(machine.set({"disc.mass": 8.4, "shaft 1.diameter": 0.0203}), **RUN)
    other = dataclasses.replace(other, substeps=plan.substeps)
    assert other == plan and hash(other) == hash(plan)


def seen(machine, plan, factors):
    """What bends, what twists and what is axial of it."""
    changed = {key: machine.get(key) * factors[i] for i, key in enumerate(KEYS)}
    run = jr.simulate(machine.set(changed), **RUN, initial="undeformed", step=plan)
    twist = run.y[20, 20]  # against the drive, whose turns would take digits of it
    return 1e3 * jnp.stack([run["disc"].x[-1], run["left"].y[-7], twist, run["disc"].z[-1]])


def test_derivatives_by_parts(planned):
    """Forward is reverse is that of the whole state; central differences agree."""
    machine, plan = planned
    at, along = jnp.ones(3), jnp.array([0.6, -1.0, 0.8])
    weights = jnp.array([1.0, -0.7, 30.0, 0.4])

    def pulled(plan):
        def both(p):
            found, pull = jax.vjp(lambda p: seen(machine, plan, p), p)
            return found, pull(weights)[0]

        return quickly_compiled(both)(at)

    (value, reverse), (of_whole, dense) = (
        pulled(plan),
        pulled(dataclasses.replace(plan, parts=None)),
    )
    np.testing.assert_allclose(value, of_whole, rtol=1e-10)
    np.testing.assert_allclose(value, seen(machine, plan, at), rtol=1e-10)  # a plain run
    scale = np.abs(dense).max()
    np.testing.assert_allclose(reverse, dense, rtol=0, atol=1e-10 * scale)

    def pushed(p):
        return jax.jvp(lambda p: seen(machine, plan, p), (p,), (along,))

    pushed = quickly_compiled(pushed)
    forward = pushed(at)[1]
    np.testing.assert_allclose(weights @ forward, reverse @ along, rtol=0, atol=1e-10 * scale)
    h = 3e-6  # twist swings often until then
    central = (pushed(at + h * along)[0] - pushed(at - h * along)[0]) / (2 * h)
    assert (np.abs(forward) > 1e-3 * np.abs(value)).all()
    np.testing.assert_allclose(central, forward, rtol=1e-6)


def test_a_program_by_parts_has_no_product_with_the_whole_state(planned):
    machine, plan = planned

    def program(plan):
        return str(jax.make_jaxpr(lambda p: seen(machine, plan, p))(jnp.ones(3)))

    predict = f"f64[48,{48 + 24 * plan.order}]"
    assert predict in program(dataclasses.replace(plan, parts=None))
    assert predict not in program(plan)


def test_parts_are_of_machines_that_are_made_alike(planned):
    """A plan for another machine steps this one as a whole, and rightly."""
    machine, plan = planned
    other = jr.Machine.in_line(
        {
            "left": machine["left"],
            "shaft 1": machine["shaft 1"],
            "disc": machine["disc"],
            "shaft 2": machine["shaft 2"],
            "drive": machine["drive"],
        },
        attachments={"tie": (jr.LinearSupport(1e6 * np.ones((6, 6)) + np.diag([9e6] * 6)), "left")},
    )
    simulation = jr.Simulation(**RUN)
    assert set_up(machine, simulation, None, plan, 51).parts == plan.parts.rows
    assert set_up(other, simulation, None, plan, 51).parts is None
    inside = jax.jit(lambda m: jr.simulate(m, **RUN, step=plan).y)(other)
    np.testing.assert_allclose(inside, jr.simulate(other, **RUN, step=plan).y, atol=1e-12)


def geared(helix: float) -> jr.Machine:
    support = jr.LinearSupport([1e7] * 3 + [1e4] * 2 + [0], [1e3] * 3 + [1, 1, 0])
    return jr.Machine(
        {
            "drive": jr.PrescribedSpin(jr.CosineRamp(60.0, 0.02)),
            "shaft": jr.Shaft(0.1, 0.03, rayleigh=(0.0, 2e-5)),
            "pinion": jr.Rotor(2.0, 2e-3, 1.2e-3, unbalance=jr.Unbalance(5e-5)),
            "mesh": jr.GearMesh(
                [0.05, 0.1], jr.elements.KelvinVoigt(1e7, 500.0), helix_angle=helix
            ),
            "wheel": jr.Rotor(5.0, 2e-2, 1.1e-2),
            "bearing": support,
        },
        {"shaft": ("drive", "pinion"), "mesh": ("pinion", "wheel"), "bearing": "wheel"},
    )


def test_what_another_value_of_a_zero_mixes_is_no_part_of_its_own(monkeypatch):
    """Spur gears leave axial motion alone, but a plan serves for helical ones."""
    monkeypatch.setattr(state_parts, "_WORTH", 0.99)
    monkeypatch.setattr(state_parts, "_LEAST", 2)
    spur = geared(0.0)
    seen = []

    def told(A, exact_rows, own=state_parts.parts_of):
        seen.append(own(A, exact_rows))
        return seen[-1]

    monkeypatch.setattr("jaxrotor.simulation.step_choice.parts_of", told)
    plan = jr.plan(spur, **RUN)
    assert {"z"} in [kinds(spur, rows) for rows in seen[0].rows]
    assert plan.parts is None
    helical = spur.set({"mesh.helix_angle": 0.3})
    inside = jax.jit(lambda m: jr.simulate(m, **RUN, step=plan).y)(helical)
    np.testing.assert_allclose(inside, jr.simulate(helical, **RUN, step=plan).y, atol=1e-11)


def test_fits_and_designs_are_run_by_parts(planned):
    machine, _ = planned
    assert settled(machine, jr.Simulation(**RUN)).step.parts is not None
    record = jr.Record({"x": jr.sensors.Series(np.arange(40) * 1e-3, np.zeros(40))})
    run = jr.MeasuredRun(record, jr.Simulation(**RUN)).planned(machine)
    assert run.simulation.step.parts is not None
    design = jr.optimization.SimulatedRun(jr.Simulation(**RUN)).ready(machine, reverse=True)
    assert design.simulation.step.parts is not None


@pytest.mark.parametrize("key", ["disc.unbalance.eccentricity", "disc.mass"])
def test_a_sweep_by_parts(planned, monkeypatch, key):
    """One A for all, and one for each: as each run by itself."""
    machine, plan = planned
    used = []

    monkeypatch.setattr(sweeping, "_LARGE_IN_COMMON", 0)

    def told(*args, own=sweeping.parts_of_all):
        used.append(own(*args))
        return used[-1]

    monkeypatch.setattr(sweeping, "parts_of_all", told)
    values = np.array([0.9, 1.0, 1.2]) * float(machine.get(key))
    outputs = {"x": jr.sweeps.TimeSeries(jr.sensors.ProximityProbe("disc", 0.0))}
    found = jr.sweep(machine, {key: values}, outputs, **RUN, step=plan)
    assert used == [plan.parts.rows]
    for value, x in zip(values, found["x"].values):
        alone = jr.simulate(machine.set({key: value}), **RUN, step=plan)["disc"].x
        np.testing.assert_allclose(x, alone, atol=1e-10 * np.ptp(alone))


def test_a_sweep_that_mixes_parts_has_them_as_one(monkeypatch):
    monkeypatch.setattr(state_parts, "_WORTH", 0.99)
    monkeypatch.setattr(state_parts, "_LEAST", 2)
    monkeypatch.setattr(sweeping, "_LARGE", 0)
    monkeypatch.setattr(sweeping, "_LARGE_IN_COMMON", 0)
    machine, key = geared(0.0), "mesh.helix_angle"
    outputs = {"z": jr.sensors.ProximityProbe("pinion", 0.0)}
    simulation = jr.Simulation(**RUN, step=1e-4)
    of_spurs, of_all = (
        sweeping.set_up(machine, {key: np.array(angles)}, outputs, simulation)[0].run.parts
        for angles in ([0.0, 0.0, 0.0], [0.0, 0.1, 0.3])
    )
    assert {"z"} in [kinds(machine, rows) for rows in of_spurs]
    assert of_all is None
