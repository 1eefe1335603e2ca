"""One HTML document with figures and tables in it, for the screen and for A4."""

import base64
import html
import io
import json
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from ..core.errors import MissingExtraError

_HERE = Path(__file__).parent
# Of a table, the cells that say whether a limit is met.
_LOOKS = {"NOT MET": "bad", "met": "good"}


class Figure(NamedTuple):
    """`draw` returns axes of matplotlib, or the bytes of a PNG. `vector`: as SVG, sharp at any size."""

    caption: str
    draw: Callable[[], Any]
    vector: bool = False


class Interactive(NamedTuple):
    """`spec`: a figure of plotly.js in plain values, its data, layout and frames."""

    caption: str
    spec: dict[str, Any]


class Table(NamedTuple):
    """Texts; `header` above the columns."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]


class Words(NamedTuple):
    text: str


class Warnings(NamedTuple):
    """Sentences in a box, before all else that is read."""

    sentences: Sequence[str]


class Source(NamedTuple):
    """A file as it was written."""

    caption: str
    text: str


Part = Figure | Interactive | Table | Words | Warnings | Source


class Chapter(NamedTuple):
    title: str
    parts: Sequence[Part]


def page(title: str, made: str, chapters: Sequence[Chapter]) -> str:
    """The whole document; nothing outside it is needed. Figures are numbered, and closed when drawn. Raises
    `MissingExtraError` where a figure wants plotly, and that is not installed."""
    zooms = any(isinstance(part, Interactive) for c in chapters for part in c.parts)
    library = f"<script>{_plotly()}</script>\n" if zooms else ""
    links = "".join(
        f'<li><a href="#chapter-{k}">{html.escape(chapter.title)}</a></li>'
        for k, chapter in enumerate(chapters, 1)
    )
    words = html.escape(title)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{words}</title>\n<style>\n{_text('page.css')}</style>\n{library}</head>\n<body>\n"
        f'<header><h1>{words}</h1>\n<p class="made">{html.escape(made)}</p></header>\n'
        f'<nav aria-label="Contents"><ol>{links}</ol></nav>\n<main>\n'
        + "\n".join(_chapters(chapters))
        + f"\n</main>\n<script>\n{_text('page.js')}</script>\n</body>\n</html>\n"
    )


def require_plotly() -> None:
    """Raises `MissingExtraError` where plotly is not installed."""
    if find_spec("plotly") is None:
        raise MissingExtraError(
            'report: needs plotly, which is not installed: pip install "jaxrotor[report]"'
        )


def _plotly() -> str:
    require_plotly()
    from plotly.offline import get_plotlyjs

    return get_plotlyjs()


def _text(name: str) -> str:
    return (_HERE / name).read_text(encoding="utf-8")


def _chapters(chapters: Sequence[Chapter]) -> Iterator[str]:
    figures = tables = 0
    for k, chapter in enumerate(chapters, 1):
        yield f'<section id="chapter-{k}">\n<h2>{k} {html.escape(chapter.title)}</h2>'
        for part in chapter.parts:
            if isinstance(part, (Figure, Interactive)):
                figures += 1
                yield _figure(part, figures)
            elif isinstance(part, Table):
                tables += 1
                yield _table(part, tables)
            else:
                yield _said(part)
        yield "</section>"


def _figure(part: Figure | Interactive, number: int) -> str:
    words = html.escape(part.caption)
    if isinstance(part, Interactive):
        height = part.spec["layout"]["height"]
        inside = (
            f'<div class="plot" style="height:{height}px" data-spec="spec-{number}"></div>'
            f'<script type="application/json" id="spec-{number}">{_json(part.spec)}</script>'
        )
    else:
        kind, data = _picture(part)
        inside = f'<img alt="{words}" src="data:image/{kind};base64,{data}">'
    return f"<figure>{inside}<figcaption>Figure {number}. {words}</figcaption></figure>"


def _json(spec: dict[str, Any]) -> str:
    # "</script>" in a name would end the element
    return json.dumps(spec, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")


def _picture(part: Figure) -> tuple[str, str]:
    from ..plot.style import close, figure_of

    drawn = part.draw()
    if isinstance(drawn, bytes):
        return "png", base64.b64encode(drawn).decode()
    figure, held = figure_of(drawn), io.BytesIO()
    if part.vector:
        figure.savefig(held, format="svg", bbox_inches="tight", metadata={"Date": None})
    else:
        figure.savefig(held, dpi=130, format="png", bbox_inches="tight")
    close([figure])
    return "svg+xml" if part.vector else "png", base64.b64encode(held.getvalue()).decode()


def _table(part: Table, number: int) -> str:
    def cell(text: str) -> str:
        look = f' class="{_LOOKS[text]}"' if text in _LOOKS else ""
        return f"<td{look}>{html.escape(text)}</td>"

    head = "".join(f"<th>{html.escape(x)}</th>" for x in part.header)
    rows = "\n".join("<tr>" + "".join(map(cell, row)) + "</tr>" for row in part.rows)
    return (
        f'<div class="table"><table><caption>Table {number}. {html.escape(part.caption)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table></div>"
    )


def _said(part: Words | Warnings | Source) -> str:
    if isinstance(part, Words):
        return f"<p>{html.escape(part.text)}</p>"
    if isinstance(part, Warnings):
        lines = "".join(f"<li>{html.escape(x)}</li>" for x in part.sentences)
        return f'<ul class="warnings">{lines}</ul>'
    return (
        f"<details open><summary>{html.escape(part.caption)}</summary>"
        f"<pre>{html.escape(part.text)}</pre></details>"
    )
