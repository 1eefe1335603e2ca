"""Instants at which a force jumps or kinks, on samples and beside them: the run and its derivatives by
them, against closed forms."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from apart import apart

import jaxrotor as jr

# On a whole sample in floating point, half way, and anywhere.
PLACES = {"on": 0.02, "half way": 0.0205, "anywhere": 0.0203}
J, END, RATE = 0.01, 0.05, 1000.0


# A torque on a free disc. `parts`: [(t, c)] jumps by c, [(t, r)] changes of its slope by r.
def turned(steps, slopes=()):
    """Angle and speed at the end."""
    speed = sum(c * (END - t) for t, c in steps)
    speed += sum(r * (END - t) ** 2 / 2 for t, r in slopes)
    angle = sum(c * (END - t) ** 2 / 2 for t, c in steps)
    angle += sum(r * (END - t) ** 3 / 6 for t, r in slopes)
    return jnp.stack([angle, speed]) / J


def pulses(start, period, width):
    rises = [start + k * period for k in range(3)]
    return turned([(t, 1.0) for t in rises] + [(t + width, -1.0) for t in rises])


CASES = {
    **{
        f"step {k}": (jr.Step, lambda t: turned([(t, 1.0)]), (at,), (1.0,))
        for k, at in PLACES.items()
    },
    **{
        f"ramp to {k}": (
            jr.Ramp,
            lambda t, d: turned([], [(t, 1 / d), (t + d, -1 / d)]),
            (0.01, at - 0.01),
            (1.0,),
        )
        for k, at in PLACES.items()
    },
    "pulses": (
        lambda s, p, w: jr.PulseTrain(p, w, 1.0, 0.0, s, count=3),
        pulses,
        (0.002, 0.01, 0.003),
        (),
    ),
}


@pytest.fixture(scope="module")
def by_instants():
    """Ends of all discs and their derivatives by all instants, (cases, 2) and (cases, 2, instants)."""

    def ends(instants):
        torques = {
            name: jr.Torque(make(*own, *rest))
            for (name, (make, _, _, rest)), own in zip(CASES.items(), instants)
        }
        machine = apart(torques, J, fixed=("x", "y", "z", "psi", "theta"))
        run = jr.simulate(machine, END, RATE, "undeformed", step=1e-3)
        return jnp.stack([jnp.stack([run[n].phi[-1], run[n].velocity[-1, 5]]) for n in torques])

    at = [tuple(map(float, start)) for _, _, start, _ in CASES.values()]
    forward, value = jax.jit(jax.jacfwd(lambda at: (ends(at),) * 2, has_aux=True))(at)
    return value, forward, jax.jit(jax.jacrev(ends))(at)


@pytest.mark.parametrize("name", CASES)
def test_the_run_and_its_derivatives_by_every_instant(name, by_instants):
    value, *modes = by_instants
    i = list(CASES).index(name)
    _, exact, at, _ = CASES[name]
    np.testing.assert_allclose(value[i], exact(*at), rtol=1e-11)
    by = [jax.jacfwd(exact, k)(*at) for k in range(len(at))]
    for found in modes:
        for j, one in enumerate(found):
            for k, derivative in enumerate(one):
                wanted = by[k] if j == i else np.zeros(2)
                np.testing.assert_allclose(derivative[i], wanted, rtol=1e-9, atol=1e-9)


# A force thrown on a disc on a spring at whole milliseconds, while it turns: no instant sees it early.


@pytest.mark.parametrize("solver", [None, jr.Rosenbrock()], ids=["adams", "rosenbrock"])
def test_a_force_thrown_on_at_any_sample(solver):
    """x = F/k (1 - cos w(t - t0)); the derivative by t0 is -F/k w sin w(t - t0)."""
    mass, k, F = 2.0, 2e4, 5.0
    w = np.sqrt(k / mass)

    def moved(at):
        parts = {
            "on": jr.Force(jr.Step(at, F), (1.0, 0.0, 0.0)),
            "s": jr.LinearSupport((k, k, k, 0, 0, 0)),
        }
        machine = jr.Machine.in_line(
            {"disc": jr.Rotor(mass, 0.01, 0.006)},
            attachments={name: (part, "disc") for name, part in parts.items()},
            prescribed={"disc": {"phi": jr.ConstantSpeed(400.0)}},
        )
        adjoint, step = (None, 1e-3) if solver is None else (diffrax.ForwardMode(), 2.5e-4)
        run = jr.simulate(machine, 0.06, 1000.0, solver=solver, step=step, adjoint=adjoint)
        return run["disc"].x

    at = jnp.arange(1, 60) * 1e-3
    at = at if solver is None else at[::9]
    found, slope = jax.jit(jax.vmap(lambda t: jax.jvp(moved, (t,), (jnp.ones(()),))))(at)
    late = np.arange(61) * 1e-3 - np.asarray(at)[:, None]
    on = late > 1e-9
    np.testing.assert_allclose(found, on * F / k * (1 - np.cos(w * late)), atol=2e-9 * F / k)
    exact = -F / k * w * on * np.sin(w * late)
    np.testing.assert_allclose(slope, exact, atol=2e-8 * F / k * w)


def test_derivatives_by_the_duration_of_a_cosine_ramp():
    """A disc behind a torsion spring whose far end follows the ramp: on both sides of the ramp's end,
    which lies on a sample, its twist is a closed form."""
    J, k, speed, rate = 0.01, 900.0, 60.0, 1000.0
    K = np.zeros((12, 12))
    K[np.ix_([5, 11], [5, 11])] = k * np.array([[1, -1], [-1, 1]])

    def simulated(duration):
        drive = jr.PrescribedSpin(jr.CosineRamp(speed, duration))
        spring = jr.ElasticMatrix(K, np.zeros((12, 12)))
        machine = jr.Machine.in_line(
            {"disc": jr.Rotor(1.0, J, 0.006), "spring": spring, "end": drive}
        )
        run = jr.simulate(machine, 0.05, rate, "undeformed", step=2.5e-4)
        return run["disc"].phi - run["end"].phi

    def exact(duration):
        w, nu, t = np.sqrt(k / J), np.pi / duration, jnp.arange(51) / rate

        def ramp(t):  # u'' + w² u = -(speed nu/2) sin(nu t)
            return -speed * nu / 2 / (w**2 - nu**2) * (jnp.sin(nu * t) - nu / w * jnp.sin(w * t))

        u, v = ramp(duration), jax.grad(ramp)(duration)
        late = t - duration
        return jnp.where(late < 0, ramp(t), u * jnp.cos(w * late) + v / w * jnp.sin(w * late))

    (found, slope), (values, slopes) = (
        jax.jit(lambda x, f=f: jax.jvp(f, (x,), (1.0,)))(0.02) for f in (simulated, exact)
    )
    np.testing.assert_allclose(found, values, atol=1e-9)
    np.testing.assert_allclose(slope, slopes, atol=1e-7 * np.max(np.abs(slopes)))
