"""The command line: `jaxrotor run|check|show|modes|campbell|response|torsional|assess|report|identify|
optimize|sweep STUDY.toml`,
`jaxrotor report RESULT`, `jaxrotor record FILE`, `jaxrotor new|schema|completion`.

JAX is imported after the arguments are read, so that `--help` answers at once; 64-bit floats are
set here, by the program, never by the library.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..core.errors import InputError, JaxrotorError, MissingExtraError, StoreError
from ..core.interrupt import (
    INTERRUPTED,
    interrupted,
    is_command_line,
    raise_from_now_on,
    time_limit,
)
from ..core.version import installed_version
from .made import by_command
from .parser import parser

OK, INPUT, FAILED = 0, 2, 3


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit status."""
    top = parser()
    given = top.parse_args(arguments)
    if given.version:
        print(f"jaxrotor {installed_version()}")
        return OK
    if given.command is None:
        top.print_help()
        return OK
    try:
        if given.command == "completion":  # the shell waits for it
            return _completion(given)
        _set_up()
        limit = _limit(getattr(given, "time_limit", None))
        commands = {
            "run": _run,
            "check": _check,
            "show": _show,
            "modes": _modes,
            "campbell": _campbell,
            "response": _response,
            "torsional": _torsional,
            "assess": _assess,
            "report": _report,
            "identify": _identify,
            "optimize": _optimize,
            "sweep": _sweep,
            "record": _record,
            "new": _new,
            "schema": _schema,
        }
        told = sys.argv[1:] if arguments is None else arguments
        with time_limit(limit), by_command(told):
            return commands[given.command](given)
    except JaxrotorError as error:
        for problem in error.problems:
            print(problem, file=sys.stderr)
        if len(error.problems) > 1:
            print(f"{len(error.problems)} problems; nothing was run.", file=sys.stderr)
        return INPUT if isinstance(error, (InputError, MissingExtraError, StoreError)) else FAILED
    except KeyboardInterrupt as stopped:
        return _stopped(str(stopped), arguments is None)
    except OSError as error:
        where = f"`{error.filename}`: " if error.filename else ""
        print(f"{where}cannot be written ({error.strerror}): choose --out", file=sys.stderr)
        return INPUT
    except Exception:
        if interrupted():  # an import that is stopped may end in any error
            return _stopped("", arguments is None)
        raise


def _stopped(words: str, alone: bool) -> int:
    why = interrupted() or "Interrupted"
    print(f"\n{why}: {words or 'nothing was written'}.", file=sys.stderr, flush=True)
    if alone:
        # Compiled code runs on in threads, and an orderly exit would wait for its end.
        os._exit(INTERRUPTED)
    return INTERRUPTED


def _limit(text: str | None) -> float | None:
    from .options import quantity_of

    seconds = quantity_of(text, "s", "--time-limit")
    if seconds is not None and not 0 < seconds < float("inf"):
        raise InputError(f"`--time-limit`: must be positive, but is {text}")
    return seconds


def _set_up() -> None:
    os.environ.setdefault("MPLBACKEND", "Agg")
    os.environ["JAX_ENABLE_X64"] = "1"
    import jax

    jax.config.update("jax_enable_x64", True)  # where something imported JAX before
    from ..core.cache import enable_for_commands

    enable_for_commands()


def _load(path: Path, run: bool = True) -> Any:
    from ..study.study import load

    study = load(path, run)
    if is_command_line():
        raise_from_now_on()
    return study


def _check(given: argparse.Namespace) -> int:
    from .check import check_study

    study = _load(given.study)
    check_study(study)
    machine, settings = study.machine, study.settings
    kinds = [type(e).__name__ for e in machine.elements().values()]
    counted = ", ".join(f"{kinds.count(k)} {k}" for k in dict.fromkeys(kinds))
    print(
        f"{given.study}: in order: {counted}; {settings.t_end:g} s at {settings.sample_rate:g} Hz"
    )
    return OK


