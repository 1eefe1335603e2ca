"""Fisher information, differentiated: forward and reverse mode over the forward slopes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxrotor as jr

UNKNOWNS = (
    jr.Unknown("d.unbalance.angle", circular=True),
    jr.Unknown("bearing.stiffness[0]", positive=True),
)


def told(x, unknowns=UNKNOWNS):
    """log det of the information on an unbalance's angle and a stiffness, from the start of a run: by a
    probe's angle, the speed and the eccentricity."""
    angle, speed, eccentricity = x
    springs = [1.2e5, 1.4e5, 1e5, 1e3, 1e3, 0.0]
    machine = jr.Machine(
        {
            "d": jr.Rotor(2.0, 0.02, 0.012, unbalance=jr.Unbalance(eccentricity, 0.7)),
            "bearing": jr.LinearSupport(springs, [60.0, 60.0, 1.0, 1.0, 1.0, 0.0]),
        },
        {"bearing": "d"},
        prescribed={"d": {"phi": jr.ConstantSpeed(100.0)}},
    )
    sensor = jr.sensors.ProximityProbe("d", angle)
    probe = jr.Channel(sensor, noise=jr.sensors.Noise(1e-6))
    # one plan for all speeds, so fine that its error does not show in their differences
    plan = jr.Plan(4, 6, 190.0, 200.0, 1e-6, 5e-5)
    run = jr.identification.CandidateRun(
        jr.Simulation(0.08, 1000.0, "undeformed", step=plan), {"d.phi.speed": speed}
    )
    found = jr.identification.information(machine, unknowns, {"probe": probe}, {"run": run})
    return jnp.linalg.slogdet(found[0, 0])[1]


def test_gradient_of_the_information():
    """Against central differences of fourth order. One slope is exact: both entries grow with the square of
    the eccentricity, which makes 4 of log det."""
    x = np.array([0.3, 190.0, 2e-5])
    reverse = np.asarray(jax.jit(jax.grad(told))(x))
    along = np.array([1.0, 20.0, 1e-5])
    both = jax.jit(lambda x: jax.jvp(told, (x,), (along,)))  # values and a slope by one program
    assert float(both(x)[1]) == pytest.approx(reverse @ along, rel=1e-9)
    for i, h in enumerate(3e-3 * np.diag(along)):
        near, far = (float(both(x + k * h)[0] - both(x - k * h)[0]) for k in (1, 2))
        central = (8 * near - far) / (12 * h[i])
        assert reverse[i] == pytest.approx(central, rel=1e-6)
    assert reverse[2] == pytest.approx(4.0 / 2e-5, rel=1e-9)


def test_an_unknown_that_jit_traces_is_refused():
    x = jnp.array([0.3, 190.0, 2e-5])
    words = "`d.unbalance.eccentricity`: is an unknown and traced by jit"
    with pytest.raises(jr.InputError, match=words):
        jax.jit(lambda x: told(x, ["d.unbalance.eccentricity"]))(x)
