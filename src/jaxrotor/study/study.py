"""A study: one machine, one simulation, and what to report of it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..machine import Machine
from ..parameter import require_x64
from ..protocol import AbstractStation
from ..units import shown
from .document import read_document
from .faults import Faults, guess
from .machine import MachineReader
from .settings import Report, Simulation, check_simulation, read_section

_SECTIONS = ("title", "source", "machine", "simulation", "report")


@dataclass(frozen=True)
class Study:
    """What `load` read. `settings` are those of the simulation, in SI; `path` is the file."""

    machine: Machine
    settings: Simulation
    title: str = ""
    source: str = ""
    report: Report = Report()
    path: Path | None = None

    @property
    def name(self) -> str:
        """The file's name without its ending: what its results are kept under."""
        return self.path.stem if self.path is not None else "study"

    def run(self, progress: bool | None = None) -> Any:
        """Simulates: the `Response`. `progress`: as in `jaxrotor.simulate`."""
        import jaxrotor

        return jaxrotor.simulate(self.machine, **self.settings.arguments(), progress=progress)


def load(path: str | Path) -> Study:
    """Reads and checks a study file (TOML).

    Nothing runs. An `InputError` lists every fault of the whole file, each with its place, the
    value found and the remedy.
    """
    require_x64()
    path = Path(path)
    document = read_document(path)
    faults = Faults()
    faults.unknown_keys("the study", document, _SECTIONS)
    texts = {key: _text(key, document.get(key, ""), faults) for key in ("title", "source")}
    machine = settings = report = None
    if "machine" in document:
        reader = MachineReader(document["machine"], faults, path.resolve().parent)
        machine = reader.read()
    else:
        faults.add("machine", "is missing: write [[machine.line]] tables, from left to right")
    if "simulation" in document:
        settings = read_section(Simulation, "simulation", document["simulation"], faults)
    else:
        faults.add("simulation", "is missing: write [simulation] with t_end and sample_rate")
    report = read_section(Report, "report", document.get("report", {}), faults)
    if settings is not None:
        check_simulation(settings, faults)
        if machine is not None:
            _check_start(machine, settings, faults)
    if machine is not None and report is not None:
        _check_report(report, machine, faults)
    if machine is None or settings is None or report is None or faults.sentences:
        raise InputError(*(f"{path.name}: {sentence}" for sentence in faults.sentences))
    return Study(machine, settings, report=report, path=path, **texts)


def _text(key: str, value: Any, faults: Faults) -> str:
    if not isinstance(value, str):
        faults.add(key, f"must be a text, but is {shown(value)}: put it in quotes")
        return ""
    return value


def _check_start(machine: Machine, settings: Simulation, faults: Faults) -> None:
    """Whether the line can start at the speed asked for."""
    from ..solve.simulate import _initial_speed

    try:
        _initial_speed(machine, settings.initial, settings.speed)
    except InputError as error:
        faults.sentences += [f"`simulation`: {problem}" for problem in error.problems]


def _check_report(report: Report, machine: Machine, faults: Faults) -> None:
    names = [n for n, e in machine.elements().items() if isinstance(e, AbstractStation)]
    if report.main is not None and report.main not in names:
        faults.add("report", f'main names no station "{report.main}"{guess(report.main, names)}')
