"""Files that are cut off: at boundaries of records, in all kinds of records, and anywhere in chunks."""

from __future__ import annotations

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.draft import COMPRESSIONS, pick, share
from tests.formats.mcap_damage.logs import Log, Style, inner, span_of_any_kind, style, unpacked, write
from tests.formats.mcap_damage.truth import Case, Message, Truth, without


@share(4)
def cut_at_a_boundary(rng: np.random.Generator) -> Case:
    """Cut a file between two records of the top level."""
    log = write(rng, style(rng))
    return cut(log, pick(rng, log.spans).start, "cut_at_a_boundary")


@share(7)
def cut_in_a_record(rng: np.random.Generator) -> Case:
    """Cut a file in a record of a randomly chosen kind, so that all kinds occur."""
    log = write(rng, style(rng))
    span = span_of_any_kind(rng, log)
    return cut(log, int(rng.integers(span.start + 1, span.end)), f"cut_in_a_record of kind {span.opcode:#x}")


@share(6)
def cut_in_a_chunk(rng: np.random.Generator) -> Case:
    """Cut a file in a chunk's data, with equal probability for all bytes."""
    log = write(rng, _chunked(rng))
    span = pick(rng, log.chunks)
    return cut(log, int(rng.integers(span.data_at, span.end)), "cut_in_a_chunk")


@share(2)
def cut_in_a_large_chunk(rng: np.random.Generator) -> Case:
    """Cut a file in a chunk of many compressed blocks: the blocks before the cut can be read."""
    log = write(rng, _chunked(rng), count=1200, chunk_size=1 << 20, filler=1500)
    span = log.chunks[0]
    return cut(log, int(rng.integers(span.data_at, span.end)), "cut_in_a_large_chunk")


@share(3)
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
            (mostly_required if log.style.compression else required).extend(span.messages[:whole])
    # The CRC of a cut chunk cannot be checked; a file without chunk CRCs is only covered by the CRC of the data.
    by_data_crc = log.style.data_crc and at >= log.data_end + 13
    by_chunks = [m for s in log.chunks if s.end <= at for m in s.messages] if log.style.crcs else []
    truth = Truth(
        log.messages,
        tuple(required),
        tuple(mostly_required),
        loss=True,
        unverified=bool(without(required, by_chunks)) and not by_data_crc,
        refusable=not required,
    )
    return Case(f"{kind} at byte {at} of {len(log.data)} ({log.style})", log.data[:at], truth)


def _chunked(rng: np.random.Generator) -> Style:
    options = style(rng)
    return Style(pick(rng, COMPRESSIONS), True, options.crcs, options.data_crc, options.summary, options.indexed)
