"""What `jaxrotor new` and `jaxrotor schema` do: a study to begin with, and what editors know studies by."""

import json
import re
import sys
from pathlib import Path

from ..core.errors import InputError
from ..core.files import written_whole

TEMPLATES = Path(__file__).parent / "templates"
SCHEMA = "jaxrotor.schema.json"
# What is written beside a template, named after the study; the template calls it RECORD.
_BESIDE = {"identify": ("toml", "csv")}
# The commands that a template is for, by the lines of its head.
_COMMAND = re.compile(r"^#   (jaxrotor .*)$", re.MULTILINE)


def names() -> list[str]:
    """Of the templates."""
    return sorted(p.stem for p in TEMPLATES.glob("*.toml") if not p.stem.endswith("_record"))


def list_templates() -> int:
    for name in names():
        text = (TEMPLATES / f"{name}.toml").read_text(encoding="utf-8")
        print(f"{name:{max(map(len, names()))}}  {_first_sentence(text)}")
    print("\njaxrotor new NAME [FILE] writes one: a study that runs as it is, to be altered")
    return 0


def _first_sentence(text: str) -> str:
    lines = [x.removeprefix("# ") for x in text.splitlines()[1:] if x.startswith("# ")]
    return re.split(r"(?<=[.?])\s", " ".join(lines))[0].rstrip(".")


def new_study(name: str, target: Path | None, force: bool) -> int:
    """Writes the template, with the schema beside it; files that are there stay, unless `force` is set."""
    if name not in names():
        from ..study.mistakes import guess

        raise InputError(f"`{name}`: is no template{guess(name, names())}")
    target = target if target is not None else Path(f"{name}.toml")
    if target.suffix.lower() != ".toml":
        raise InputError(f"`{target}`: must end in .toml: name it {target.stem}.toml")
    files = {target: (TEMPLATES / f"{name}.toml").read_text(encoding="utf-8")}
    for ending in _BESIDE.get(name, ()):
        source = TEMPLATES / f"{name}_record.{ending}"
        files[target.with_name(f"{target.stem}_record.{ending}")] = source.read_text("utf-8")
    for file in files:
        if file.exists() and not force:
            raise InputError(f"`{file}`: is there already: name another file, or add --force")
    for file, text in files.items():
        with written_whole(file) as part:
            part.write_text(text.replace("RECORD", f"{target.stem}_record"), encoding="utf-8")
    beside = target.with_name(SCHEMA)
    if not beside.exists() or force:
        with written_whole(beside) as part:
            part.write_text(schema_text(), encoding="utf-8")
    print(f"{', '.join(map(str, files))}; beside it {SCHEMA}, by which editors complete its keys")
    for command in _COMMAND.findall(files[target]):
        print(f"  {command.replace('STUDY.toml', str(target))}")
    return 0


def schema_text() -> str:
    """Made from the parts as they are; a line for each definition."""
    from ..study.schema import schema

    found = schema()
    parts = found.pop("$defs")
    lines = [f"{json.dumps(k)}:{_compact(v)}" for k, v in parts.items()]
    return f'{_compact(found)[:-1]},\n"$defs":{{\n' + ",\n".join(lines) + "\n}}\n"


def _compact(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


def print_schema(out: Path | None) -> int:
    if out is None:
        sys.stdout.write(schema_text())
        return 0
    with written_whole(out) as part:
        part.write_text(schema_text(), encoding="utf-8")
    print(out)
    return 0
