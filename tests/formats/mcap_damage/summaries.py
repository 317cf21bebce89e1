"""Summaries that lie, although their CRC fits: the data section is what counts, and a difference is told."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.assembly import Ending, Index, assemble
from tests.formats.mcap_damage.chunks import drawn
from tests.formats.mcap_damage.messages import DEFINITIONS, TOPICS
from tests.formats.mcap_damage.truth import Case, Truth

_Change = Callable[[list[Index]], list[Index]]
_RAW = DEFINITIONS["/raw"].channel


def lying_count(rng: np.random.Generator) -> Case:
    """The statistics tell other numbers of messages: what should be there is missed, so that is a loss."""
    messages, blocks = drawn(rng)
    off = int(rng.choice([1, 5, 2**31, 2**62, 2**63]))
    data = assemble(blocks, Ending(crc=bool(rng.integers(2)), count_off=off))
    return Case(f"lying_count {off:+}", data, Truth(tuple(messages), tuple(messages), loss=True))


def lying_channel_counts(rng: np.random.Generator) -> Case:
    """The statistics tell other numbers of messages by channel, enormous ones too: no memory may be taken for them."""
    messages, blocks = drawn(rng)
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
    return Case(f"lying_channel_counts {i}", data, Truth(tuple(messages), tuple(messages)))


def lying_index(rng: np.random.Generator) -> Case:
    """The chunk index points into records, out of the file, to overlapping chunks, or is of other chunks."""
    messages, blocks = drawn(rng, everywhere=True)
    size = len(assemble(blocks))
    somewhere = int(rng.integers(size))
    changes: dict[str, _Change] = {
        "none": lambda _: [],
        "one missing": lambda found: found[:3] + found[4:],
        "one twice": lambda found: [found[0], *found],
        "backwards": lambda found: found[::-1],
        "into a record": lambda found: [replace(index, start=index.start + 5) for index in found],
        "somewhere": lambda found: [replace(found[0], start=somewhere), *found[1:]],
        "out of the file": lambda found: [replace(index, start=size + 1000) for index in found],
        "2^64 - 1": lambda found: [replace(index, start=2**64 - 1) for index in found],
        "overlapping": lambda found: [replace(index, start=found[0].start) for index in found],
        "lengths": lambda found: [replace(index, length=index.length + 9) for index in found],
        "lengths of 2^63": lambda found: [replace(index, length=2**63) for index in found],
        "sizes": lambda found: [replace(index, sizes=(2**63, 2**63)) for index in found],
        "sizes of 0": lambda found: [replace(index, sizes=(0, 0)) for index in found],
        "times": lambda found: [replace(index, times=(0, 0)) for index in found],
        "compression": lambda found: [replace(index, compression="bz2") for index in found],
        "index length": lambda found: [replace(index, index_length=index.index_length + 1) for index in found],
        "index length 0": lambda found: [replace(index, index_length=0) for index in found],
        "index length over the next chunk": _over_the_next,
        "index length of 2^64 - 1": lambda found: [replace(index, index_length=2**64 - 1) for index in found],
        "offsets": lambda found: [replace(index, offsets=dict.fromkeys(index.offsets, 5)) for index in found],
    }
    name = list(changes)[int(rng.integers(len(changes)))]
    data = assemble(blocks, Ending(crc=bool(rng.random() < 0.8), indexes=changes[name]))
    return Case(f"lying_index {name}", data, Truth(tuple(messages), tuple(messages)))


def hiding_index(rng: np.random.Generator) -> Case:
    """The chunk index claims that every chunk but the first holds /raw alone: who asks for others must have them."""
    messages, blocks = drawn(rng, everywhere=True)

    def hide(found: list[Index]) -> list[Index]:
        return [found[0], *(replace(index, offsets={_RAW: index.start + index.length}) for index in found[1:])]

    counts: list[Callable[[dict[int, int]], dict[int, int]]] = [dict, lambda counts: {_RAW: sum(counts.values())}]
    i = int(rng.integers(2))
    data = assemble(blocks, Ending(indexes=hide, counts=counts[i]))
    return Case(f"hiding_index {i}", data, Truth(tuple(messages), tuple(messages)))


def renamed_in_the_summary(rng: np.random.Generator) -> Case:
    """The summary has the topics of two channels the other way round: the data's count, or the channel is refused."""
    messages, blocks = drawn(rng, everywhere=bool(rng.integers(2)))
    a, b = rng.choice(len(TOPICS), 2, replace=False).tolist()
    one, two = DEFINITIONS[TOPICS[a]], DEFINITIONS[TOPICS[b]]
    told = b"".join(
        replace(known, topic=two.topic if known is one else one.topic if known is two else known.topic).records
        for known in DEFINITIONS.values()
    )
    must = tuple(message for message in messages if message.topic not in (one.topic, two.topic))
    data = assemble(blocks, Ending(crc=bool(rng.random() < 0.7), definitions=told))
    return Case(f"renamed_in_the_summary {one.topic} {two.topic}", data, Truth(tuple(messages), must))


def summary_of_another_file(rng: np.random.Generator) -> Case:
    """The summary, footer included, of another file of the same machine stands behind the data."""
    messages, blocks = drawn(rng)
    _, others = drawn(rng)
    one, two = assemble(blocks), assemble(others[: int(rng.integers(1, 8))])
    data = one[: _summary_start(one)] + two[_summary_start(two) :]
    return Case("summary_of_another_file", data, Truth(tuple(messages), tuple(messages)))


def lying_footer(rng: np.random.Generator) -> Case:
    """The footer names other places, its CRC being none or wrong: every message is in the data."""
    messages, blocks = drawn(rng)
    data = assemble(blocks)
    places = [0, 1, 8, len(data), len(data) - 20, 2**63, 2**64 - 1, _summary_start(data) + 1, 40]
    place = places[int(rng.integers(len(places)))]
    crc = int(rng.integers(2))
    footer = records.record(records.FOOTER, struct.pack("<QQI", place, place, crc))
    made = data[: -len(records.MAGIC) - 29] + footer + records.MAGIC
    return Case(f"lying_footer {place} {crc}", made, Truth(tuple(messages), tuple(messages)))


def _over_the_next(found: list[Index]) -> list[Index]:
    """The first chunk's message indexes are said to reach over the second chunk, which the index leaves out."""
    first, over = found[0], found[2]
    return [replace(first, index_length=over.start - first.start - first.length), *found[2:]]


def _summary_start(data: bytes) -> int:
    return int(struct.unpack_from("<Q", data, len(data) - len(records.MAGIC) - 20)[0])


KINDS = {
    lying_count: 2,
    lying_channel_counts: 2,
    lying_index: 6,
    hiding_index: 1,
    renamed_in_the_summary: 2,
    summary_of_another_file: 1,
    lying_footer: 2,
}
