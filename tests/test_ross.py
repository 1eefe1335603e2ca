"""Machines from ROSS 2.3: natural frequencies at five speeds and unbalance response of three of its own
example rotors, both programs given one description; what cannot be carried is refused."""

import warnings

import equinox as eqx
import jax
import numpy as np
import pytest

import jaxrotor as jr
from jaxrotor.interop.ross import from_ross

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # ROSS looks for fluid libraries that it does without
    ross = pytest.importorskip("ross", reason="the extra `interop` is not installed")

LATER = int(ross.__version__.partition(".")[0]) > 2
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
        example = getattr(ross, request.param, None)
        if example is None:
            pytest.skip("not in this version of ROSS")
        return request.param, example()


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
    found = theirs.run_unbalance_response(node, magnitude, phase, speeds).forced_resp
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
        (dict(shaft=dict(shear_method_calc="hutchinson")), "must be Cowper's, but is hutchinson's"),
    ],
)
def test_what_cannot_be_carried_is_refused(options, words):
    with pytest.raises(jr.InputError, match=words):
        from_ross(example(**options))


def test_a_refusal_for_each_kind():
    """Three elements with one fault, and another: two sentences."""
    with pytest.raises(jr.InputError) as error:
        from_ross(example(shaft=dict(shear_method_calc="hutchinson")), [(9, 1e-4, 0.0)])
    assert len(error.value.problems) == 2
    assert [p.count("`") for p in error.value.problems] == [2, 6]


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
    """A bearing that answers `K(frequency, speed)`: taken at the speed; over both each by itself."""
    if LATER:
        k = 1e6 * np.array([[2.0, 2.02], [4.0, 4.02]])  # speed, frequency
        given = dict(kxx=k, cxx=0 * k, frequency=[0.0, 1.0], speed=[100.0, 300.0])
        table = from_ross(example(bearing=given))["Bearing 0"]
        np.testing.assert_allclose(table.stiffness[:, :, 0, 0], k)
        return

    class Later(ross.BearingElement):
        speed = np.array([100.0, 300.0])

        def K(self, frequency, speed=None):
            return super().K(0.0) * (1 + speed / 100.0 + frequency / 50.0 * (frequency != speed))

        def C(self, frequency, speed=None):
            return super().C(0.0)

    theirs = example()
    theirs.bearing_elements[0] = Later(0, kxx=1e6, cxx=100.0)
    table = from_ross(theirs)[str(theirs.bearing_elements[0].tag or "bearing")]
    np.testing.assert_allclose(table.speeds, [100.0, 300.0])
    np.testing.assert_allclose(table.stiffness[:, 0, 0], [2e6, 4e6])
    theirs.bearing_elements[0].frequency = np.array([0.0, 1.0])
    table = from_ross(theirs)[str(theirs.bearing_elements[0].tag or "bearing")]
    np.testing.assert_allclose(table.frequencies, [0.0, 1.0])
    np.testing.assert_allclose(table.stiffness[:, :, 0, 0], [[2e6, 2.02e6], [4e6, 4.02e6]])


