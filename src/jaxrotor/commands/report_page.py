"""One HTML document with figures and tables in it, for the screen and for A4."""

import base64
import html
import io
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

_STYLE = """
body { font: 10.5pt/1.45 Georgia, serif; max-width: 190mm; margin: 12mm auto; color: #111; padding: 0 4mm }
h1 { font-size: 19pt; margin: 0 0 2mm }
h2 { font-size: 13.5pt; margin: 9mm 0 2mm; border-bottom: 1px solid #888 }
p { margin: 2mm 0 } .made { color: #555; font-size: 9pt }
figure { margin: 4mm 0; break-inside: avoid } figure img { max-width: 100%; display: block; margin: 0 auto }
figcaption, caption { color: #444; font-size: 9pt; text-align: left; margin-top: 1mm; caption-side: top }
table { border-collapse: collapse; width: 100%; font: 8.5pt/1.35 Arial, sans-serif; margin: 3mm 0 }
th { text-align: left; border-bottom: 1.5px solid #333 }
th, td { padding: 1mm 2mm 1mm 0; vertical-align: top }
td { border-bottom: 1px solid #ddd } tr { break-inside: avoid } thead { display: table-header-group }
td.bad { color: #a3170d; font-weight: bold } td.good { color: #1d6b22 }
@page { size: A4; margin: 16mm 14mm } @media print { body { margin: 0; max-width: none; padding: 0 } }
@media print { h2 { break-after: avoid } }
"""


class Figure(NamedTuple):
    caption: str
    draw: Callable[[], Any]


class Table(NamedTuple):
    """Texts; `header` above the columns."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]


class Words(NamedTuple):
    text: str


class Chapter(NamedTuple):
    title: str
    parts: Sequence[Figure | Table | Words]


def page(title: str, made: str, chapters: Sequence[Chapter]) -> str:
    """The whole document; nothing outside it is needed. Figures are numbered, and closed when drawn."""
    out = [
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
        f"<title>{html.escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>",
        f'<h1>{html.escape(title)}</h1>\n<p class="made">{html.escape(made)}</p>',
    ]
    figures = tables = 0
    for k, chapter in enumerate(chapters, 1):
        out.append(f"<h2>{k} {html.escape(chapter.title)}</h2>")
        for part in chapter.parts:
            if isinstance(part, Figure):
                figures += 1
                out.append(_figure(part, figures))
            elif isinstance(part, Table):
                tables += 1
                out.append(_table(part, tables))
            else:
                out.append(f"<p>{html.escape(part.text)}</p>")
    return "\n".join([*out, "</body>\n</html>\n"])


def _figure(part: Figure, number: int) -> str:
    from ..plot.style import close, figure_of

    drawn = figure_of(part.draw())
    held = io.BytesIO()
    drawn.savefig(held, dpi=130, format="png", bbox_inches="tight")
    close([drawn])
    data = base64.b64encode(held.getvalue()).decode()
    words = html.escape(part.caption)
    return (
        f'<figure><img alt="{words}" src="data:image/png;base64,{data}">'
        f"<figcaption>Figure {number}. {words}</figcaption></figure>"
    )


def _table(part: Table, number: int) -> str:
    def cell(text: str) -> str:
        look = {"NOT MET": ' class="bad"', "met": ' class="good"'}.get(text, "")
        return f"<td{look}>{html.escape(text)}</td>"

    head = "".join(f"<th>{html.escape(x)}</th>" for x in part.header)
    rows = "\n".join("<tr>" + "".join(map(cell, row)) + "</tr>" for row in part.rows)
    return (
        f"<table><caption>Table {number}. {html.escape(part.caption)}</caption>"
        f"<thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table>"
    )
