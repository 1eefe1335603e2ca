"""The API reference: a page a room, each public name once, in the words of its docstring."""

import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .examples import ELSEWHERE, found
from .names import CORE, Name, groups, public, rooms

ELEMENTS = "rotors shafts bearings couplings laws drives control".split()
TITLES = {
    CORE: "Machines, studies, settings, errors",
    **{f"elements-{kind}": f"elements: {kind}" for kind in ELEMENTS},
}


def pages() -> Iterator[tuple[str, str]]:
    """(path, Markdown) of each page, the index first."""
    names, places = public(), found()
    yield "api/index.md", index(names)
    for page in order(names):
        own = [name for name in names if name.page == page]
        words = [f"# {TITLES.get(page, page)}", ""]
        first = page.split("-")[0]
        if first != CORE:
            words += [f"In Python: `jr.{first}`.", ""]
        yield (
            f"api/{page}.md",
            "\n".join(words + [part for name in own for part in entry(name, places)]),
        )


def used_in(name: Name, places: dict[str, list[str]]) -> str:
    """The pages, experiments and studies whose code has this name; at most a few."""
    found = dict.fromkeys(p for place in name.places for p in places.get(place, ()))
    pages = [p for p in found if p.startswith("docs/")]
    # where it is the subject stands before where it happens to be
    pages.sort(
        key=lambda p: (not p.startswith("docs/parts/"), p.startswith(("docs/how", "docs/start")))
    )
    told = [f"[{Path(p).stem.replace('-', ' ')}](../{p.removeprefix('docs/')})" for p in pages[:4]]
    told += [f"`{p}`" for p in found if p.startswith(("experiments/", "configs/"))][:2]
    told += [f"`{ELSEWHERE[name.place]}`"] if name.place in ELSEWHERE else []
    return f"*Examples:* {', '.join(told)}.\n" if told else ""


def order(names: list[Name]) -> list[str]:
    """The pages in the order of the rooms, elements by kind."""
    wanted = [CORE, *(f"elements-{kind}" for kind in ELEMENTS), *rooms()]
    return [page for page in wanted if any(name.page == page for name in names)]


def entry(name: Name, places: dict[str, list[str]]) -> Iterator[str]:
    """One public name: its heading, how it is called, its docstring and its public members."""
    place = f"jaxrotor.{name.place}"
    others = sorted({f"jaxrotor.{one}" for one in name.places} - {place, name.identifier})
    yield "".join(f'<a id="{anchor}"></a>' for anchor in others) + "\n"
    yield f'### jr.{name.place} {{ #{place} data-toc-label="{name.place.rpartition(".")[2]}" }}\n'
    call = signature(name) if callable(name.thing) else ""
    if call:
        yield f"```python\n{call}\n```\n"
    yield f"::: {name.identifier}\n    options:\n      show_root_heading: false\n"
    yield used_in(name, places)


def signature(name: Name) -> str:
    """How it is called; empty for what is not called so."""
    if inspect.isabstract(name.thing):
        return ""
    try:
        parameters = inspect.signature(name.thing).parameters.values()
    except (TypeError, ValueError):
        return ""
    words, marked = [], False
    for one in parameters:
        if one.kind is one.KEYWORD_ONLY and not marked:
            words.append("*")
            marked = True
        if one.kind is one.VAR_POSITIONAL:
            words.append(f"*{one.name}")
        elif one.kind is one.VAR_KEYWORD:
            words.append(f"**{one.name}")
        else:
            words.append(
                one.name if one.default is one.empty else f"{one.name}={_shown(one.default)}"
            )
    call = f"jr.{name.place}({', '.join(words)})"
    if len(call) <= 88:
        return call
    return f"jr.{name.place}(\n" + "".join(f"    {word},\n" for word in words) + ")"


def _shown(value: Any) -> str:
    if callable(value):
        return getattr(value, "__name__", "...")
    return "..." if "<" in repr(value) else repr(value).replace("\n", " ")


def index(names: list[Name]) -> str:
    """All names: the top ones by what they are for, the others by their room."""
    by_place = {place: name for name in names for place in name.places}
    lines = [
        "# All public names",
        "",
        "`import jaxrotor as jr`; what a script starts with is `jr.Name`, the rest `jr.room.Name`. "
        "Each name has its units, shapes and errors where it leads.",
        "",
    ]
    for words, own in groups().items():
        lines += [f"## {words[0].upper()}{words[1:]}", "", "| | |", "|---|---|"]
        lines += [_row(by_place[name]) for name in own] + [""]
    for room in rooms():
        rest = [name for name in names if name.place.startswith(f"{room}.")]
        if rest:
            lines += [f"## jr.{room}", "", "| | |", "|---|---|", *map(_row, rest), ""]
    return "\n".join(lines)


def _row(name: Name) -> str:
    link = name.link.removeprefix("api/")
    return f"| [`jr.{name.place}`]({link}) | {name.summary.replace('|', chr(92) + '|')} |"
