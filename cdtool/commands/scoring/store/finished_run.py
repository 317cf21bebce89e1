"""All results of a run in the store: found again as a whole when nothing that determines one of them has changed.

What determines them are the keys of every log's outcomes, in order, and everything that is not about one log: what was
learned, the limits, the findings before the first log. Traces are in the store under keys of their own.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from types import GenericAlias
from typing import Any

from cdtool.base.files.typed_json import decoded, encoded
from cdtool.results.evaluated import Evaluated
from cdtool.results.results import tables

# Rows that are in memory as text at once.
_AT_ONCE = 4096
# What the logs add to the provenance.
_FROM_LOGS = ("units", "load_cell_sha256")
_HEAD = "head"


@dataclass(frozen=True)
class TraceKey:
    """The key of a trace in the store, and why it was chosen."""

    key: str
    chosen: str


@dataclass(frozen=True)
class FinishedRun:
    """The results of a run with their statistics, where its traces are, and how many logs could not be read."""

    evaluated: Evaluated
    traces: tuple[TraceKey, ...]
    failed: int

    def to_texts(self) -> Iterator[tuple[str, str]]:
        """Yield names and texts: all but the rows, then the rows of each table, many at a time."""
        results = self.evaluated.results
        from_logs = {name: results.provenance[name] for name in _FROM_LOGS if name in results.provenance}
        yield _HEAD, encoded(self._with(from_logs, dict.fromkeys(tables(), ())), FinishedRun)
        for name, kind in tables().items():
            rows = getattr(results, name)
            for first in range(0, len(rows), _AT_ONCE):
                yield name, encoded(rows[first : first + _AT_ONCE], _rows_of(kind))

    @classmethod
    def of_texts(cls, texts: Iterable[tuple[str, str]], provenance: Mapping[str, Any]) -> FinishedRun | None:
        """Return what `to_texts` made; None if there is nothing. Raises ValueError for anything else.

        `provenance` is that of the run, without what follows from its logs.
        """
        head = None
        rows: dict[str, tuple[Any, ...]] = dict.fromkeys(tables(), ())
        for name, text in texts:
            if name == _HEAD:
                head = decoded(text, cls)
            elif name in rows:
                rows[name] += decoded(text, _rows_of(tables()[name]))
            else:
                raise ValueError(f"not a finished run: {name}")
        return head and head._with({**provenance, **head.evaluated.results.provenance}, rows)

    def _with(self, provenance: Mapping[str, Any], rows: Mapping[str, Any]) -> FinishedRun:
        results = replace(self.evaluated.results, provenance=provenance, **rows)
        return replace(self, evaluated=replace(self.evaluated, results=results))


def _rows_of(kind: Any) -> Any:
    return GenericAlias(tuple, (kind, ...))
