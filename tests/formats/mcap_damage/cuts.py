"""Files that are cut off: at boundaries of records, in all kinds of records, and anywhere in chunks."""

from __future__ import annotations

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.logs import Log, Style, inner, style, unpacked, write
from tests.formats.mcap_damage.truth import Case, Message, Truth, without


def cut_at_a_boundary(rng: np.random.Generator) -> Case:
    """Cut a file between two records of the top level."""
    log = write(rng, style(rng))
    return cut(log, log.spans[int(rng.integers(len(log.spans)))].start, "cut_at_a_boundary")


def cut_in_a_record(rng: np.random.Generator) -> Case:
    """Cut a file in a record of a randomly chosen kind, so that all kinds occur."""
    log = write(rng, style(rng))
    kinds = sorted({span.opcode for span in log.spans})
    kind = kinds[int(rng.integers(len(kinds)))]
    spans = [span for span in log.spans if span.opcode == kind]
    span = spans[int(rng.integers(len(spans)))]
    return cut(log, int(rng.integers(span.start + 1, span.end)), f"cut_in_a_record of kind {kind:#x}")


def cut_in_a_chunk(rng: np.random.Generator) -> Case:
    """Cut a file in a chunk's data, with equal probability for all bytes."""
    log = write(rng, _chunked(rng))
    span = log.chunks[int(rng.integers(len(log.chunks)))]
    return cut(log, int(rng.integers(span.data_at, span.end)), "cut_in_a_chunk")


def cut_in_a_large_chunk(rng: np.random.Generator) -> Case:
    """Cut a file in a chunk of many compressed blocks: the blocks before the cut can be read."""
    log = write(rng, _chunked(rng), count=1200, chunk_size=1 << 20, filler=1500)
    span = log.chunks[0]
    return cut(log, int(rng.integers(span.data_at, span.end)), "cut_in_a_large_chunk")


def cut_in_the_ending(rng: np.random.Generator) -> Case:
    """Cut a file after the last message: in the data end, summary, footer or the last magic bytes."""
    log = write(rng, style(rng))
    return cut(log, int(rng.integers(log.data_end, len(log.data))), "cut_in_the_ending")


def cut(log: Log, at: int, kind: str) -> Case:
    """Return the first `at` bytes: complete messages before the cut must be read, and the readable part of a chunk."""
    required: list[Message] = []
    mostly_required: list[Message] = []
    for span in log.spans:
        if span.end <= at:
            required += span.messages
        elif span.opcode == records.CHUNK and span.data_at < at:
            content = unpacked(log.style.compression, log.data[span.data_at : at])
            whole = sum(opcode == records.MESSAGE for opcode, _, _ in inner(content))
            if log.style.compression:
                mostly_required += span.messages[:whole]
            else:
                required += span.messages[:whole]
    # The CRC of a cut chunk cannot be checked; a file without chunk CRCs is only covered by the CRC of the data.
    covered = log.style.crcs and log.style.chunked
    covered = covered or (log.style.data_crc and at >= log.data_end + 13)
    unverified = bool(
        without(required, () if not covered else [m for s in log.chunks if s.end <= at for m in s.messages])
    )
    truth = Truth(
        log.messages,
        tuple(required),
        tuple(mostly_required),
        loss=True,
        unverified=unverified and not (log.style.data_crc and at >= log.data_end + 13),
        refusable=not required,
    )
    return Case(f"{kind} at byte {at} of {len(log.data)} ({log.style})", log.data[:at], truth)


def _chunked(rng: np.random.Generator) -> Style:
    options = style(rng)
    compression = ("", "lz4", "zstd")[int(rng.integers(3))]
    return Style(compression, True, options.crcs, options.data_crc, options.summary, options.indexed)


KINDS = {
    cut_at_a_boundary: 4,
    cut_in_a_record: 7,
    cut_in_a_chunk: 6,
    cut_in_a_large_chunk: 2,
    cut_in_the_ending: 3,
}
