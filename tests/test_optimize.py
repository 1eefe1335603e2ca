"""The optimizer itself: against SciPy, machines optimised anew, loops and brute force."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest
from scipy.optimize import minimize, minimize_scalar

import jaxrotor as jr
from jaxrotor.optimization import experiment
from jaxrotor.optimization.augmented_lagrangian import Layout, tell
from jaxrotor.optimization.problem import pose
from jaxrotor.search.instrumented import Instrumented
from jaxrotor.search.space import Space
from jaxrotor.search.unknown import expanded

INERTIA, DAMPING, STIFFNESS = 0.004, 0.15, 70.0
PATHS = ("damper.stiffness", "damper.damping", "damper.inertia")
SIZES = np.array([STIFFNESS, DAMPING, INERTIA])


def machine(stiffness=STIFFNESS, damping=DAMPING, inertia=INERTIA) -> jr.Machine:
    """A rotor on a torsion spring, with a tuned damper."""
    return jr.Machine.in_line(
        {
            "end": jr.PrescribedSpin(jr.ConstantSpeed(0.0)),
            "spring": jr.Coupling([0.0, 0, 0, 0, 0, 900.0]),
            "disc": jr.Rotor(1.0, 0.04, 0.03),
        },
        attachments={"damper": (jr.TorsionalDamper(inertia, damping, stiffness), "disc")},
        fixed={"disc": ("x", "y", "z", "psi", "theta")},
    )


MACHINE = machine()


def numbers(m):
    """Stiffness, damping and inertia of the damper by their sizes, and the rotor's inertia: what functions of
    the machine below are made of, so that SciPy can have the very same functions."""
    return [m.get(path) / size for path, size in zip(PATHS, SIZES)] + [
        m.get("disc.polar_inertia") / 0.04
    ]


def judged(function):
    """A function of these four numbers as one of the machine."""
    return jr.optimization.NoRun().measure(lambda m: function(*numbers(m)))


def bowl(a, b, c, p):
    return (a - 2) ** 2 + (b - 1.5 * p) ** 2 + (c - 0.5) ** 2 + 0.3 * a * b * c * p


def line(a, b, c, p):
    return a + 2 * b * p


def ball(a, b, c, p):
    return a**2 + b**2 + c**2


def product(a, b, c, p):
    return a * b * c


BOWL, LINE, BALL, PRODUCT = map(judged, (bowl, line, ball, product))
POSITIVE = [jr.Unknown(path, positive=True) for path in PATHS]
BOXED = [*POSITIVE[:2], jr.Unknown(PATHS[2], bounds=(0.6 * INERTIA, 2 * INERTIA))]
LIMITS = (2.5, 2.0, 0.2)


def constrained(limits=LIMITS, p=1.0, unknowns=BOXED, **more):
    start = MACHINE.set({"disc.polar_inertia": 0.04 * p})
    held = [LINE <= limits[0], BALL.equal_to(limits[1]), PRODUCT >= limits[2]]
    return jr.optimize(start, unknowns, BOWL, held, progress=False, **more)


@pytest.fixture(scope="module")
def optimum():
    return constrained()


def by_scipy(function, constraints, bounds, start=(1.0, 1.0, 1.0)):
    """`constraints`: (type, function), by SciPy's sequential quadratic programming."""
    found = minimize(
        function, start, method="SLSQP", jac=jax.grad(function), bounds=bounds,
        constraints=[dict(type=kind, fun=f, jac=jax.jacfwd(f)) for kind, f in constraints],
        options=dict(ftol=1e-12, maxiter=500),
    )  # fmt: skip
    # 8: no step gains anything any more, rounding is reached
    assert found.success or found.status == 8, found.message
    return found


def place(found: jr.optimization.Optimum):
    return np.array([found.values[path] for path in PATHS]) / SIZES


def test_bounds_equalities_and_inequalities(optimum):
    want = by_scipy(
        lambda x: bowl(*x, 1.0),
        [
            ("ineq", lambda x: LIMITS[0] - line(*x, 1.0)),
            ("eq", lambda x: ball(*x, 1.0) - LIMITS[1]),
            ("ineq", lambda x: product(*x, 1.0) - LIMITS[2]),
        ],
        [(0, None), (0, None), (0.6, 2.0)],
    )
    assert optimum.converged
    assert optimum.objective == pytest.approx(want.fun, rel=1e-6)
    np.testing.assert_allclose(place(optimum), want.x, rtol=1e-5)
    # the line and the box hold the design, the product does not; the box is never touched
    assert [held.active for held in optimum.constraints] == [True, True, False]
    assert 0.6 < place(optimum)[2] < 0.6 + 1e-4
    first, second, third = optimum.constraints
    assert first.value == pytest.approx(LIMITS[0], rel=1e-6) and third.price == 0.0
    assert second.value == pytest.approx(LIMITS[1], rel=1e-6)
    words = str(optimum)
    assert words.count("holds the design") == 2 and words.count("is free") == 1


