"""Which class a `kind` means. There is no register: the public names of jaxrotor's packages are looked
through, so a new element is known to study files as soon as it is public."""

import importlib
import inspect
import sys
from pathlib import Path
from typing import Any

import equinox as eqx

from .. import elements
from .mistakes import Faults, guess


def public_kinds(base: type | tuple[type, ...]) -> dict[str, type]:
    """name -> class, for every public class of jaxrotor that is a `base` and can be built."""
    packages = [importlib.import_module(f"..{room}", __package__) for room in _ROOMS]
    found = {name: getattr(package, name) for package in packages for name in dir(package)}
    return {name: c for name, c in sorted(found.items()) if _fits(c, base)}


def public_constants() -> dict[str, Any]:
    """Name in small letters -> constant such as STEEL, of what machines are made of."""
    found = {key.lower(): getattr(elements, key) for key in dir(elements) if key.isupper()}
    return {name: value for name, value in found.items() if isinstance(value, eqx.Module)}


# Where they stand; what is found in one is not looked for in the next, nor is that loaded.
_ROOMS = ("elements", "profiles", "integrators", "objectives", "sensors", "optimization", "sweeps")


def _public(kind: str) -> Any:
    """The public thing of that name, or `None`."""
    for room in _ROOMS:
        package = importlib.import_module(f"..{room}", __package__)
        if kind in dir(package):
            return getattr(package, kind)
    return None


def find_kind(
    kind: Any,
    base: type | tuple[type, ...],
    place: str,
    faults: Faults,
    folder: Path | None,
    prefix: str = "",
) -> type | None:
    """The class that `kind` names: `"Rotor"`, or a user's `"mypackage.bearings:MyBearing"`.

    A user's module is looked for on Python's path and beside the study file (`folder`).
    """
    if not isinstance(kind, str):
        faults.add(place, f'{prefix}kind must be a text such as "Rotor", but is {kind!r}: quote it')
        return None
    if ":" not in kind:
        cls = _public(kind)
        if _fits(cls, base):
            return cls
        faults.add(
            place,
            f'{prefix}kind "{kind}" is unknown{guess(kind, public_kinds(base))}, or your own as '
            '"package.module:Class"',
        )
        return None
    module_name, _, class_name = kind.partition(":")
    cls, failure = _import(module_name, class_name, folder)
    if failure:
        faults.add(place, f'{prefix}kind "{kind}" cannot be imported: {failure}')
        return None
    if not _fits(cls, base):
        what = "has methods left to write" if inspect.isabstract(cls) else "is none"
        bases = " or ".join(b.__name__ for b in (base if isinstance(base, tuple) else (base,)))
        faults.add(
            place,
            f'{prefix}kind "{kind}" must be a class derived from jaxrotor\'s {bases}, '
            f"but {what}: see its docstring",
        )
        return None
    return cls


def _fits(candidate: Any, base: type | tuple[type, ...]) -> bool:
    return (
        isinstance(candidate, type)
        and issubclass(candidate, base)
        and not inspect.isabstract(candidate)
    )


def _import(module_name: str, class_name: str, folder: Path | None) -> tuple[Any, str]:
    added = [str(folder)] if folder is not None else []
    sys.path[:0] = added
    try:
        module = importlib.import_module(module_name)
    except Exception as error:  # whatever the user's module raises while it is imported
        return None, f"{type(error).__name__}: {error}: check the module's name and that it imports"
    finally:
        for entry in added:
            sys.path.remove(entry)
    if not hasattr(module, class_name):
        names = [n for n, c in vars(module).items() if isinstance(c, type)]
        return None, f"its module has no `{class_name}`{guess(class_name, names)}"
    return getattr(module, class_name), ""
