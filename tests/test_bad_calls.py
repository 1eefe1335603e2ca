"""Bad Python calls by the hundred: every argument of the public functions and classes, given what it cannot
be, is refused in a sentence, at once, and before anything compiles.

The calls are generated: a table says what a right call looks like, type hints and declared parameters say
which kind each argument is of, and each kind has its list of values that are none.
"""

import dataclasses
import inspect
import random
import signal
import typing
from fractions import Fraction

import equinox as eqx
import numpy as np
from helpers import at_instants
from right_calls import BAD, HUGE, PARTS, WAVE, T, functions, line
from wrong_calls import named

import jaxrotor as jr
from jaxrotor.core.arguments import positive, whole
from jaxrotor.core.gate import takes


def kind_of_field(field, hint, declared) -> str | None:
    """Which list of bad values a constructor's argument is given."""
    if "unit" in field.metadata:
        rule = field.metadata
        if () not in rule["shapes"]:
            return "matrix" if all(len(s) == 2 for s in rule["shapes"]) else "numbers"
        return "positive" if rule["positive"] else "number"
    members = typing.get_args(hint) or (hint,)
    if typing.get_origin(hint) is typing.Literal:
        return "choice"
    for plain, kind in ((bool, "flag"), (int, "count"), (float, "positive"), (str, "text")):
        if plain in members:
            return kind
    if any(isinstance(m, type) and issubclass(m, eqx.Module) for m in members):
        return "object"
    return None


def public(name):
    rooms = (
        jr,
        jr.elements,
        jr.profiles,
        jr.linear,
        jr.diagnostics,
        jr.objectives,
        jr.optimization,
    )
    rooms += (jr.identification, jr.sensors, jr.simulation, jr.sweeps, jr.standards, jr.periodic)
    return next(getattr(room, name) for room in rooms if name in room.__all__)


def bad_parts():
    for name, (place, right) in PARTS.items():
        cls = public(name)
        hints = typing.get_type_hints(cls)
        parameters = list(inspect.signature(cls).parameters)
        given = dict(zip(parameters, right))
        fields = {f.name: f for f in dataclasses.fields(cls)}
        for key in parameters:
            field = fields.get(key)
            kind = None if field is None else kind_of_field(field, hints[key], given.get(key))
            for value in BAD.get(kind or "", []):
                if value is None and (field.metadata.get("optional") or field.default is None):
                    continue
                if value is None and type(None) in typing.get_args(hints[key]):
                    continue
                several = () in field.metadata.get("shapes", ()) and any(
                    len(s) == 1 for s in field.metadata["shapes"]
                )
                if isinstance(value, list) and several:
                    continue
                if (
                    kind == "object" and value == 3 and "drives" in field.metadata
                ):  # a steady schedule
                    continue
                places = (None, 3) in field.metadata.get("shapes", ())
                if places and np.shape(value) == (2, 3):  # two, at one point
                    continue
                if key == "seed" and isinstance(value, int) and value > 0:  # as good as another
                    continue
                if (key, value) == ("delay", 0.0):  # none
                    continue
                yield (
                    f"{name}({key}={shown(value)})",
                    lambda c=cls, k={**given, key: value}, p=place: p(c(**k)),
                )
        yield f"{name}(misspelt)", lambda c=cls, k=given: c(**k, lenghth=1.0)


def shown(value):
    return "huge" if value is HUGE else " ".join(repr(value).split())[:40]


def bad_functions():
    machine = line()
    model = object.__new__(jr.linear.LinearModel)
    found = object.__new__(jr.identification.Identification)
    response = at_instants(machine, np.zeros((2, 6)), np.zeros((2, 6)))
    record = jr.Record({"x": jr.sensors.Series(T, WAVE)})
    for name, (right, kinds) in functions(machine, model, response, found, record).items():
        function = public(name)
        parameters = inspect.signature(function).parameters
        for key, kind in kinds.items():
            for value in BAD[kind]:
                if key in parameters and value is None and parameters[key].default is None:
                    continue
                if key == "near" and value == 1j:  # an eigenvalue
                    continue
                yield (
                    f"{name}({key}={shown(value)})",
                    lambda f=function, k={**right, key: value}: f(**k),
                )
        yield f"{name}(misspelt)", lambda f=function, k=right: f(**k, sampel_rate=1.0)


def outcome(call, seconds=5):
    """'refused', or what came instead of a sentence."""

    def too_long(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, too_long)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        got = call()
    except jr.InputError as error:
        long = max(map(len, error.problems))
        return "refused" if long < 500 and "\n" not in error.problems[0] else f"{long} characters"
    except TimeoutError:
        return "hangs"
    except Exception as error:
        return f"raw {type(error).__name__}: {str(error)[:100]}"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    return f"accepted: {shown(got)}"


def one_of_each(calls):
    """Of the calls that spoil the same argument one, by lot; the same ones each time."""
    draw, grouped = random.Random(17), {}
    for label, call in calls:
        grouped.setdefault(label.partition("=")[0], []).append((label, call))
    return [draw.choice(group) for group in grouped.values()]


def wrong(calls):
    """What was not refused in a sentence within five seconds."""
    return {label: got for label, call in calls if (got := outcome(call)) != "refused"}


def test_parts_refuse_what_they_cannot_be_made_of():
    calls = one_of_each(bad_parts())
    assert len(calls) > 300
    assert wrong(calls) == {}


def test_functions_refuse_what_they_cannot_use():
    calls = one_of_each(bad_functions())
    assert len(calls) > 200
    assert wrong(calls) == {}


def test_what_was_measured_to_be_accepted_or_raw_is_refused():
    assert wrong(named().items()) == {}


def test_the_right_calls_beside_the_bad_ones_are_accepted():
    """Else every bad call would be refused for another reason."""
    for name, (place, right) in PARTS.items():
        assert isinstance(place(public(name)(*right)), jr.Machine), name


def test_numbers_of_other_kinds_are_taken_in_64_bits():
    """A float of 32 bits as a sample rate would let everything be computed in 32 bits."""
    gated = takes(rate=positive("Hz"), count=whole(1))(lambda rate, count=1: (rate, count))
    for given in (2000, np.float32(2000), np.int64(2000), np.array(2000.0), Fraction(2000)):
        rate, count = gated(given, count=np.int64(3))
        assert type(rate) is float and rate == 2000.0 and type(count) is int
