"""What parts and machines show of themselves: values that read back, no more than a screen."""

import re
import shutil
import tomllib
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import tomli_w

import jaxrotor as jr
from jaxrotor.core.units import quantity
from jaxrotor.machine.layout import layout_of

CONFIGS = sorted((Path(__file__).parents[1] / "configs").glob("*.toml"))
el = jr.elements
NUMBER = r"-?[\d.]+(?:e[+-]?\d+)?"


@pytest.fixture(scope="module")
def machines(tmp_path_factory):
    """Of the configs, their machines alone: what they are asked for takes longer to read."""
    folder, found = tmp_path_factory.mktemp("machines"), {}
    for own in CONFIGS[0].parent.glob("*.py"):  # laws of one's own stand beside their study
        shutil.copy(own, folder)
    for config in CONFIGS:
        section = tomllib.loads(config.read_text(encoding="utf-8"))["machine"]
        path = folder / config.name
        path.write_text(tomli_w.dumps({"machine": section}), encoding="utf-8")
        found[config.stem] = jr.load(path, run=False).machine
    return found


@pytest.fixture
def rotor():
    return jr.Rotor(6.08, 0.0272, 0.0136, jr.Unbalance(1.5e-4, angle=np.pi / 6), ends=(0.1, 0.02))


def test_a_rotor_is_one_line_in_the_units_of_a_drawing(rotor):
    assert repr(rotor) == (
        "Rotor(mass=6.08 kg, polar_inertia=0.0272 kg*m^2, transverse_inertia=0.0136 kg*m^2, "
        "unbalance=Unbalance(eccentricity=0.15 mm, angle=30 deg), ends=[100, 20] mm)"
    )
    # what is as by default is left out, wherever the number came from
    assert "angle" not in repr(
        eqx.tree_at(lambda r: (r.unbalance.angle, r.angle), rotor, (0.0, 0.0))
    )


@pytest.mark.parametrize(
    "part, words",
    [
        (jr.Torque(5.0), "Torque(value=5 N*m)"),
        (jr.Torque(jr.Step(0.05, -2e3)), "Torque(value=Step(time=50 ms, after=-2 kN*m))"),
        (jr.Force(jr.Impulse(1.0, 2e-3, 0.6)), "impulse=0.6 N*s"),
        (jr.PrescribedSpin(jr.CosineRamp(100 * np.pi, 2.5)), "CosineRamp(speed=3000 rpm, duration=2.5 s)"),
        (jr.Shaft(1.2, 0.05, rayleigh=(0.5, 2e-5)),
         "length=1.2 m, diameter=50 mm, rayleigh=[0.5 1/s, 20 us]"),
        (jr.Shaft(1.2, 0.05, material=jr.Material(7e10, 2.7e10, 2700.0)),
         "Material(youngs_modulus=70 GPa, shear_modulus=27 GPa, density=2700 kg/m^3)"),
        (jr.STEEL, "Material(youngs_modulus=210 GPa, shear_modulus=81 GPa, density=7850 kg/m^3)"),
        (jr.LinearSupport((2e7, 3e7, 0, 0, 0, 40)), "stiffness=([20, 30, 0] MN/m, [0, 0, 40] N*m/rad)"),
        (jr.GearMesh((0.1, 0.2), el.KelvinVoigt(4e8, 3e3)),
         "KelvinVoigt(stiffness=400 MN/m, damping=3 kN*s/m)"),
        (jr.Coupling(phi=el.KelvinVoigt(4e8, 3e3)), "stiffness=400 MN*m/rad, damping=3 kN*m*s/rad"),
        (jr.Shaft(0.1, 0.01, flaw=[el.Bow(1e-4), el.Kink(np.pi / 180, 0.0, 0.5)]),
         "Bow(sagitta=0.1 mm), Kink("),
        (jr.SpeedTable(np.linspace(0, 2, 30), np.linspace(0, 10 * np.pi, 30)),
         "SpeedTable(times=30 values from 0 to 2 s, speeds=30 values from 0 to 300 rpm)"),
    ],
)  # fmt: skip
def test_units_suit_the_size_and_the_place(part, words):
    """Written by hand from the field's usage."""
    assert words in repr(part)


