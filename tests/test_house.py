"""The architecture: arrows between rooms go down, and the map in CONTRIBUTING.md is that of the imports."""

import importlib.util
from pathlib import Path

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


def test_the_map_is_true():
    assert house.page() in (ROOT / "CONTRIBUTING.md").read_text()


def test_files_are_read_at_a_sitting():
    long = {
        f: n for f in house.SOURCE.rglob("*.py") if (n := len(f.read_text().splitlines())) > 500
    }
    assert not long
