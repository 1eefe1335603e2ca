"""How results were made: written beside their numbers, so that a report can say it."""

import contextlib
import contextvars
import datetime
import shlex
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from ..core.version import installed_version

if TYPE_CHECKING:
    from ..study.study import Study

_command: contextvars.ContextVar[str] = contextvars.ContextVar("command", default="")


@contextlib.contextmanager
def by_command(arguments: Sequence[str]) -> Iterator[None]:
    """What is written inside was asked for by these arguments of `jaxrotor`."""
    token = _command.set(shlex.join(["jaxrotor", *arguments]))
    try:
        yield
    finally:
        _command.reset(token)


def made_of(study: "Study") -> dict[str, Any]:
    """For a summary: command, version, date, and the study as its file was written."""
    now = datetime.datetime.now().astimezone().isoformat(timespec="seconds")
    try:
        text = "" if study.path is None else study.path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):  # moved since it was read
        text = ""
    return {
        "command": _command.get(),
        "jaxrotor": installed_version(),
        "date": now,
        "study": text,
    }