def own_settings(part):
    """Those of the part itself, not of the parts inside."""
    text = repr(part).partition("(")[2].removesuffix(")")
    while (less := re.sub(r"\w+\([^()]*\)", "", text)) != text:
        text = less
    return text


def test_every_number_reads_back(machines):
    """By the reader of study files, which knows nothing of how parts are shown."""
    count = 0
    for machine in machines.values():
        for path, value in machine.parameters().items():
            name, *steps = path.split(".")
            if np.ndim(value) or len(steps) != 1 or name == "gravity":
                continue
            shown = re.search(rf"\b{steps[0]}=({NUMBER}) ?([^,]*)", own_settings(machine[name]))
            if shown is None:  # as by default
                fields = {f.name: f for f in type(machine[name]).__dataclass_fields__.values()}
                assert float(value) == fields[steps[0]].default
                continue
            (unit,) = machine.units(path)
            read = quantity(shown[0].partition("=")[2], unit) if shown[2] else float(shown[1])
            assert read == pytest.approx(float(value), rel=6e-6, abs=0)
            count += 1
    assert count > 150


def test_a_machine_is_its_line_up_on_a_screen(machines):
    for machine in machines.values():
        lines = repr(machine).splitlines()
        assert len(lines) <= 40 and max(map(len, lines)) <= 100
        free = len(layout_of(machine).free)
        assert f" {free} degrees of freedom" in lines[0]
        for name in machine.elements():
            assert sum(line.startswith(f"  {name}  ") for line in lines) >= 1
    lines = repr(machines["two_rotor_startup"]).splitlines()
    assert lines[0] == "Machine: 5 stations, 24 degrees of freedom, gravity [0, -9.81, 0] m/s^2"
    order = [line[2:9].strip() for line in lines[2:] if line[2] != " "]
    assert order == "second,shaft 1,left,shaft 2,main,shaft 3,right,shaft 4,end".split(",")


def test_nothing_is_compiled_for_it(machines):
    compiled = []
    jax.monitoring.register_event_duration_secs_listener(
        lambda event, seconds, **_: compiled.append(event) if "compile" in event else None
    )
    jax.jit(lambda x: x + 1)(1.0)
    assert compiled  # such events are seen
    compiled.clear()
    for machine in machines.values():
        repr(jax.tree.map(lambda x: np.asarray(x), machine))
        repr(machine)
    jax.monitoring.clear_event_listeners()
    assert not compiled


def long_line(count=40):
    parts = {}
    for k in range(count):
        parts |= {f"disc {k}": jr.Rotor(1.0, 0.01, 0.006), f"shaft {k}": jr.Shaft(0.1, 0.02)}
    parts["last"] = jr.Rotor(1.0, 0.01, 0.006)
    return parts


def test_a_long_line_is_cut_in_the_middle():
    lines = repr(jr.Machine.in_line(long_line(), {"load": (jr.Torque(1.0), "disc 7")})).splitlines()
    (cut,) = [i for i, line in enumerate(lines) if "more ..." in line]
    left_out = int(re.search(r"\.\.\. (\d+) more", lines[cut])[1])
    listed = [line for line in lines[2:-2] if "more" not in line]
    assert len(lines) == 40 and len(listed) + left_out == 81
    assert lines[2].startswith("  disc 0 ") and listed[-1].startswith("  last")
    assert lines[-1].split() == ["load", "Torque", "at", "disc", "7,", "value=1", "N*m"]


