"""What `jaxrotor record` does: what is in a file of measured data, printed and drawn; or a record file."""

from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.files import folder_written_whole, save_json, written_whole
from ..sensors.draft import draft, unknowns
from ..sensors.read import read_record
from ..sensors.sampling import rate_of, suspicions
from ..sensors.survey import Signal, Survey, of_record, survey
from .output import save_figure

_HEADER = (
    "signal",
    "samples",
    "from, s",
    "to, s",
    "rate, Hz",
    "unit",
    "least",
    "greatest",
    "rms",
    "missing",
)


def run_record(file: Path, out: Path | None, force: bool) -> int:
    """Prints and draws the signals of a record file, or of a data file of any kind."""
    from ..plot.record import signals_over_time, spectra

    described = file.suffix.lower() == ".toml"
    found = of_record(file, read_record(file)) if described else survey(file)
    odd = {one.name: suspicions(one.t, one.values) for one in found.signals}
    print(_table(found.signals))
    _tell(found, odd)
    folder = out if out is not None else Path("results") / f"{file.stem}_record"
    with folder_written_whole(folder, force) as part:
        names = ["signals.png", "spectra.png", "summary.json"]
        save_figure(signals_over_time(found.signals, file.name), part / names[0])
        drawn = spectra(found.signals, f"{file.name}: amplitude spectra")
        if drawn is None:
            names.remove("spectra.png")
        else:
            save_figure(drawn, part / names[1])
        save_json(part / "summary.json", _summary(found, odd))
    print(f"\n{folder}/: {', '.join(names)}")
    if not described:
        print(f"a record file for it: jaxrotor record {file} --init")
    return 0


def init_record(file: Path, target: Path | None, force: bool) -> int:
    """Writes a record file in TOML for a data file."""
    if file.suffix.lower() == ".toml":
        raise InputError(
            f"`{file}`: is a record file already: name a file of data, such as run.csv"
        )
    target = target if target is not None else file.with_suffix(".toml")
    if target.suffix.lower() != ".toml":
        raise InputError(f"`{target}`: must end in .toml: name it {target.stem}.toml")
    if target.exists() and not force:
        raise InputError(
            f"`{target}`: is there already: name another file after --init, or add --force"
        )
    found = survey(file)
    text = draft(found, target)
    with written_whole(target) as part:
        part.write_text(text, encoding="utf-8")
    print(f"{target}: {len(found.signals)} channels")
    _tell(found, {})
    if count := unknowns(found):
        many = "entries are" if count > 1 else "entry is"
        print(f'\n{count} {many} still "?": write what is known there before it is read')
    return 0


def _tell(found: Survey, odd: dict[str, list[str]]) -> None:
    who: dict[str, list[str]] = {}
    for name, each in odd.items():
        for words in each:
            who.setdefault(words, []).append(name)
    suspicious = [f"{_listed(names, len(odd))}: {words}" for words, names in who.items()]
    left = [f"{name}: {words}" for name, words in found.left_out.items()]
    for heading, lines in (
        ("how it was read", found.notes),
        ("guessed", found.guesses),
        ("left out", left),
        ("suspicious", suspicious),
    ):
        if lines:
            print(f"\n{heading}:")
        for line in lines:
            print(f"  {line}")


def _listed(names: list[str], count: int) -> str:
    if len(names) == count > 1:
        return "all signals"
    more = f" and {len(names) - 4} more" if len(names) > 5 else ""
    return ", ".join(names[:4] if more else names) + more


def _facts(one: Signal) -> dict[str, Any]:
    """What the table shows of a signal; `None` for what is not known."""
    held = one.values[np.isfinite(one.values)]
    t = one.t if one.t is not None and one.t.size else None
    return {
        "samples": int(one.values.size),
        "from_s": float(t[0]) if t is not None else None,
        "to_s": float(t[-1]) if t is not None else None,
        "rate_Hz": rate_of(t) if t is not None else None,
        "unit": one.unit or None,
        "least": float(held.min()) if held.size else None,
        "greatest": float(held.max()) if held.size else None,
        "rms": float(np.sqrt(np.mean(held**2))) if held.size else None,
        "missing": int(one.values.size - held.size),
    }


def _summary(found: Survey, odd: dict[str, list[str]]) -> dict[str, Any]:
    return {
        "file": str(found.file),
        "signals": {one.name: _facts(one) | {"suspicious": odd[one.name]} for one in found.signals},
        "notes": found.notes,
        "guesses": found.guesses,
        "left_out": found.left_out,
    }


def _table(signals: list[Signal]) -> str:
    rows = [_HEADER, *(_row(one) for one in signals)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(_HEADER))]
    left = (0, 5)
    return "\n".join(
        "  ".join(
            text.ljust(width) if k in left else text.rjust(width)
            for k, (text, width) in enumerate(zip(row, widths))
        ).rstrip()
        for row in rows
    )


def _row(one: Signal) -> tuple[str, ...]:
    facts = _facts(one)
    rate = "?" if one.t is None else "uneven"
    return (
        one.name,
        str(facts["samples"]),
        *(_shown(facts[key], 6) for key in ("from_s", "to_s")),
        rate if facts["rate_Hz"] is None else _shown(facts["rate_Hz"], 6),
        one.unit or "?",
        *(_shown(facts[key], 4) for key in ("least", "greatest", "rms")),
        str(facts["missing"]),
    )


def _shown(value: float | None, digits: int) -> str:
    return "?" if value is None else f"{value:.{digits}g}"
