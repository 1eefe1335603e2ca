"""What the command line takes."""

import argparse
from pathlib import Path
from typing import Any

from . import help_texts

_TAKES = {
    "report": (
        "RESULT",
        "a folder of results or a file in it; or a study (.toml) with [standards], to be assessed",
    )
}


def _writes(command: argparse.ArgumentParser, name: str, quiet: str) -> None:
    """What a command takes that writes a folder of its own."""
    command.add_argument(
        "--out", metavar="DIR", type=Path, help=f"folder (default: results/<study>_{name})"
    )
    command.add_argument("--quiet", action="store_true", help=quiet)
    command.add_argument("--force", action="store_true", help="write into a folder in use")


def _added(commands: Any, name: str, words: str, epilog: str | None = None) -> Any:
    """A command, told in the same words in the list and on its own page."""
    return commands.add_parser(
        name,
        help=words,
        description=f"{words[0].upper()}{words[1:]}.",
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(
        prog="jaxrotor",
        description=help_texts.ABOUT,
        epilog=help_texts.EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("--version", action="store_true", help="print the version and stop")
    commands = top.add_subparsers(dest="command", metavar="COMMAND")

    def command(name: str, words: str) -> argparse.ArgumentParser:
        sub = _added(commands, name, words)
        what = _TAKES.get(name, ("STUDY", "a study file (.toml)"))
        sub.add_argument("study", metavar=what[0], type=Path, help=what[1])
        return sub

    run = command("run", "simulate a study; write data, summary and figures")
    run.add_argument("--out", metavar="DIR", type=Path, help="folder (default: results/<study>)")
    run.add_argument("--quiet", action="store_true", help="no progress bar, no table")
    run.add_argument(
        "--force", action="store_true", help="write into a folder that holds other files too"
    )
    command("check", "validate a study, all of it; run nothing")
    show = command("show", "draw the machine of a study, side view to scale")
    show.add_argument("--out", metavar="FILE", type=Path, help="picture (default: <study>.png)")
    modes = command("modes", "print natural frequencies, damping and whirl of each mode")
    modes.add_argument("--speed", metavar="SPEED", help='such as "3000 rpm" (default: at rest)')
    modes.add_argument("--count", type=int, default=12, help="how many modes (default: 12)")
    modes.add_argument(
        "--out", metavar="DIR", type=Path, help="write their shapes, drawn and as numbers"
    )
    modes.add_argument("--force", action="store_true", help="write into a folder in use")
    campbell = command("campbell", "natural frequencies over speed: figure, table, critical speeds")
    campbell.add_argument(
        "--to",
        metavar="SPEED",
        help='highest speed, such as "6000 rpm" (default: 1.2 of the drive\'s)',
    )
    campbell.add_argument("--points", type=int, default=61, help="speeds (default: 61)")
    campbell.add_argument("--modes", type=int, default=10, help="how many modes (default: 10)")
    campbell.add_argument(
        "--orders", default="1", help="excitation per turn, such as 1,2,4 (default: 1)"
    )
    campbell.add_argument(
        "--out", metavar="DIR", type=Path, help="folder (default: results/<study>_campbell)"
    )
    campbell.add_argument("--force", action="store_true", help="write into a folder in use")
    response = command(
        "response",
        "unbalance response over speed, or the response to a harmonic force: Bode, polar",
    )
    response.add_argument(
        "--outputs",
        metavar="NAMES",
        help='what to watch, such as "disc.x,bearing.force.x,shaft.torque" (default: the rotors)',
    )
    response.add_argument(
        "--to",
        metavar="SPEED",
        help='highest speed or frequency, such as "6000 rpm" (default: 1.2 of the drive\'s)',
    )
    response.add_argument("--points", type=int, default=600, help="speeds (default: 600)")
    response.add_argument(
        "--at", metavar="NAMES", help='harmonic force instead of unbalance, at such as "disc.x"'
    )
    response.add_argument(
        "--speed", metavar="SPEED", help="with --at: the speed of the machine (default: at rest)"
    )
    response.add_argument(
        "--out", metavar="DIR", type=Path, help="folder (default: results/<study>_response)"
    )
    response.add_argument("--force", action="store_true", help="write into a folder in use")
    torsion = command(
        "torsional",
        "torsional analysis: modes, separation, forced response, starts, as [torsional] asks",
    )
    torsion.epilog = help_texts.TORSIONAL
    torsion.add_argument(
        "--no-run", action="store_true", help="leave the start out: run nothing of [simulation]"
    )
    _writes(torsion, "torsional", "no progress bar")
    judged = command(
        "assess",
        "hold the machine against API and ISO, as [standards] asks: limits, verdicts, what helps",
    )
    judged.epilog = help_texts.ASSESS
    judged.add_argument(
        "--out", metavar="DIR", type=Path, help="folder (default: results/<study>_assess)"
    )
    report = command("report", "a result as one page, or the assessment of a study as a document")
    report.epilog = help_texts.REPORT
    report.add_argument(
        "--standard", choices=("api617",), help="of a study: whose order (default: api617)"
    )
    report.add_argument(
        "--out",
        metavar="FILE",
        type=Path,
        help="file (default: <result>.html, or results/<study>_report.html)",
    )
    judged.add_argument("--force", action="store_true", help="write into a folder in use")
    for each in (judged, report):
        each.add_argument(
            "--no-gradients", action="store_true", help="without what moves each number, sooner"
        )
        each.add_argument("--quiet", action="store_true", help="no progress bar")
    found = command(
        "identify", "find parameters from measured runs, as [identify] in the study asks"
    )
    _writes(found, "identify", "no progress bar, no table")
    best = command(
        "optimize", "find the best design under constraints, as [optimize] in the study asks"
    )
    best.epilog = help_texts.OPTIMIZE
    _writes(best, "optimize", "no progress bar, no table")
    many = command(
        "sweep",
        "run a machine many times over, with scatter or on a grid, as [sweep] in the study asks",
    )
    many.epilog = help_texts.SWEEP
    many.add_argument(
        "--out", metavar="DIR", type=Path, help="folder (default: results/<study>_sweep)"
    )
    many.add_argument("--resume", action="store_true", help="go on with a sweep that was stopped")
    many.add_argument("--quiet", action="store_true", help="no progress bar, no table")
    many.add_argument(
        "--force", action="store_true", help="write into a folder in use, over a stopped sweep too"
    )
    record = _added(
        commands,
        "record",
        "show what a file of measured data holds, or write a record file for it",
        help_texts.RECORD,
    )
    record.add_argument("file", metavar="FILE", type=Path, help="a file of data, or a record file")
    record.add_argument(
        "-o", "--out", metavar="DIR", type=Path, help="folder (default: results/<file>_record)"
    )
    record.add_argument(
        "--init",
        metavar="NAME.toml",
        nargs="?",
        const="",
        help="write a record file for FILE instead (default: beside it, ending in .toml)",
    )
    record.add_argument(
        "--force", action="store_true", help="write into a folder in use, or over a record file"
    )
    _add_helpers(commands)
    for lasting in (run, found, best, many):
        lasting.add_argument(
            "--time-limit",
            metavar="TIME",
            help='stop after such as "30 min", and keep what there is',
        )
    return top


def _add_helpers(commands: Any) -> None:
    """What helps to write studies, and runs none."""
    new = _added(
        commands, "new", "write a study to begin with: commented, it runs as it is", help_texts.NEW
    )
    new.add_argument("template", metavar="TEMPLATE", nargs="?", help="which one (see --list)")
    new.add_argument(
        "file", metavar="FILE", nargs="?", type=Path, help="file (default: <template>.toml)"
    )
    new.add_argument("--list", action="store_true", help="say which templates there are")
    new.add_argument("--force", action="store_true", help="write over files that are there")
    known = _added(
        commands, "schema", "print the JSON Schema of studies, for editors", help_texts.SCHEMA
    )
    known.add_argument("--out", metavar="FILE", type=Path, help="file (default: printed)")
    shell = _added(
        commands,
        "completion",
        "print a script by which a shell completes commands, options and files",
        help_texts.COMPLETION,
    )
    shell.add_argument("shell", choices=("bash", "zsh", "fish"), help="which shell")
