"""Recover a damaged MCAP file into a clean one that also records what was lost."""

from __future__ import annotations

import os
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING

from cdtool.base.errors import RecordingError, UsageError
from cdtool.base.files.writing import replaced
from cdtool.base.findings import Finding
from cdtool.base.remote.remote_path import check_place, is_remote
from cdtool.formats.channels.channel_assembly import file_digest

if TYPE_CHECKING:
    from cdtool.execution.workers import Progress
    from cdtool.formats.mcap.clean_file import CleanFile
    from cdtool.formats.mcap.log import Log

_RECORD = "cdtool.recovered"


@dataclass(frozen=True)
class Recovered:
    """The file written: its messages, how many of them have no CRC, and how many without a CRC were left out.

    `findings` concern the source. `whole`: nothing was lost and nothing left out.
    """

    source: str
    output: str
    messages: int
    unverified: int
    left_out: int
    findings: tuple[Finding, ...]

    @property
    def whole(self) -> bool:
        """Whether the output contains everything that the source should contain."""
        return not self.left_out and all(finding.severity != "loss" for finding in self.findings)


def recover(
    source: Path, output: Path, unverified: bool = False, *, force: bool = False, progress: Progress | None = None
) -> Recovered:
    """Write the remainder of a damaged MCAP file as a clean one.

    Parameters
    ----------
    source : Path
        The damaged file.
    output : Path
        The file to write, ending in .mcap.
    unverified : bool, optional
        Keep messages without a CRC (it is lost, or the recorder wrote none), in chunks without a CRC; else they are
        left out. Damaged data is never marked as verified.
    force : bool, optional
        Replace an existing file, but never the source.
    progress : callable, optional
        Called with the number of messages written and the total.

    Returns
    -------
    Recovered
        The number of messages, and the findings. Messages are copied byte for byte; the metadata record
        `cdtool.recovered` contains the SHA-256 of the source, and what was lost and what is unverified.

    Raises
    ------
    RecordingError
        The file is not an MCAP file, or no message can be recovered.
    UsageError
        The output already exists, or is not the name of an MCAP file.

    Examples
    --------
    >>> import cdtool
    >>> from pathlib import Path
    >>> whole = Path("sample_logs/gate/stiff/01.mcap").read_bytes()
    >>> _ = Path("cut.mcap").write_bytes(whole[: len(whole) * 2 // 3])
    >>> recovered = cdtool.recover(Path("cut.mcap"), Path("clean.mcap"), unverified=True)
    >>> recovered.whole, recovered.messages > 0
    (False, True)
    """
    from cdtool.formats.mcap import Mcap
    from cdtool.formats.mcap.log import Log

    _check_names(source, output, force)
    if not Mcap().sniff(source) and source.suffix.lower() != ".mcap":
        raise RecordingError(f"{source}: is not an MCAP file", "only MCAP files have checksums to recover by")
    surveyed = Log(source, strict=False)
    for _ in surveyed.blocks():
        pass
    findings = surveyed.findings()
    if not surveyed.count:
        raise RecordingError(f"{source}: no message can be recovered: {findings[0]}", "copy the file again")
    if surveyed.unverified == surveyed.count and not unverified:
        raise RecordingError(
            f"{source}: none of its {surveyed.count} messages has a checksum",
            "--recover all keeps them, marked as such",
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
    from cdtool.formats.mcap.clean_file import CleanFile
    from cdtool.formats.mcap.log import Log

    log = Log(source, strict=False)
    clean = CleanFile(file, log.profile)
    for piece in log.blocks():
        covered = [item for item in piece if all_covered or item.covered]
        if covered:
            clean.add_messages(covered, covered=True)
        rest = [item for item in piece if not (all_covered or item.covered)]
        if rest and result.unverified:
            clean.add_messages(rest, covered=False)
        if progress:
            progress(log.count, result.messages + result.left_out)
    if log.unverified != result.unverified + result.left_out:
        raise RecordingError(f"{source}: changed while it was read", "wait until the recorder has closed it")
    _copy_extras(log, clean)
    lost = [str(finding) for finding in result.findings if finding.severity == "loss"]
    told = {
        "source_sha256": file_digest(source),
        "messages": str(result.messages),
        "lost": "\n".join(lost) or "nothing",
        "unverified": f"{result.unverified} messages in chunks without a checksum, {result.left_out} left out",
    }
    clean.add_metadata(_RECORD, told)
    clean.finish()


def _copy_extras(log: Log, clean: CleanFile) -> None:
    """Copy intact attachments and metadata; their checksums are kept, missing ones stay missing."""
    from cdtool.formats.mcap.file_bytes import FileBytes
    from cdtool.formats.mcap.records import PREFIX, Opcode, parse

    with closing(FileBytes(log.path)) as file:
        for opcode, at, length in log.section.extras:
            content = file.read(at + PREFIX, length - PREFIX)
            record = parse(opcode, content)
            if opcode == Opcode.ATTACHMENT:
                crc = 32 + len(record.name.encode()) + len(record.media_type.encode()) + len(record.data)
                clean.add_attachment(record, covered=any(content[crc : crc + 4]))
            else:
                clean.add_metadata(record.name, record.metadata)


def _check_names(source: Path, output: Path, force: bool) -> None:
    if not source.is_file():
        raise RecordingError(f"{source}: no such file", "check the path")
    if not is_remote(source) and not os.access(source, os.R_OK):
        raise RecordingError(f"{source}: cannot be read", "check the file's permissions")
    if output.suffix.lower() != ".mcap":
        raise UsageError(f"{output}: must end in .mcap", "choose another name")
    if is_remote(output):
        check_place(output)
    elif not output.parent.is_dir():
        raise UsageError(f"{output}: no folder {output.parent}", "create the folder first")
    if output.exists() and output.samefile(source):
        raise UsageError(f"{output}: is the file to recover", "choose another name")
    if output.exists() and not force:
        raise UsageError(f"{output}: already exists", "choose another name, or overwrite it with --force")