def test_prices_are_slopes_of_the_optimum(optimum):
    for k, h in ((0, 2e-3), (1, 2e-3)):
        ends = []
        for sign in (1, -1):
            moved = list(LIMITS)
            moved[k] += sign * h
            ends.append(constrained(moved).objective)
        slope = (ends[0] - ends[1]) / (2 * h)
        assert optimum.constraints[k].price == pytest.approx(slope, rel=2e-3)
    # a lower bound that holds: its limit raised costs, as said by a positive price
    low = [jr.optimize(MACHINE, POSITIVE, BOWL, [PRODUCT >= limit]) for limit in (1.9, 2.0, 2.1)]
    slope = (low[2].objective - low[0].objective) / 0.2
    assert low[1].constraints[0].price == pytest.approx(slope, rel=1e-2) and slope > 0


def test_sensitivities_against_machines_optimised_anew(optimum):
    """The rotor's inertia is in the objective and in the line that holds the design."""
    found = optimum.sensitivities()
    assert "disc.polar_inertia" in found and not set(found) & set(PATHS)
    h = 1e-3
    slope = (constrained(p=1 + h).objective - constrained(p=1 - h).objective) / (2 * h * 0.04)
    assert float(found["disc.polar_inertia"]) == pytest.approx(slope, rel=1e-4)
    assert float(found["disc.mass"]) == 0.0
    assert set(optimum.sensitivities(["disc.mass"])) == {"disc.mass"}
    with pytest.raises(jr.InputError, match="disk"):
        optimum.sensitivities(["disk.mass"])


def test_tolerances_against_what_the_objective_rises():
    found = jr.optimize(MACHINE, POSITIVE, BOWL)
    rise = 1e-4
    for path, off in found.tolerances(rise).items():
        value = found.values[path]
        ends = [
            float(bowl(*numbers(found.machine.set({path: x})))) for x in (value - off, value + off)
        ]
        assert np.mean(ends) / found.objective - 1 == pytest.approx(rise, rel=1e-2)


def test_forward_and_reverse_mode_and_optax(optimum):
    back = constrained(reverse=True)
    assert back.objective == pytest.approx(optimum.objective, rel=1e-9)
    assert back.found.prices == pytest.approx(optimum.found.prices, abs=1e-6)
    slow = constrained(optimiser=optax.adam(0.02), iterations=300)
    assert slow.objective == pytest.approx(optimum.objective, rel=1e-3)
    assert slow.found.violation < 1e-3


# Several entries: the largest counts


def three(a, b, c, p):
    return jnp.stack(
        [(a - 1) ** 2 + b**2 + 1, (a + 1) ** 2 + (b - 2) ** 2, (a - b) ** 2 + 0.1 * a + 2 + (c - 1) ** 2]
    )  # fmt: skip


def test_minimax():
    found = jr.optimize(MACHINE, POSITIVE, judged(three))
    want = by_scipy(
        lambda x: x[3],
        [("ineq", lambda x: x[3] - three(*x[:3], 1.0))],
        [(0, None)] * 3 + [(None, None)],
        (1.0, 1.0, 1.0, 5.0),
    )
    assert found.objective == pytest.approx(want.fun, rel=1e-7)
    np.testing.assert_allclose(place(found), want.x[:3], rtol=1e-4)
    assert found.weights.sum() == pytest.approx(1.0, abs=1e-6) and found.weights.min() >= 0.0
    # no change lowers all that hold it up: their slopes, so weighed, cancel
    slopes = jax.jacfwd(lambda x: three(*x, 1.0))(jnp.asarray(place(found)))
    np.testing.assert_allclose(found.weights @ np.asarray(slopes), 0.0, atol=1e-5)
    # those that lie lower weigh nothing
    low = np.asarray(three(*place(found), 1.0)) < found.objective - 1e-4
    assert np.all(found.weights[low] < 1e-6)


