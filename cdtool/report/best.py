"""Each group of a benchmark in a sentence: the best detector, its latency, and what its zeros can mean at most.

Conventions: best is who has the fewest contacts missed or not assessable, then the fewest false alarms in all groups,
then the least median as it is shown; equal ones are named together unless their comparison shows a difference. Whether
a difference is more than chance is known from the comparisons of pairs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from cdtool.base.plain_text import NAMED, counted
from cdtool.report.number_text import NOT_ASSESSABLE, missed, value_and_interval
from cdtool.report.table import Cell, Heading, Table, name_cell, shown
from cdtool.report.tables.results import TOO_FEW, at_most, has_exposure, latency_cell, part_of, without_difference
from cdtool.results.comparison import Comparison
from cdtool.results.evaluated import Evaluated
from cdtool.results.summary import Summary

BEST = (
    "Best: fewest contacts missed or not assessable, then fewest false alarms in all groups, then least median of the "
    "latency from the onset to the alarm. “At most”: one-sided 95 % bound."
)
# What a detector that is not the best can be ahead in.
_AHEAD = (
    "shown to miss fewer of the contacts that both could assess",
    "faster on average",
    "faster, but with more misses, false alarms or contacts not assessable",
)
_FEW = "too few recordings to show a difference"
_ALARMS_UNKNOWN = f"false alarms {NOT_ASSESSABLE}"


def best_table(evaluated: Evaluated) -> Table:
    """Return a sentence for each group; for one without contacts it is about the false alarms."""
    alarms = {
        name: sum(_alarms(item) for item in evaluated.summaries if item.detector == name)
        for name in evaluated.results.detectors
    }
    rows = []
    for group in evaluated.results.groups:
        items = [item for item in evaluated.summaries if item.group == group]
        hit = [item for item in items if item.contacts]
        words = _of_contacts(evaluated, hit, alarms) if hit else f"no contacts; {_of_false_alarms(items)}"
        made = "injected contacts; " if group in part_of(evaluated.results.provenance, "injected") else ""
        rows.append((name_cell(group), Cell(made + words)))
    return Table("best", "Best detectors", (Heading("group"), Heading("best detector")), rows, "contacts")


def _alarms(item: Summary) -> float:
    """Return the false alarms; infinite if there were operations, but none in which an alarm would have counted."""
    return math.inf if item.operations and not has_exposure(item) else item.false_alarms


def _of_contacts(evaluated: Evaluated, items: Sequence[Summary], alarms: Mapping[str, float]) -> str:
    if not any(item.detected for item in items):
        return f"no detector detected a contact: {_outcomes(min(items, key=lambda item: item.not_assessable))}"

    def rank(item: Summary) -> tuple[float, ...]:
        median = math.inf if math.isnan(item.median_ms) else item.median_ms
        return item.missed + item.not_assessable, alarms[item.detector], median

    first, *others = sorted(items, key=rank)
    alike = [item.detector for item in others if rank(item)[:2] == rank(first)[:2]]
    same = [item.detector for item in others if _median(item).split(" (")[0] == _median(first).split(" (")[0]]
    pairs = _pairs(evaluated, first)
    unlike = [name for name, (_, why) in pairs.items() if not why]
    equal = [first.detector, *(name for name in same if name in alike and name not in unlike)]
    words = "every detector missed contacts; " if others and all(item.missed for item in items) else ""
    words += _named(equal) + (" are equally good" if len(equal) > 1 else " is best" if others else "")
    count = alarms[first.detector]
    heard = f"{counted(int(count), 'false alarm')} in all groups" if math.isfinite(count) else _ALARMS_UNKNOWN
    heard = heard if count else "no false alarm"
    return f"{words}: median {_median(first)}, {_outcomes(first)}, {heard}{_evidence(pairs, equal, alike)}"


def _median(item: Summary) -> str:
    """Return the median with its interval, or with the range where contacts are too few for one."""
    value, *ends = value_and_interval(item.median, item.resolution_ms)
    unit = " ms" if math.isfinite(item.median_ms) else ""
    if math.isnan(item.median.low):
        return f"{value}{unit} (range {latency_cell('range', item).text})"
    return f"{value}{unit}{''.join(ends).replace('(', '(95 %: ')}"


def _outcomes(item: Summary) -> str:
    count, *bound = missed(item.missed, item.assessable, item.missed_at_most)
    most = f" ({bound[0].lstrip(': ')})" if bound else ""
    unseen = f"{item.not_assessable} {NOT_ASSESSABLE}" if item.not_assessable else ""
    return ", ".join(filter(None, (f"{count} contacts missed{most}" if item.assessable else "", unseen)))


def _pairs(evaluated: Evaluated, first: Summary) -> dict[str, tuple[Comparison, str]]:
    """Return by the other detector its comparison with the first one, and why that shows no difference; else ""."""
    return {
        pair.second if pair.first == first.detector else pair.first: (pair, why)
        for pair, why in zip(evaluated.comparisons, without_difference(evaluated.comparisons), strict=True)
        if pair.group == first.group and first.detector in (pair.first, pair.second)
    }


def _evidence(pairs: Mapping[str, tuple[Comparison, str]], equal: Sequence[str], alike: Sequence[str]) -> str:
    """Return how sure it is that the best detector is better than the others; empty without others.

    `alike` have as many contacts missed or not assessable and as many false alarms as the best one.
    """
    others = {name: found for name, found in pairs.items() if name not in equal}
    ahead = {name: pair for name, (pair, _) in others.items() if name in (pair.faster, pair.misses_less)}
    kinds = [_AHEAD[0 if pair.faster != name else 1 if name in alike else 2] for name, pair in ahead.items()]
    said = {what: [name for name, of in zip(ahead, kinds, strict=True) if of == what] for what in _AHEAD}
    words = "".join(f"; {_named(names)} {what}" for what, names in said.items() if names)
    unshown = {name: why for name, (_, why) in others.items() if why}
    if unshown:
        few = set(unshown.values()) == {TOO_FEW}
        return f"{words}; {_FEW if few else f'not shown to be better than {_named(list(unshown))}'}"
    every = f"all {len(others)} others" if len(others) > 2 else _named(list(others))
    return words or (f"; shown to be better than {every}" if others else "")


def _of_false_alarms(items: Sequence[Summary]) -> str:
    counts = [item for item in items if has_exposure(item)]
    if not counts:
        return _ALARMS_UNKNOWN if any(item.operations for item in items) else "nothing was scored"
    quiet = [item for item in counts if not item.false_alarms]
    words = []
    if quiet:
        least = min(quiet, key=lambda item: item.judged_operations)
        every = " of any detector" if len(items) > 1 else ""
        who = every if len(quiet) == len(items) else f" of {_named([item.detector for item in quiet])}"
        operations = counted(least.judged_operations, "operation")
        words.append(f"no false alarm{who} in {operations} ({at_most(least)})")
    loud = sorted((item for item in counts if item.false_alarms), key=lambda item: item.false_alarms)
    words += [
        f"{counted(item.false_alarms, 'false alarm')} of {shown(item.detector)} in "
        f"{counted(item.judged_operations, 'operation')} ({at_most(item)})"
        for item in loud[:NAMED]
    ]
    words += [f"{len(loud) - NAMED} detectors more"] if len(loud) > NAMED else []
    return "; ".join(words)


def _named(detectors: Sequence[str]) -> str:
    names = [shown(name) for name in detectors[:NAMED]]
    names += [f"{len(detectors) - NAMED} more"] if len(detectors) > NAMED else []
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))
