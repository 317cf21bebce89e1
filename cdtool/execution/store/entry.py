"""One entry of the store: what was computed, under the key of everything that determined it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from cdtool.execution.store.digest import code_version, digest_of
from cdtool.execution.store.sources import SourceFile

Kind = Literal["log", "detector", "trace", "learned", "source"]


@dataclass(frozen=True)
class Entry:
    """What was computed for a recording: rows of the log, of one detector, a trace, or thresholds learned.

    `key` is a SHA-256 in hexadecimal digits; `content` is JSON. `sources` are the files read for it, `seconds` the time
    that it took, `failed` whether it is a reading error; `version` is that of the code. An entry of the kind "source"
    has only sources: of a log that was learned from, or that has the same content as before with another time.
    """

    key: str
    kind: Kind
    recording: str
    detector: str
    content: str
    sources: tuple[SourceFile, ...] = ()
    seconds: float = 0.0
    failed: bool = False
    version: str = ""

    @property
    def size(self) -> int:
        """Return the size of the sources [bytes]."""
        return sum(item.size for item in self.sources)


def source_entry(recording: str, sources: tuple[SourceFile, ...]) -> Entry:
    """Return an entry that has only the sources of a recording."""
    return Entry(digest_of("source", recording, sources), "source", recording, "", "", sources, version=code_version())
