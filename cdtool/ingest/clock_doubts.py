"""Why a survey has no clock, or a doubtful one: columns named as one that stand still, repeat or are missing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from cdtool.clock.stamps import COARSE_SHARE
from cdtool.columns import Column
from cdtool.distribution import Distribution
from cdtool.formats.source import Source
from cdtool.ingest.clock_guess import Reread, TableClock, is_clock_name
from cdtool.ingest.log_figures import ClockFigures, ColumnFigures
from cdtool.recording import Finding


def clock_doubts(
    source: Source,
    figures: Mapping[str, ColumnFigures],
    clocks: Mapping[str, ClockFigures],
    reread: Reread,
    clock: TableClock | None,
) -> list[Finding]:
    """Of a table the columns that are named as clocks and are none, and that there is no clock; of topics coarse ones.

    `figures` are those of the columns, `clocks` those of the topics' own clocks.
    """
    tables = [column for column in source.columns.values() if column.time is None and column.values.ndim == 1]
    found = list(_named_ones(tables, figures, reread, clock))
    if tables and clock is None:
        text = "no column looks like a clock: rates, gaps and times are unknown"
        found.append(Finding(f"{text}; name it, or the sample rate, in [channels] time of a machine file"))
    for name, known in clocks.items():
        doubt = _doubt(known.steps) if name and known.rows > 2 else ""
        if doubt:
            found.append(Finding(f"{doubt}", f"{name} time"))
    return found


def _named_ones(
    tables: list[Column], figures: Mapping[str, ColumnFigures], reread: Reread, clock: TableClock | None
) -> Iterator[Finding]:
    for column in tables:
        if not is_clock_name(column.name) or (clock is not None and column.name == clock.column):
            continue
        steps, last = Distribution(), np.empty(0)
        for piece in reread(column.name):
            known = np.concatenate((last, piece[np.isfinite(piece)]))
            steps.add(np.diff(known))
            last = known[-1:]
        forward = figures[column.name]
        if doubt := _doubt(steps):
            yield Finding(f"named as a clock, but {doubt}", column.name)
        elif forward.present == 0:
            yield Finding("named as a clock, but it holds no stamp", column.name)
        elif clock is None and forward.forward < forward.steps:
            text = f"named as a clock, but it runs backward at {forward.steps - forward.forward} of its steps"
            yield Finding(text, column.name)


def _doubt(steps: Distribution) -> str:
    """What is odd about steps between stamps, empty where nothing is."""
    repeated = steps.share(0.0, 0.0) if steps.count else 0.0
    if repeated >= 1.0:
        return f"all of its {steps.count + 1} stamps are the same: the clock stands still"
    if repeated > COARSE_SHARE:
        return f"{100.0 * repeated:.3g} % of its stamps repeat: a coarse clock"
    return ""
