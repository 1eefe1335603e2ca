"""The wheel in an empty environment: what is in it, that importing it asks no network, README's first example
as it is written. On other Pythons and with the oldest releases: `make wheels`."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
OFFLINE = """
import socket
def refused(*args, **more):
    raise OSError("no network here")
socket.socket.connect = socket.create_connection = socket.getaddrinfo = refused
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    out = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", out, ROOT]
    subprocess.run(build, check=True)
    (found,) = out.glob("*.whl")
    return found


def test_what_is_in_it(wheel):
    """All of the source and nothing else: faces, types, templates."""
    inside = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    source = {
        str(path.relative_to(ROOT / "src"))
        for path in (ROOT / "src").rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }
    assert inside == source
    assert "jaxrotor/py.typed" in inside


def test_readme_as_written(wheel, tmp_path):
    made = [sys.executable, "-m", "venv", tmp_path / "env"]
    subprocess.run(made, check=True)
    python = tmp_path / "env" / "bin" / "python"
    pins = ROOT / "constraints.txt"
    subprocess.run(
        [python, "-m", "pip", "install", "--quiet", "--no-compile", "-c", pins, wheel], check=True
    )
    example = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
    assert example is not None
    clean = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "JAX_ENABLE_X64")}
    ran = subprocess.run(
        [python, "-c", OFFLINE + example[1]],
        cwd=tmp_path, env=clean, capture_output=True, text=True,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    peak, by_eccentricity, by_length = map(float, ran.stdout.split())
    # as the comment below the example says
    assert (peak, by_eccentricity, by_length) == pytest.approx((9.77e-4, 4.88, 0.0130), rel=2e-3)
