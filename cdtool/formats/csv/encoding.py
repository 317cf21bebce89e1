"""Detect from a file's first bytes whether it is text, its encoding and its line ends."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

from cdtool.base.errors import RecordingError
from cdtool.base.files.kinds import kind_of
from cdtool.formats.csv.gzipped import is_gzipped, measure
from cdtool.formats.csv.text import SAMPLE_BYTES, UNIT_BYTES, Text, read_sample, read_small, recoded
from cdtool.formats.csv_dialect.east_asian import east_asian

# UTF-32 before UTF-16, because its byte order mark starts with that of UTF-16.
_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_CONTROL = re.compile(rb"[\x01-\x08\x0e-\x19\x1b-\x1f]")
# The first bytes of a file, by which text is distinguished from other contents.
HEAD_BYTES = 4096
_ALLOWED = bytes(byte for byte in range(256) if not _CONTROL.match(bytes((byte,))))
_TABLES = ("", "a table of numbers")  # kinds of a text that begins with [, as a head [Header] or the unit [s]
_OTHER_KINDS = (b"%PDF", b"\x89", b"GIF8", b"\xff\xd8", b"PK\x03\x04", b"\x1f\x8b", b"SQLite format", b"#ROSBAG")


def looks_like_text(sample: bytes) -> bool:
    """Return whether the bytes may be a table of numbers.

    They are not if they are markup or a known binary format, or have NUL bytes that are not parts of wide characters.
    """
    head = sample[:HEAD_BYTES]
    if head.startswith(_OTHER_KINDS):
        return False
    encoding, mark = _by_mark(head)
    if encoding in UNIT_BYTES:
        usable = len(head) - (len(head) - mark) % UNIT_BYTES[encoding]
        try:
            text = codecs.getincrementaldecoder(encoding)().decode(head[mark:usable]).rstrip("\0").encode()
        except UnicodeError:
            return False
    else:
        text = head[mark:].rstrip(b"\0")  # after a power failure a file system may pad the end of a file
    # NUL bytes between lines result from a power failure; a binary file has other control characters, too.
    first_line = text.lstrip(b"\r\n").partition(b"\n")[0].partition(b"\r")[0]
    begin = text.lstrip()
    is_other = begin.startswith(b"[") and kind_of(begin) not in _TABLES  # JSON, or a file of cdtool
    if not text or b"\0" in first_line or is_other or begin.startswith((b"<", b"{")):
        return False
    controls = len(text.translate(None, _ALLOWED))
    # A few may be there by mistake: the error names their line.
    return not controls or (b"\0" not in text and controls <= max(3, 0.02 * len(text)))


def open_table(path: Path, encoding: str, most: int = SAMPLE_BYTES) -> tuple[Text, bytes]:
    """Return the encoding and line ends of a text, and its first bytes; raises RecordingError if it is empty."""
    content = read_small(path)
    sample = read_sample(path, most) if content is None else content[:most]
    if not sample.strip():
        raise RecordingError("is empty", "was the recording stopped immediately, or the copy cut off?")
    return detect_text(path, sample, encoding, content)


def detect_text(path: Path, sample: bytes, pinned: str = "", content: bytes | None = None) -> tuple[Text, bytes]:
    """Return encoding and line ends, and the sample as part of the stream; raises RecordingError.

    `content` are all bytes of the file if they have been read.
    """
    if not looks_like_text(sample):
        raise RecordingError("is not a table of numbers: binary or markup", "name a CSV, MCAP or MAT file")
    marked, mark = _by_mark(sample)
    encoding = pinned or marked or _narrow(sample)
    if pinned and mark and marked and codecs.lookup(pinned).name != marked:
        raise RecordingError(
            f"line 1 begins with the byte order mark of {marked.upper()}, [csv] encoding is '{pinned}'",
            "correct or remove encoding in [csv]",
        )
    stream = sample[mark:]
    if encoding in UNIT_BYTES:
        content, mark = recoded(path, encoding, mark, content), 0
        stream = content[: 2 * len(sample)]  # at most 3 bytes of UTF-8 are 2 of UTF-16
    total, size = _without_padding(path, content)
    stream = stream[: max(size - mark, 0)]
    if pinned and encoding not in UNIT_BYTES:
        _check_pinned(stream, encoding)
    head = stream[:HEAD_BYTES]
    control = _CONTROL.search(head) if head.translate(None, _ALLOWED) else None
    if control is not None:
        line = stream.count(b"\n", 0, control.start()) + 1
        raise RecordingError(
            f"line {line} contains a control character (byte 0x{control[0][0]:02x})",
            "save the table as plain text, without terminal colours",
        )
    # A single line feed at the end of a file with carriage returns does not count as its line end.
    inner = stream.rstrip(b"\r\n")
    line_end = b"\n" if b"\n" in inner or b"\r" not in inner else b"\r"
    if b"\r" not in inner and b"\n" not in stream and b"\r" in stream:
        line_end = b"\r"
    return Text(path, encoding, mark, size, total - size, line_end, content), stream


def _by_mark(sample: bytes) -> tuple[str | None, int]:
    """Return the encoding by a byte order mark, and how long that is; without one UTF-16, if the bytes are such."""
    known = ((name, len(mark)) for mark, name in _MARKS if sample.startswith(mark))
    return next(known, (_wide_without_mark(sample), 0))


def _wide_without_mark(sample: bytes) -> str | None:
    """Return UTF-16 without a byte order mark: nearly every second byte of a table is NUL, and few of the others."""
    head = sample[:HEAD_BYTES].rstrip(b"\0")
    if b"\0" not in head:  # the usual case
        return None
    head += b"\0" * (len(head) % 2)
    if len(head) < 4:
        return None
    even, odd = head[0::2].count(0) / (len(head) // 2), head[1::2].count(0) / (len(head) // 2)
    if odd > 0.7 and even < 0.05:
        return "utf-16-le"
    return "utf-16-be" if even > 0.7 and odd < 0.05 else None


def _narrow(sample: bytes) -> str:
    if sample.isascii():
        return "utf-8"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(sample)
    except UnicodeDecodeError:
        if asian := east_asian(sample):
            return asian
        # Bytes 0x80 to 0x9f are letters and quotes in Windows-1252, control characters in Latin-1.
        return "cp1252" if any(0x80 <= byte <= 0x9F for byte in set(sample)) else "latin-1"
    return "utf-8"


def _check_pinned(stream: bytes, encoding: str) -> None:
    try:
        codecs.getincrementaldecoder(encoding)().decode(stream)
    except UnicodeError as fault:
        at = getattr(fault, "start", 0)
        line = stream.count(b"\n", 0, at) + 1
        raise RecordingError(
            f"line {line} is not valid {encoding}, as [csv] encoding states", "correct or remove encoding"
        ) from fault


def _without_padding(path: Path, known: bytes | None) -> tuple[int, int]:
    """Return the size of a text, and its size without the NUL bytes at its end; `known` are its bytes."""
    if known is not None:
        return len(known), len(known.rstrip(b"\0"))
    if is_gzipped(path):
        return measure(path)
    total = end = path.stat().st_size
    with path.open("rb") as file:
        while end > 0:
            start = max(0, end - (1 << 16))
            file.seek(start)
            content = len(file.read(end - start).rstrip(b"\0"))
            end = start + content
            if content:
                break
    return total, end
