"""What most kinds of damage begin with: eight chunks of known messages, which they change, and a drawn ending."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from tests.formats.mcap_damage.assembly import Block, Ending, assemble, blocks_of
from tests.formats.mcap_damage.messages import ordinary
from tests.formats.mcap_damage.truth import Case, Message, Truth

COMPRESSIONS = ("", "lz4", "zstd")
Kind = Callable[[np.random.Generator], Case]
KINDS: dict[Kind, float] = {}
"""Kind of damage -> its share of the cases."""
T = TypeVar("T")


def share(of_cases: float) -> Callable[[Kind], Kind]:
    """Register a kind of damage with its share of the cases."""

    def register(kind: Kind) -> Kind:
        KINDS[kind] = of_cases
        return kind

    return register


def pick(rng: np.random.Generator, items: Sequence[T]) -> T:
    return items[int(rng.integers(len(items)))]


def draw_ending(rng: np.random.Generator) -> Ending:
    """Return an ending, usually with a summary; sometimes without the summary's CRC, or with a CRC of the data."""
    without_any, without_crc, data_crc = rng.random(3) < (0.25, 0.2, 0.2)
    return Ending(not without_any, not without_crc, bool(data_crc))


class Draft:
    """Messages and eight chunks of them; the definitions are in the first chunk, or in every chunk."""

    def __init__(
        self, rng: np.random.Generator, compression: str | None = None, everywhere: bool | None = None
    ) -> None:
        compression = pick(rng, COMPRESSIONS) if compression is None else compression
        everywhere = bool(rng.random() < 0.5) if everywhere is None else everywhere
        self.rng = rng
        self.messages = ordinary(rng, 64)
        self.blocks = blocks_of(self.messages, 8, compression, everywhere)

    @cached_property
    def ending(self) -> Ending:
        """Drawn where it is first used."""
        return draw_ending(self.rng)

    def place(self) -> int:
        """Return the number of any chunk."""
        return int(self.rng.integers(len(self.blocks)))

    def pick(self, items: Sequence[T]) -> T:
        return pick(self.rng, items)

    def other_than(self, *topics: str) -> tuple[Message, ...]:
        return tuple(message for message in self.messages if message.topic not in topics)

    def change(self, changed: Mapping[int, Message]) -> None:
        """Replace messages, by the id of the object, in the list and in the chunks."""
        self.messages = [changed.get(id(message), message) for message in self.messages]
        self.blocks = [
            replace(block, messages=tuple(changed.get(id(message), message) for message in block.messages))
            for block in self.blocks
        ]

    def define(self, definitions: bytes) -> None:
        """Write other definitions into the first chunk and into the summary."""
        self.blocks[0] = replace(self.blocks[0], before=definitions)
        self.ending = replace(self.ending, definitions=definitions)

    def case(
        self,
        name: str,
        parts: Sequence[Block | bytes] | None = None,
        required: Iterable[Message] | None = None,
        written: Iterable[Message] | None = None,
        **truth: Any,
    ) -> Case:
        """Return the case of these parts (without: the chunks), of which all that is written is required."""
        known = tuple(self.messages if written is None else written)
        needed = known if required is None else tuple(required)
        return Case(name, assemble(self.blocks if parts is None else parts, self.ending), Truth(known, needed, **truth))
