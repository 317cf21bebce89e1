"""`cdtool convert`: a log's channels, or all its columns, into another container, to the bit and with provenance."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path

import numpy as np

from cdtool.channels import ChannelMap, ChannelSource
from cdtool.errors import UsageError, nearest
from cdtool.formats.channel_assembly import as_logged, file_digest
from cdtool.formats.groups import Group, Writer
from cdtool.formats.mcap_writing import EXACT_TIME, exact_times, with_exact_times
from cdtool.formats.reading import choose_format, log_parts, mapped_source
from cdtool.formats.source import Column, Source, split_unit
from cdtool.machine_file import MachineFile, fingerprint, read_machine_file
from cdtool.recording import Finding, FloatArray, Recording
from cdtool.version import __version__
from cdtool.workflows.clock_guess import guess_clock
from cdtool.workflows.converted_machine import converted_machine
from cdtool.workflows.written_file import written_file

_WRITERS = {
    ".csv": "cdtool.formats.csv_writing:write_csv_table",
    ".mcap": "cdtool.formats.mcap_writing:write_mcap_topics",
    ".parquet": "cdtool.formats.parquet:write_table",
    ".feather": "cdtool.formats.parquet:write_table",
    ".h5": "cdtool.formats.hdf5:write_hdf5",
    ".hdf5": "cdtool.formats.hdf5:write_hdf5",
    ".mf4": "cdtool.formats.mdf:write_mdf",
    ".tdms": "cdtool.formats.tdms:write_tdms",
}
_ONE_CLOCK = (".csv",)


@dataclass(frozen=True)
class Converted:
    """The files that were written, the machine files that read them, how much there is, and what is odd."""

    source: str
    files: tuple[str, ...]
    machine_files: tuple[str, ...]
    columns: int
    clocks: int
    findings: tuple[Finding, ...]


def convert(
    source: str | Path, output: str | Path, *, machine: str | Path | MachineFile | None = None, force: bool = False
) -> Converted:
    """Write a log's mapped channels (as logged, SI), or without a machine file all its numeric columns, to `output`.

    Nothing is resampled: each channel keeps its own clock. A CSV table has but one: of several clocks each gets a file
    of its own, `output` with `.1`, `.2` before the suffix. Values are float64 to the bit. With a machine file another
    one is written beside each file, which reads it. Raises UsageError for an unknown suffix and where a file is there.
    """
    log, target = Path(source), Path(output)
    writer = _writer(target)
    parts = log_parts(log)
    if len(parts) > 1:
        raise UsageError(f"{log}: is a log in {len(parts)} parts", "convert them one by one")
    machine_file = (
        None if machine is None else machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    )
    groups, origin, findings = _mapped(parts[0], machine_file) if machine_file else _surveyed(parts[0])
    pieces = _pieces(target, groups)
    names = [path for path, _ in pieces]
    companions = [path.with_name(f"{path.name}.machine.toml") for path in names] if machine_file else []
    _check_free([*names, *companions], log, force)
    provenance = _provenance(parts[0], origin, machine_file)
    with ExitStack() as stack:  # all of them or none
        for i, (path, part) in enumerate(pieces):
            written = writer(stack.enter_context(written_file(path)), part, provenance)
            if machine_file is not None:
                text = converted_machine(machine_file, path, part, written, companions[i])
                stack.enter_context(written_file(companions[i])).write_text(text, encoding="utf-8")
    width = sum(len(parts) for group in groups for parts in group.flat)
    made = tuple(map(str, names)), tuple(map(str, companions))
    return Converted(str(log), *made, width, len(groups), tuple(findings))


def _writer(target: Path) -> Writer:
    place = _WRITERS.get(target.suffix.lower())
    if place is None:
        raise UsageError(f"{target}: '{target.suffix}' cannot be written", nearest(target.suffix, _WRITERS))
    module, _, name = place.partition(":")
    writer: Writer = getattr(import_module(module), name)
    return writer


def _check_free(paths: Sequence[Path], log: Path, force: bool) -> None:
    for path in paths:
        if path.exists() and log.exists() and path.samefile(log):
            raise UsageError(f"{path}: is the log itself", "choose another name")
        if path.exists() and not force:
            raise UsageError(f"{path}: is there already", "choose another name, or overwrite it with --force")


def _pieces(target: Path, groups: Sequence[Group]) -> list[tuple[Path, Sequence[Group]]]:
    """Which groups go into which file."""
    if target.suffix.lower() in _ONE_CLOCK and len(groups) > 1:
        names = [target.with_name(f"{target.stem}.{i}{target.suffix}") for i in range(1, len(groups) + 1)]
        return [(name, [group]) for name, group in zip(names, groups, strict=True)]
    return [(target, groups)]


def _mapped(path: Path, machine_file: MachineFile) -> tuple[list[Group], float, list[Finding]]:
    """The channels as logged, those of one clock together."""
    source, channels = mapped_source(path, machine_file)
    source = _exact(path, source, channels)
    recording: Recording = as_logged(source, channels, machine_file.machine)
    columns = [
        Column(name, series.values if series.joint_count > 1 else series.values[:, 0], series.time, _unit(series.unit))
        for name, series in recording.channels.items()
    ]
    return _grouped(columns, recording.joints), recording.origin, list(recording.findings)


def _surveyed(path: Path) -> tuple[list[Group], float, list[Finding]]:
    """All numeric columns; a table's clock is guessed, since some containers need one."""
    found = choose_format(path)
    source = _exact(path, found.columns(path), None)
    columns = [part for column in _without_units(source.columns.values()) for part in _split(column)]
    findings = list(source.findings)
    timed = [column for column in columns if column.time is not None]
    groups = _grouped(timed, ())
    clock = guess_clock(source)
    rest = [column for column in columns if column.time is None and not _is_clock(column, groups)]
    for rows in dict.fromkeys(len(column.values) for column in rest):
        table = tuple(column for column in rest if len(column.values) == rows)
        time = clock.time if clock is not None and len(clock.time) == rows else None
        groups.append(Group(f"clock_{len(groups) + 1}", time, table, is_table=True))
    return groups, source.origin, findings


