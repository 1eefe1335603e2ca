"""The stiff solver's Jacobian by parts: against the field's own tangents, and in a run."""

from pathlib import Path

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.core.quick import quickly_compiled
from jaxrotor.integrators.rosenbrock import Rosenbrock, SlopedField
from jaxrotor.machine.field import initial_states, n_free, vector_field
from jaxrotor.machine.layout import count_of_free
from jaxrotor.machine.slopes_by_parts import SlopesByParts
from jaxrotor.machine.system import assemble


def film_rotor(elements=3, **shaft):
    """A rotor whose shafts have mass and damping that turns with them, on two films of oil."""
    given = dict(length=0.25, diameter=0.022, rayleigh=(0.0, 2e-5)) | shaft
    film = jr.JournalBearing(0.03, 0.012, 0.15e-3, 0.04)
    end = dict(mass=0.4, polar_inertia=5e-5, transverse_inertia=1e-4)
    return jr.Machine.in_line(
        {
            "drive": jr.PrescribedSpin(jr.LinearRamp(start=150.0, speed=400.0, duration=1.0)),
            "quill": jr.Coupling([0, 0, 0, 0, 0, 1e4], [0, 0, 0, 0, 0, 1]),
            "left": jr.Rotor(**end),
            "shaft 1": jr.FiniteElementShaft(elements=elements, **given),
            "disc": jr.Rotor(4.0, 0.012, 0.007, unbalance=jr.Unbalance(20e-6, 0.3, 1e-3, 0.1)),
            "shaft 2": jr.FiniteElementShaft(elements=elements, **given),
            "right": jr.Rotor(**end),
        },
        attachments={"left film": (film, "left"), "right film": (film, "right")},
        gravity=(0.0, -9.81, 0.0),
        fixed={"left": ["z"]},
    )


def config(name):
    return jr.load(Path(__file__).parents[1] / "configs" / f"{name}.toml", run=False).machine


MACHINES = {
    "a reduced rotor on films": lambda: film_rotor().reduced(1000.0, speed=400.0),
    "finite elements, all of them": lambda: film_rotor(2).full(),
    "paper's kind, no shaft with mass": lambda: config("overhung_fan"),
    "internal states of several kinds": lambda: config("magnetic_bearings"),
    "a motor's states, couplings, a free spin": lambda: config("motor_coupling_pump"),
}


@pytest.mark.parametrize("made", MACHINES.values(), ids=MACHINES)
def test_against_tangents_of_the_field(made):
    """`E k' = B y' + c t'` where k' are tangents of the field, at a state that is far from rest."""
    system = assemble(made())
    assert SlopesByParts.serve(system)
    n, start = n_free(system), initial_states(system)
    rng = np.random.default_rng(1)
    y = [
        1e-4 * rng.normal(size=n),
        0.1 * rng.normal(size=n),
        start + 1e-3 * rng.normal(size=start.size),
    ]
    y, t = jnp.concatenate(y), jnp.asarray(0.37)

    @quickly_compiled
    def both(t, y, system):
        by_y, by_t = jax.jacfwd(lambda t, y: vector_field(t, y, system)[n:], (1, 0))(t, y)
        return jnp.column_stack([by_y, by_t]), SlopesByParts.of(system)(t, y)

    tangents, (E, B, c) = jax.tree.map(np.asarray, both(t, y, system))
    B = np.column_stack([B, c])
    size = np.abs(E) @ np.abs(tangents) + np.abs(B)
    assert np.max(np.abs(E @ tangents - B) / np.max(size, axis=1)[:, None]) < 1e-13
    assert np.linalg.matrix_rank(B[:, :n]) > n // 2
    assert np.any(E != np.eye(len(E))) == (system.mass is not None)


def test_a_step_by_parts():
    """A step of Rodas5P from a whirl, by parts: itself, and its derivatives in reverse mode (the transpose of
    forward mode's), against the step whose Jacobian is one tangent for each state, and its differences."""
    made = film_rotor(1).full()
    n = count_of_free(made)
    rng = np.random.default_rng(2)
    lateral = np.array(assemble(made).layout.free) // assemble(made).layout.n_mass < 2
    start = np.concatenate(
        [3e-5 * rng.normal(size=n) * lateral, 1e-2 * rng.normal(size=n) * lateral]
    )
    weights = np.concatenate(
        [1e6 * rng.normal(size=n) * lateral, 1e2 * rng.normal(size=n) * lateral]
    )
    t, h = jnp.asarray(0.3), 1e-4

    def reached(x, known):
        machine = made.set({"left film.clearance": 1e-4 * x[0], "disc.mass": x[1]})
        system = assemble(machine)
        y = jnp.asarray(start) * x[2]
        field = SlopedField(vector_field, SlopesByParts.of(system)) if known else vector_field
        terms = diffrax.ODETerm(field)  # pyright: ignore
        y1, error, *_ = Rosenbrock().step(terms, t, t + h, y, system, None, False)
        return weights @ y1, error

    x = jnp.array([1.5, 4.0, 1.0])
    by_parts = quickly_compiled(jax.value_and_grad(lambda x: reached(x, True), has_aux=True))
    (value, error), reverse = by_parts(x)
    by_tangents = quickly_compiled(lambda x: reached(x, False))
    same, other = by_tangents(x)
    np.testing.assert_allclose(value, same, rtol=1e-9)
    np.testing.assert_allclose(error, other, atol=1e-9 * np.max(np.abs(other)))
    steps = 1e-4 * np.diag(x)
    central = [
        (by_tangents(x + step)[0] - by_tangents(x - step)[0]) / (2 * step[i])
        for i, step in enumerate(steps)
    ]
    np.testing.assert_allclose(reverse, central, rtol=1e-6)


def test_a_run_takes_them(monkeypatch):
    """Its path is that of a run whose Jacobians are tangents of the field; slopes by parts are asked for."""
    asked = []
    monkeypatch.setattr(SlopesByParts, "__call__", _counted(SlopesByParts.__call__, asked))
    machine, simulation = film_rotor(2).full(), jr.Simulation(2e-3, 4000.0, initial="undeformed")
    by_parts = jr.simulate(machine, simulation, progress=False)
    assert by_parts.info.solver == "Rosenbrock" and asked
    del asked[:]
    monkeypatch.setattr(SlopesByParts, "serve", lambda system: False)
    # another step count, so that the program is another
    simulation = jr.Simulation(2.25e-3, 4000.0, initial="undeformed")
    by_tangents = jr.simulate(machine, simulation, progress=False)
    assert not asked
    ours, theirs = (np.asarray(run["disc"].y) for run in (by_parts, by_tangents))
    np.testing.assert_allclose(
        ours, theirs[: ours.size], rtol=1e-9, atol=1e-9 * np.max(np.abs(ours))
    )


def _counted(call, asked):
    def counted(self, *args):
        asked.append(None)
        return call(self, *args)

    return counted
