"""Machines from ROSS 2.3: natural frequencies at five speeds and unbalance response of three of its own
example rotors, both programs given one description; what cannot be carried is refused."""

import warnings

import equinox as eqx
import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.interop.ross import from_ross

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # ROSS looks for fluid libraries that it does without
    ross = pytest.importorskip("ross", reason="the extra `interop` is not installed")

SPEEDS = [0.0, 60.0, 200.0, 500.0, 1000.0]
# rotor, (node of the unbalance, kg m, rad), nodes observed
ROTORS = {
    "rotor_example_with_damping": ((12, 3e-5, -1.1), (4, 12, 20)),
    "coaxrotor_example": ((13, 1e-4, 2.0), (1, 13, 18)),
    "compressor_example": ((26, 1e-4, 0.7), (7, 26, 48)),
}


@pytest.fixture(scope="module", params=ROTORS)
def rotor(request):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the compressor's file is of an older version
        return request.param, getattr(ross, request.param)()


@pytest.fixture(scope="module")
def machine(rotor):
    name, theirs = rotor
    # tables are taken at the speeds compared, since the programs interpolate differently
    speeds = SPEEDS if name == "compressor_example" else None
    return from_ross(theirs, unbalance=[ROTORS[name][0]], table_speeds=speeds)


def lowest(values, count=12):
    values = values[values.imag > 1.0]
    return values[np.argsort(np.abs(values))][:count]


def test_natural_frequencies(rotor, machine):
    """The twelve lowest at each of five speeds: frequency to 1e-6, decay to 1e-6 of the frequency."""
    for speed in SPEEDS:
        mine = lowest(np.asarray(jr.linearize(machine, speed, at="undeformed").eigenvalues))
        theirs = lowest(np.linalg.eigvals(rotor[1].A(speed)))
        assert len(mine) == 12
        # whirl in two planes at rest has one frequency twice: the order within is free
        gap = np.min(np.abs(mine[:, None] - theirs[None]), axis=1) / np.abs(mine)
        assert np.all(gap < 1e-6), (speed, gap)
        gap = np.min(np.abs(mine[:, None] - theirs[None]), axis=0) / np.abs(theirs)
        assert np.all(gap < 1e-6), (speed, gap)


@pytest.mark.filterwarnings("ignore:Extrapolating")  # both take its tables there
def test_unbalance_response(rotor, machine):
    """Magnitude and phase along x and y, 1e-5."""
    name, theirs = rotor
    (node, magnitude, phase), nodes = ROTORS[name]
    speeds = np.array(SPEEDS[1:])
    outputs = [f"node {n}.{c}" for n in nodes for c in "xy"]
    mine = np.asarray(jr.unbalance_response(machine, outputs, speeds, at="undeformed").values)
    found = theirs.run_unbalance_response(node, magnitude, phase, frequency=speeds).forced_resp
    last = len(theirs.nodes) - 1
    for k, n in enumerate(nodes):
        first = 6 * n if n <= last else 6 * (last + 1) + 3 * (n - last - 1)
        expected = found[first : first + 2].T
        assert np.all(np.abs(expected) > 0)
        np.testing.assert_allclose(mine[:, 2 * k : 2 * k + 2] / expected, 1.0, rtol=0, atol=1e-5)


def test_log_decrement_of_level_two(rotor, machine):
    """Of the lowest mode that does not whirl backward, with all seals: as its report of the standards takes
    it. Modes damped by half of the critical and more are not what a rotor becomes unstable in, and
    are passed over."""
    name, theirs = rotor
    if name != "compressor_example":
        pytest.skip("one with seals")
    modal = theirs.run_modal(speed=500.0)
    light = (modal.whirl_direction() != "Backward") & (modal.damping_ratio < 0.5)
    expected = modal.log_dec[light][0]
    (found,) = jr.standards.level_two(machine, 500.0, at="undeformed").findings
    assert float(found.value) == pytest.approx(expected, rel=1e-5)