def test_worst_and_mean_of_a_batch():
    """Machines whose stiffness is up to a fifth off: the best damping."""
    factors = np.array([0.8, 0.9, 1.0, 1.1, 1.2])
    batch = jr.optimization.NoRun(jr.Variations({PATHS[0]: factors}))

    def height(a, b, c, p):
        return 1 / ((a - 1.05) ** 2 + 0.3 * b**2) + 3 * b + a

    measure = lambda m: height(*numbers(m))  # noqa: E731
    for over, pick in (("worst", np.max), ("mean", np.mean)):
        found = jr.optimize(MACHINE, POSITIVE[1:2], batch.measure(measure, over))
        want = minimize_scalar(
            lambda b, pick=pick: pick([height(f, b, 1.0, 1.0) for f in factors]),
            bounds=(0.1, 4.0),
            options=dict(xatol=1e-11),
        )
        assert found.objective == pytest.approx(want.fun, rel=1e-9)
        assert found.values[PATHS[1]] == pytest.approx(want.x * DAMPING, rel=1e-4)
        assert over in found.name and found.weights.size == (5 if over == "worst" else 1)
    nominal = jr.optimize(MACHINE, POSITIVE[1:2], measure)
    best = minimize_scalar(lambda b: height(1.0, b, 1.0, 1.0), bounds=(0.1, 4.0))
    assert nominal.objective == pytest.approx(best.fun, rel=1e-8)


# Searches


def test_the_better_of_two_minima():
    def wells(a, b, c, p):
        return (a - 1) ** 2 * (a - 3) ** 2 - 0.1 * a

    objective = judged(wells)
    near = jr.optimize(MACHINE, POSITIVE[:1], objective)
    both = jr.optimize(MACHINE, POSITIVE[:1], objective, starts=[{PATHS[0]: 3.2 * STIFFNESS}])
    assert near.values[PATHS[0]] < 1.5 * STIFFNESS and len(near.history) == 1
    assert both.objective < near.objective - 0.1 and len(both.history) == 2
    assert both.values[PATHS[0]] == pytest.approx(3.0125 * STIFFNESS, rel=1e-3)
    assert both.start[PATHS[0]] == pytest.approx(STIFFNESS)


@pytest.mark.parametrize("more", [{}, dict(optimiser=optax.adam(0.02), iterations=30)])
def test_ctrl_c_keeps_the_best_so_far(monkeypatch, more):
    """Of what was evaluated until then, by the functions themselves: what misses the bounds least."""
    tells, seen = [], []

    def stopped(problem, layout, x, terms):
        if len(tells) == 7:
            raise KeyboardInterrupt
        tells.append(1)
        seen.append(x)
        return tell(problem, layout, x, terms)

    monkeypatch.setattr("jaxrotor.optimization.search.tell", stopped)
    found = constrained(**more)
    assert found.interrupted and not found.converged and found.to_dict()["interrupted"]
    assert "! the search was interrupted" in str(found) and len(found.history[0]) == 7
    space = found.problem.space
    places = [np.asarray(space.values(x[: len(space)])) / SIZES for x in seen]
    missed = [
        max(
            (line(*x, 1.0) - LIMITS[0]) / LIMITS[0],
            abs(ball(*x, 1.0) - LIMITS[1]) / LIMITS[1],
            (LIMITS[2] - product(*x, 1.0)) / LIMITS[2],
        )
        for x in places
    ]
    best = int(np.argmin(missed))
    np.testing.assert_allclose(place(found), places[best], rtol=1e-12)
    assert found.found.violation == pytest.approx(missed[best], rel=1e-9)
    assert found.objective == pytest.approx(bowl(*places[best], 1.0), rel=1e-9)


def test_ctrl_c_before_a_search_and_between_two(monkeypatch):
    """Nothing is known before the first evaluation; later the searches that ended count."""
    first = constrained(iterations=5)

    def stopped_at(call):
        tells = []

        def stopped(*given):
            tells.append(1)
            if len(tells) == call:
                raise KeyboardInterrupt
            return tell(*given)

        monkeypatch.setattr("jaxrotor.optimization.search.tell", stopped)

    stopped_at(1)
    with pytest.raises(KeyboardInterrupt):
        constrained()
    stopped_at(6)
    both = constrained(iterations=5, starts=[{PATHS[0]: 1.1 * STIFFNESS}])
    assert both.interrupted and len(both.history) == 1
    assert both.values == first.values and not first.interrupted


