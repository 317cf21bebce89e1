"""Flipped bits, changed bytes and zeroed sectors, anywhere in a file.

The expected result depends on the position of the damage: a chunk's content is covered by the chunk's CRC, the summary
by its own, and all bytes before the data end by the CRC of the data section if there is one. Messages outside of chunks
and chunks with the CRC 0 are only covered by the latter.
"""

from __future__ import annotations

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.draft import pick, share
from tests.formats.mcap_damage.logs import Log, Span, span_of_any_kind, style, write
from tests.formats.mcap_damage.truth import Case, Message, Truth


@share(8)
def flipped_bit(rng: np.random.Generator) -> Case:
    """Flip one bit anywhere."""
    log = write(rng, style(rng))
    at = int(rng.integers(len(log.data)))
    return _flipped(log, {at: log.data[at] ^ (1 << int(rng.integers(8)))}, "flipped_bit")


@share(7)
def flipped_bit_of_a_kind(rng: np.random.Generator) -> Case:
    """Flip one bit in a record of a randomly chosen kind, so that small records are hit as often as large ones."""
    log = write(rng, style(rng))
    span = span_of_any_kind(rng, log)
    at = int(rng.integers(span.start, span.end))
    return _flipped(log, {at: log.data[at] ^ (1 << int(rng.integers(8)))}, f"flipped_bit_of_a_kind {span.opcode:#x}")


@share(7)
def flipped_bit_of_a_frame(rng: np.random.Generator) -> Case:
    """Flip one bit of a record's opcode or length, or of a chunk's header."""
    log = write(rng, style(rng))
    span = pick(rng, log.spans)
    end = span.data_at if span.opcode == records.CHUNK else span.start + 9
    at = int(rng.integers(span.start, end))
    return _flipped(log, {at: log.data[at] ^ (1 << int(rng.integers(8)))}, f"flipped_bit_of_a_frame {span.opcode:#x}")


@share(4)
def changed_byte(rng: np.random.Generator) -> Case:
    """Change one byte to any other value."""
    log = write(rng, style(rng))
    at = int(rng.integers(len(log.data)))
    return _flipped(log, {at: (log.data[at] + int(rng.integers(1, 256))) % 256}, "changed_byte")


@share(4)
def changed_bytes(rng: np.random.Generator) -> Case:
    """Change some bytes at several positions."""
    log = write(rng, style(rng))
    positions = rng.integers(len(log.data), size=int(rng.integers(2, 6))).tolist()
    return _flipped(log, {at: (log.data[at] + int(rng.integers(1, 256))) % 256 for at in positions}, "changed_bytes")


@share(3)
def zeroed_sector(rng: np.random.Generator) -> Case:
    """Set 512 bytes to 0, like a sector that a disk has not written."""
    log = write(rng, style(rng))
    at = int(rng.integers(len(log.data))) // 512 * 512
    return _flipped(log, dict.fromkeys(range(at, min(at + 512, len(log.data))), 0), "zeroed_sector")


# A record without a checksum may turn into one of these outside of chunks, which are read as unverified.
_READ_BARE = (records.SCHEMA, records.CHANNEL, records.MESSAGE)


def _flipped(log: Log, changes: dict[int, int], kind: str) -> Case:
    data = bytearray(log.data)
    for at, value in changes.items():
        data[at] = value
    hit = sorted(at for at in changes if log.data[at] != data[at])
    shown = f"bytes {hit[0]} to {hit[-1]}" if len(hit) > 5 else f"byte {', '.join(map(str, hit))}"
    place = ", ".join(sorted({f"{span.opcode:#x}" if (span := log.span(at)) else "magic" for at in hit}))
    return Case(f"{kind} at {shown} in {place} ({log.style})", bytes(data), _truth(log, bytes(data), hit))


def _truth(log: Log, data: bytes, hit: list[int]) -> Truth:
    """Return the truth: every chunk with an undamaged record must be read if its definitions can be read."""
    style = log.style
    spans = [log.span(at) for at in hit]
    in_data = [at for at in hit if at < log.data_end]
    in_summary = [at for at in hit if at >= log.data_end]
    begins = any(at < len(records.MAGIC) for at in hit)
    in_data_end = any(log.data_end <= at < log.data_end + 13 for at in hit)
    whole = [span for span in log.spans if span.messages and span not in spans]
    required = [message for span in whole for message in span.messages]
    if not style.chunked:
        required = _required_without_chunks(log, hit)
    covered = style.chunked and style.crcs
    checked = covered and not any(log.opens(at) and data[at] in _READ_BARE for at in hit)
    if not checked and style.data_crc and any(at < log.data_end + 13 for at in hit):
        # The CRC of the data does not match, so that all values are doubtful, or the CRC itself is damaged.
        return Truth(log.messages, loss=None, refusable=True, checked=not any(_hides_crc(log, at) for at in hit))
    if not _definitions_known(log, hit):
        required = []
    return Truth(
        log.messages,
        tuple(required),
        checked=checked or not in_data,
        undetectable=_silent(log, spans, hit),
        # Bytes without a checksum may form a message without the requested field, which is an error.
        # A damaged data end may contain a CRC although the file has none.
        refusable=begins or not required or not (checked or not (in_data or in_data_end)),
        loss=None if in_data or in_summary else False,
        unverified=not covered and not style.data_crc,
    )


def _required_without_chunks(log: Log, hit: list[int]) -> list[Message]:
    """Return the messages before the first wrong length: without chunks, the start of the next record is unknown."""
    required: list[Message] = []
    for span in log.spans:
        frame = range(span.start, span.start + 9)
        if any(at in frame for at in hit if at < log.data_end):
            break
        if span.messages and not any(at in span for at in hit):
            required += span.messages
    return required


def _hides_crc(log: Log, at: int) -> bool:
    """Return whether the damage may hide the CRC of the data section: it is in that CRC, or in a record's prefix."""
    span = log.span(at)
    return span is None or at in range(span.start, span.start + 9) or log.data_end <= at < log.data_end + 13


def _definitions_known(log: Log, hit: list[int]) -> bool:
    """Return whether the definitions can be read: from the first chunk (or before the first message), or a summary."""
    first = next(i for i, span in enumerate(log.spans) if span.messages)
    ends = log.spans[first].end if log.style.chunked else log.spans[first].start
    if not any(len(records.MAGIC) <= at < ends for at in hit):
        return True
    if not log.style.chunked or not log.style.crcs:
        return False
    return log.style.summary and not any(at >= log.data_end for at in hit)


def _silent(log: Log, spans: list[Span | None], hit: list[int]) -> bool:
    """Return whether a loss may be undetectable: a record that became an unknown one must be skipped.

    It is detected by the counts of a summary, or by a message index without its chunk.
    """
    style = log.style
    if style.chunked and style.crcs and (style.summary or style.indexed):
        return len(hit) > 1
    hits_prefix = [span for span, at in zip(spans, hit, strict=True) if span is None or at < span.start + 9]
    return bool(hits_prefix) or not style.crcs or not style.chunked