def test_inertia_of_all_kinds_and_unbalance_where_there_is_no_disk():
    """Mass coefficients, symmetric, skew and over speed, and a mass that differs by direction: eigenvalues of
    both programs; the response to unbalance at a node without a disk."""
    steel = ross.Material("steel", rho=7810, E=211e9, G_s=81.2e9)
    over = dict(kxx=[1e6, 2e6, 3e6], cxx=[50.0] * 3, mxx=[2.0, 3.0, 5.0], frequency=SPEEDS[:3])
    theirs = ross.Rotor(
        [ross.ShaftElement(L=0.25, idl=0.0, odl=0.05, material=steel) for _ in range(4)],
        [ross.DiskElement(1, 30.0, 0.2, 0.3)],
        [
            ross.BearingElement(0, kxx=1e6, cxx=100.0, mxx=3.0, myy=5.0, mxy=0.5, myx=0.5),
            ross.SealElement(2, kxx=1e4, cxx=100.0, mxx=3.0, mxy=0.5, myx=-0.5),
            ross.BearingElement(3, **over),
            ross.BearingElement(4, kxx=2e6, cxx=10.0, n_link=5),
            ross.BearingElement(5, kxx=1e7, kyy=2e7, cxx=100.0),
        ],
        [ross.PointMass(5, mx=8.0, my=4.0, mz=6.0)],
    )
    # a small one: what unbalance does to the turning, and that back, is of its square, and not in ROSS
    machine = from_ross(theirs, unbalance=[(2, 1e-6, 0.3)])
    for speed in SPEEDS[:3]:
        mine = lowest(np.asarray(jr.linearize(machine, speed, at="undeformed").eigenvalues))
        gap = np.min(np.abs(mine[:, None] - np.linalg.eigvals(theirs.A(speed))), axis=1)
        assert len(mine) == 12 and np.all(gap < 1e-8 * np.abs(mine)), gap
    speeds = np.array(SPEEDS[1:3])
    found = jr.unbalance_response(machine, ["node 1.x", "node 2.y"], speeds, at="undeformed").values
    expected = theirs.run_unbalance_response(2, 1e-6, 0.3, speeds).forced_resp[[6, 13]].T
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_gears_and_a_shaft_between_two_others():
    """Eigenvalues of three shafts with two meshes; what a GearMesh does not have is refused."""
    steel = ross.Material("steel", rho=7810, E=211e9, G_s=81.2e9)

    def line(teeth, helix=0.0):
        gear = ross.GearElement(
            2,
            5.0,
            0.02,
            0.04,
            teeth,
            pitch_diameter=0.004 * teeth,
            pr_angle=0.35,
            helix_angle=helix,
        )
        return ross.Rotor(
            [ross.ShaftElement(L=0.25, idl=0.0, odl=0.05, material=steel) for _ in range(3)],
            [ross.DiskElement(1, 30.0, 0.2, 0.3), gear],
            [ross.BearingElement(n, kxx=1e6, kyy=3e6, cxx=100.0) for n in (0, 3)],
        )

    given = dict(coupled_nodes=(2, 2), gear_mesh_stiffness=1e8)
    pair = ross.MultiRotor(line(50), line(25), orientation_angle=0.7, **given)
    train = ross.MultiRotor(pair, line(40), orientation_angle=-0.5, **given)
    machine = from_ross(train)
    assert sum(isinstance(e, jr.GearMesh) for e in machine.elements().values()) == 2
    for speed in (0.0, 200.0):
        mine = lowest(np.asarray(jr.linearize(machine, speed, at="undeformed").eigenvalues))
        gap = np.min(np.abs(mine[:, None] - np.linalg.eigvals(train.A(speed))), axis=1)
        assert len(mine) == 12 and np.all(gap < 1e-8 * np.abs(mine)), gap
    helical = ross.MultiRotor(line(50, 0.2), line(25, 0.2), **given)
    square = {"enable": True, "amplitude_ratio": 0.1} if LATER else True
    varying = ross.MultiRotor(line(50), line(25), square_varying_stiffness=square, **given)
    for rotor, words in (
        (helical, "helical gears cannot"),
        (varying, "that varies with the teeth"),
    ):
        with pytest.raises(jr.InputError, match=words):
            from_ross(rotor)


def test_unbalance_needs_a_shaft_and_a_rotor_is_a_rotor():
    with pytest.raises(
        jr.InputError, match="node 9`: there is no such node of a shaft: 0 to 3 are"
    ):
        from_ross(example(), unbalance=[(9, 1e-4, 0.0)])
    with pytest.raises(jr.InputError, match="takes a ross.Rotor, CoAxialRotor or .* a str"):
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


