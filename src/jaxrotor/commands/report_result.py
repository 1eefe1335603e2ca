"""What `jaxrotor report RESULT` does: what another command wrote, as one page."""

import importlib
import sys
from pathlib import Path

from ..core.errors import InputError
from ..core.files import written_whole
from ..pages.page import page, require_plotly
from ..pages.result import Result, find_result

DONE = 0
# Which file of the pages lays out which kind of result.
_LAID_OUT = {
    "run": "run",
    "sweep": "sweep",
    "identify": "identify",
    "optimize": "optimize",
    "campbell": "linear",
    "response": "linear",
    "modes": "linear",
}


def report_result(place: Path, out: Path | None, quiet: bool = False) -> int:
    """Writes the page of the result; returns the exit status."""
    result = find_result(place)
    require_plotly()
    target = out if out is not None else result.page
    if target.suffix.lower() not in (".html", ".htm"):
        raise InputError(f'`{target}`: must end in .html, but ends in "{target.suffix}"')
    if not quiet:
        print(f"{result.title}: laying out", file=sys.stderr)
    text = page(result.title, _made(result), _chapters(result))
    with written_whole(target) as file:
        Path(file).write_text(text, encoding="utf-8")
    print(f"{target}   ({len(text) / 1e6:.1f} MB)")
    return DONE


def _chapters(result: Result) -> list:
    room = importlib.import_module(f"..pages.{_LAID_OUT.get(result.kind, 'other')}", __package__)
    return room.chapters(result)


def _made(result: Result) -> str:
    version = result.made.get("jaxrotor") or result.summary.get("versions", {}).get("jaxrotor")
    words = [
        f"jaxrotor {version}" if version else "",
        str(result.made.get("command") or ""),
        str(result.made.get("date") or "").replace("T", " "),
    ]
    return "Made by " + ", ".join(w for w in words if w) + "." if any(words) else str(result.folder)
