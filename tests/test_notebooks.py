"""The notebooks of the six steps run from top to bottom, and say what the pages say."""

import importlib.util
import json
from pathlib import Path

import nbformat
import pytest

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
spec = importlib.util.spec_from_file_location("notebooks", ROOT / "docs" / "notebooks.py")
assert spec and spec.loader
notebooks = importlib.util.module_from_spec(spec)
spec.loader.exec_module(notebooks)


def test_there_are_six():
    assert [p.stem.split("-", 1)[1] for p in NOTEBOOKS] == [
        "line-up",
        "run",
        "look",
        "linearise",
        "differentiate",
        "identify",
    ]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch, capsys):
    """Cell by cell in this process: a kernel for each would start six times. Their asserts hold; outputs are
    not kept."""
    monkeypatch.chdir(tmp_path)
    found = nbformat.read(path, as_version=4)
    nbformat.validate(found)
    names: dict = {"__name__": "__main__"}
    cells = [cell for cell in found.cells if cell.cell_type == "code"]
    assert cells and found.cells[0].source.startswith("# ")
    for k, cell in enumerate(cells, 1):
        assert not cell.outputs and cell.execution_count is None
        exec(compile(cell.source, f"{path.name}, cell {k}", "exec"), names)


def test_notebooks_are_the_pages():
    """So that what runs here is what stands there; conftest.py leaves those pages out."""
    assert len(notebooks.steps()) == len(NOTEBOOKS)
    for page in notebooks.steps():
        kept = (notebooks.NOTEBOOKS / f"{page.stem}.ipynb").read_text(encoding="utf-8")
        assert kept == notebooks.written(page), f"{page.stem}: python docs/notebooks.py --write"


def test_a_page_becomes_cells():
    page = (
        "# 1. Step\n\nWords.\n\n<details markdown><summary>All</summary>\n\n```python\na = 1\n```\n\n"
        "</details>\n\n![A](../images/a.png)\n\nNext: [two](2-two.md).\n"
    )
    cells = notebooks.notebook(page)["cells"]
    assert [c["cell_type"] for c in cells] == ["markdown", "code", "markdown"]
    texts = ["".join(c["source"]) for c in cells]
    assert texts == ["# 1. Step\n\nWords.\n\nAll", "a = 1", "Next: [two](2-two.ipynb)."]
    assert json.dumps(cells)
