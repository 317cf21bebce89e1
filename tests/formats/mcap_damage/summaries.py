"""False summaries with a valid CRC: the data section takes precedence, and differences are reported."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.assembly import Ending, Index, assemble
from tests.formats.mcap_damage.chunks import draw_blocks
from tests.formats.mcap_damage.messages import DEFINITIONS, TOPICS
from tests.formats.mcap_damage.truth import Case, Truth

_Change = Callable[[list[Index]], list[Index]]
_RAW = DEFINITIONS["/raw"].channel


def false_count(rng: np.random.Generator) -> Case:
    """Set a false number of messages in the statistics: messages seem to be missing, which is a loss."""
    messages, blocks = draw_blocks(rng)
    off = int(rng.choice([1, 5, 2**31, 2**62, 2**63]))
    data = assemble(blocks, Ending(crc=bool(rng.integers(2)), count_off=off))
    return Case(f"false_count {off:+}", data, Truth(tuple(messages), tuple(messages), loss=True))


def false_channel_counts(rng: np.random.Generator) -> Case:
    """Set false, also enormous, message counts per channel: no memory may be allocated for them."""
    messages, blocks = draw_blocks(rng)
    changes: list[Callable[[dict[int, int]], dict[int, int]]] = [
        lambda _: {},
        lambda counts: {**counts, 1: 2**62},
        lambda counts: {**counts, 1: 0},
        lambda counts: {**counts, 999: 5},
        lambda counts: dict(zip(counts, reversed(list(counts.values())), strict=True)),
        lambda _: dict.fromkeys(range(3000), 2**64 - 1),
    ]
    i = int(rng.integers(len(changes)))
    data = assemble(blocks, Ending(crc=bool(rng.random() < 0.8), counts=changes[i]))
    return Case(f"false_channel_counts {i}", data, Truth(tuple(messages), tuple(messages)))


def false_index(rng: np.random.Generator) -> Case:
    """Write a chunk index that points into records, beyond the file, to overlapping chunks, or to other chunks."""
    messages, blocks = draw_blocks(rng, everywhere=True)
    size = len(assemble(blocks))
    somewhere = int(rng.integers(size))
    changes: dict[str, _Change] = {
        "none": lambda _: [],
        "one missing": lambda indexes: indexes[:3] + indexes[4:],
        "one twice": lambda indexes: [indexes[0], *indexes],
        "backwards": lambda indexes: indexes[::-1],
        "into a record": lambda indexes: [replace(index, start=index.start + 5) for index in indexes],
        "somewhere": lambda indexes: [replace(indexes[0], start=somewhere), *indexes[1:]],
        "out of the file": lambda indexes: [replace(index, start=size + 1000) for index in indexes],
        "2^64 - 1": lambda indexes: [replace(index, start=2**64 - 1) for index in indexes],
        "overlapping": lambda indexes: [replace(index, start=indexes[0].start) for index in indexes],
        "lengths": lambda indexes: [replace(index, length=index.length + 9) for index in indexes],
        "lengths of 2^63": lambda indexes: [replace(index, length=2**63) for index in indexes],
        "sizes": lambda indexes: [replace(index, sizes=(2**63, 2**63)) for index in indexes],
        "sizes of 0": lambda indexes: [replace(index, sizes=(0, 0)) for index in indexes],
        "times": lambda indexes: [replace(index, times=(0, 0)) for index in indexes],
        "compression": lambda indexes: [replace(index, compression="bz2") for index in indexes],
        "index length": lambda indexes: [replace(index, index_length=index.index_length + 1) for index in indexes],
        "index length 0": lambda indexes: [replace(index, index_length=0) for index in indexes],
        "index length over the next chunk": _over_the_next,
        "index length of 2^64 - 1": lambda indexes: [replace(index, index_length=2**64 - 1) for index in indexes],
        "offsets": lambda indexes: [replace(index, offsets=dict.fromkeys(index.offsets, 5)) for index in indexes],
    }
    name = list(changes)[int(rng.integers(len(changes)))]
    data = assemble(blocks, Ending(crc=bool(rng.random() < 0.8), indexes=changes[name]))
    return Case(f"false_index {name}", data, Truth(tuple(messages), tuple(messages)))


def incomplete_index(rng: np.random.Generator) -> Case:
    """Write a chunk index with only /raw in all chunks but the first: other requested topics must still be read."""
    messages, blocks = draw_blocks(rng, everywhere=True)

    def hide(indexes: list[Index]) -> list[Index]:
        return [indexes[0], *(replace(index, offsets={_RAW: index.start + index.length}) for index in indexes[1:])]

    counts: list[Callable[[dict[int, int]], dict[int, int]]] = [dict, lambda counts: {_RAW: sum(counts.values())}]
    i = int(rng.integers(2))
    data = assemble(blocks, Ending(indexes=hide, counts=counts[i]))
    return Case(f"incomplete_index {i}", data, Truth(tuple(messages), tuple(messages)))


def exchanged_topics_in_the_summary(rng: np.random.Generator) -> Case:
    """Exchange the topics of two channels in the summary: the data's topics are read, or the channels are refused."""
    messages, blocks = draw_blocks(rng, everywhere=bool(rng.integers(2)))
    a, b = rng.choice(len(TOPICS), 2, replace=False).tolist()
    one, two = DEFINITIONS[TOPICS[a]], DEFINITIONS[TOPICS[b]]
    definitions = b"".join(
        replace(known, topic=two.topic if known is one else one.topic if known is two else known.topic).records
        for known in DEFINITIONS.values()
    )
    required = tuple(message for message in messages if message.topic not in (one.topic, two.topic))
    data = assemble(blocks, Ending(crc=bool(rng.random() < 0.7), definitions=definitions))
    return Case(f"exchanged_topics_in_the_summary {one.topic} {two.topic}", data, Truth(tuple(messages), required))


