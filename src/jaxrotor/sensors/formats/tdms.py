"""TDMS files of LabVIEW: channels by their paths, `group/channel`."""

import logging
from pathlib import Path
from typing import Any

import numpy as np
from nptdms import TdmsFile
from nptdms.log import log_manager

from ...core.errors import InputError
from .table import Column, Table, even


def read_tdms(file: Path) -> Table:
    """Channels with a `wf_increment` know their time. Where they began at different times of day, it counts
    from the earliest. Values are read when they are asked for."""
    columns: dict[str, Column] = {}
    others: dict[str, str] = {}
    notes: list[str] = []
    level = log_manager.log_level
    log_manager.set_level(logging.ERROR)  # what it warns of is refused below
    try:
        opened = TdmsFile.read_metadata(file)
    finally:
        log_manager.set_level(level)
    status = opened.file_status
    if status.incomplete_final_segment or status.channel_statuses:
        raise InputError(
            f"`{file}`: is cut off, or was not closed by its program: copy it again, or save it anew there"
        )
    channels = [channel for group in opened.groups() for channel in group.channels()]
    began = [c.properties["wf_start_time"] for c in channels if _begins(c)]
    first = min(began, default=None)
    if first is not None and max(began) > first:
        notes.append(f"channels began at different times: time counts from {first} on")
    for channel in channels:
        name = f"{channel.group_name}/{channel.name}"
        if not len(channel):
            others[name] = "empty"
            continue
        told = channel.properties
        step, times = float(told.get("wf_increment", 0.0)), None
        if step > 0:
            late = (
                (told["wf_start_time"] - first) / np.timedelta64(1, "s")
                if _begins(channel)
                else 0.0
            )
            start = late + float(told.get("wf_start_offset", 0.0))
            times = even(start, step, len(channel))
        unit = str(told.get("unit_string", ""))
        columns[name] = Column(_reader(file, channel.group_name, channel.name), unit, times)
    return Table(columns, tuple(notes), others)


def _begins(channel: Any) -> bool:
    """Whether the time of day is told at which a channel that knows its sampling began."""
    told = channel.properties
    known = isinstance(told.get("wf_start_time"), np.datetime64)
    return known and float(told.get("wf_increment", 0.0)) > 0


def _reader(file: Path, group: str, name: str) -> Any:
    def read() -> np.ndarray:
        with TdmsFile.open(file) as opened:
            return np.asarray(opened[group][name][:])

    return read
