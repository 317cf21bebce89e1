"""What a search has measured, line by line in a file, so that an interrupted search goes on where it stopped."""

from __future__ import annotations

import json
from pathlib import Path

from cdtool.tuning.candidate import Candidate, Measured


class Journal:
    """The measurements of one detector in a file of the output folder; those of another search are dropped.

    `key` is the digest of everything that determines a measurement beside its candidate.
    """

    def __init__(self, path: Path, key: str) -> None:
        self.path, self._key = path, key
        self.known = self._read()
        if not self.known:
            path.write_text(json.dumps({"search": key}) + "\n", encoding="utf-8")

    def add(self, candidate: Candidate, measured: Measured) -> None:
        """Append a measurement."""
        self.known[candidate.key] = measured
        line = json.dumps([candidate.key, measured.to_dict()], separators=(",", ":"))
        with self.path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")

    def _read(self) -> dict[str, Measured]:
        """Return the measurements of an earlier run; the last line may be cut off."""
        found: dict[str, Measured] = {}
        try:
            with self.path.open(encoding="utf-8") as file:
                if json.loads(file.readline()).get("search") != self._key:
                    return {}
                for line in file:
                    if not line.endswith("\n"):
                        break
                    key, values = json.loads(line)
                    found[key] = Measured.from_dict(values)
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            pass
        if found:
            # A line that was cut off would spoil the next one.
            lines = [json.dumps({"search": self._key})]
            lines += [json.dumps([key, item.to_dict()], separators=(",", ":")) for key, item in found.items()]
            self.path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return found
