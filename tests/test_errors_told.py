"""What is public tells in its docstring which errors it raises: those that stand in its own code, in the
helpers of its file that it calls, and what the gate before its arguments refuses."""

import ast
import functools
import inspect
import textwrap
from types import ModuleType

import jaxrotor as jr
from jaxrotor.core import errors, quick

FAMILY = {
    name: kind
    for name, kind in vars(errors).items()
    if isinstance(kind, type) and issubclass(kind, errors.JaxrotorError | KeyboardInterrupt)
}


def public():
    """(name, function) of all that is public, and of the public methods and constructors of classes."""
    rooms = [jr, *(r for n in jr.__all__ if inspect.ismodule(r := getattr(jr, n)))]
    things = {id(t): t for room in rooms for n in room.__all__ if callable(t := getattr(room, n))}
    for thing in things.values():
        if isinstance(thing, ModuleType):
            continue
        if not isinstance(thing, type):
            yield thing.__qualname__, thing
            continue
        for name, member in vars(thing).items():
            function = getattr(member, "__func__", member)
            if not name.startswith("_") and inspect.isfunction(function):
                yield f"{thing.__name__}.{name}", function


def raised(function, seen=frozenset()) -> set[str]:
    """Names of the errors of ours that a function raises, or a private helper beside it."""
    # a gate before it refuses; what has it compiled does not
    found, bare = set(), function
    while hasattr(bare, "__wrapped__"):
        code = getattr(bare, "__code__", None)
        if code and code.co_filename != quick.__file__:
            found = {"InputError"}
        bare = bare.__wrapped__
    if bare.__qualname__ in seen:
        return found
    tree = ast.parse(textwrap.dedent(inspect.getsource(bare)))
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise) and node.exc is not None:
            kind = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            if isinstance(kind, ast.Name) and kind.id in FAMILY:
                found.add(kind.id)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id == "refuse":
                found.add("InputError")
            helper = bare.__globals__.get(node.func.id)
            own = inspect.isfunction(helper) and helper.__module__ == bare.__module__
            if own and node.func.id.startswith("_"):
                found |= raised(helper, seen | {bare.__qualname__})
    return found


def untold(function) -> set[str]:
    words = inspect.getdoc(function) or ""
    return {name for name in raised(function) if name not in words}


def test_what_is_public_tells_its_errors():
    missing = {name: sorted(lacking) for name, f in public() if (lacking := untold(f))}
    assert not missing, "\n".join(f"{name}: {', '.join(m)}" for name, m in missing.items())


def test_an_error_that_is_not_told_is_found():
    def _helper():
        raise errors.InputError("no")

    @functools.wraps(_helper)
    def gated():
        """Says nothing."""

    assert {"simulate", "Machine.set", "Rotor.acceleration"} < {name for name, _ in public()}
    assert untold(gated) == {"InputError"}
    assert raised(jr.read_record) >= {"InputError"}
