"""Results are whole or not there, whatever happens while they are written."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import jaxrotor as jr
from jaxrotor.core import files

EARLIER = {
    "summary.json": "earlier",
    "response.nc": "earlier",
    "01.png": "earlier",
    "mine.txt": "mine",
}
NEW = {"summary.json": "new", "response.nc": "new", "02.png": "new"}


def put(folder, contents):
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in contents.items():
        (folder / name).write_text(text)


def held(folder):
    return {p.name: p.read_text() for p in folder.iterdir() if p.is_file()}


def written(target, **options):
    with files.folder_written_whole(target, **options) as part:
        put(part, NEW)


def test_new_results_take_the_place_of_the_earlier_ones(tmp_path):
    target = tmp_path / "results"
    written(target)
    assert held(target) == NEW
    put(target, EARLIER)
    written(target)
    assert held(target) == {**EARLIER, **NEW}
    assert [p.name for p in tmp_path.iterdir()] == ["results"]


CHILD = """
import os, sys
from pathlib import Path
from jaxrotor import files
count, target = int(sys.argv[1]), Path(sys.argv[2])
for name in ("replace", "rmdir", "unlink"):
    def dying(*given, act=getattr(os, name)):
        global count
        count -= 1
        if count < 0:
            os.kill(os.getpid(), 9)
        return act(*given)
    setattr(os, name, dying)
with files.folder_written_whole(target) as part:
    for name in ("summary.json", "response.nc", "02.png"):
        (part / name).write_text("new")
"""


@pytest.mark.parametrize("moment", range(5))
def test_killed_at_any_moment_one_of_the_results_is_whole(tmp_path, moment):
    """SIGKILL instead of the first, second, ... move; then the next run ends what was begun."""
    target = tmp_path / "results"
    put(target, EARLIER)
    subprocess.run([sys.executable, "-c", CHILD, str(moment), str(target)], check=False)
    if target.exists():  # never a mixture
        found = held(target)
        texts = {found[name] for name in ("summary.json", "response.nc")}
        assert texts in ({"earlier"}, {"new"}) and found.get("01.png", "earlier") == "earlier"
    written(target)
    assert held(target) == {**EARLIER, **NEW}
    assert [p.name for p in tmp_path.iterdir()] == ["results"]


def test_what_killed_programs_left_is_swept_up(tmp_path):
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    start = f".results.{files.socket.gethostname()}-"
    dead, living = tmp_path / f"{start}{process.pid}-abc", tmp_path / f"{start}{os.getpid()}-abc"
    put(dead, NEW)
    put(living, NEW)
    written(tmp_path / "results")
    assert not dead.exists() and living.exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device")
def test_a_full_disk_ends_in_words_and_leaves_nothing(tmp_path, monkeypatch):
    def full(self, data):
        with open("/dev/full", "wb", buffering=0) as out:
            return out.write(data)

    machine = jr.Machine({"top": jr.Rotor(1.0, 0.02, 0.012)}, {}, fixed={"top": ("x", "y", "z")})
    run = jr.simulate(machine, 0.004, 1000.0, "undeformed", step=1e-3)
    run.to_xarray()  # what is compiled for it goes to a cache on the same disk
    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space left"):
        run.save(tmp_path / "run.nc")
    assert not list(tmp_path.iterdir())


def test_a_place_that_cannot_be_written_to_is_found_out_before_the_run(tmp_path, monkeypatch):
    target = tmp_path / "results"
    put(target, EARLIER)

    def refused(*given, dir=None, **options):
        if Path(dir) == target:
            raise PermissionError(13, "Permission denied")
        return str(make(*given, dir=dir, **options))

    make = files.tempfile.mkdtemp
    monkeypatch.setattr(files.tempfile, "mkdtemp", refused)
    with pytest.raises(
        jr.InputError, match=r"results`: cannot be written to \(Permission denied\)"
    ):
        with files.folder_written_whole(target):
            pytest.fail("began to run")
    assert held(target) == EARLIER


def test_results_that_cannot_be_moved_are_not_thrown_away(tmp_path, monkeypatch):
    target = tmp_path / "results"

    def refused(*given):
        raise OSError(30, "Read-only file system")

    with pytest.raises(
        jr.InputError, match="could not be written .*the results are whole in"
    ) as caught:
        with files.folder_written_whole(target) as part:
            put(part, NEW)
            monkeypatch.setattr(os, "replace", refused)
    place = Path(str(caught.value).split("`")[3])
    assert held(place) == NEW


def test_a_mounted_folder_gets_its_files_one_by_one(tmp_path, monkeypatch):
    target = tmp_path / "results"
    put(target, EARLIER)
    replace = os.replace

    def busy(a, b):
        if Path(a) == target:
            raise OSError(16, "Device or resource busy")
        return replace(a, b)

    monkeypatch.setattr(os, "replace", busy)
    written(target)
    assert held(target) == {**EARLIER, **NEW}