def example(**options):
    """ROSS's own rotor_example with other options of one shaft element, disk or bearing."""
    steel = ross.Material("steel", rho=7810, E=211e9, G_s=81.2e9)
    shaft = dict(L=0.25, idl=0.0, odl=0.05, material=steel) | options.get("shaft", {})
    elements = [ross.ShaftElement(**shaft) for _ in range(3)]
    disk = ross.DiskElement(1, 30.0, 0.2, 0.3) if "disk" not in options else options["disk"]
    bearing = dict(kxx=1e6, cxx=100.0) | options.get("bearing", {})
    return ross.Rotor(
        elements,
        [disk],
        [ross.BearingElement(n, **bearing) for n in (0, 3)],
        **options.get("rotor", {}),
    )


@pytest.mark.parametrize(
    "options, words",
    [
        (dict(shaft=dict(gyroscopic=False)), "gyroscopic moments go with rotary inertia"),
        (dict(shaft=dict(shear_method_calc="hutchinson")), "must be Cowper's, but is hutchinson's"),
        (dict(shaft=dict(axial_force=10.0)), "axial_force and torque within a shaft"),
        (dict(shaft=dict(idl=0.01, idr=0.02)), "a bore that tapers"),
        (dict(bearing=dict(mxx=3.0)), "mass coefficients of a bearing"),
    ],
)
def test_what_cannot_be_carried_is_refused(options, words):
    with pytest.raises(jr.InputError, match=words):
        from_ross(example(**options))


def test_a_refusal_for_each_kind():
    """Three elements with the same two faults: two sentences."""
    with pytest.raises(jr.InputError) as error:
        from_ross(example(shaft=dict(axial_force=10.0, gyroscopic=False)))
    assert len(error.value.problems) == 2
    assert all(p.count("`") == 6 for p in error.value.problems)


def test_a_coupling_and_a_bearing_tagged_as_a_station():
    """Natural frequencies of two shafts with a coupling between, both programs, at rest and at speed."""
    steel = ross.Material("steel", rho=7810, E=211e9, G_s=81.2e9)

    def shaft():
        return ross.ShaftElement(L=0.25, idl=0.0, odl=0.05, material=steel)

    # the tilt and axial stiffnesses of a flexible one
    coupling = ross.CouplingElement(
        4.0, 5.0, 0.02, 0.03, kt_x=4e7, kt_y=4e7, kt_z=1e7, kr_x=2e4, kr_y=2e4, kr_z=1e5, cr_z=3.0
    )
    bearings = [ross.BearingElement(n, kxx=1e6, cxx=100.0, tag=f"node {n}") for n in (0, 2, 3, 5)]
    theirs = ross.Rotor(
        [shaft(), shaft(), coupling, shaft(), shaft()],
        [ross.DiskElement(1, 30.0, 0.2, 0.3)],
        bearings,
    )
    machine = from_ross(theirs)
    assert "node 0 (2)" in machine.connections()
    for speed in (0.0, 300.0):
        mine = lowest(np.asarray(jr.linearize(machine, speed, at="undeformed").eigenvalues))
        values = np.linalg.eigvals(theirs.A(speed))
        gap = np.min(np.abs(mine[:, None] - values[None]), axis=1) / np.abs(mine)
        assert len(mine) == 12 and np.all(gap < 1e-6), gap


def test_a_table_under_a_pedestal_goes_by_the_rotors_speed():
    """The pedestal does not turn: eigenvalues at the points of its table."""
    steel = ross.Material("steel", rho=7810, E=211e9, G_s=81.2e9)
    speeds, k = np.array([0.0, 150.0, 400.0]), np.array([1e6, 3e6, 9e6])
    table = ross.BearingElement(4, kxx=k, cxx=0 * k + 100.0, frequency=speeds)
    theirs = ross.Rotor(
        [ross.ShaftElement(L=0.25, idl=0.0, odl=0.05, material=steel) for _ in range(3)],
        [ross.DiskElement(1, 30.0, 0.2, 0.3)],
        [
            ross.BearingElement(0, kxx=1e6, cxx=100.0),
            ross.BearingElement(3, kxx=2e6, cxx=10.0, n_link=4),
            table,
        ],
        [ross.PointMass(4, 8.0)],
    )
    machine = from_ross(theirs)
    for speed in speeds[1:]:
        mine = lowest(np.asarray(jr.linearize(machine, speed, at="undeformed").eigenvalues))
        values = np.linalg.eigvals(theirs.A(speed))
        gap = np.min(np.abs(mine[:, None] - values[None]), axis=1) / np.abs(mine)
        assert np.all(gap < 1e-5), gap


