"""The site: what is made from the program is whole, builds strictly, and needs nothing from outside."""

import html
import inspect
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import equinox as eqx
import pytest

import jaxrotor as jr

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
sys.path.insert(0, str(DOCS))

from pages import examples, gallery, parts, pictures, validation
from pages.names import public


def test_every_public_name_has_an_example():
    """In code of a page, an experiment or a study; what compiles too long for that is run by a test."""
    names, lacking = examples.without()
    assert not lacking, "no executed code shows " + ", ".join(f"jr.{n.place}" for n in lacking)
    known = {name.place for name in names}
    for place, test in examples.ELSEWHERE.items():
        shown = place.rpartition(".")[2].removesuffix("_curves").removesuffix("_ross")
        assert place in known and shown in (ROOT / test).read_text(encoding="utf-8")
    assert len(examples.ELSEWHERE) < len(names) / 40


def test_a_name_without_an_example_is_found(monkeypatch):
    """What is used under another name counts; what stands in words does not."""
    code = "from jaxrotor import plot\nel = jr.elements\nel.Crack(0.2)\nplot.bode(x)\nrun.plot.orbit('a')"
    assert {"elements.Crack", "plot.bode", "plot.orbits"} <= set(examples.chains(code))
    assert "plot.campbell_diagram" in set(examples.chains("c = jr.campbell(m, s)\nc.plot()"))
    monkeypatch.setattr(examples, "sources", lambda: iter([("x.md", "jr.Rotor")]))
    places = {name.place for name in examples.without()[1]}
    assert "simulate" in places and "Rotor" not in places


def test_every_part_has_its_section():
    """Each class of `jr.elements` and `jr.profiles` that a user builds is on a page of the parts, once."""
    pages = [page.read_text(encoding="utf-8") for page in (DOCS / "parts").glob("*.md")]
    marked = [
        found["place"].rpartition(".")[2] for page in pages for found in parts.MARK.finditer(page)
    ]
    assert len(marked) == len(set(marked))
    built = {
        name
        for room in (jr.elements, jr.profiles)
        for name in room.__all__
        if inspect.isclass(kind := getattr(room, name)) and issubclass(kind, eqx.Module)
    }
    assert built == set(marked)


def test_a_section_tells_units_bounds_and_defaults():
    (rotor,) = [name for name in public() if name.place == "Rotor"]
    section = parts.section(rotor, "rotor.png")
    assert "| `mass` | kg | positive | must be given |" in section
    assert "| `ends` | m | zero or positive, 2 numbers | none |" in section
    assert "| `setpoint` | rad/s | a number or a schedule | must be given |" in "\n".join(
        parts.parameters(jr.SpeedGovernor)
    )
    # of the class as it is: nothing that its docstring or its fields do not say
    assert "Parameters, SI" not in section and "Matyja" in section


@pytest.mark.parametrize("thing", [jr.elements.KelvinVoigt(1e3, 30.0), jr.LinearRamp(100.0, 2.0)])
def test_pictures_are_drawn(thing):
    assert pictures.png(thing).startswith(b"\x89PNG")


def test_the_validation_page_is_what_the_program_gives():
    """Its quick cases, computed anew, to the last printed digit."""
    rows = validation.written()
    cases = [case for group in validation.CASES.values() for case in group]
    assert {case.title for case in cases} == set(rows)
    quick = [case for case in cases if case.quick]
    wrong = [words for case in quick for words in validation.stale(case, rows[case.title])]
    assert len(quick) > 6 and not wrong, "\n".join(wrong)


def test_a_stale_number_is_found():
    case = validation.Case("x", "y", lambda: [("w", "12.34", 12.341), ("z", 1 + 2j, 1 + 2j)])
    told = [list(row) for row in case.table()]
    assert told[0] == ["w", "12.34", "12.341", "8.1e-05"] and not validation.stale(case, told)
    told[0][2] = "12.36"
    assert validation.stale(case, told) == ["x: w is 12.341 now, not 12.36"]


def test_the_gallery_is_light_and_complete():
    thumbs = sorted(gallery.THUMBS.glob("*.png"))
    assert all(one.stat().st_size <= gallery.LARGEST for one in thumbs)
    assert sum(one.stat().st_size for one in thumbs) < 2_000_000
    assert {one.stem for one in thumbs} <= {entry.name for entry in gallery.ENTRIES}
    studies = {f"configs/{path.name}" for path in (ROOT / "configs").glob("*.toml")}
    unshown = {"configs/coupling_bench.toml", "configs/rk4_rig.toml"}  # their experiments are
    assert studies - {entry.source for entry in gallery.ENTRIES} == unshown
    for entry in gallery.ENTRIES:
        assert (ROOT / entry.source).is_file()
    kept = json.loads(gallery.TIMES.read_text(encoding="utf-8"))
    assert gallery.PAGE.read_text(encoding="utf-8") == gallery.page(kept)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("mkdocs", reason="the extra `docs` is not installed")
    pytest.importorskip("mkdocstrings", reason="the extra `docs` is not installed")
    folder = tmp_path_factory.mktemp("site")
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1", "JAXROTOR_SITE_PICTURES": "off"}
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-d", str(folder)]
    built = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert built.returncode == 0, built.stdout + built.stderr
    return {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8")
            for path in folder.rglob("*") if path.suffix in (".html", ".css", ".json", ".js")}  # fmt: skip


def test_it_builds_and_can_be_searched(site):
    index = json.loads(site["search/search_index.json"])
    places = {one["location"] for one in index["docs"]}
    assert {"start/2-run.html", "how/units.html", "parts/bearings.html#JournalBearing"} <= places
    assert "search/search_index.js" in site  # for pages opened from a disk


def test_every_public_name_has_its_place(site):
    anchors = {
        page: set(re.findall(r'id="([^"]+)"', text))
        for page, text in site.items()
        if page[-5:] == ".html"
    }
    for name in public():
        page, _, anchor = name.link.partition("#")
        own = anchors[page.replace(".md", ".html")]
        missing = [p for p in name.places if f"jaxrotor.{p}" not in own]
        assert anchor in own and not missing, (page, name.places)
        # its docstring stands there
        first = (inspect.getdoc(name.thing) or "").split()[:1]
        assert (
            not first
            or html.escape(first[0].strip("`*.,:"), quote=False)
            in site[page.replace(".md", ".html")]
        )


def test_nothing_is_loaded_from_outside(site):
    """No script, style, font or picture of another host; links that a reader follows may lead there."""
    for page, text in site.items():
        if page.endswith(".html"):
            loaded = re.findall(
                r"<(?:script|link|img|iframe|source)[^>]*(?:src|href)=[\"']?(https?:)?//[^>]*>",
                text,
            )
            assert not loaded, page
        elif page.endswith(".css"):
            assert not re.search(r"(?:@import|url\()\s*[\"']?(?:https?:)?//", text), page
