"""All results of a run in the store: found again as a whole when nothing that determines one of them has changed.

What determines them are the keys of every log's outcomes, in order, and everything that is not about one log: what was
learned, the limits, the findings before the first log. Traces are in the store under keys of their own.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import GenericAlias
from typing import Any

from cdtool.base.files.bounded_loading import parse_own_json
from cdtool.base.files.typed_json import decoded, encoded
from cdtool.results.comparison import Comparison
from cdtool.results.evaluated import Evaluated
from cdtool.results.results import ConclusionResult, Results, tables
from cdtool.results.summary import Summary

# Rows that are in memory as text at once.
_AT_ONCE = 4096
# What the logs add to the provenance.
_FROM_LOGS = ("units", "load_cell_sha256")
_HEAD = "head"
_SUMMARIES, _KINDS, _CONDITIONS = "summaries", "kinds", "conditions_summaries"
_COMPARISONS, _CONCLUSION = "comparisons", "conclusion"
_Summaries, _Comparisons = tuple[Summary, ...], tuple[Comparison, ...]


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

    def to_texts(self) -> Iterator[list[tuple[str, str]]]:
        """Yield all of it as names and texts, some at a time."""
        results = self.evaluated.results
        head = {
            **{name: results.provenance[name] for name in _FROM_LOGS if name in results.provenance},
            "traces": encoded(self.traces, tuple[TraceKey, ...]),
            "failed": self.failed,
        }
        yield [
            (_HEAD, json.dumps(head)),
            (_SUMMARIES, encoded(self.evaluated.summaries, _Summaries)),
            (_KINDS, encoded(self.evaluated.kinds, _Summaries)),
            (_CONDITIONS, encoded(self.evaluated.conditions, _Summaries)),
            (_COMPARISONS, encoded(self.evaluated.comparisons, _Comparisons)),
            (_CONCLUSION, encoded(results.conclusion, ConclusionResult)),
        ]
        for name, kind in tables().items():
            rows = getattr(results, name)
            for first in range(0, len(rows), _AT_ONCE):
                yield [(name, encoded(rows[first : first + _AT_ONCE], _rows_of(kind)))]

    @classmethod
    def of_texts(
        cls, texts: Iterator[tuple[str, str]], provenance: Mapping[str, Any], groups: Sequence[str]
    ) -> FinishedRun | None:
        """Return what `to_texts` made; None if there is nothing. Raises ValueError for anything else.

        `provenance` is that of the run, without what follows from its logs; `groups` are its groups.
        """
        known: dict[str, list[Any]] = {name: [] for name in tables()}
        parts: dict[str, str] = {}
        try:
            for name, text in texts:
                if name in known:
                    known[name] += decoded(text, _rows_of(tables()[name]))
                else:
                    parts[name] = text
            if not parts:
                return None
            head = parse_own_json(parts[_HEAD])
            held: dict[str, Any] = {name: tuple(rows) for name, rows in known.items()}
            results = Results(
                provenance={**provenance, **{name: head[name] for name in _FROM_LOGS if name in head}},
                detectors=tuple(provenance["gains"]),
                groups=tuple(groups),
                conclusion=decoded(parts[_CONCLUSION], ConclusionResult),
                **held,
            )
            evaluated = Evaluated(
                results,
                decoded(parts[_SUMMARIES], _Summaries),
                decoded(parts[_COMPARISONS], _Comparisons),
                decoded(parts[_KINDS], _Summaries),
                decoded(parts[_CONDITIONS], _Summaries),
            )
            return cls(evaluated, decoded(head["traces"], tuple[TraceKey, ...]), head["failed"])
        except (KeyError, TypeError) as fault:
            raise ValueError(f"not a finished run: {fault}") from fault


def _rows_of(kind: Any) -> Any:
    return GenericAlias(tuple, (kind, ...))
