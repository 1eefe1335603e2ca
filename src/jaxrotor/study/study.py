"""A study: one machine, one simulation, and what to report of it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import simulation
from ..core.arguments import path
from ..core.document import read_document
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import require_x64
from ..core.protocol import AbstractPrescribed, AbstractStation
from ..core.result_text import shows
from ..core.units import shown
from ..machine.machine import Machine
from .diagnosis import Diagnosis
from .figures import Figure, check_figures, read_figures
from .machine import MachineReader
from .mistakes import Faults, guess
from .settings import Report, Simulation, check_simulation, read_section

_SECTIONS = (
    "title",
    "source",
    "machine",
    "simulation",
    "report",
    "figures",
    "identify",
    "optimize",
    "sweep",
)


_NO_SIMULATION = "simulation: is missing: write [simulation] with t_end and sample_rate"


@shows(without=("figures", "identify", "optimize", "sweep"))
@dataclass(frozen=True)
class Study:
    """What `load` read. `simulation` are the settings of a run, in SI; `figures` are drawn beside
    those that `report` chooses; `identify`, `optimize` and `sweep` are what the commands of these names
    are asked for; `path` is the file."""

    machine: Machine
    simulation: Simulation | None
    title: str = ""
    source: str = ""
    report: Report = Report()
    figures: tuple[Figure | Diagnosis, ...] = ()
    path: Path | None = None
    identify: Any = None
    optimize: Any = None
    sweep: Any = None

    @property
    def settings(self) -> Simulation:
        """Those of `simulation`; raises `InputError` where the study has none."""
        if self.simulation is None:
            raise InputError(_NO_SIMULATION)
        return self.simulation

    @property
    def name(self) -> str:
        """The file's name without its ending: what its results are kept under."""
        return self.path.stem if self.path is not None else "study"

    def run(self, progress: bool | None = None) -> Any:
        """Simulates: the `Response`. `progress`: as in `jaxrotor.simulate`."""
        return simulation.simulate(self.machine, **self.settings.arguments(), progress=progress)


@takes(path=path)
def load(path: str | Path, run: bool = True) -> Study:
    """Reads and checks a study file (TOML). `run`: whether it must have a [simulation], which linear analysis
    does without.

    Nothing runs. An `InputError` lists every fault of the whole file, each with its place, the
    value found and the remedy.
    """
    require_x64()
    path = Path(path)
    document = read_document(path, "[machine] and [simulation]")
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
    elif run or any(key in document for key in ("identify", "optimize", "sweep")):
        faults.sentences.append(_NO_SIMULATION)
    report = read_section(Report, "report", document.get("report", {}), faults)
    figures = read_figures(document.get("figures", []), faults)
    if settings is not None:
        check_simulation(settings, faults)
        if machine is not None:
            _check_length(machine, settings, faults)
            _check_start(machine, settings, faults)
    if machine is not None and report is not None:
        _check_report(report, machine, faults)
    if machine is not None:
        check_figures(figures, machine, faults)
    if machine is None or report is None or faults.sentences:
        raise InputError(*(f"{path.name}: {sentence}" for sentence in faults.sentences))
    asked = {} if settings is None else _asked(document, machine, settings, path)
    return Study(machine, settings, report=report, figures=figures, path=path, **asked, **texts)


def _asked(document: dict, machine: Machine, settings: Simulation, path: Path) -> dict[str, Any]:
    """The sections [identify], [optimize] and [sweep], where there are any."""
    folder, asked, sentences = path.resolve().parent, {}, []
    try:
        if "identify" in document:
            from .identify import read_identify

            asked["identify"] = read_identify(document["identify"], machine, folder)
    except InputError as error:
        sentences += error.problems
    try:
        if "optimize" in document:
            from .optimize import read_optimize

            asked["optimize"] = read_optimize(document["optimize"], machine, settings, folder)
    except InputError as error:
        sentences += error.problems
    try:
        if "sweep" in document:
            from .sweep import read_sweep

            asked["sweep"] = read_sweep(document["sweep"], machine, settings, folder)
    except InputError as error:
        sentences += error.problems
    if sentences:
        raise InputError(*(f"{path.name}: {sentence}" for sentence in sentences))
    return asked


def _text(key: str, value: Any, faults: Faults) -> str:
    if not isinstance(value, str):
        faults.add(key, f"must be a text, but is {shown(value)}: put it in quotes")
        return ""
    return value


def _check_length(machine: Machine, settings: Simulation, faults: Faults) -> None:
    """Whether memory holds the run."""
    from ..simulation.checks import sample_count

    if settings.t_end * settings.sample_rate < 2:  # is told already
        return
    try:
        sample_count(settings.t_end, settings.sample_rate, len(machine.wiring.stations))
    except InputError as error:
        faults.sentences += [f"`simulation`: {p}" for p in error.problems]


def _check_start(machine: Machine, settings: Simulation, faults: Faults) -> None:
    """Whether the line can start at the speed asked for; a drive has a speed of its own."""
    if settings.speed is None and settings.initial != "steady":
        return
    drive = _drive_speed(machine)
    speed = drive if settings.speed is None else settings.speed
    if drive is not None and abs((speed or 0.0) - drive) > 1e-9 * max(1.0, abs(drive)):
        faults.add(
            "simulation",
            f"speed must be the drive's own, {drive:g} rad/s at t = 0, but is {speed:g} rad/s: "
            "leave it out, or change the drive's profile",
        )
    if settings.initial == "steady" and not speed:
        faults.add(
            "simulation",
            'speed must not be zero where initial is "steady" (running in whirl), but is 0 rad/s: '
            + ('write speed = "3000 rpm"' if drive is None else "let the drive start running"),
        )


def _drive_speed(machine: Machine) -> float | None:
    """Speed of a driven end at the start, rad/s; None where the line spins freely."""
    import jax

    from ..machine.wiring import FIXED

    motions = [s.motion for s in machine.stations if isinstance(s, AbstractPrescribed)]
    held = [h for h in machine.wiring.held if h.coordinate == 5 and h.motion != FIXED]
    if motions:
        return float(jax.jvp(motions[0], (0.0,), (1.0,))[1][5])
    if held:
        return float(jax.jvp(machine.motions[held[0].motion].position, (0.0,), (1.0,))[1])
    return None


def _check_report(report: Report, machine: Machine, faults: Faults) -> None:
    names = [n for n, e in machine.elements().items() if isinstance(e, AbstractStation)]
    if report.main is not None and report.main not in names:
        faults.add("report", f'main names no station "{report.main}"{guess(report.main, names)}')
