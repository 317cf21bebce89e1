"""`cdtool convert`: write a log's channels or all its columns to another file format, bit for bit, with provenance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cdtool.base.errors import RecordingError, UsageError
from cdtool.base.files.writing import replaced
from cdtool.base.findings import Finding
from cdtool.base.remote.remote_path import location
from cdtool.base.version import __version__
from cdtool.commands.convert.channel_rows import ChannelRows
from cdtool.commands.convert.log_rows import LogRows
from cdtool.commands.convert.section_rows import Rows, SectionRows
from cdtool.formats.channels.channel_assembly import file_digest
from cdtool.formats.channels.parts import join_digests
from cdtool.formats.channels.reading import LogFolder, log_parts
from cdtool.formats.groups import UNVERIFIED, Parts
from cdtool.formats.machine_file import MachineFile, fingerprint, read_machine_file
from cdtool.formats.written_files import files_of, machine_text, writer_of
from cdtool.recordings.log_section import LogSection

if TYPE_CHECKING:
    from cdtool.execution.workers import Progress


@dataclass(frozen=True)
class Converted:
    """The files written, the machine files for them, the amount of data, and the findings."""

    source: str
    files: tuple[str, ...]
    machine_files: tuple[str, ...]
    columns: int
    clocks: int
    findings: tuple[Finding, ...]


def convert(
    source: str | Path,
    output: str | Path,
    *,
    machine: str | Path | MachineFile | None = None,
    section: LogSection = LogSection(),
    force: bool = False,
    progress: Progress | None = None,
) -> Converted:
    """Write the mapped channels of a log, or without a machine file all its numeric columns, to another container.

    Parameters
    ----------
    source : str or Path
        The log, or a folder with its parts, as rosbag2 writes it.
    output : str or Path
        The file to write; its suffix selects the container. A CSV table has only one clock: if there are several, each
        is written to its own file, with `.1`, `.2` before the suffix.
    machine : str, Path or MachineFile, optional
        Maps the channels; they are written as logged, in SI units, with a machine file for each file written.
    section : LogSection, optional
        The part of the log that is written; the whole log by default. A distance travelled needs `machine`.
    force : bool, optional
        Replace existing files.
    progress : callable, optional
        Called with the number of rows written and the total.

    Returns
    -------
    Converted
        The files written, the number of columns and clocks, and the findings. Values are float64, bit for bit; each
        channel keeps its own clock.

    Raises
    ------
    UsageError
        The suffix is unknown, or a file already exists.
    RecordingError
        The log cannot be read, or has none of the mapped channels.

    Examples
    --------
    >>> import cdtool
    >>> machine = "sample_logs/gate/machine.toml"
    >>> converted = cdtool.convert("sample_logs/gate/stiff/03.csv", "stiff-03.mcap", machine=machine)
    >>> converted.files, converted.columns
    (('stiff-03.mcap',), 7)
    """
    log, target = location(source), location(output)
    writer = writer_of(target)
    parts = log_parts(log)
    _check_apart(target, log, parts)
    machine_file = (
        None if machine is None else machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    )
    rows: Rows = ChannelRows(log, machine_file) if machine_file else LogRows(log)
    if not rows.groups:
        raise RecordingError(f"{log}: contains none of the mapped channels", "see cdtool info for its content")
    rows = SectionRows(log, rows, section, machine_file) if section else rows
    pieces = files_of(target, rows.groups)
    names = [path for path, _ in pieces]
    companions = [path.with_name(f"{path.name}.machine.toml") for path in names] if machine_file else []
    beside = [path for path in machine_file.files_beside(log) if path.is_file()] if machine_file else []
    _check_free([*names, *companions], [*parts, *beside], force)
    provenance = _provenance(log, parts, rows, machine_file, section)
    if beside:
        provenance |= {"load_cell": "; ".join(f"{path.name} {file_digest(path)}" for path in beside)}
    row_progress = _RowProgress(log, sum(group.rows for group in rows.groups), progress)
    with replaced(*names, *companions) as temporary:  # all or none
        for i, (path, part) in enumerate(pieces):
            written = writer(temporary[i], part, row_progress.of(rows.parts(part)), provenance)
            if machine_file is not None:
                text = machine_text(machine_file, path, part, written, companions[i])
                temporary[len(names) + i].write_text(text, encoding="utf-8", newline="\n")
    width = sum(len(parts) for group in rows.groups for parts in group.flat)
    made = tuple(map(str, names)), tuple(map(str, companions))
    return Converted(str(log), *made, width, len(rows.groups), tuple(rows.findings))


@dataclass
class _RowProgress:
    """Passes the parts of a log to the writer and reports the progress; `rows` is the number of all its rows."""

    log: Path
    rows: int
    progress: Progress | None
    _done: int = 0

    def of(self, parts: Parts) -> Parts:
        """Yield the parts; a read error is reported for the source, not for the file being written."""
        try:
            for ready in parts:
                yield ready
                self._done += sum(len(part) for part in ready if part is not None)
                if self.progress:
                    self.progress(self._done, self.rows)
        except OSError as fault:
            text = f"{self.log}: cannot be read: {fault.strerror or fault}"
            raise RecordingError(text, "check its disk") from fault


def _check_apart(target: Path, log: Path, parts: Sequence[Path]) -> None:
    """Raise UsageError if the new file would become a part of the log."""
    alike = target.suffix.lower() == parts[0].suffix.lower()
    if log.is_dir() and alike and target.parent.is_dir() and target.parent.samefile(log):
        raise UsageError(f"{target}: would be a part of the log", "write it to another folder")


def _check_free(paths: Sequence[Path], parts: Sequence[Path], force: bool) -> None:
    for path in paths:
        if path.exists() and any(path.samefile(part) for part in parts):
            raise UsageError(f"{path}: is the log itself, or its load cell", "choose another name")
        if path.exists() and not force:
            raise UsageError(f"{path}: already exists", "choose another name, or overwrite it with --force")


def _provenance(
    log: Path, parts: Sequence[Path], rows: Rows, machine_file: MachineFile | None, section: LogSection
) -> dict[str, str]:
    """Return the provenance; for a log in parts with each part's name and SHA-256, `sha256` being that of these."""
    if log.is_dir():
        parts = LogFolder.of(log).files  # in order of time
    digests = {part.name: file_digest(part) for part in parts}
    told = {
        "source": log.name or log.resolve().name,
        "sha256": join_digests(list(digests.values())),
        "version": __version__,
        "origin_s": repr(rows.origin),
    }
    if log.is_dir():
        told["parts"] = "; ".join(f"{name} {digest}" for name, digest in digests.items())
    if section:
        told["section"] = str(section)
    if lost := [str(finding) for finding in rows.findings if finding.severity == "loss"]:
        told["lost"] = "; ".join(lost)
    if unverified := [finding.message for finding in rows.findings if finding.kind == "unverified"]:
        told[UNVERIFIED] = "; ".join(unverified)
    if machine_file is not None:
        told |= {"machine": machine_file.machine.name, "machine_fingerprint": fingerprint(machine_file.machine)}
    return told
