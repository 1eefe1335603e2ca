"""The map of the source: its rooms (packages) from the top floor down, and what each uses, from the imports.

    python docs/house.py           prints it
    python docs/house.py --write   writes it into CONTRIBUTING.md

The order of the rooms is kept here and held by tests/test_house.py: a room uses those below it alone.
"""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "jaxrotor"
BEGIN, END = "<!-- map: python docs/house.py --write -->", "<!-- end of map -->"
# From the ground up.
ORDER = """
core profiles machine
elements/laws elements/rotors elements/shafts elements/couplings elements/drives elements/bearings
elements/control elements integrators simulation linear periodic sensors interop search identification
objectives optimization sweeps diagnostics standards plot study pages commands
""".split()


def room(module: tuple[str, ...]) -> str:
    """Of a module, by the parts of its path in the source; "" for the package itself."""
    if (
        module[:1] == ("elements",)
        and len(module) > 1
        and (SOURCE / "elements" / module[1]).is_dir()
    ):
        return "/".join(module[:2])
    return module[0] if module and (SOURCE / module[0]).is_dir() else ""


def imports(file: Path) -> Iterator[tuple[str, ...]]:
    """Each module of ours that a file imports anywhere, as parts of its path."""
    package = file.relative_to(SOURCE).parts[:-1]
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            for name in node.names:
                first, *rest = name.name.split(".")
                if first == "jaxrotor":
                    yield tuple(rest)
        elif isinstance(node, ast.ImportFrom):
            module = tuple(node.module.split(".")) if node.module else ()
            if node.level:
                base = package[: len(package) - node.level + 1]
            elif module[:1] == ("jaxrotor",):
                base, module = (), module[1:]
            else:
                continue
            for name in node.names:  # `from ..plot import select`: a module or what one holds
                path = (*base, *module)
                deeper = SOURCE.joinpath(*path, name.name)
                yield (
                    (*path, name.name)
                    if deeper.is_dir() or deeper.with_suffix(".py").is_file()
                    else path
                )


def arrows() -> dict[tuple[str, str], list[str]]:
    """(room, room that it uses) -> the files that do. What gathers public names (`__init__`) is no arrow."""
    found: dict[tuple[str, str], list[str]] = {}
    for file in sorted(SOURCE.rglob("*.py")):
        own = room(file.relative_to(SOURCE).with_suffix("").parts)
        if file.name == "__init__.py" or not own:
            continue
        for module in imports(file):
            if room(module) != own:
                found.setdefault((own, room(module)), []).append(str(file.relative_to(SOURCE)))
    return found


def circles() -> list[list[str]]:
    """Files that import each other, in whatever round; what a function imports, or a type checker, counts."""
    uses: dict[str, set[str]] = {}
    for file in SOURCE.rglob("[!_]*.py"):
        modules = (SOURCE.joinpath(*module).with_suffix(".py") for module in imports(file))
        uses[_name(file)] = {_name(module) for module in modules if module.is_file()}

    def reached(name: str) -> set[str]:
        found, waiting = set(), [name]
        while waiting:
            new = uses.get(waiting.pop(), set()) - found
            found |= new
            waiting += new
        return found

    far = {name: reached(name) for name in uses}
    rounds = {tuple(sorted(b for b in far[a] if a in far.get(b, ()))) for a in uses if a in far[a]}
    return sorted(map(list, rounds))


def _name(file: Path) -> str:
    return file.relative_to(SOURCE).as_posix()


def page() -> str:
    """The map, in Markdown."""
    found = arrows()
    lines = [
        f"{len(ORDER)} rooms, {len(found)} arrows, all down; each room is told with those that it uses.",
        "",
        "| room | what is in it | uses |",
        "|---|---|---|",
    ]
    for name in reversed(ORDER):
        words = ast.get_docstring(ast.parse((SOURCE / name / "__init__.py").read_text())) or ""
        used = [b for a, b in found if a == name]
        used = ", ".join(sorted(used, key=lambda r: -ORDER.index(r)))
        lines.append(f"| `{name}/` | {words.splitlines()[0].rstrip('.')} | {used or '-'} |")
    return "\n".join(lines)


def main() -> None:
    if "--write" not in sys.argv[1:]:
        print(page())
        return
    text = (ROOT / "CONTRIBUTING.md").read_text()
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    (ROOT / "CONTRIBUTING.md").write_text(f"{before}{BEGIN}\n{page()}\n{END}{after}")


if __name__ == "__main__":
    main()
