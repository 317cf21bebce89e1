"""Cases of all kinds of damage: `cases(seed, count)`."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module

import numpy as np

from tests.formats.mcap_damage.draft import KINDS, Kind
from tests.formats.mcap_damage.truth import Case

for _module in ("cuts", "flips", "chunks", "definitions", "payloads", "inserted_bytes", "summaries"):
    import_module(f"tests.formats.mcap_damage.{_module}")  # registers its kinds


def kind_of(seed: int, number: int) -> tuple[Kind, np.random.Generator]:
    """Return the kind of a case, and its random generator."""
    shares = np.array(list(KINDS.values()))
    rng = np.random.default_rng([seed, number])
    return list(KINDS)[int(rng.choice(len(KINDS), p=shares / shares.sum()))], rng


def cases(seed: int, count: int, first: int = 0) -> Iterator[Case]:
    """Yield the cases number `first` to `first + count` of a seed; each depends only on seed and number."""
    for number in range(first, first + count):
        make, rng = kind_of(seed, number)
        yield make(rng)
