"""Score `cdtool init` on layouts: channels mapped right, and what is wrong without a CHECK mark."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

from cdtool.base.errors import CdtoolError
from cdtool.commands.init.drafting import init
from cdtool.formats.channels.reading import choose_format
from cdtool.recordings.units import find_unit
from tests.commands.init.layouts import Layout, Truth

_TYPES = {"linear axis": ("linear_axis",), "rotary axis": ("rotary_axis",), "robot": ("rotary_axis", "linear_axis")}


@dataclass(frozen=True)
class Known:
    """What a column of a file is, and all channels that are right for it; "" among them if it may stay unmapped."""

    truth: Truth
    accepted: frozenset[str]

    @property
    def required(self) -> bool:
        """Return whether the column belongs to a channel that the draft should map."""
        return bool(self.truth.channel) and "" not in self.accepted


_UNKNOWN = Known(Truth(), frozenset(("",)))


@dataclass(frozen=True)
class Score:
    """The draft of one layout: channels that it should map, those mapped right, and the errors.

    A channel is right if every joint has a column of it, in one order for all channels. `wrong` are channels with
    another column and a wrong kind of machine, `units` right channels with a wrong unit; `unmarked` are those of both
    without a CHECK mark. `missing` are channels of the log that the draft does not map.
    """

    name: str
    expected: tuple[str, ...]
    right: tuple[str, ...]
    missing: tuple[str, ...]
    wrong: tuple[str, ...]
    units: tuple[str, ...]
    unmarked: tuple[str, ...]
    fault: str = ""


def score(layout: Layout, folder: Path, *, audited: bool = False) -> Score:
    """Draft the machine file of a layout's log in a folder and compare the draft with the truth.

    The audit of the clocks takes half of the time and changes no draft; it is left out unless `audited`.
    """
    known = {name: _known(item, layout.accept.get(name, ())) for name, item in layout.truth.items()}
    expected = sorted({item.truth.channel for item in known.values() if item.required})
    try:
        with nullcontext() if audited else patch("cdtool.truth.synchronisation.audit.audit", return_value=()):
            text = init(layout.log, folder / "machine.toml", force=True).text
        values = tomllib.loads(text)
        channels = values["channels"].get("mcap", values["channels"])
        if not _drafted_columns(channels) <= known.keys():  # else the file need not be read once more
            known = _by_file_names(known, choose_format(layout.log).columns(layout.log).names)
    except CdtoolError as fault:
        return Score(layout.name, tuple(expected), (), tuple(expected), (), (), (), str(fault))
    order = _joint_order(channels, known)
    parts = {name: part for name, part in channels.items() if isinstance(part, dict)}
    faults = {name: _fault(name, part, known, order) for name, part in parts.items()}
    units = {name: "" if faults[name] else _unit_fault(name, part, known) for name, part in parts.items()}
    if values["machine"]["type"] not in _TYPES[layout.machine]:
        faults["type"] = values["machine"]["type"]
    errors = {**units, **{name: fault for name, fault in faults.items() if fault}}
    return Score(
        layout.name,
        tuple(expected),
        tuple(name for name in expected if name in parts and not faults[name]),
        tuple(name for name in expected if name not in parts),
        _listed(faults),
        _listed(units),
        _listed({name: fault for name, fault in errors.items() if fault and not _is_checked(text, name)}),
    )


def _listed(faults: Mapping[str, str]) -> tuple[str, ...]:
    return tuple(f"{name}: {fault}" for name, fault in faults.items() if fault)


def _known(truth: Truth, accept: Sequence[str]) -> Known:
    channel = "torque" if truth.channel == "current" else truth.channel
    return Known(Truth(channel, truth.joint, truth.unit), frozenset((channel, *accept)))


def _by_file_names(known: Mapping[str, Known], names: Sequence[str]) -> dict[str, Known]:
    """Return what the columns are by the names that the file's reader has for them: the same, or those in order."""
    if len(names) != len(known):
        return dict(known)
    return dict(known) | {name: item for name, item in zip(names, known.values(), strict=True) if name not in known}


def _columns_of(part: dict) -> list[str]:
    if "topic" in part:
        return [f"{part['topic']} {part['field']}"]
    listed = part.get("columns", [part.get("column")])
    return [str(column) for column in listed if column is not None]


def _drafted_columns(channels: dict) -> set[str]:
    parts = [part for part in channels.values() if isinstance(part, dict)]
    return {column for part in parts for column in _columns_of(part)}


def _joint_order(channels: dict, known: Mapping[str, Known]) -> list[str]:
    """Return the joints in the order of the first channel of several columns that are of different joints."""
    for name in ("position", "speed", "torque", *channels):
        part = channels.get(name)
        columns = _columns_of(part) if isinstance(part, dict) else []
        joints = [known[column].truth.joint for column in columns if column in known]
        if len(joints) > 1 and len(set(joints)) == len(joints) and all(joints):
            return joints
    return []


def _fault(channel: str, part: dict, known: Mapping[str, Known], order: Sequence[str]) -> str:
    """Return what is wrong with the columns of a mapped channel, or an empty text."""
    columns = _columns_of(part)
    required = {name: item.truth for name, item in known.items() if item.required and item.truth.channel == channel}
    if not columns:
        clock = next((name for name in required if channel == "time"), "")
        return f"a placeholder instead of {clock!r}" if clock else ""
    for k, column in enumerate(columns):
        item = known.get(column, _UNKNOWN)
        if channel not in item.accepted:
            return f"column {column!r} is {item.truth.channel or 'no channel'}"
        if item.truth.joint and len(columns) > 1 and order and item.truth.joint != order[k]:
            return f"column {column!r} is joint {item.truth.joint} in place of {order[k]}"
    joints = {truth.joint for truth in required.values() if truth.joint}
    covered = joints & {known[column].truth.joint for column in columns}
    if len(covered) < len(joints):
        return f"{len(covered)} of {len(joints)} joints"
    return ""


def _unit_fault(channel: str, part: dict, known: Mapping[str, Known]) -> str:
    """Return what is wrong with the unit of a channel with the right columns, or an empty text."""
    columns = _columns_of(part)
    true_unit = known[columns[0]].truth.unit if columns else ""
    if channel == "time" and "rate_hz" in part:
        return f"counts instead of {true_unit!r}" if true_unit else ""
    drafted = part.get("unit", "")
    if not true_unit or not drafted:
        return ""
    first, second = find_unit(true_unit), find_unit(drafted)
    alike = first is not None and second is not None and first.si == second.si
    if alike and abs(first.factor / second.factor - 1.0) < 1e-6:
        return ""
    return f"unit {drafted!r} instead of {true_unit!r}"


def _is_checked(text: str, key: str) -> bool:
    """Return whether the comment of a key contains CHECK."""
    lines = text.splitlines()
    at = next(i for i, line in enumerate(lines) if re.match(rf"{key} = ", line))
    if "  # " in lines[at]:
        return "CHECK" in lines[at].split("  # ", 1)[1]
    first = at
    while first and lines[first - 1].startswith("# "):
        first -= 1
    return any("CHECK" in line for line in lines[first:at])
