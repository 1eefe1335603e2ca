"""Torsion in its own right, orders of excitation, elements' signals as outputs, the map over support
stiffness: against NumPy with the matrices written by hand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import jaxrotor as jr

HELD = ("x", "y", "z", "psi", "theta")
# five discs in a row, kg m² and N m/rad
J = np.array([2.0, 1.0, 3.0, 1.5, 0.5])
K = np.array([4e4, 9e4, 2e4, 6e4])
C = np.array([3.0, 5.0, 2.0, 4.0])
REST = (1e5, 1e3, 1e3, 0.0)  # N/m, N m/rad: along, and about x, y and the shaft


def five_discs(**engine):
    line = {}
    for i, j in enumerate(J):
        line[f"disc {i}"] = jr.Rotor(1.0, j, j)
        if i < 4:
            line[f"shaft {i}"] = jr.Coupling([0] * 5 + [K[i]], [0] * 5 + [C[i]])
    attachments = {"engine": (jr.EngineTorque(**engine), "disc 0")} if engine else {}
    return jr.Machine.in_line(line, attachments, fixed={f"disc {i}": HELD for i in range(5)})


def chain(values):
    out = np.zeros((5, 5))
    for i, k in enumerate(values):
        out[i : i + 2, i : i + 2] += k * np.array([[1, -1], [-1, 1]])
    return out


def test_holzers_table():
    """Angles and torques of each mode: the torque in a shaft is the sum of all inertia torques to its
    left, and behind the last disc nothing is left."""
    machine = five_discs().set({f"shaft {i}.damping": np.zeros(6) for i in range(4)})
    squares, shapes = scipy.linalg.eigh(chain(K), np.diag(J))
    found = jr.torsional_modes(machine)
    assert [m.name for m in found] == [f"torsional {k}" for k in (1, 2, 3, 4)]
    for k, mode in enumerate(found):
        assert mode.frequency == pytest.approx(np.sqrt(squares[k + 1]), rel=1e-9)
        shape = shapes[:, k + 1] / shapes[np.argmax(np.abs(shapes[:, k + 1])), k + 1]
        np.testing.assert_allclose([*mode.angles.values()], shape, atol=1e-7)
        sums = -np.cumsum(mode.frequency**2 * J * shape)
        np.testing.assert_allclose(
            [*mode.torques.values()], sums[:-1], atol=1e-6 * np.abs(sums).max()
        )
        np.testing.assert_allclose(
            sum(mode.inertia_torques.values()), 0, atol=1e-6 * np.abs(sums).max()
        )
    words = jr.linear.holzer_table(found[0])
    assert "torsional 1" in words and "disc 4" in words and "shaft 3" in words


def test_torque_in_the_teeth():
    """A geared pair: the tooth force times the radius balances what is on either side (TOR-02's matrices)."""
    gears = {
        "motor": jr.Rotor(1.0, 0.3, 0.3),
        "s1": jr.Coupling([0] * 5 + [5e3]),
        "pinion": jr.Rotor(1.0, 0.02, 0.02),
        "mesh": jr.GearMesh((0.05, 0.1), jr.elements.KelvinVoigt(2e8)),
        "wheel": jr.Rotor(1.0, 0.2, 0.2),
        "s2": jr.Coupling([0] * 5 + [8e3]),
        "pump": jr.Rotor(1.0, 0.5, 0.5),
    }
    machine = jr.Machine.in_line(
        gears, fixed={n: HELD for n in ("motor", "pinion", "wheel", "pump")}
    )
    mode = jr.torsional_modes(machine, 100.0)[0]
    torque = {k: v.real for k, v in mode.inertia_torques.items()}
    arm = 0.05 * np.cos(0.3490658503988659)
    left = torque["motor"] + torque["pinion"]
    assert abs(left) > 1.0
    force = mode.tooth_forces["mesh"].real
    assert force * arm == pytest.approx(left, rel=1e-6)
    right = torque["wheel"] + torque["pump"]
    assert force * 2 * arm == pytest.approx(right, rel=1e-6)
    # the table has N·m under N·m: upon the pinion, whose inertia and the motor's ask for it
    assert mode.torques["mesh"].real == pytest.approx(left, rel=1e-6)
    words = next(w for w in jr.linear.holzer_table(mode).splitlines() if w.startswith("mesh"))
    assert [float(x) for x in words.split()[1:]] == pytest.approx([left, force], rel=1e-5)
    within = 0.4 * mode.frequency, 0.6 * mode.frequency
    met = [
        jr.linear.interferences(machine, (2,), within, 1, shaft=shaft)[0]
        for shaft in (None, "pump")
    ]
    # two turns of the pump's own shaft a period, at half of the frequency of its own speed
    assert [m.speed for m in met] == pytest.approx([mode.frequency / 2] * 2, rel=1e-6)
    with pytest.raises(jr.InputError, match="shaft: there is no station `pupm`"):
        jr.linear.interferences(machine, (2,), (1.0, 2.0), shaft="pupm")


def test_forced_torsional_vibration():
    """A harmonic torque at the first disc: torque in every shaft, 1e-10."""
    w = np.array([40.0, 130.0, 300.0])
    outputs = [f"shaft {i}.torque" for i in range(4)]
    found = jr.frequency_response(five_discs(), "disc 0.phi", outputs, w)
    assert found.units == ("N*m",) * 4
    for k, wk in enumerate(w):
        D = chain(K) + 1j * wk * chain(C) - wk**2 * np.diag(J)
        angles = np.linalg.solve(D, [1, 0, 0, 0, 0])
        expected = (K + 1j * wk * C) * np.diff(angles)
        np.testing.assert_allclose(found.values[k, :, 0], expected, rtol=1e-9)


def test_engine_orders():
    """Each harmonic of the engine at its own frequency, with its phase; the mean torque does not vibrate."""
    orders, amplitudes, phases = [0.5, 1.5, 4.0], [30.0, 80.0, 20.0], [0.3, -1.0, 2.0]
    machine = five_discs(mean=100.0, orders=orders, amplitudes=amplitudes, phases=phases)
    speeds = np.array([60.0, 110.0])
    asked = (1.5, 4.0, 2.0)
    found = jr.order_response(
        machine, ["shaft 1.torque", "disc 4.phi"], speeds, asked, at="undeformed"
    )
    for s, speed in enumerate(speeds):
        for k, order in enumerate(asked):
            w = order * speed
            torque = 0.0
            if order in orders:
                i = orders.index(order)
                torque = amplitudes[i] * np.exp(1j * phases[i])
            D = chain(K) + 1j * w * chain(C) - w**2 * np.diag(J)
            angles = np.linalg.solve(D, [torque, 0, 0, 0, 0])
            expected = [(K[1] + 1j * w * C[1]) * (angles[2] - angles[1]), angles[4]]
            np.testing.assert_allclose(found.values[s, k], expected, rtol=1e-8, atol=1e-10)
    phi = np.linspace(0, 4 * np.pi, 20001)
    wave = sum(
        (found.values[0, k, 0] * np.exp(1j * order * phi)).real for k, order in enumerate(asked)
    )
    assert float(found.peak[0, 0]) == pytest.approx(np.abs(wave).max(), rel=1e-4)
    with pytest.raises(jr.InputError, match="multiples of one half, positive, but one is 0.3"):
        jr.order_response(machine, "disc 4.phi", speeds, (0.3,))


def test_an_engines_pulses_are_no_spring():
    """Its torque depends on the angle, but the linear machine has the mean of it."""
    machine = five_discs(mean=0.0, orders=[2.0], amplitudes=[1e4])
    plain = jr.linearize(five_discs(), 50.0, at="undeformed")
    np.testing.assert_allclose(jr.linearize(machine, 50.0, at="undeformed").K, plain.K, atol=1e-9)


def jeffcott(k=1e5, c=30.0, m=2.0, e=1e-5, **options):
    """Free to turn, held along and against tilting by springs: static unbalance moves it in x and y."""
    support = jr.LinearSupport([k, k, *REST], [c, c, 1.0, 1.0, 1.0, 0.0])
    disc = jr.Rotor(m, 0.02, 0.012, unbalance=jr.Unbalance(e, 0.5))
    return jr.Machine.in_line({"d": disc}, attachments={"bearing": (support, "d")}, **options)


def test_force_on_the_bearing():
    """What the support exerts, -(k + i w c) x, in N, and its exact derivative by the stiffness."""
    w, k, c, m, e = 150.0, 1e5, 30.0, 2.0, 1e-5
    found = jr.unbalance_response(jeffcott(), ["d.x", "bearing.force.x", "bearing.force.y"], [w])
    x = m * e * w**2 * np.exp(0.5j) / (k - m * w**2 + 1j * w * c)
    expected = [x, -(k + 1j * w * c) * x, 1j * (k + 1j * w * c) * x]
    np.testing.assert_allclose(found.values[0], expected, rtol=1e-9)
    assert found.units == ("m", "N", "N")

    def force(k, at="equilibrium"):
        machine = jeffcott().set({"bearing.stiffness": jnp.array([k, k, *REST])})
        return jr.unbalance_response(machine, "bearing.force.x", [w], at=at).magnitude[0, 0]

    def by_hand(k):
        return abs((k + 1j * w * c) * m * e * w**2 / (k - m * w**2 + 1j * w * c))

    h = 1e-4 * k
    slope = (by_hand(k + h) - by_hand(k - h)) / (2 * h)
    assert float(jax.jit(jax.grad(force))(k)) == pytest.approx(slope, rel=1e-6)
    # reverse mode has been forwards through the rest, which is where it is undeformed
    ahead = jax.jit(lambda k: jax.jvp(lambda k: force(k, "undeformed"), (k,), (1.0,))[1])
    forward = ahead(k)
    assert float(forward) == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize(
    "output, words",
    [
        ("bearing.torque", "`bearing` offers no such quantity: take one of bearing.force.x"),
        ("bearing.force.w", "`bearing.force.w`: no such coordinate"),
        ("disc.x", "no such coordinate: write station.coordinate with one of the stations d"),
        ("d.z", "z of `d` is held"),
    ],
)
def test_outputs_that_do_not_exist(output, words):
    with pytest.raises(jr.InputError, match=words):
        jr.unbalance_response(jeffcott(fixed={"d": ("z",)}), output, [100.0])


def test_unbalance_behind_a_gear():
    """The wheel's unbalance answers at the wheel's own speed, half the pinion's and backwards."""
    support = jr.LinearSupport([1e6, 1e6, 1e6, 1e3, 1e3, 0], [50, 50, 50, 1, 1, 0])
    machine = jr.Machine(
        {
            "pinion": jr.Rotor(1.0, 0.002, 0.0015, unbalance=jr.Unbalance(4e-5)),
            "mesh": jr.GearMesh((0.05, 0.1), jr.elements.KelvinVoigt(1e7)),
            "wheel": jr.Rotor(3.0, 0.02, 0.0125, unbalance=jr.Unbalance(1e-5, 0.8)),
            "b1": support,
            "b2": support,
        },
        {"mesh": ("pinion", "wheel"), "b1": "pinion", "b2": "wheel"},
    )
    speed = 200.0
    inputs = ["wheel.x", "wheel.y"]
    H = jr.frequency_response(machine, inputs, ["wheel.x", "pinion.y"], [100.0], speed).values[0]
    force = 3.0 * 1e-5 * 100.0**2 * np.exp(0.8j) * np.array([1.0, -1j])
    found = jr.unbalance_response(machine, ["wheel.x", "pinion.y"], [speed], shaft="wheel").values[
        0
    ]
    np.testing.assert_allclose(found, np.conj(H) @ force, rtol=1e-8)
    H = jr.frequency_response(machine, ["pinion.x", "pinion.y"], ["wheel.x"], [speed], speed).values
    force = 4e-5 * speed**2 * np.array([1.0, -1j])
    found = jr.unbalance_response(machine, "wheel.x", [speed]).values[0]
    np.testing.assert_allclose(found, H[0] @ force, rtol=1e-8)
    # whirl is told by the own spin of each shaft
    names = {m.name: m for m in jr.modes(jr.linearize(machine, 2000.0, at="undeformed"))}
    wheel = [
        i for i, (s, c) in enumerate(jr.linearize(machine, 2000.0).coordinates) if s == "wheel"
    ]
    spins = jr.linearize(machine, 2000.0, at="undeformed").spins
    np.testing.assert_allclose(spins[np.array(wheel)], -1000.0)
    assert "1 forward" in names and "1 backward" in names


def test_map_over_support_stiffness():
    """Each point of the map is a critical speed of the machine with such supports; stiff ones pin it."""
    steel = jr.Material(2.11e11, 8.1e10, 7810.0)

    def machine(k, **options):
        support = jr.LinearSupport([k, 2 * k, 0, 0, 0, 0], [500.0, 500.0, 0, 0, 0, 0])
        return jr.Machine.in_line(
            {
                "left": jr.Node(),
                "shaft 1": jr.FiniteElementShaft(0.5, 0.05, material=steel, elements=1),
                "disc": jr.Rotor(30.0, 0.33, 0.178),
                "shaft 2": jr.FiniteElementShaft(0.8, 0.05, material=steel, elements=2),
                "right": jr.Node(),
            },
            attachments={"b1": (support, "left"), "b2": (support, "right")} if k else None,
            fixed={"left": ("z",)} | options,
        )

    stiffness = np.array([1e5, 3e7])
    found = jr.linear.critical_speed_map(machine(1e6), stiffness, count=3)
    assert found.supports == ("b1", "b2")
    np.testing.assert_allclose(found.actual["b1"][2], 2e6)
    for k, speeds in zip(stiffness, found.speeds):
        alike = machine(1e6).set(
            {f"{b}.stiffness": np.array([k, k, 0, 0, 0, 0]) for b in ("b1", "b2")}
            | {f"{b}.damping": np.zeros(6) for b in ("b1", "b2")}
        )
        known = np.asarray(jr.critical_speeds(alike))
        for speed in speeds:
            assert np.min(np.abs(known - speed)) < 1e-7 * speed
            near = jr.modes(jr.linearize(alike, speed, at="undeformed"))
            mode = min(near, key=lambda m: abs(m.frequency - speed) + 1e9 * (m.whirl <= 0))
            assert mode.whirl > 0.99 and mode.frequency == pytest.approx(speed, rel=1e-7)
    pinned = jr.linear.critical_speed_map(machine(1e6), [1e13], count=1).speeds[0, 0]
    held = machine(0, left=("x", "y", "z"), right=("x", "y"))
    assert pinned == pytest.approx(float(jr.critical_speeds(held)[1]), rel=1e-5)
    with pytest.raises(jr.InputError, match="stiffness must be finite and above 0, but holds 0"):
        jr.linear.critical_speed_map(machine(1e6), [0.0])
    with pytest.raises(jr.InputError, match="supports: .*disc"):
        jr.linear.critical_speed_map(machine(1e6), [1e6], supports=("disc",))


def test_interferences():
    """Orders that meet torsional frequencies, and how far from the speeds of operation."""
    machine = five_discs()
    first = jr.torsional_modes(machine)[0].frequency
    found = jr.linear.interferences(machine, (1, 2), (0.4 * first, 0.48 * first), count=1)
    assert [f.order for f in found] == [2.0, 1.0]
    assert found[0].speed == pytest.approx(first / 2)
    assert found[0].separation == pytest.approx(0.5 / 0.48 - 1)
    assert found[1].separation == pytest.approx(1 / 0.48 - 1)
    with pytest.raises(
        jr.InputError, match="speeds must be a rising list of 2 numbers at least in rad/s"
    ):
        jr.linear.interferences(machine, (1,), (200.0, 100.0))
    pinned = jr.Machine.in_line({"d": jr.Rotor(1.0, 1.0, 1.0)}, fixed={"d": ("phi",)})
    with pytest.raises(jr.InputError, match="nothing can twist in this machine"):
        jr.linear.torsional(jr.linearize(pinned, 0.0))


def test_the_lowest_modes_of_many():
    """Shift and invert against all eigenvalues, on a shaft of 40 elements with rigid-body motions free."""
    machine = jr.Machine.in_line(
        {
            "a": jr.Node(),
            "shaft": jr.FiniteElementShaft(1.5, 0.05, elements=40, rayleigh=(2.0, 1e-6)),
            "b": jr.Rotor(20.0, 0.2, 0.12),
        },
        attachments={
            "s": (jr.LinearSupport([1e6, 2e6, 0, 0, 0, 0]), "a"),
            "s2": (jr.LinearSupport([3e6, 2e6, 0, 0, 0, 0]), "b"),
        },
    )
    model = jr.linearize(machine, 300.0, at="undeformed")
    values = np.linalg.eigvals(np.asarray(model.A))
    values = values[values.imag > 1e-3]
    expected = values[np.argsort(np.abs(values))][:10]
    found = jr.modes(model, 10)
    # the dense solver itself is right to 1e-6 rad/s only, beside eigenvalues of 1e7
    np.testing.assert_allclose([m.eigenvalue for m in found], expected, rtol=2e-8, atol=1e-6)
    for mode in found[:4]:
        residual = (
            mode.eigenvalue**2 * model.M + mode.eigenvalue * (model.C + model.G) + model.K
        ) @ mode.shape
        assert np.linalg.norm(residual) < 1e-9 * np.linalg.norm(model.K, 2) * np.linalg.norm(
            mode.shape
        )


def test_peak_of_the_unbalance_response():
    """Jeffcott: at w0/sqrt(1 - 2 zeta²), e/(2 zeta sqrt(1 - zeta²)) high; derivatives by k, c and e."""
    k, c, m, e = 1e5, 30.0, 2.0, 1e-5

    def by_hand(p):
        w0, zeta = np.sqrt(p[0] / m), p[1] / (2 * np.sqrt(p[0] * m))
        return np.array([w0 / np.sqrt(1 - 2 * zeta**2), p[2] / (2 * zeta * np.sqrt(1 - zeta**2))])

    def found(p):
        machine = jeffcott().set(
            {
                "bearing.stiffness": jnp.array([p[0], p[0], *REST]),
                "bearing.damping": jnp.array([p[1], p[1], 1.0, 1.0, 1.0, 0.0]),
                "d.unbalance.eccentricity": p[2],
            }
        )
        return jnp.stack(
            jr.linear.unbalance_peak(machine, "d.y", 100.0, 400.0, 31, at="undeformed")
        )

    p = np.array([k, c, e])
    forward, value = jax.jit(jax.jacfwd(lambda p: (found(p),) * 2, has_aux=True))(p)
    np.testing.assert_allclose(value, by_hand(p), rtol=1e-9)
    expected = np.stack(
        [
            (by_hand(p * (1 + h)) - by_hand(p * (1 - h))) / 2e-5 / p[i]
            for i, h in enumerate(1e-5 * np.eye(3))
        ],
        axis=1,
    )
    size = np.abs(expected * p).max(axis=1, keepdims=True)
    for slopes in (forward, jax.jit(jax.jacrev(found))(p)):
        np.testing.assert_allclose(slopes * p / size, expected * p / size, atol=1e-7)
    with pytest.raises(jr.InputError, match="`d.y` has no peak between 10 and 100 rad/s"):
        jr.linear.unbalance_peak(jeffcott(), "d.y", 10.0, 100.0, 5)
