"""The architecture and its face: arrows go down, the map in CONTRIBUTING.md is true, names are found."""

import importlib.util
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import jaxrotor as jr

ROOT = Path(__file__).parents[1]
spec = importlib.util.spec_from_file_location("house", ROOT / "docs" / "house.py")
assert spec and spec.loader
house = importlib.util.module_from_spec(spec)
spec.loader.exec_module(house)


def test_every_room_has_its_floor():
    rooms = {house.room(f.relative_to(house.SOURCE).parts) for f in house.SOURCE.rglob("*.py")}
    assert rooms - {""} == set(house.ORDER)


def test_arrows_go_down():
    floor = {name: i for i, name in enumerate(house.ORDER)}
    up = [(a, b, files) for (a, b), files in house.arrows().items() if floor.get(b, 99) >= floor[a]]
    assert not up


def test_no_two_files_import_each_other():
    assert not house.circles()


def test_a_circle_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr(house, "SOURCE", tmp_path)
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "a.py").write_text("from .b import x")
    (tmp_path / "room" / "b.py").write_text("def f():\n    from ..room import c")
    (tmp_path / "room" / "c.py").write_text("from . import a")
    (tmp_path / "room" / "d.py").write_text("from . import a")
    assert house.circles() == [["room/a.py", "room/b.py", "room/c.py"]]


def test_the_map_is_true():
    assert house.page() in (ROOT / "CONTRIBUTING.md").read_text()


def test_files_are_read_at_a_sitting():
    long = {
        f: n for f in house.SOURCE.rglob("*.py") if (n := len(f.read_text().splitlines())) > 500
    }
    assert not long


def test_the_face_can_be_read():
    """What a script starts with, and where the rest is."""
    assert len(jr.__all__) + 1 < 125 and set(jr.__all__) <= set(dir(jr))
    rooms = [getattr(jr, name) for name in jr.__all__ if inspect.ismodule(getattr(jr, name))]
    for room in rooms:
        assert all(hasattr(room, name) for name in room.__all__), room
    # a class has one name alone, and one that stands lower tells where
    with pytest.raises(AttributeError, match=r"it is jr\.sensors\.Twist"):
        jr.Twist  # noqa: B018
    for wrong, meant in (
        ("Rotar", "did you mean jr.Rotor?"),
        ("Steel", "did you mean jr.STEEL?"),
        ("Disk", "see jr.Rotor"),
        ("Twista", "did you mean jr.sensors.Twist?"),
        ("Quux", "attribute Quux"),
    ):
        with pytest.raises(AttributeError) as told:
            getattr(jr, wrong)
        assert str(told.value).endswith(meant)
    assert jr.__version__.count(".") == 2


def test_no_name_hides_another():
    rooms = [name for name in jr.__all__ if inspect.ismodule(getattr(jr, name))]
    below = {name for room in rooms for name in getattr(jr, room).__all__}
    assert not below & set(rooms)


def test_help_loads_nothing_heavy():
    code = (
        "import sys\nfrom jaxrotor.commands.cli import main\nassert main([]) == 0\n"
        "heavy = {'jax', 'numpy', 'scipy', 'matplotlib', 'xarray'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "jaxrotor run" in done.stdout


def test_check_loads_only_what_the_study_needs():
    """A study without [identify], [optimize] or [sweep] is checked without what only these use."""
    code = (
        "import sys\nfrom jaxrotor.commands.cli import main\n"
        "assert main(['check', 'configs/two_rotor_startup.toml']) == 0\n"
        "heavy = {'scipy.interpolate', 'scipy.optimize', 'scipy.signal', 'scipy.special', 'scipy.stats', "
        "'diffrax', 'matplotlib', 'optax', 'pandas', 'tqdm', 'xarray', 'zarr'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert "2 Rotor" in done.stdout


def test_a_room_loads_what_is_asked_for():
    """And a function that its module is named after is found whichever of the two was loaded first."""
    code = (
        "import sys\nimport jaxrotor as jr\n"
        "jr.Rotor\nassert 'jaxrotor.elements.shafts.section' not in sys.modules\n"
        "import jaxrotor.linear.campbell\nassert callable(jr.linear.campbell)\n"
        "from jaxrotor.linear import campbell, modes\nassert callable(campbell) and callable(modes)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
