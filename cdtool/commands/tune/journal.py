"""What a search has measured, line by line in a file, so that an interrupted search goes on where it stopped."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cdtool.base.errors import OutputError
from cdtool.base.files.bounded_loading import parse_own_json
from cdtool.commands.tune.search.candidate import Candidate, Measured


class TuningJournal:
    """The measurements of one detector in a file of the output folder; those of another search are dropped.

    `key` is the digest of everything that determines a measurement beside its candidate.
    """

    def __init__(self, path: Path, key: str) -> None:
        self.path, self._key = path, key
        self.known = self._read()
        # A line that was cut off would spoil the next one: what is known is written again.
        lines = [json.dumps({"search": key}), *(_line(*item) for item in self.known.items())]
        with _explained(path), path.open("w", encoding="utf-8", newline="\n") as file:
            file.writelines(f"{line}\n" for line in lines)

    def add(self, candidate: Candidate, measured: Measured) -> None:
        """Append a measurement."""
        self.known[candidate.key] = measured
        with _explained(self.path), self.path.open("a", encoding="utf-8", newline="\n") as file:
            file.write(f"{_line(candidate.key, measured)}\n")

    def _read(self) -> dict[str, Measured]:
        """Return the measurements of an earlier run; the last line may be cut off."""
        found: dict[str, Measured] = {}
        try:
            with self.path.open(encoding="utf-8") as file:
                if parse_own_json(file.readline()).get("search") != self._key:
                    return {}
                for line in file:
                    if not line.endswith("\n"):
                        break
                    key, values = parse_own_json(line)
                    found[key] = Measured.from_dict(values)
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            pass
        return found


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    """Raise OutputError for a file that cannot be written."""
    try:
        yield
    except OSError as fault:
        words = f"{path}: cannot be written: {fault.strerror or fault}"
        raise OutputError(words, "free space, or choose another --output") from fault


def _line(key: str, measured: Measured) -> str:
    return json.dumps([key, measured.to_dict()], separators=(",", ":"))
