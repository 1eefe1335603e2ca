"""Ctrl-C at the command line ends in a sentence, at any moment. This file imports nothing heavy: it is the
first that the package runs."""

import os
import signal
import sys

INTERRUPTED = 130
_seen = False


def is_command_line() -> bool:
    """Whether this process is the program `jaxrotor`, not somebody's script."""
    given = sys.orig_argv
    if os.path.basename(sys.argv[0] if sys.argv else "") in ("jaxrotor", "jaxrotor.exe"):
        return True
    return "-m" in given and given[given.index("-m") + 1 :][:1] in (["jaxrotor"], ["jaxrotor.cli"])


def leave_at_once() -> None:
    """Until something is begun: an interrupt that is raised amid imports may come out as any other error."""

    def leave(*_) -> None:
        os.write(2, b"\nInterrupted: nothing was begun.\n")
        os._exit(INTERRUPTED)

    signal.signal(signal.SIGINT, leave)


def raise_from_now_on() -> None:
    """`KeyboardInterrupt` again, and remembered."""

    def interrupt(*_) -> None:
        global _seen
        _seen = True
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupt)


def interrupted() -> bool:
    """Whether Ctrl-C has been pressed since, whatever came of it."""
    return _seen
