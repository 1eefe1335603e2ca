"""Whether a type checker knows all that is public: every name of `jaxrotor` and of its packages, with the
methods and fields of classes.

    python docs/typed.py

Lists what it does not know, and the share that it does. `make lint` runs it. A wrong use of a type is found
by pyright itself; this is about what is left unsaid.
"""

import inspect
import json
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import jaxrotor as jr


def public() -> set[str]:
    """`module.name` of each public function and class, where it is written."""
    rooms = [jr, *(getattr(jr, n) for n in jr.__all__ if inspect.ismodule(getattr(jr, n)))]
    found = (getattr(room, name) for room in rooms for name in room.__all__)
    return {_written(one) for one in found if not isinstance(one, ModuleType)} - {""}


def _written(thing: Any) -> str:
    name = getattr(
        thing, "__qualname__", None
    )  # a constant such as STEEL has none: its class is told
    return f"{thing.__module__}.{name}" if name else ""


def symbols() -> list[dict[str, Any]]:
    """What pyright says of each, without what begins with an underscore."""
    command = ["pyright", "--verifytypes", "jaxrotor", "--ignoreexternal", "--outputjson"]
    # --verifytypes looks for libraries beside the first `python` on the path
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    environment = os.environ | {"PATH": path}
    asked = subprocess.run(
        [sys.executable, "-m", *command], capture_output=True, text=True, env=environment
    )
    told = json.loads(asked.stdout)["typeCompleteness"]["symbols"]
    names = public()

    def of_ours(symbol: dict[str, Any]) -> bool:
        name = symbol["name"]
        last = name.rpartition(".")[2]
        own = name in names or any(name.startswith(f"{one}.") for one in names)
        return symbol["isExported"] and own and (last[0] != "_" or last[:2] == "__")

    return [symbol for symbol in told if of_ours(symbol)]


def main() -> int:
    found = symbols()
    # what is inferred from its value alone (`plot = plot_door()`) is ambiguous to pyright, not unknown
    unknown = [s for s in found if not (s["isTypeKnown"] or s["isTypeAmbiguous"])]
    for symbol in unknown:
        said = [d["message"].splitlines()[0] for d in symbol["diagnostics"]]
        said = [words for words in said if not words.startswith("No docstring")]
        print(f"{symbol['name']}: {'; '.join(said) or 'of a type that is not known wholly'}")
    known = len(found) - len(unknown)
    print(f"{known} of {len(found)} public names, methods and fields have a known type")
    return bool(unknown) or not found


if __name__ == "__main__":
    sys.exit(main())
