"""configs/governed_generator.toml: a rigid line with the same PI law, by SciPy; and its books."""

from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

import jaxrotor as jr

STUDY = jr.load(Path(__file__).parents[1] / "configs" / "governed_generator.toml")


def test_speed_and_torque_follow_the_governor():
    run = STUDY.run()
    rod = 7850 * np.pi * 0.03**2 * 0.5  # kg
    inertia = 0.9 + 1.5 + rod * 0.03**2 / 2
    drag = 2.0 * rod * 0.03**2 / 2  # alpha M v of the turning shaft

    def rates(t, y):
        load = 300.0 if 0.3 <= t < 1.2 else 0.0
        error = 1500 * np.pi / 30 - y[0]
        return [(40 * error + y[1] - load - drag * y[0]) / inertia, 200 * error]

    t = np.asarray(run.t)
    rigid = solve_ivp(rates, (0, 2.5), [1500 * np.pi / 30, 0.0], t_eval=t, max_step=1e-3, rtol=1e-9)
    late = t > 0.1
    mean = (0.9 * run["engine"].speed + 1.5 * run["generator"].speed) / 2.4  # free of the twist
    np.testing.assert_allclose(mean[late], rigid.y[0][late], atol=0.02)
    assert np.ptp(rigid.y[0]) > 10.0
    torque = np.asarray(run["governor"].forces)[:, 0, 5]
    wanted = 40 * (1500 * np.pi / 30 - rigid.y[0]) + rigid.y[1]
    np.testing.assert_allclose(torque[late], wanted[late], atol=8.0)
    # the bearing out of line carries half of what bends the shaft: it settles where statics says
    at_rest = jr.static_equilibrium(STUDY.machine.set({"governor.torque_limit": 1e-9}))
    names = STUDY.machine.wiring.stations
    settled = np.asarray(run["generator"].x)[-200:].mean()
    assert abs(settled - float(at_rest.position[names.index("generator"), 0])) < 2e-6


def test_books():
    """By the study's own solver; past the step of load at 0.3 s."""
    own = STUDY.simulation.solver
    run = jr.Simulation(0.5, 1000.0, "undeformed", speed=157.08, solver=own, step=5e-5)
    audit = jr.energy_audit(STUDY.machine, run)
    assert float(audit.relative) < 1e-6
