"""All kinds of damage with their shares of the cases: `cases(seed, count)`."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from tests.formats.mcap_damage import chunks, cuts, definitions, flips, inserted_bytes, payloads, summaries
from tests.formats.mcap_damage.truth import Case

Kind = Callable[[np.random.Generator], Case]

# Kind of damage -> its share.
KINDS: dict[Kind, float] = {
    **cuts.KINDS,
    **flips.KINDS,
    **chunks.KINDS,
    **definitions.KINDS,
    **payloads.KINDS,
    **inserted_bytes.KINDS,
    **summaries.KINDS,
}


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
