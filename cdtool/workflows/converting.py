"""`cdtool convert`: a log's channels, or all its columns, into another container, to the bit and with provenance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from cdtool.errors import UsageError, nearest
from cdtool.formats.channel_assembly import file_digest
from cdtool.formats.groups import UNVERIFIED, Group, Writer
from cdtool.formats.reading import log_parts
from cdtool.machine_file import MachineFile, fingerprint, read_machine_file
from cdtool.recording import Finding
from cdtool.version import __version__
from cdtool.workflows.channel_rows import ChannelRows
from cdtool.workflows.converted_machine import converted_machine
from cdtool.workflows.log_rows import LogRows
from cdtool.workflows.written_file import written_file

_WRITERS = {
    ".csv": "cdtool.formats.csv_writing:write_csv_table",
    ".mcap": "cdtool.formats.mcap_writing:write_mcap_topics",
    ".parquet": "cdtool.formats.parquet_writing:write_table",
    ".feather": "cdtool.formats.parquet_writing:write_table",
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
    rows = ChannelRows(parts[0], machine_file) if machine_file else LogRows(parts[0])
    pieces = _pieces(target, rows.groups)
    names = [path for path, _ in pieces]
    companions = [path.with_name(f"{path.name}.machine.toml") for path in names] if machine_file else []
    _check_free([*names, *companions], log, force)
    provenance = _provenance(parts[0], rows.origin, machine_file, rows.findings)
    with ExitStack() as stack:  # all of them or none
        for i, (path, part) in enumerate(pieces):
            written = writer(stack.enter_context(written_file(path)), part, rows.parts(part), provenance)
            if machine_file is not None:
                text = converted_machine(machine_file, path, part, written, companions[i])
                stack.enter_context(written_file(companions[i])).write_text(text, encoding="utf-8")
    width = sum(len(parts) for group in rows.groups for parts in group.flat)
    made = tuple(map(str, names)), tuple(map(str, companions))
    return Converted(str(log), *made, width, len(rows.groups), tuple(rows.findings))


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


def _provenance(
    path: Path, origin: float, machine_file: MachineFile | None, findings: Sequence[Finding]
) -> Mapping[str, str]:
    told = {
        "source": path.name,
        "sha256": file_digest(path),
        "version": __version__,
        "origin_s": repr(origin),
    }
    if lost := [str(finding) for finding in findings if finding.severity == "loss"]:
        told["lost"] = "; ".join(lost)
    if unverified := [finding.message for finding in findings if finding.message.endswith(": unverified")]:
        told[UNVERIFIED] = "; ".join(unverified)
    if machine_file is not None:
        told |= {"machine": machine_file.machine.name, "machine_fingerprint": fingerprint(machine_file.machine)}
    return told