def test_other_numbers_need_no_new_program(caplog):
    constrained()
    with jax.log_compiles():
        caplog.clear()
        constrained((2.4, 2.1, 0.1), 1.1)
        jr.optimize(
            machine(50.0, 0.2, 0.005),
            BOXED,
            BOWL,
            [LINE <= 3.0, BALL.equal_to(2.2), PRODUCT >= 0.3],
        )
    compiled = [r.getMessage() for r in caplog.records if "Compiling" in r.getMessage()]
    assert not [words for words in compiled if "tell" in words], compiled


def run(t_end=0.1, rate=400.0, **more) -> jr.optimization.SimulatedRun:
    """After a blow of 0.2 N*m*s on the rotor."""
    still = jnp.zeros((2, 6))
    blown = jr.State(still, still.at[1, 5].set(5.0), jnp.array([0.0, -5.0]))
    return jr.optimization.SimulatedRun(
        t_end, rate, initial=blown, **dict(step=1 / rate, solver=jr.ETD4RK()) | more
    )


def test_what_shares_an_experiment_runs_once(monkeypatch):
    made = []

    def counted(*args, **kwargs):
        made.append(1)
        return simulate(*args, **kwargs)

    simulate = experiment.simulate
    monkeypatch.setattr(experiment, "simulate", counted)
    bench = Instrumented(MACHINE, {})
    space = Space.of(bench, expanded(POSITIVE[:2], MACHINE))

    def runs(first, second):
        measured = first.measure(jr.objectives.RootMeanSquare(jr.sensors.Twist("end", "disc")))
        held = second.measure(jr.objectives.PeakValue(jr.sensors.Signal("damper", "torque"))) <= 1.0
        problem = pose(bench, space, [measured, held], False)
        made.clear()
        jax.eval_shape(problem.vector, jnp.zeros(2))
        return len(made)

    one = run()
    assert runs(one, one) == 1 and runs(one, run()) == 2


def test_the_slope_of_a_run_with_constraints():
    """Minimax of two levels, an equation and two bounds, through a run; in both modes, by differences."""
    one = run()
    torque = jr.sensors.Signal("damper", "torque")
    twist = jr.sensors.Twist("end", "disc")

    def levels(response):
        return jnp.stack(
            [jr.objectives.RootMeanSquare(s)(response) * w for s, w in ((twist, 100), (torque, 1))]
        )

    criteria = [
        one.measure(levels),
        one.measure(jr.objectives.PeakValue(torque)) <= 3.0,
        (one.measure(jr.objectives.Integral(twist, power=2)) + 1e-6 * PRODUCT) >= 1e-3,
        BALL.equal_to(2.0),
    ]
    bench = Instrumented(MACHINE, {})
    space = Space.of(bench, expanded(BOXED, MACHINE))
    layout = Layout((2, 1, 1, 1), ("<=", ">=", "=="))
    x = jnp.array([0.1, -0.2, 0.3, 1.1])
    told = []
    for reverse in (False, True):
        problem = pose(bench, space, criteria, reverse)
        terms = layout.begun([3.0, 1e-3, 2.0], problem.vector(x[:3]), 10.0)
        told.append(tell(problem, layout, x, terms))
        if not reverse:
            for k, d in enumerate(1e-4 * np.eye(4)):
                up, down = (tell(problem, layout, x + s * d, terms).merit for s in (1, -1))
                slope = (up - down) / 2e-4
                assert told[0].slope[k] == pytest.approx(float(slope), rel=1e-5, abs=1e-6)
    assert np.abs(told[0].slope).min() > 1e-3
    np.testing.assert_allclose(told[1].slope, told[0].slope, rtol=1e-8)


def test_a_run_by_an_adaptive_solver():
    """Forward mode on the way, reverse mode for the sensitivities: each with the adjoint that it needs."""
    level = run(solver=diffrax.Tsit5(), step=5e-4).measure(
        jr.objectives.RootMeanSquare(jr.sensors.Twist("end", "disc"))
    )

    def designed(inertia):
        start = MACHINE.set({"disc.polar_inertia": inertia})
        return jr.optimize(start, POSITIVE[1:2], level, iterations=40)

    found = designed(0.04)
    slope = float(found.sensitivities(["disc.polar_inertia"])["disc.polar_inertia"])
    ends = [designed(0.04 + h).objective for h in (1e-5, -1e-5)]
    assert found.converged and found.objective < found.objective_before
    assert slope == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-4)


# What goes wrong


