"""False summaries with a valid CRC: the data section takes precedence, and differences are reported."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tests.formats.mcap_damage import records
from tests.formats.mcap_damage.assembly import Ending, Index, assemble
from tests.formats.mcap_damage.draft import Draft, share
from tests.formats.mcap_damage.messages import DEFINITIONS, TOPICS
from tests.formats.mcap_damage.truth import Case, Truth

_RAW = DEFINITIONS["/raw"].channel
Counts = dict[int, int]


@share(2)
def false_count(rng: np.random.Generator) -> Case:
    """Set a false number of messages in the statistics: messages seem to be missing, which is a loss."""
    draft = Draft(rng)
    off = int(rng.choice([1, 5, 2**31, 2**62, 2**63]))
    draft.ending = Ending(crc=bool(rng.integers(2)), count_off=off)
    return draft.case(f"false_count {off:+}", loss=True)


@share(2)
def false_channel_counts(rng: np.random.Generator) -> Case:
    """Set false, also enormous, message counts per channel: no memory may be allocated for them."""
    draft = Draft(rng)
    changes: list[Callable[[Counts], Counts]] = [
        lambda _: {},
        lambda counts: {**counts, 1: 2**62},
        lambda counts: {**counts, 1: 0},
        lambda counts: {**counts, 999: 5},
        lambda counts: dict(zip(counts, reversed(list(counts.values())), strict=True)),
        lambda _: dict.fromkeys(range(3000), 2**64 - 1),
    ]
    i = int(rng.integers(len(changes)))
    draft.ending = Ending(crc=bool(rng.random() < 0.8), counts=changes[i])
    return draft.case(f"false_channel_counts {i}")


# By name, the fields of every chunk index that are false.
_FALSE_FIELDS: dict[str, Callable[[Index], dict[str, object]]] = {
    "into a record": lambda index: {"start": index.start + 5},
    "2^64 - 1": lambda _: {"start": 2**64 - 1},
    "lengths": lambda index: {"length": index.length + 9},
    "lengths of 2^63": lambda _: {"length": 2**63},
    "sizes": lambda _: {"sizes": (2**63, 2**63)},
    "sizes of 0": lambda _: {"sizes": (0, 0)},
    "times": lambda _: {"times": (0, 0)},
    "compression": lambda _: {"compression": "bz2"},
    "index length": lambda index: {"index_length": index.index_length + 1},
    "index length 0": lambda _: {"index_length": 0},
    "index length of 2^64 - 1": lambda _: {"index_length": 2**64 - 1},
    "offsets": lambda index: {"offsets": dict.fromkeys(index.offsets, 5)},
}


@share(6)
def false_index(rng: np.random.Generator) -> Case:
    """Write a chunk index that points into records, beyond the file, to overlapping chunks, or to other chunks."""
    draft = Draft(rng, everywhere=True)
    size = len(assemble(draft.blocks))
    somewhere = int(rng.integers(size))
    changes: dict[str, Callable[[list[Index]], list[Index]]] = {
        name: lambda indexes, fields=fields: [replace(index, **fields(index)) for index in indexes]
        for name, fields in _FALSE_FIELDS.items()
    } | {
        "none": lambda _: [],
        "one missing": lambda indexes: indexes[:3] + indexes[4:],
        "one twice": lambda indexes: [indexes[0], *indexes],
        "backwards": lambda indexes: indexes[::-1],
        "somewhere": lambda indexes: [replace(indexes[0], start=somewhere), *indexes[1:]],
        "out of the file": lambda indexes: [replace(index, start=size + 1000) for index in indexes],
        "overlapping": lambda indexes: [replace(index, start=indexes[0].start) for index in indexes],
        "index length over the next chunk": _over_the_next,
    }
    name = draft.pick(list(changes))
    draft.ending = Ending(crc=bool(rng.random() < 0.8), indexes=changes[name])
    return draft.case(f"false_index {name}")


def _over_the_next(indexes: list[Index]) -> list[Index]:
    """Return an index without the second chunk, whose bytes are declared as message indexes of the first chunk."""
    first, over = indexes[0], indexes[2]
    return [replace(first, index_length=over.start - first.start - first.length), *indexes[2:]]


@share(1)
def incomplete_index(rng: np.random.Generator) -> Case:
    """Write a chunk index with only /raw in all chunks but the first: other requested topics must still be read."""
    draft = Draft(rng, everywhere=True)

    def hide(indexes: list[Index]) -> list[Index]:
        return [indexes[0], *(replace(index, offsets={_RAW: index.start + index.length}) for index in indexes[1:])]

    counts: list[Callable[[Counts], Counts]] = [dict, lambda counts: {_RAW: sum(counts.values())}]
    i = int(rng.integers(2))
    draft.ending = Ending(indexes=hide, counts=counts[i])
    return draft.case(f"incomplete_index {i}")


@share(2)
def exchanged_topics_in_the_summary(rng: np.random.Generator) -> Case:
    """Exchange the topics of two channels in the summary: the data's topics are read, or the channels are refused."""
    draft = Draft(rng, everywhere=bool(rng.integers(2)))
    one, two = (DEFINITIONS[TOPICS[i]] for i in rng.choice(len(TOPICS), 2, replace=False).tolist())
    exchanged = {one.topic: two.topic, two.topic: one.topic}
    definitions = b"".join(
        replace(known, topic=exchanged.get(known.topic, known.topic)).records for known in DEFINITIONS.values()
    )
    draft.ending = Ending(crc=bool(rng.random() < 0.7), definitions=definitions)
    name = f"exchanged_topics_in_the_summary {one.topic} {two.topic}"
    return draft.case(name, required=draft.other_than(one.topic, two.topic))


@share(1)
def summary_of_another_file(rng: np.random.Generator) -> Case:
    """Append the summary and footer of another file of the same machine."""
    draft, other = Draft(rng), Draft(rng)
    one, two = assemble(draft.blocks), assemble(other.blocks[: int(rng.integers(1, 8))])
    data = one[: _summary_start(one)] + two[_summary_start(two) :]
    return Case("summary_of_another_file", data, Truth(tuple(draft.messages), tuple(draft.messages)))


@share(2)
def false_footer(rng: np.random.Generator) -> Case:
    """Set false positions in the footer, with a missing or wrong CRC: every message is in the data."""
    draft = Draft(rng)
    data = assemble(draft.blocks)
    positions = [0, 1, 8, len(data), len(data) - 20, 2**63, 2**64 - 1, _summary_start(data) + 1, 40]
    position, crc = draft.pick(positions), int(rng.integers(2))
    footer = records.record(records.FOOTER, struct.pack("<QQI", position, position, crc))
    content = data[: -len(records.MAGIC) - 29] + footer + records.MAGIC
    return Case(f"false_footer {position} {crc}", content, Truth(tuple(draft.messages), tuple(draft.messages)))


def _summary_start(data: bytes) -> int:
    return int(struct.unpack_from("<Q", data, len(data) - len(records.MAGIC) - 20)[0])