def of_one(**options):
    """Matrices of one element in both programs, (12, 12) each, lateral rows alone: K, M and all of G."""
    steel = ross.Material("steel", rho=7810, E=211e9, G_s=81.2e9)
    theirs = ross.ShaftElement(**(dict(L=0.25, idl=0.0, odl=0.05, material=steel) | options))
    rotor = ross.Rotor([theirs], [], [ross.BearingElement(n, kxx=1e6, cxx=0.0) for n in (0, 1)])
    machine = from_ross(rotor)
    (name,) = (n for n, e in machine.elements().items() if isinstance(e, jr.FiniteElementShaft))
    ((_, found, _),) = machine[name].parts().connectors
    one = jax.tree.map(lambda x: x[..., 0], found)
    M, G = np.asarray(one.M), np.array(one.G)
    for k in (0, 6):  # what the spin's momentum gives at both ends
        G[k + 3, k + 4] += M[k + 5, 5] + M[k + 5, 11]
        G[k + 4, k + 3] -= M[k + 5, 5] + M[k + 5, 11]
    across = np.ix_(*[[0, 1, 3, 4, 6, 7, 9, 10]] * 2)
    mine = [np.asarray(one.matrices()[0])[across], M[across], G[across]]
    return mine, [x[across] for x in (theirs.K(), theirs.M(), theirs.G())]


@pytest.mark.parametrize(
    "options, shear",
    [
        (dict(axial_force=3e5), 0.0),
        (dict(axial_force=-2e5, shear_effects=False), 0.0),
        (dict(torque=2e4, shear_effects=False), 0.0),
        # about the section's axis here, about the centre line's there: 1/(1 + 12 EI/(kappa G A L²)) of it
        (dict(torque=2e4), 3e-4),
        (dict(gyroscopic=False), 0.0),
        (dict(rotary_inertia=False), 0.0),
        (dict(idl=0.01, idr=0.03, odr=0.06, shear_effects=False), 0.0),
        # kappa G A of every section here, kappa of the middle one there
        (dict(idl=0.01, idr=0.03, odr=0.06), 6e-3),
    ],
)
def test_loads_bores_and_gyroscopic_moments_element_by_element(options, shear):
    """To rounding; where shear is counted in another way the difference is told, and is no larger."""
    for name, mine, theirs in zip("KMG", *of_one(**options)):
        size = max(np.max(np.abs(theirs)), 1e-6)
        gap = np.max(np.abs(mine - theirs)) / size
        assert gap < (shear if name == "K" and shear else 1e-12), name
    if shear:
        (mine, *_), (theirs, *_) = of_one(**options)
        assert np.max(np.abs(mine - theirs)) > 1e-2 * shear * np.max(np.abs(theirs))


def test_a_loaded_rotor_of_ross():
    """Tension and torque together, without gyroscopic moments: eigenvalues to 1e-9 where shear is left
    out."""
    options = dict(axial_force=3e5, torque=1e4, gyroscopic=False, shear_effects=False)
    theirs = example(shaft=options)
    mine = lowest(np.asarray(jr.linearize(from_ross(theirs), 200.0, at="undeformed").eigenvalues))
    values = np.linalg.eigvals(theirs.A(200.0))
    gap = np.min(np.abs(mine[:, None] - values[None]), axis=1) / np.abs(mine)
    assert len(mine) == 12 and np.all(gap < 1e-9), gap
    bare = np.linalg.eigvals(example().A(200.0))
    assert np.min(np.abs(mine[0] - bare)) > 1e-2 * np.abs(mine[0])


def test_it_runs_in_time():
    """With a drive the carried machine starts up, and its disk whirls with the shaft."""
    ramp = {"node 0": {"phi": jr.CosineRamp(speed=50.0, duration=0.2)}}
    machine = from_ross(example(), [(1, 1e-3, 0.0)], fixed={"node 0": ("z",)}, prescribed=ramp)
    run = jr.simulate(machine, 0.3, 1000.0)
    assert float(run["node 3"].speed[-1]) == pytest.approx(50.0, rel=1e-3)
    assert np.hypot(run["node 1"].x, run["node 1"].y).max() > 1e-7