def test_no_finite_start():
    nothing = judged(lambda a, b, c, p: jnp.log(a - 2.0))
    with pytest.raises(
        jr.ConvergenceError, match="no start gives finite numbers: `function` is nan"
    ):
        jr.optimize(MACHINE, POSITIVE[:1], nothing)
    # another start is fine, and the search stays among finite numbers
    edge = judged(lambda a, b, c, p: (a - 2.5) ** 2 - 0.1 * jnp.log(a - 2.0))
    found = jr.optimize(MACHINE, POSITIVE[:1], edge, starts=[{PATHS[0]: 5 * STIFFNESS}])
    want = minimize_scalar(
        lambda a: (a - 2.5) ** 2 - 0.1 * np.log(a - 2.0),
        bounds=(2.001, 5),
        options=dict(xatol=1e-10),
    )
    assert found.objective == pytest.approx(want.fun, abs=1e-9) and len(found.history) == 1
    assert np.isnan(found.objective_before)


def test_what_wants_to_be_nothing_or_endless():
    """The numbers stay finite, and those that are told are the machine's."""
    toward = (
        judged(lambda a, b, c, p: (a - 2) ** 2 + b),
        judged(lambda a, b, c, p: (a - 2) ** 2 - b),
    )
    for objective, low, high in zip(toward, (0.0, 1e6), (1e-6, np.inf)):
        found = jr.optimize(MACHINE, POSITIVE[:2], objective)
        assert low < found.values[PATHS[1]] < high
        assert found.values[PATHS[1]] == pytest.approx(
            float(found.machine.get(PATHS[1])), rel=1e-12
        )


def test_bounds_that_exclude_one_another():
    found = jr.optimize(MACHINE, POSITIVE[:2], BOWL, [LINE <= 1.0, LINE >= 2.0], iterations=60)
    assert not found.converged and found.found.violation > 0.1
    assert "bounds missed by" in str(found) and "ran out" in found.stopped
    assert found.to_dict()["converged"] is False


@pytest.mark.parametrize(
    "arguments, words",
    [
        (([], BOWL), "no parameter is looked for: name one at least"),
        ((["damper.mass"], BOWL), "mass"),
        ((["ring.mass"], BOWL), "`ring.mass`"),
        ((POSITIVE, 3.0), "must be made by an experiment's .* but is 3.0 .float."),
        ((POSITIVE, jr.objectives.TotalMass), "must be made by an experiment's .*TotalMass"),
        ((POSITIVE, BOWL, [BALL]), "a constraint is written `criterion <= limit`, but one is"),
        ((POSITIVE, BOWL, [True]), "a constraint is written `criterion <= limit`, but one is True"),
    ],
)
def test_wrong_arguments(arguments, words):
    with pytest.raises(jr.InputError, match=words):
        jr.optimize(MACHINE, *arguments)


@pytest.mark.parametrize(
    "options, words",
    [
        (dict(iterations=0), "iterations must be a whole number, 1 at least, but is 0"),
        (dict(iterations=2.5), "iterations must be a whole number, 1 at least, but is 2.5"),
        (dict(tolerance=2), "tolerance must be above 0 and below 1, but is 2"),
        (dict(starts=[{"damper.mass": 1.0}]), "damper.mass"),
        (dict(starts=[{PATHS[0]: -1.0}]), PATHS[0]),
    ],
)
def test_wrong_options(options, words):
    with pytest.raises(jr.InputError, match=words):
        jr.optimize(MACHINE, POSITIVE, BOWL, **options)


def test_wrong_limits_and_weights():
    for limit, words in (
        ("low", "one number in SI"),
        (np.nan, "finite"),
        (np.ones(2), "one number"),
    ):
        with pytest.raises(jr.InputError, match=f"a limit must be .*{words}"):
            BOWL <= limit  # noqa: B015
    with pytest.raises(jr.InputError, match="weighed by a finite number, but by inf"):
        np.inf * BOWL
    with pytest.raises(jr.InputError, match='over must be "worst" or "mean", but is "best"|best'):
        jr.optimization.NoRun().measure(jr.objectives.TotalMass(), "best")
    with pytest.raises(jr.InputError, match="machine must be a Machine, but is 'x'"):
        jr.optimize("x", POSITIVE, BOWL)
    with pytest.raises(jr.InputError, match="mass"):
        jr.optimize(
            MACHINE,
            POSITIVE,
            jr.optimization.NoRun(jr.Variations({"damper.mass": [1.0]})).measure(
                jr.objectives.TotalMass()
            ),
        )