def _exact(path: Path, source: Source, channels: ChannelMap | None) -> Source:
    """The exact times of an MCAP file that cdtool itself converted: its messages' are whole nanoseconds."""
    told = exact_times(path) if source.format == "mcap" else None
    if told is None:
        return source
    exact = source
    if channels is not None:
        topics = dict.fromkeys(item.topic for item in channels.sources)
        clocks = tuple(ChannelSource("event", topic=topic, field=EXACT_TIME) for topic in topics)
        exact = choose_format(path).columns(path, replace(channels, sources=clocks))
    made = with_exact_times(source, exact, float(told.get("cdtool.origin_s", "0")))
    kept = {name: column for name, column in made.columns.items() if not name.endswith(f" {EXACT_TIME}")}
    return replace(made, columns=kept)


def _without_units(columns: Iterable[Column]) -> list[Column]:
    """`torque [N m]` as `torque`, where no other column is called so: the unit is kept beside the name."""
    columns = list(columns)
    count = Counter(split_unit(column.name)[0] for column in columns)
    short = {column.name: split_unit(column.name)[0] for column in columns if column.unit is not None}
    return [
        replace(column, name=short[column.name]) if column.name in short and count[short[column.name]] == 1 else column
        for column in columns
    ]


def _split(column: Column) -> list[Column]:
    """A topic's array as a column an element; names that no container takes for groups or for numbers."""
    name = column.name.lstrip("/").replace("/", ".")
    name = f"column_{name}" if name.isdigit() else name
    if column.values.ndim == 1:
        return [replace(column, name=name)]
    base = name.removesuffix("[:]")
    columns = np.ascontiguousarray(column.values.T)
    return [Column(f"{base}[{i}]", values, column.time, column.unit) for i, values in enumerate(columns)]


def _grouped(columns: Sequence[Column], joints: tuple[str, ...]) -> list[Group]:
    clocks: dict[bytes, tuple[FloatArray, list[Column]]] = {}
    for column in columns:
        assert column.time is not None
        clocks.setdefault(column.time.tobytes(), (column.time, []))[1].append(replace(column, time=None))
    return [
        Group(f"clock_{i}", time, tuple(members), joints) for i, (time, members) in enumerate(clocks.values(), start=1)
    ]


def _is_clock(column: Column, groups: Sequence[Group]) -> bool:
    """True for a column that is the clock of others: it is written with them."""
    return any(group.time is not None and np.array_equal(column.values, group.time) for group in groups)


def _unit(name: str) -> str | None:
    return None if name == "1" else name


def _provenance(path: Path, origin: float, machine_file: MachineFile | None) -> Mapping[str, str]:
    told = {
        "source": path.name,
        "sha256": file_digest(path),
        "version": __version__,
        "origin_s": repr(origin),
    }
    if machine_file is not None:
        told |= {"machine": machine_file.machine.name, "machine_fingerprint": fingerprint(machine_file.machine)}
    return told
