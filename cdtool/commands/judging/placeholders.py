"""Find placeholders of `cdtool init` that are still in a machine file."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np

from cdtool.base.errors import ConfigurationError
from cdtool.base.files.bounded_loading import read_text
from cdtool.base.findings import Finding
from cdtool.formats.channels.channel_map import ChannelSource
from cdtool.formats.machine_file import MachineFile
from cdtool.recordings.recording import Recording
from cdtool.recordings.units import RAW_UNITS, find_unit

_KEY = re.compile(r"^\s*([A-Za-z_]\w*)\s*=")
_MARK = re.compile(r"#.*\bCHECK\b")


def placeholder_findings(recording: Recording, machine_file: MachineFile) -> list[Finding]:
    """Return a warning for each placeholder that is still in a machine file, and for the marks of `cdtool init`.

    Parameters
    ----------
    recording : Recording
        A log on the load side: the load's speed shows what a placeholder does.
    machine_file : MachineFile
        The machine file with which it was read.

    Returns
    -------
    list of Finding
        Empty for a machine file without placeholders. A rotary axis may have the ratio 1.
    """
    machine = machine_file.machine
    found = []
    of_motor = getattr(machine, "ratio_unit", "") == "m/rad" and getattr(machine, "coordinates", "") == "motor"
    if of_motor and any(ratio == 1.0 for ratio in getattr(machine, "transmission_ratio", ())):
        found.append(Finding("placeholder_ratio", "", {"speed": _top_speed(recording)}))
    maps = machine_file.topics if machine_file.topics.sources else machine_file.columns
    found += [
        Finding("placeholder_scale", channel, {"raw": raw, "unit": unit, "per": per})
        for channel, (raw, unit, per) in _scales(maps.sources)
    ]
    key = getattr(machine, "inertia_key", "")
    load = getattr(machine, "load_inertia", (1.0,))
    if key and not any(load) and not any(getattr(machine, "motor_inertia", (1.0,))):
        found.append(Finding("placeholder_inertia", "", {"key": key}))
    count, keys = _marked_keys(machine_file)
    return [*found, Finding("unchecked_lines", "", {"count": count, "keys": keys})] if count else found


def _top_speed(recording: Recording) -> float:
    speed = np.abs(recording["speed"].values) if "speed" in recording else np.empty(0)
    known = speed[np.isfinite(speed)]
    return float(known.max()) if len(known) else math.nan


def _scales(sources: tuple[ChannelSource, ...]) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """Yield the channels in a raw unit with the scale 1, and the units of both and of the scale."""
    for source in sources:
        known = find_unit(source.stated) if source.stated else None
        if known is None or known.si not in RAW_UNITS or source.duty is not None or source.unit in RAW_UNITS:
            continue
        if all(factor == known.factor for factor in source.factor):
            yield source.channel, (source.stated, source.unit, known.si)


def _marked_keys(machine_file: MachineFile) -> tuple[int, tuple[str, ...]]:
    """Return how many keys have a comment with the mark CHECK, after the key or before it, and which."""
    try:
        lines = read_text(machine_file.path, ConfigurationError).splitlines()
    except ConfigurationError:  # a machine file that was read and is gone since, as that of a trial draft
        return 0, ()
    keys, marked = [], False
    for line in lines:
        if line.lstrip().startswith("#"):
            marked = marked or bool(_MARK.search(line))
            continue
        key = _KEY.match(line)
        if key and (marked or _MARK.search(line)):
            keys.append(key[1])
        marked = False
    return len(keys), tuple(dict.fromkeys(keys))
