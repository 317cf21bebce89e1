"""What is left of a damaged MCAP file as a clean one, and what was lost, said in the file itself."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING

from cdtool.errors import RecordingError, UsageError
from cdtool.files import replaced
from cdtool.findings import Finding

if TYPE_CHECKING:
    from cdtool.formats.mcap.container.clean_file import CleanFile
    from cdtool.formats.mcap.container.log import Log
    from cdtool.workflows.runs import Progress

_PIECE = 1 << 20
_RECORD = "cdtool.recovered"


@dataclass(frozen=True)
class Recovered:
    """A file that was written: its messages, those of them that no CRC covers, those left out as none does.

    `findings` are about the source. `whole`: nothing was lost and nothing left out.
    """

    source: str
    output: str
    messages: int
    unverified: int
    left_out: int
    findings: tuple[Finding, ...]

    @property
    def whole(self) -> bool:
        """All that the source should hold is in the output."""
        return not self.left_out and all(finding.severity != "loss" for finding in self.findings)


def recover(
    source: Path, output: Path, unverified: bool = False, *, force: bool = False, progress: Progress | None = None
) -> Recovered:
    """Write what is left of an MCAP file as a clean one; raises RecordingError where nothing is, UsageError.

    Messages are copied byte for byte. Those that no CRC covers (it is lost, or the writer made none) are left out, or,
    with `unverified`, kept in chunks without a CRC: nothing damaged is ever stamped as good. The metadata record
    `cdtool.recovered` tells the source's SHA-256, what was lost and what is unverified. `force` overwrites another file
    that is there; never the source.
    """
    from cdtool.formats.mcap import Mcap
    from cdtool.formats.mcap.container.log import Log

    _check_names(source, output, force)
    if not Mcap().sniff(source) and source.suffix.lower() != ".mcap":
        raise RecordingError(f"{source}: is not an MCAP file", "other formats have no checksums to recover by")
    surveyed = Log(source, strict=False)
    for _ in surveyed.pieces():
        pass
    findings = surveyed.findings()
    if not surveyed.count:
        raise RecordingError(f"{source}: no message can be recovered: {findings[0]}", "copy the file again")
    if surveyed.unverified == surveyed.count and not unverified:
        raise RecordingError(
            f"{source}: no checksum covers any of its {surveyed.count} messages",
            "--unverified keeps them, marked as such",
        )
    kept = surveyed.unverified if unverified else 0
    left_out = surveyed.unverified - kept
    result = Recovered(str(source), str(output), surveyed.count - left_out, kept, left_out, tuple(findings))
    with replaced(output) as (part,), part.open("wb") as file:
        _write(source, file, result, surveyed.unverified == 0, progress)
    return result


def _write(
    source: Path, file: IO[bytes], result: Recovered, all_covered: bool, progress: Progress | None = None
) -> None:
    from cdtool.formats.mcap.container.clean_file import CleanFile
    from cdtool.formats.mcap.container.log import Log
    from cdtool.formats.mcap.container.records import Metadata

    log = Log(source, strict=False)
    clean = CleanFile(file, log.profile)
    for piece in log.pieces():
        covered = [item for item in piece if all_covered or item.covered]
        if covered:
            clean.add_messages(covered, covered=True)
        rest = [item for item in piece if not (all_covered or item.covered)]
        if rest and result.unverified:
            clean.add_messages(rest, covered=False)
        if progress:
            progress(log.count, result.messages + result.left_out)
    if log.unverified != result.unverified + result.left_out:
        raise RecordingError(f"{source}: changed while it was read", "wait until its recorder has closed it")
    _copy_extras(log, clean)
    lost = [str(finding) for finding in result.findings if finding.severity == "loss"]
    told = {
        "source_sha256": _digest(source),
        "messages": str(result.messages),
        "lost": "\n".join(lost) or "nothing",
        "unverified": f"{result.unverified} messages kept in chunks without a checksum, {result.left_out} left out",
    }
    clean.add_metadata(Metadata(_RECORD, told))
    clean.finish()


def _copy_extras(log: Log, clean: CleanFile) -> None:
    """Attachments and metadata that are whole; they carry the checksums that they had, or none."""
    from cdtool.formats.mcap.container.attachments import attachment_index
    from cdtool.formats.mcap.container.file_bytes import FileBytes
    from cdtool.formats.mcap.container.records import PREFIX, Attachment, Metadata

    with FileBytes(log.path) as file:
        for opcode, at, length in log.section.extras:
            if opcode == Attachment.opcode:
                ends = range(at + _PIECE, at + length + _PIECE, _PIECE)
                pieces = (bytes(file.read(end - _PIECE, min(end, at + length) - end + _PIECE)) for end in ends)
                clean.add_attachment(pieces, attachment_index(file, at, length))
            else:
                clean.add_metadata(Metadata.read(file.read(at + PREFIX, length - PREFIX)))


def _check_names(source: Path, output: Path, force: bool) -> None:
    if not source.is_file():
        raise RecordingError(f"{source}: no such file", "check the path")
    if not os.access(source, os.R_OK):
        raise RecordingError(f"{source}: cannot be read", "check the file's permissions")
    if output.suffix.lower() != ".mcap":
        raise UsageError(f"{output}: is not the name of an MCAP file", "let it end in .mcap")
    if not output.parent.is_dir():
        raise UsageError(f"{output}: no folder {output.parent}", "make it first")
    if output.exists() and output.samefile(source):
        raise UsageError(f"{output}: is the file to recover from", "write to another one")
    if output.exists() and not force:
        raise UsageError(f"{output}: already exists", "choose another name, or overwrite it with --force")


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
