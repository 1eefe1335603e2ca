"""The notebooks of the six steps, from the pages of "getting started": text and code are those of the pages.

    python docs/notebooks.py           says which differ
    python docs/notebooks.py --write   writes them into docs/notebooks/

Outputs are not kept: they are what the reader's own machine says.
"""

import json
import re
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PAGES, NOTEBOOKS = ROOT / "docs" / "start", ROOT / "docs" / "notebooks"
_FENCE = re.compile(r"^```python\n(.*?)^```$\n?", re.DOTALL | re.MULTILINE)
_HTML = re.compile(r"</?details[^>]*>|</?summary[^>]*>")
_IMAGE = re.compile(r"^!\[.*?\]\(.*?\)\n", re.MULTILINE)
_STEP = re.compile(r"\((\d-[\w-]+)\.md\)")


def notebook(page: str) -> dict[str, Any]:
    """Of a page in Markdown: a cell for each block of code, one for each text between."""
    cells = []
    pieces = _FENCE.split(page)
    for k, piece in enumerate(pieces):
        code = k % 2 == 1
        text = piece if code else _STEP.sub(r"(\1.ipynb)", _IMAGE.sub("", _HTML.sub("", piece)))
        text = re.sub(r"\n{3,}", "\n\n", text).strip()
        if not text:
            continue
        cell: dict[str, Any] = {
            "cell_type": "code" if code else "markdown",
            "id": f"cell-{len(cells) + 1}",
            "metadata": {},
            "source": text.splitlines(keepends=True),
        }
        cells.append(cell | ({"execution_count": None, "outputs": []} if code else {}))
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    language = {"name": "python"}
    return {
        "cells": cells,
        "metadata": {"kernelspec": kernel, "language_info": language},
        "nbformat": 4,
        "nbformat_minor": 5,
    }


def written(page: Path) -> str:
    text = page.read_text(encoding="utf-8")
    return json.dumps(notebook(text), indent=1, ensure_ascii=False) + "\n"


def steps() -> list[Path]:
    """The pages, in order; none where they are not there."""
    return sorted(PAGES.glob("[0-9]-*.md"))


def main() -> int:
    differ = []
    for page in steps():
        target = NOTEBOOKS / f"{page.stem}.ipynb"
        text = written(page)
        if not target.exists() or target.read_text(encoding="utf-8") != text:
            differ.append(target)
            if "--write" in sys.argv[1:]:
                NOTEBOOKS.mkdir(exist_ok=True)
                target.write_text(text, encoding="utf-8")
    for target in differ:
        print(target.relative_to(ROOT))
    return 0 if "--write" in sys.argv[1:] else len(differ)


if __name__ == "__main__":
    sys.exit(main())
