"""Ctrl-C, SIGTERM and a time limit end a command in a sentence, at any moment. This file imports nothing
heavy: it is the first that the package runs."""

import _thread
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

INTERRUPTED = 130
_reason: str | None = None
_finishing, _pending = False, False


def is_command_line() -> bool:
    """Whether this process is the program `jaxrotor`, not somebody's script."""
    given = sys.orig_argv
    if os.path.basename(sys.argv[0] if sys.argv else "") in ("jaxrotor", "jaxrotor.exe"):
        return True
    return "-m" in given and given[given.index("-m") + 1 :][:1] in (
        ["jaxrotor"],
        ["jaxrotor.commands.cli"],
    )


def leave_at_once() -> None:
    """Until something is begun: an interrupt that is raised amid imports may come out as any other error."""

    def leave(*_) -> None:
        os.write(2, f"\n{_reason or 'Interrupted'}: nothing was begun.\n".encode())
        os._exit(INTERRUPTED)

    signal.signal(signal.SIGINT, leave)


def raise_from_now_on() -> None:
    """`KeyboardInterrupt` again, and remembered; SIGTERM, which batch systems send, raises it too."""

    def interrupt(number, _) -> None:
        global _reason, _pending
        _reason = _reason or ("Interrupted" if number == signal.SIGINT else "Terminated")
        if _finishing and not _pending:
            _pending = True
            os.write(2, b"\nwriting what there is; Ctrl-C again: leave at once\n")
            return
        raise KeyboardInterrupt

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, interrupt)


def interrupted() -> str | None:
    """What stopped the program, whatever came of it; `None` where nothing did."""
    return _reason


@contextmanager
def finishing() -> Iterator[None]:
    """At the command line a first Ctrl-C in the block only shows in `interrupted()`; a second one raises."""
    global _finishing, _pending
    _finishing, _pending = True, False
    try:
        yield
    finally:
        _finishing = False


@contextmanager
def time_limit(seconds: float | None) -> Iterator[None]:
    """Raises `KeyboardInterrupt` in the block after so many seconds, as Ctrl-C would."""
    global _reason
    _reason = None

    def over() -> None:
        global _reason
        _reason = f"Stopped at the time limit of {seconds:g} s"
        _thread.interrupt_main()

    timer = None if seconds is None else threading.Timer(seconds, over)
    if timer is not None:
        timer.daemon = True
        timer.start()
    try:
        yield
    finally:
        if timer is not None:
            timer.cancel()
