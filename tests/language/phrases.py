"""The phrases that the checker refuses, read from phrases.toml."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Phrase:
    """A phrase that is refused, and what to write in its place."""

    name: str
    anchors: tuple[str, ...]
    pattern: re.Pattern[str]
    instead: str
    hit: str
    allowed: str

    def find(self, text: str, lower_case: str) -> Iterator[re.Match[str]]:
        """Yield every hit in `text`, of which `lower_case` is the text in lower case."""
        if any(anchor in lower_case for anchor in self.anchors):
            yield from self.pattern.finditer(text)


def read_phrases() -> tuple[Phrase, ...]:
    """Return the phrases in the order of the file."""
    table = tomllib.loads(Path(__file__).with_name("phrases.toml").read_text(encoding="utf-8"))["phrase"]
    return tuple(
        Phrase(
            name,
            tuple(entry["anchors"]),
            re.compile(entry["pattern"].replace(" ", r"\s+"), re.IGNORECASE),
            entry["instead"],
            entry["hit"],
            entry["allowed"],
        )
        for name, entry in table.items()
    )
