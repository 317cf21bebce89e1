"""The files of a log as cdtool writes them: the writer of each suffix, and the machine file that reads them back."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from cdtool.base.errors import ConfigurationError, UsageError, nearest
from cdtool.base.files.bounded_loading import read_text
from cdtool.base.remote.remote_path import joined, relative_name
from cdtool.formats.columns import Column
from cdtool.formats.groups import Group, GroupWriter, WrittenNames
from cdtool.formats.machine_file import MachineFile
from cdtool.recordings.recording import UNITLESS

WRITERS = {
    ".csv": "cdtool.formats.exports.csv_writing:write_csv_table",
    ".mcap": "cdtool.formats.bags.mcap_writing:write_mcap_topics",
    ".parquet": "cdtool.formats.containers.parquet_writing:write_parquet",
}
ONE_CLOCK = (".csv", ".parquet")


def writer_of(target: Path) -> GroupWriter:
    """Return the writer of a file's suffix; raises UsageError for an unknown one."""
    place = WRITERS.get(target.suffix.lower())
    if place is None:
        raise UsageError(f"{target}: '{target.suffix}' cannot be written", nearest(target.suffix, WRITERS))
    module, _, name = place.partition(":")
    writer: GroupWriter = getattr(import_module(module), name)
    return writer


def files_of(target: Path, groups: Sequence[Group]) -> list[tuple[Path, Sequence[Group]]]:
    """Return which groups are written to which file."""
    if target.suffix.lower() in ONE_CLOCK and len(groups) > 1:
        names = [target.with_name(f"{target.stem}.{i}{target.suffix}") for i in range(1, len(groups) + 1)]
        return [(name, [group]) for name, group in zip(names, groups, strict=True)]
    return [(target, groups)]


def machine_text(
    machine_file: MachineFile, log: Path, groups: Sequence[Group], names: WrittenNames, target: Path
) -> str:
    """Return the text of `target`: the machine file without its channels, then those of the converted log."""
    import tomlkit

    document = tomlkit.parse(read_text(machine_file.path, ConfigurationError))
    document.pop("channels", None)
    machine = document.get("machine", {})
    if "urdf" in machine and machine_file.path.parent.resolve() != target.parent.resolve():
        urdf = joined(machine_file.path.parent, str(machine["urdf"]))
        machine["urdf"] = relative_name(urdf, target.parent)
    mapped = machine_file.topics if machine_file.topics.sources else machine_file.columns
    kinds = next((item.kinds for item in mapped.sources if item.channel == "label"), ())
    return f"{tomlkit.dumps(document).rstrip()}\n\n{_channels(log, groups, names, mapped.speed_low_pass, kinds)}"


def _channels(
    log: Path, groups: Sequence[Group], names: WrittenNames, corner: float, kinds: Sequence[tuple[float, str]]
) -> str:
    topics = log.suffix.lower() == ".mcap"
    lines = [f"# The channels of {log.name} as cdtool wrote them: SI units, as logged."]
    lines += ["[channels.mcap]"] if topics else ["[channels]", 'time = { column = "time", unit = "s" }']
    lines.append(f"speed_low_pass_hz = {corner!r}")
    for group, of_group in zip(groups, names, strict=True):
        for column, places in zip(group.columns, of_group, strict=True):
            if topics:
                topic, _, field = places[0].partition(" ")
                where = f"topic = {_text(topic)}, {_field(field, column)}"
            elif len(places) == 1:
                where = f"column = {_text(places[0])}"
            else:
                where = f"columns = [{', '.join(map(_text, places))}]"
            unit = "" if column.name in UNITLESS else f", unit = {_text(column.unit or '1')}"
            of_label = ", ".join(f'"{value:.17g}" = {_text(kind)}' for value, kind in kinds)
            also = f", kinds = {{ {of_label} }}" if of_label and column.name == "label" else ""
            lines.append(f"{column.name} = {{ {where}{unit}{also} }}")
    return "\n".join(lines) + "\n"


def _field(field: str, column: Column) -> str:
    """Return the field of a channel in [channels.mcap]; the axes of a force are elements of an array."""
    if column.name != "force" or column.values.ndim == 1:
        return f"field = {_text(field)}"
    elements = [_text(field.replace("[:]", f"[{axis}]")) for axis in range(column.values.shape[1])]
    return f"fields = [{', '.join(elements)}]"


def _text(value: str) -> str:
    """Return a TOML string: JSON's escapes are valid in TOML, except for DEL."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def require_free_folder(folder: Path) -> None:
    """Raise UsageError unless a folder is new or empty."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"{folder} exists and is not an empty folder", "choose another --output")