def along(*three):
    return [*three, 0.0, 0.0, 0.0]


def between(six):
    return np.kron([[1, -1], [-1, 1]], np.diag(np.asarray(six, float)))


def pump_line():
    """A stepped and a loaded shaft, a coupling to a third, a bearing on a pedestal, a seal with inertia."""
    stepped = jr.FiniteElementShaft(
        [0.2, 0.3], [0.05, 0.06], [0.01, 0.0], elements=2, rayleigh=(1.0, 0.0)
    )
    parts = dict(
        a=jr.Node(),
        b=jr.Rotor(30.0, 0.3, 0.2, jr.Unbalance(1e-6, 0.3), angle=0.1),
        c=jr.Node(),
        d=jr.Node(),
        e=jr.Node(),
        pedestal=jr.Node(),
        one=stepped,
        two=jr.FiniteElementShaft(0.4, 0.05, elements=3, axial_force=1e4),
        three=jr.FiniteElementShaft(0.2, 0.04, elements=1, shear=False),
        coupling=jr.ElasticMatrix(between([1e6, 1e6, 1e6, 1e3, 1e3, 1e4]), between([1.0] * 6)),
        seal=jr.LinearSupport(along(1e7, 2e7, 1e5), along(1e3, 1e3, 0), mass=along(2.0, 3.0, 0)),
        film=jr.ElasticMatrix(between(along(1e7, 1e7, 1e6)), between(along(100, 100, 100))),
        base=jr.LinearSupport(along(1e8, 2e8, 1e8), along(1e3, 1e3, 1e3)),
        mass=jr.AddedInertia((20.0, 30.0, 20.0)),
        table=jr.SpeedDependentSupport(
            SPEEDS[:3], [along(k, 2 * k, 0) for k in (1e6, 2e6, 3e6)], [along(100, 100, 0)] * 3
        ),
        stuck=jr.elements.PointUnbalance(1e-6, 0.2),
        load=jr.Torque(3.0),
        wheel=jr.AddedInertia(1.0, 0.01, 0.01),
    )
    places = dict(one=("a", "b"), two=("b", "c"), coupling=("c", "d"), three=("d", "e"))
    places |= dict(seal="a", film=("c", "pedestal"), base="pedestal", mass="pedestal", table="e")
    places |= dict(stuck="two.1", load="a", wheel="e")
    return jr.Machine(parts, places, fixed={"pedestal": ("psi", "theta", "phi")})


def test_a_machine_as_a_rotor_of_ross_and_back():
    """Eigenvalues of both programs at three speeds, the response to unbalance, and the machine read back."""
    machine = pump_line()
    theirs = jr.interop.to_ross(machine)
    assert theirs.left_out == ("load",) and theirs.nodes["pedestal"] == 10
    for speed in SPEEDS[:3]:
        mine = lowest(np.asarray(jr.linearize(machine, speed, at="undeformed").eigenvalues))
        values = np.linalg.eigvals(theirs.rotor.A(speed))
        gap = np.min(np.abs(mine[:, None] - values), axis=1)
        assert len(mine) == 12 and np.all(gap < 1e-8 * np.abs(mine)), gap
    back = from_ross(theirs.rotor, theirs.unbalance)
    again = lowest(np.asarray(jr.linearize(back, speed, at="undeformed").eigenvalues))
    np.testing.assert_allclose(again, mine, rtol=1e-9)
    found = jr.unbalance_response(machine, ["b.x", "two.1.y"], [200.0], at="undeformed").values[0]
    node, amount, angle = zip(*theirs.unbalance)
    speeds = np.array([200.0])
    whole = theirs.rotor.run_unbalance_response(list(node), list(amount), list(angle), speeds)
    rows = [6 * theirs.nodes["b"], 6 * theirs.nodes["two.1"] + 1]
    np.testing.assert_allclose(found, whole.forced_resp[rows, 0], rtol=1e-6)