def _show(given: argparse.Namespace) -> int:
    from matplotlib.backend_bases import FigureCanvasBase

    from ..core.files import written_whole
    from ..plot.machine import draw_machine
    from ..plot.style import figure_of

    study = _load(given.study, run=False)
    target = given.out or Path(f"{study.name}.png")
    formats = FigureCanvasBase.get_supported_filetypes()
    if not target.is_dir() and target.suffix[1:].lower() not in formats:
        raise InputError(
            f"`{target}`: must end in the name of a picture format, but ends in "
            f'"{target.suffix}": name it {target.stem}.png, .svg or .pdf'
        )
    figure = figure_of(draw_machine(study.machine))
    with written_whole(target) as part:
        figure.savefig(part, dpi=150, bbox_inches="tight", format=target.suffix[1:])
    print(target)
    return OK


def _run(given: argparse.Namespace) -> int:
    from .run import run_study

    return run_study(_load(given.study), given.out, quiet=given.quiet, force=given.force)


def _modes(given: argparse.Namespace) -> int:
    from .linear import run_modes

    return run_modes(
        _load(given.study, run=False), given.speed, given.count, given.out, given.force
    )


def _campbell(given: argparse.Namespace) -> int:
    from .linear import run_campbell

    try:
        orders = tuple(float(x) for x in given.orders.split(","))
    except ValueError:
        raise InputError(
            f"`--orders`: must be numbers between commas, such as 1,2, but is {given.orders!r}"
        ) from None
    return run_campbell(
        _load(given.study, run=False),
        given.to,
        given.points,
        given.modes,
        orders,
        given.out,
        given.force,
    )


def _response(given: argparse.Namespace) -> int:
    from .response import run_response

    return run_response(
        _load(given.study, run=False),
        given.outputs,
        given.to,
        given.points,
        given.at,
        given.speed,
        given.out,
        given.force,
    )


def _torsional(given: argparse.Namespace) -> int:
    from .torsional import run_torsional

    study = _load(given.study, run=False)
    return run_torsional(study, given.out, given.force, not given.no_run, given.quiet)


def _assess(given: argparse.Namespace) -> int:
    from .assess import run_assess

    study = _load(given.study, run=False)
    return run_assess(study, given.out, not given.no_gradients, given.quiet, given.force)


def _report(given: argparse.Namespace) -> int:
    place: Path = given.study
    if place.suffix.lower() != ".toml":
        if given.standard is not None:
            raise InputError(
                f"`--standard`: goes with a study, STUDY.toml, but `{place}` is none: leave it out for the "
                "page of a result"
            )
        from .report_result import report_result

        return report_result(place, given.out, given.quiet)
    from .report import run_report

    study = _load(place, run=False)
    return run_report(study, given.out, not given.no_gradients, given.quiet)


def _identify(given: argparse.Namespace) -> int:
    from .identify import run_identify

    return run_identify(_load(given.study), given.out, given.quiet, given.force)


def _optimize(given: argparse.Namespace) -> int:
    from .optimize import run_optimize

    return run_optimize(_load(given.study), given.out, given.quiet, given.force)


def _sweep(given: argparse.Namespace) -> int:
    from .sweep import run_sweep

    return run_sweep(_load(given.study), given.out, given.resume, given.quiet, given.force)


def _record(given: argparse.Namespace) -> int:
    from .record import init_record, run_record

    if is_command_line():
        raise_from_now_on()
    if given.init is None:
        return run_record(given.file, given.out, given.force)
    return init_record(given.file, Path(given.init) if given.init else None, given.force)


def _new(given: argparse.Namespace) -> int:
    from .new import list_templates, new_study

    if given.list or given.template is None:
        return list_templates()
    return new_study(given.template, given.file, given.force)


def _schema(given: argparse.Namespace) -> int:
    from .new import print_schema

    return print_schema(given.out)


def _completion(given: argparse.Namespace) -> int:
    from .completion import script

    print(script(parser(), given.shell))
    return OK


if __name__ == "__main__":
    sys.exit(main())