def test_branches_and_what_is_held_say_where():
    """Declared out of order, a gear pair of two branches, one of them wired from right to left."""
    line = {
        "a": jr.Rotor(1.0, 0.01, 0.006), "mesh": jr.GearMesh((0.1, 0.2), el.KelvinVoigt(1e8, 10.0)),
        "b": jr.Rotor(1.0, 0.01, 0.006), "far mesh": jr.GearMesh((0.1, 0.2), el.KelvinVoigt(1e8, 10.0)),
        "c": jr.Rotor(1.0, 0.01, 0.006), "shaft": jr.Shaft(0.1, 0.02),
        "drive": jr.PrescribedSpin(jr.ConstantSpeed(1.0)),
    }  # fmt: skip
    machine = jr.Machine(
        line, {"shaft": ("drive", "a"), "mesh": ("a", "b"), "far mesh": ("a", "c")},
        fixed={"a": ["z"], "b": ["z", "psi"]}, prescribed={"c": {"x": jr.CosineRamp(1e-3, 1.0)}},
    )  # fmt: skip
    rows = [line for line in repr(machine).splitlines() if line[2] != " "]  # not the folded ones
    words = [[w.strip() for w in line.split("  ") if w.strip()] for line in rows]
    assert [w[0] for w in words[2:9]] == ["drive", "shaft", "a", "mesh", "b", "far mesh", "c"]
    assert words[7][2].startswith("a - c, ") and words[5][2].startswith("radii=")
    assert words[9:14] == [
        ["fixed:"], ["a", "z"], ["b", "z, psi"],
        ["prescribed:"], ["c.x", "CosineRamp", "speed=0.001 m/s, duration=1 s"],
    ]  # fmt: skip
    # the same units by path: along a line, and of a displacement
    assert machine.units("mesh.mesh.stiffness") == ("N/m",)
    assert machine.units("c.x.speed") == ("m/s",)


def test_what_is_not_known_shows_its_shape(machines, rotor):
    machine, seen = machines["two_rotor_startup"], []

    def look(mass):
        seen.append(repr(machine.set({"main.mass": mass})))
        return mass

    jax.make_jaxpr(look)(1.0)
    jax.vmap(look)(jnp.ones(3))
    jax.grad(look)(2.0)
    assert "mass=f64[] kg" in seen[0] and "mass=f64[] kg" in seen[1] and "mass=2 kg" in seen[2]
    batch = jax.tree.map(lambda x: jnp.stack([x, x]), machine)
    assert "mass=f64[2] kg" in repr(batch) and "gravity f64[2,3] m/s^2" in repr(batch)
    assert "speed=f64[] rad/s" in repr(jax.eval_shape(lambda: machine))
    broken = eqx.tree_at(lambda r: r.mass, rotor, jnp.asarray(np.nan))
    assert "mass=nan kg" in repr(broken)
    gone = jnp.asarray(3.0)
    gone.delete()
    assert "mass=f64[] kg" in repr(eqx.tree_at(lambda r: r.mass, rotor, gone))


def test_no_tree_fails(machines):
    """What filters, partitions and half-built modules are made of."""
    machine = machines["motor_coupling_pump"]
    for tree in (
        jax.tree.map(lambda x: None, machine),
        jax.tree.map(lambda x: 0, machine),
        jax.tree.map(lambda x: "a text", machine),
        jax.tree.map(lambda x: x > 0, machine),
        eqx.tree_at(lambda m: m.stations, machine, None),
        eqx.tree_at(lambda m: m.connectors, machine, ()),
        eqx.tree_at(lambda m: m["motor"], machine, 7),
        eqx.tree_at(lambda m: m["coupling"], machine, object()),
        object.__new__(jr.Machine),
        object.__new__(jr.Rotor),
    ):
        lines = repr(tree).splitlines()
        assert len(lines) <= 40 and max(map(len, lines)) <= 500
        if isinstance(tree, jr.Machine):
            assert tree._repr_html_().startswith(("<pre>", "<img"))


def test_a_notebook_shows_the_drawing(machines):
    page = machines["overhung_fan"]._repr_html_()
    assert page.startswith('<img alt="side view to scale" src="data:image/png;base64,iVBORw0KGgo')
    assert "<pre>Machine: " in page and "wheel" in page
    batch = jax.tree.map(lambda x: jnp.stack([x, x]), machines["overhung_fan"])
    assert batch._repr_html_().startswith("<pre>Machine: ")


def test_configs_are_written_and_read_back(machines, tmp_path):
    """Here, where they have been read already: `test_to_toml` has the rest."""
    for name, machine in machines.items():
        path = tmp_path / f"{name}.toml"
        path.write_text(machine.to_toml(), encoding="utf-8")
        again = jr.load(path, run=False).machine
        assert jax.tree.structure(again) == jax.tree.structure(machine), name
        assert all(map(np.array_equal, jax.tree.leaves(again), jax.tree.leaves(machine))), name