def test_gears_as_a_multirotor():
    """Three lines; a mesh whose first gear is not the built one."""

    def line(p):
        parts = {
            f"{p}a": jr.Node(),
            f"{p}b": jr.Rotor(30.0, 0.3, 0.2),
            f"{p}g": jr.Rotor(5.0, 0.04, 0.02),
            f"{p}s": jr.FiniteElementShaft(0.3, 0.05, elements=1),
            f"{p}t": jr.FiniteElementShaft(0.3, 0.05, elements=1),
            f"{p}k": jr.LinearSupport(along(1e6, 3e6, 1e5), along(100, 100, 0)),
            f"{p}l": jr.LinearSupport(along(1e6, 3e6, 1e5), along(100, 100, 0)),
        }
        places = {f"{p}s": (f"{p}a", f"{p}b"), f"{p}t": (f"{p}b", f"{p}g"), f"{p}k": f"{p}a"}
        return parts, places | {f"{p}l": f"{p}g"}

    parts, places = {}, {}
    for p in "xyz":
        more = line(p)
        parts, places = parts | more[0], places | more[1]

    def mesh(radii, stiffness, orientation, teeth):
        law = jr.elements.KelvinVoigt(stiffness)
        return jr.GearMesh(radii, law, pressure_angle=0.35, orientation=orientation, teeth=teeth)

    parts |= {"m1": mesh([0.1, 0.05], 1e8, 0.7, 50), "m2": mesh([0.08, 0.1], 2e8, -0.5, 40)}
    machine = jr.Machine(parts, places | {"m1": ("xg", "yg"), "m2": ("zg", "xg")})
    theirs = jr.interop.to_ross(machine)
    for speed in (0.0, 200.0):
        mine = lowest(np.asarray(jr.linearize(machine, speed, at="undeformed").eigenvalues))
        gap = np.min(np.abs(mine[:, None] - np.linalg.eigvals(theirs.rotor.A(speed))), axis=1)
        assert len(mine) == 12 and np.all(gap < 1e-8 * np.abs(mine)), gap
    with pytest.raises(jr.InputError, match="ROSS needs whole teeth, but they are 50.5 and 25.25"):
        jr.interop.to_ross(machine.set({"m1.teeth": 50.5}))


@pytest.mark.parametrize(
    "changed, words",
    [
        (dict(load=jr.FanLoad(0.1)), "`load`: a FanLoad has no counterpart"),
        (
            dict(seal=jr.LinearSupport([1e7, 1e7, 0, 1e3, 0, 0])),
            "`seal`: a bearing of ROSS acts along x, y",
        ),
        (
            dict(two=jr.FiniteElementShaft(0.4, 0.05, damping="rotating")),
            "`two`: damping that turns",
        ),
        (dict(b=jr.Rotor(30.0, 0.3, 0.2, jr.Unbalance(0.0, 0.0, 0.1))), "`b`: dynamic unbalance"),
        (dict(one=jr.Shaft(0.5, 0.05)), "no counterpart in ROSS"),
    ],
)
def test_what_ross_has_not_is_refused(changed, words):
    machine = pump_line()
    places = machine.connections()
    if "one" in changed:  # a shaft without mass between stations that have some
        parts = {
            "a": jr.Rotor(1.0, 0.01, 0.01),
            "b": jr.Rotor(1.0, 0.01, 0.01),
            "one": changed["one"],
        }
        other = jr.Machine(parts, {"one": ("a", "b")})
    else:
        other = jr.Machine(machine.elements() | changed, places, fixed=machine.fixed())
    with pytest.raises(jr.InputError, match=words):
        jr.interop.to_ross(other)


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