def test_tables_over_speed_as_ross_3_has_them():
    """A bearing that answers `K(frequency, speed)`: taken at the speed; over both it is refused."""

    class Later(ross.BearingElement):
        speed = np.array([100.0, 300.0])

        def K(self, frequency, speed=None):
            return super().K(0.0) * (1 + speed / 100.0)

        def C(self, frequency, speed=None):
            return super().C(0.0)

    theirs = example()
    theirs.bearing_elements[0] = Later(0, kxx=1e6, cxx=100.0)
    table = from_ross(theirs)[str(theirs.bearing_elements[0].tag or "bearing")]
    np.testing.assert_allclose(table.speeds, [100.0, 300.0])
    np.testing.assert_allclose(table.stiffness[:, 0, 0], [2e6, 4e6])
    theirs.bearing_elements[0].frequency = np.array([0.0, 1.0])
    with pytest.raises(jr.InputError, match="a table over both frequency and speed"):
        from_ross(theirs)


def test_unbalance_needs_a_disk_and_a_rotor_is_a_rotor():
    with pytest.raises(
        jr.InputError, match="node 2`: there is no disk to carry it: put it at one of 1"
    ):
        from_ross(example(), unbalance=[(2, 1e-4, 0.0)])
    with pytest.raises(
        jr.InputError, match="takes a ross.Rotor or ross.CoAxialRotor, but .* a str"
    ):
        from_ross("rotor.toml")


def test_a_tapered_shaft_bends_alike():
    """Lateral modes of tapered elements agree; torsion differs, for ROSS takes the mean of the ends."""
    theirs = example(shaft=dict(odl=0.05, odr=0.04))
    machine = from_ross(theirs)
    found = jr.modes(jr.linearize(machine, 100.0, at="undeformed"), 8)
    expected = lowest(np.linalg.eigvals(theirs.A(100.0)), 40)
    lateral = [m for m in found if m.kind == "lateral"]
    assert len(lateral) >= 4
    for mode in lateral:
        assert np.min(np.abs(expected - mode.eigenvalue)) < 1e-6 * abs(mode.eigenvalue)


def test_it_runs_in_time():
    """With a drive the carried machine starts up, and its disk whirls with the shaft."""
    ramp = {"node 0": {"phi": jr.CosineRamp(speed=50.0, duration=0.2)}}
    machine = from_ross(example(), [(1, 1e-3, 0.0)], fixed={"node 0": ("z",)}, prescribed=ramp)
    run = jr.simulate(machine, 0.3, 1000.0)
    assert float(run["node 3"].speed[-1]) == pytest.approx(50.0, rel=1e-3)
    assert np.hypot(run["node 1"].x, run["node 1"].y).max() > 1e-7


# Magnetic bearings

W_AMB = [20.0, 60.0, 150.0, 400.0, 1000.0, 3000.0]


def levitated(bearing=None, extra=(), **options):
    """A shaft of two pieces with a disk between two magnetic bearings, or what `bearing` makes instead."""
    steel = ross.Material("steel", rho=7810, E=211e9, G_s=81.2e9)
    shaft = [ross.ShaftElement(L=0.15, idl=0.0, odl=0.03, material=steel) for _ in range(2)]
    given = dict(g0=5e-4, i0=1.5, ag=2e-4, nw=200, alpha=0.39269908, frequency=W_AMB) | options
    make = bearing or (lambda n: ross.MagneticBearingElement(n=n, tag=f"amb {n}", **given))
    parts = [*map(make, (0, 2)), *extra]
    return ross.Rotor(shaft, [ross.DiskElement(1, 6.0, 0.02, 0.012)], parts)


# ROSS makes them with NumPy's old matrices
old_matrices = pytest.mark.filterwarnings("ignore:the matrix subclass:PendingDeprecationWarning")


