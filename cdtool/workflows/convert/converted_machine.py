"""The machine file for a converted log: the user's own, with channels that name the new columns."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cdtool.bounded_loading import ContentError, parse_toml, read_text
from cdtool.errors import ConfigurationError
from cdtool.formats.groups import Group, WrittenNames
from cdtool.machine_file import MachineFile
from cdtool.recording import UNITLESS

_HEADER = re.compile(r"^\s*\[\[?\s*(?P<name>[^\[\]]+?)\s*\]\]?\s*(#.*)?$")
_URDF = re.compile(r"^(\s*urdf\s*=\s*).*$", re.MULTILINE)


def converted_machine(
    machine_file: MachineFile, log: Path, groups: Sequence[Group], names: WrittenNames, target: Path
) -> str:
    """Return the text of `target`: the machine file without its channels, then those of the converted log."""
    text = read_text(machine_file.path, ConfigurationError)
    kept = _without_channels(text)
    if not _same(text, kept):  # the tables cannot be separated line by line: write only the channels
        kept = f"# Put [machine] of {machine_file.path.name} here.\n"
    urdf = _stated_urdf(text)
    if urdf and machine_file.path.parent.resolve() != target.parent.resolve():
        place = os.path.relpath(machine_file.path.parent / urdf, target.parent)
        kept = _URDF.sub(lambda match: f"{match[1]}{_text(Path(place).as_posix())}", kept)
    corner = (machine_file.topics if machine_file.topics.sources else machine_file.columns).speed_low_pass
    return f"{kept.rstrip()}\n\n{_channels(log, groups, names, corner)}"


def _channels(log: Path, groups: Sequence[Group], names: WrittenNames, corner: float) -> str:
    topics = log.suffix.lower() == ".mcap"
    lines = [f"# The channels of {log.name} as cdtool convert wrote them: SI units, as logged."]
    lines += ["[channels.mcap]"] if topics else ["[channels]", 'time = { column = "time", unit = "s" }']
    lines.append(f"speed_low_pass_hz = {corner!r}")
    for group, of_group in zip(groups, names, strict=True):
        for column, places in zip(group.columns, of_group, strict=True):
            if topics:
                topic, _, field = places[0].partition(" ")
                where = f"topic = {_text(topic)}, field = {_text(field)}"
            elif len(places) == 1:
                where = f"column = {_text(places[0])}"
            else:
                where = f"columns = [{', '.join(map(_text, places))}]"
            unit = "" if column.name in UNITLESS else f", unit = {_text(column.unit or '1')}"
            lines.append(f"{column.name} = {{ {where}{unit} }}")
    return "\n".join(lines) + "\n"


def _without_channels(text: str) -> str:
    kept, skipping = [], False
    for line in text.splitlines():
        header = _HEADER.match(line)
        if header is not None:
            name = header["name"].replace('"', "").replace(" ", "")
            skipping = name == "channels" or name.startswith("channels.")
        if not skipping:
            kept.append(line)
    return "\n".join(kept) + "\n"


def _same(text: str, kept: str) -> bool:
    """Whether the remaining text is valid TOML and contains everything but the channels."""
    try:
        before, after = parse_toml(text), parse_toml(kept)
    except ContentError:
        return False
    before.pop("channels", None)
    return before == after


def _stated_urdf(text: str) -> str:
    machine: dict[str, Any] = parse_toml(text).get("machine", {})
    return str(machine.get("urdf", ""))


def _text(value: str) -> str:
    """Return a TOML string: JSON's escapes are valid in TOML, except for DEL."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
