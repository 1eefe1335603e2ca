"""A study: one machine, one simulation, and what to report of it."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import simulation
from ..core.arguments import path
from ..core.document import read_document
from ..core.errors import InputError
from ..core.gate import takes
from ..core.parameter import require_x64
from ..core.protocol import AbstractStation
from ..core.result_text import shows
from ..core.units import shown
from ..machine.machine import Machine
from ..simulation.simulation import Simulation
from .diagnosis import Diagnosis
from .figures import Figure, check_figures, read_figures
from .machine import MachineReader
from .mistakes import Faults, guess
from .settings import Report, read_section, read_simulation

if TYPE_CHECKING:
    from ..standards.finding import Assessment

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
    "torsional",
    "standards",
)


_NO_SIMULATION = (
    "simulation: is missing: write [simulation] with t_end and sample_rate (for the machine alone, "
    "jr.load(path, run=False) does without)"
)


@shows(without=("figures", "identify", "optimize", "sweep", "torsional", "standards"))
@dataclass(frozen=True)
class Study:
    """What `load` read. `simulation`: how the machine is run; `figures` are drawn beside
    those that `report` chooses; `identify`, `optimize`, `sweep` and `torsional` are what the commands of
    these names are asked for, `standards` is what `jaxrotor assess` is; `path` is the file."""

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
    torsional: Any = None
    standards: Any = None

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
        return simulation.simulate(self.machine, self.settings, progress=progress)

    def assess(self) -> "Assessment":
        """What [standards] and [torsional] ask for: all findings, in the order of the field. Raises
        `InputError` where the study asks for none, and as the checks do."""
        from .assessing import assessed

        return assessed(self.machine, self.standards, self.torsional, moving=False).assessment


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
        settings = read_simulation(document["simulation"], machine, faults)
    elif run or any(key in document for key in ("identify", "optimize", "sweep")):
        faults.sentences.append(_NO_SIMULATION)
    report = read_section(Report, "report", document.get("report", {}), faults)
    figures = read_figures(document.get("figures", []), faults)
    if machine is not None and report is not None:
        _check_report(report, machine, faults)
    torsional = standards = None
    if machine is not None:
        check_figures(figures, machine, faults)
        torsional = _torsional(document, machine, faults)
        standards = _standards(document, machine, faults)
    if machine is None or report is None or faults.sentences:
        raise InputError(*(f"{path.name}: {sentence}" for sentence in faults.sentences))
    asked = {} if settings is None else _asked(document, machine, settings, path)
    return Study(
        machine,
        settings,
        report=report,
        figures=figures,
        path=path,
        torsional=torsional,
        standards=standards,
        **asked,
        **texts,
    )


def _torsional(document: dict, machine: Machine, faults: Faults) -> Any:
    """The section [torsional], where there is one: it does without [simulation]."""
    if "torsional" not in document:
        return None
    from .torsional import read_torsional

    try:
        return read_torsional(document["torsional"], machine)
    except InputError as error:
        faults.sentences += error.problems
        return None


def _standards(document: dict, machine: Machine, faults: Faults) -> Any:
    """The section [standards], likewise."""
    if "standards" not in document:
        return None
    from .read_standards import read_standards

    try:
        return read_standards(document["standards"], machine)
    except InputError as error:
        faults.sentences += error.problems
        return None


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


def _check_report(report: Report, machine: Machine, faults: Faults) -> None:
    names = [n for n, e in machine.elements().items() if isinstance(e, AbstractStation)]
    if report.main is not None and report.main not in names:
        faults.add("report", f'main names no station "{report.main}"{guess(report.main, names)}')