def summary_of_another_file(rng: np.random.Generator) -> Case:
    """Append the summary and footer of another file of the same machine."""
    messages, blocks = draw_blocks(rng)
    _, others = draw_blocks(rng)
    one, two = assemble(blocks), assemble(others[: int(rng.integers(1, 8))])
    data = one[: _summary_start(one)] + two[_summary_start(two) :]
    return Case("summary_of_another_file", data, Truth(tuple(messages), tuple(messages)))


def false_footer(rng: np.random.Generator) -> Case:
    """Set false positions in the footer, with a missing or wrong CRC: every message is in the data."""
    messages, blocks = draw_blocks(rng)
    data = assemble(blocks)
    positions = [0, 1, 8, len(data), len(data) - 20, 2**63, 2**64 - 1, _summary_start(data) + 1, 40]
    position = positions[int(rng.integers(len(positions)))]
    crc = int(rng.integers(2))
    footer = records.record(records.FOOTER, struct.pack("<QQI", position, position, crc))
    content = data[: -len(records.MAGIC) - 29] + footer + records.MAGIC
    return Case(f"false_footer {position} {crc}", content, Truth(tuple(messages), tuple(messages)))


def _over_the_next(indexes: list[Index]) -> list[Index]:
    """Return an index without the second chunk, whose bytes are declared as message indexes of the first chunk."""
    first, over = indexes[0], indexes[2]
    return [replace(first, index_length=over.start - first.start - first.length), *indexes[2:]]


def _summary_start(data: bytes) -> int:
    return int(struct.unpack_from("<Q", data, len(data) - len(records.MAGIC) - 20)[0])


KINDS = {
    false_count: 2,
    false_channel_counts: 2,
    false_index: 6,
    incomplete_index: 1,
    exchanged_topics_in_the_summary: 2,
    summary_of_another_file: 1,
    false_footer: 2,
}