@old_matrices
@pytest.mark.parametrize(
    "options",
    [
        dict(kp_pid=9000.0, kd_pid=20.0, ki_pid=1000.0, n_f=2e4, k_amp=1.2, k_sense=0.9),
        dict(kd_pid=20.0, ki_pid=3e5, sensors_axis_rotation=0.3),
        dict(controller_transfer_function=([2e3, 2e7, 1e11], [1.0, 3e4, 1e7])),
    ],
    ids=["pid", "without kp", "polynomials"],
)
def test_a_magnetic_bearing(options):
    """Its own coefficients at each frequency (as computed; the spline through them is off by up to 2 %, where
    points are few), and the receptance of its rotor with those."""
    options = dict(options)
    if "controller_transfer_function" in options:
        control = pytest.importorskip("control")
        rows = options["controller_transfer_function"]
        options["controller_transfer_function"] = control.TransferFunction(*rows)
    theirs = levitated(**options)
    machine, one = from_ross(theirs), theirs.bearing_elements[0]
    speed, inputs = 200.0, ["node 0.x", "node 1.y"]
    outputs = ["node 0.x", "node 0.y", "node 1.x", "node 1.y"]
    got = jr.frequency_response(
        machine, inputs, outputs, W_AMB, speed=speed, at="undeformed"
    ).values
    for k, w in enumerate(W_AMB):
        own = {
            f"{a}{b}{c}": float(getattr(one, f"{a}{b}{c}")[k])
            for a in "kc"
            for b in "xy"
            for c in "xy"
        }
        alike = levitated(lambda n, own=own: ross.BearingElement(n, **own))
        damping = alike.C(w) + speed * alike.G()
        stiffness = -w * w * alike.M(w) + 1j * w * damping + alike.K(w)
        want = np.linalg.inv(stiffness)[np.ix_([0, 1, 6, 7], [0, 7])]
        np.testing.assert_allclose(got[k], want, rtol=1e-6, atol=1e-8 * np.abs(want).max())


@old_matrices
def test_sensitivity_of_a_magnetic_bearing():
    """As ROSS computes it, in time, with two mistakes: in `compute_pid_amb` the magnets' stiffness has the
    sign of a spring, and acts on the disturbance too. Put into a machine (the stiffness, with the other sign,
    into the controller's gain) they give ROSS's signal; the machine itself is right in all other tests."""
    signal = pytest.importorskip("scipy.signal")
    from jaxrotor.linear.loops import opened

    options = dict(g0=1e-3, i0=1.0, ag=1e-4, kp_pid=1600.0, n_f=1e4)
    dampers = [ross.BearingElement(n, kxx=1e-3, cxx=120.0, tag=f"damper {n}") for n in (0, 2)]
    theirs = levitated(extra=dampers, **options)
    found = theirs.run_amb_sensitivity(
        speed=100.0, t_max=0.25, dt=5e-5, disturbance_amplitude=1e-3, amb_tags=["amb 0"],
        disturbance_min_frequency=2.0, disturbance_max_frequency=200.0, verbose=0,
    ).sensitivity_run_time_results  # fmt: skip
    machine = from_ross(theirs)
    for name in ("amb 0", "amb 2"):
        magnet = machine[name].magnet.linearised()
        gain = machine[name].controller.proportional
        gain = gain + magnet.displacement_stiffness / magnet.current_stiffness
        machine = machine.set({f"{name}.controller.proportional": gain})
        passive = jr.elements.LinearMagnet(magnet.current_stiffness, 0.0)
        machine = eqx.tree_at(lambda m, name=name: m[name].magnet, machine, passive)
    loops = opened(machine, ("amb 0",), 100.0, "undeformed")
    row, column = np.asarray(loops.C)[:1], np.asarray(loops.E)[:, :1]
    added, want = (found["amb 0"]["x"][f"{k}_signal"] for k in ("excitation", "sensor"))
    _, got, _ = signal.lsim((np.asarray(loops.A), column, row, [[0.0]]), added, found["t"])
    # its force is that of the step before
    assert np.abs(got - want).max() < 0.01 * np.abs(want).max()
