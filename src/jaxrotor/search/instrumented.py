"""A machine with its measurement channels: everything whose parameters can be looked for."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..core.errors import InputError
from ..core.parameter import as_float64, problems
from ..machine.machine import Machine
from ..machine.paths import entry_of, field_of, resolve, split_entry, with_entry
from ..machine.wiring import unknown
from ..sensors.channel import AbstractChannel
from ..simulation.response import blank_run


class Instrumented(eqx.Module):
    """`machine` and the `channels` that look at it, by name."""

    machine: Machine
    channels: dict[str, AbstractChannel]

    def __check_init__(self) -> None:
        for name, channel in self.channels.items():
            if name in self.machine.wiring.order:
                raise InputError(
                    f"`{name}`: is a part of the machine and a channel: give the channel another name"
                )
            found = list(problems(channel, name))
            if found:
                raise InputError(*found)

    def check(self) -> None:
        """Raises `InputError` where a channel does not find what it looks at: told by shapes alone."""
        found = []

        def all_of(machine: Machine) -> None:
            run = blank_run(machine, jnp.arange(3.0))  # what they have in common is traced once
            for name, channel in self.channels.items():
                try:
                    channel.measure(run)
                except InputError as error:
                    found.extend(f"`{name}`: {problem}" for problem in error.problems)

        eqx.filter_eval_shape(all_of, self.machine)
        if found:
            raise InputError(*found)

    def get(self, path: str) -> Any:
        """A parameter of the machine or of a channel."""
        whole, entry = split_entry(path)
        head, *steps = whole.split(".")
        if head in self.channels and steps:
            value = resolve(self.channels[head], steps, path)
            field = field_of(resolve(self.channels[head], steps[:-1], path), steps[-1])
            if field is None or "unit" not in field.metadata:
                raise InputError(f"`{path}`: is no number that could be looked for")
        elif head in self.machine.wiring.order or head == "gravity":
            value = self.machine.get(whole)
        else:
            known = (*self.machine.wiring.order, *self.channels)
            raise InputError(f"`{path}`: {unknown('element or channel', head, known)}")
        if value is None:
            raise InputError(f"`{path}`: is not set: give it a value in the machine first")
        if isinstance(value, eqx.Module):
            raise InputError(f"`{path}`: is a part with several parameters: name one of them")
        if entry is None:
            if np.ndim(value):
                raise InputError(
                    f"`{path}`: has {np.size(value)} entries: name one, such as `{path}[0]`"
                )
            return value
        return entry_of(value, entry, path)

    def set(self, values: Mapping[str, Any]) -> "Instrumented":
        """Other values, by path; checked by the machine where they are known."""
        whole: dict[str, Any] = {}
        channels = dict(self.channels)
        for path, value in values.items():
            name, entry = split_entry(path)
            head, *steps = name.split(".")
            if head in channels:
                if entry is not None:
                    value = with_entry(resolve(channels[head], steps, name), entry, value, path)
                channels[head] = eqx.tree_at(
                    lambda c: resolve(c, steps, name),  # noqa: B023
                    channels[head],
                    as_float64(value),
                )
            else:
                whole[path] = value
        return Instrumented(self.machine.set(whole) if whole else self.machine, channels)

    def unit(self, path: str) -> str:
        """SI unit of a parameter."""
        name, entry = split_entry(path)
        head, *steps = name.split(".")
        if head not in self.channels:
            units = self.machine.units(name)
            return units[entry if entry is not None and len(units) > 1 else 0]
        channel = self.channels[head]
        if steps == ["sensitivity"]:
            return f"{channel.recorded_in}/({channel.sensor.unit})"
        if steps[-1] in ("bias", "std", "quantum", "subtracted"):
            return channel.recorded_in
        field = field_of(resolve(channel, steps[:-1], name), steps[-1])
        return field.metadata["unit"] if field is not None else ""
