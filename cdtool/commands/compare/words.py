"""The comparison of two builds in words: each row, the verdict, and how contacts were paired."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from cdtool.base.plain_text import counted, first_of, shorten
from cdtool.commands.compare.pairs import Pairing
from cdtool.commands.compare.questions import Figure
from cdtool.commands.compare.rows import INCONCLUSIVE, NOTHING_SHOWN, BuildRow, Question
from cdtool.statistics.interval import Interval

# The reason of a verdict on a file compared with itself or with a copy.
SAME_RESULTS = "both files contain the same results"


def row_words(row: BuildRow, asked: int) -> str:
    """Return the changes shown for a detector in a group; otherwise which change would have been shown.

    `asked`: the number of tests that were corrected together.
    """
    shown = [_SHOWN[item.figure](item) for item in row.questions if item.outcome in ("worse", "better")]
    words = [*shown, *_on_the_same(row)]
    if row.inconclusive:
        opened = ", ".join(_open(item, asked) for item in _unresolved(row))
        words.append(f"otherwise {INCONCLUSIVE}" if shown else f"{INCONCLUSIVE}: {opened}")
    elif not shown:
        words.append(f"{NOTHING_SHOWN} ({_would_have_been(row)})")
    if row.one_not_assessable:
        words.append(f"{row.one_not_assessable} of {row.pairs} contacts not assessable in one of the builds")
    return "; ".join(words)


def _on_the_same(row: BuildRow) -> list[str]:
    """Describe what happened on the contacts that both files contain: a fact, whatever it says about others."""
    ways = ((row.later, row.later_ms, "later"), (row.earlier, row.earlier_ms, "earlier"))
    parts = [f"{count} {way} by {_range(*ends)} ms" for count, ends, way in ways if ends]
    parts += [f"{row.newly_missed} newly missed"] if row.newly_missed else []
    parts += [f"{row.newly_detected} no longer missed"] if row.newly_detected else []
    return [f"on the same {counted(row.pairs, 'contact')}: {', '.join(parts)}"] if parts else []


def _range(least: float, most: float) -> str:
    return figure(least) if figure(least) == figure(most) else f"{figure(least)} to {figure(most)}"


def overall_words(
    verdict: str, rows: Sequence[BuildRow], asked: int, significance: float, relevant_change: float
) -> str:
    """Return the verdict in one sentence."""
    counts = [sum(item.outcome == way for row in rows for item in row.questions) for way in ("worse", "better")]
    unresolved = sum(row.inconclusive for row in rows)
    relevant = f"a change of {100.0 * relevant_change:g} %"
    if verdict == INCONCLUSIVE:
        if not any(_could_show(row) for row in rows):
            return f"{INCONCLUSIVE}: this sample is too small to detect any change"
        where = f"in {unresolved} of {counted(len(rows), 'row')}"
        return f"{INCONCLUSIVE}: {where} this sample is too small to rule out {relevant}"
    if verdict == NOTHING_SHOWN and not asked:
        return f"{NOTHING_SHOWN}: every outcome is the same"
    rate = f"family-wise error rate {significance:g}"
    if verdict == NOTHING_SHOWN:
        return f"no change shown ({counted(asked, 'test')}, {rate})"
    ways = [f"{count} {way}" for count, way in zip(counts, ("worse", "better"), strict=True) if count]
    open_rows = f"; {INCONCLUSIVE} in {unresolved} of {counted(len(rows), 'row')}" if unresolved else ""
    return f"{verdict}: {' and '.join(ways)} of {counted(asked, 'test')} ({rate}){open_rows}"


def gone_words(only_old: Sequence[str]) -> str:
    """Return what is missing from the new results, to append to the verdict."""
    return f"; only in old: {first_of([shorten(name, 40) for name in only_old])}" if only_old else ""


def pairing_words(pairings: Mapping[str, Pairing]) -> list[str]:
    """Return a note for each group whose recordings are not all the same in both."""
    words = []
    for group, pairing in pairings.items():
        alone = f"{pairing.old_alone} only in old and {pairing.new_alone} only in new"
        if not pairing.partners:
            if pairing.old_alone or pairing.new_alone:
                words.append(f"{group}: unpaired, the recordings differ ({pairing.old_alone} and {pairing.new_alone})")
        elif not pairing.paired:
            both = counted(len(pairing.partners), "recording", "are")
            words.append(f"{group}: unpaired, {both} in both, {alone}")
        elif pairing.old_alone or pairing.new_alone:
            words.append(
                f"{group}: {counted(len(pairing.partners), 'recording', 'are')} paired; {alone} count only for false "
                "alarms"
            )
    return words


def _latency(item: Question) -> str:
    way = "slower" if item.change.value > 0.0 else "faster"
    return f"{way} by {_interval(item.change, 'ms')}"


def _force(item: Question) -> str:
    way = "more" if item.change.value > 0.0 else "less"
    return f"{way} force at the alarm by {_interval(item.change, 'N')}"


def _missed(item: Question) -> str:
    if not math.isnan(item.complete_change_p):
        what = "misses every contact" if item.outcome == "worse" else "detects every contact of a group that was missed"
        return f"{what}: {_counts(item)}{_by_chance(item)}"
    return f"misses {'more' if item.outcome == 'worse' else 'fewer'}: {_counts(item)}"


def _by_chance(item: Question) -> str:
    return f" (probability by chance {item.complete_change_p:.3g})"


def _not_assessable(item: Question) -> str:
    if not math.isnan(item.complete_change_p):
        what = "nothing is assessable" if item.outcome == "worse" else "all is assessable"
        return f"{what}: not assessable {_counts(item)}{_by_chance(item)}"
    return f"{'more' if item.outcome == 'worse' else 'fewer'} not assessable: {_counts(item)}"


def _false_alarms(item: Question) -> str:
    way = "more" if item.outcome == "worse" else "fewer"
    return f"{way} false alarms: {item.new:g} in {item.new_of:.3g} h, before {item.old:g} in {item.old_of:.3g} h"


_SHOWN: dict[Figure, Callable[[Question], str]] = {
    "latency_ms": _latency,
    "missed": _missed,
    "not_assessable": _not_assessable,
    "false_alarms": _false_alarms,
    "force_at_alarm_n": _force,
}


def _unresolved(row: BuildRow) -> list[Question]:
    """Return the questions that leave a relevant change open; a force only if the latency does not."""
    found = [item for item in row.questions if item.outcome == INCONCLUSIVE]
    latency = any(item.figure == "latency_ms" for item in found)
    missed = any(item.figure == "missed" for item in found)
    shadowed = {"force_at_alarm_n"} if latency else set()
    shadowed |= {item.figure for item in found if item.figure == "not_assessable" and missed and not item.new}
    return [item for item in found if item.figure not in shadowed]


def _open(item: Question, asked: int) -> str:
    """Describe what remains open about a quantity."""
    if item.figure in ("latency_ms", "force_at_alarm_n"):
        what, unit = ("latency", "ms") if item.figure == "latency_ms" else ("force at the alarm", "N")
        if item.detectable == math.inf or math.isnan(item.detectable):
            # Without its values, which the tables have: of many detectors this is then one sentence.
            return f"{what} ({item.reason or _too_few(asked)})"
        change = f"only a change of {figure(item.detectable)} {unit} would have been shown"
        return f"{what} {figure(item.old)} {unit} to {figure(item.new)} {unit}, {change}"
    what = {"missed": "missed", "not_assessable": "not assessable", "false_alarms": "false alarms"}[item.figure]
    seen = f"{what} {item.old:g} to {item.new:g}"
    if item.left_open == math.inf:
        return f"{seen}, {item.reason or 'nothing was assessable'}"
    if item.figure == "false_alarms":
        return f"{seen}, up to {item.left_open:.2g} more per operation not ruled out"
    return f"{seen}, up to {100.0 * item.left_open:.2g} % more not ruled out"


def _too_few(asked: int) -> str:
    return f"too few recordings for {counted(asked, 'test')}"


def _would_have_been(row: BuildRow) -> str:
    latency, alarms = row.question("latency_ms"), row.question("false_alarms")
    if latency is None:
        return _least_alarms(alarms) if alarms else "nothing could be tested"
    if latency.same:
        return "every latency is the same"
    if latency.outcome == "not_asked":
        return f"latency: {latency.reason}"
    return f"a change of {figure(latency.detectable)} ms would have been shown"


def _least_alarms(item: Question) -> str:
    if math.isnan(item.detectable):
        return f"false alarms: {item.reason}"
    if item.detectable == math.inf:
        return "this sample is too small to show any change in false alarms"
    return f"{item.detectable:g} false alarms instead of {item.old:g} would have been shown"


def _could_show(row: BuildRow) -> bool:
    return any(item.outcome != "not_asked" and math.isfinite(item.detectable) for item in row.questions)


def _counts(item: Question) -> str:
    return f"{item.new:g} of {item.new_of:g}, before {item.old:g} of {item.old_of:g}"


def _interval(change: Interval, unit: str) -> str:
    """Return the size of a change with its interval, independent of its sign."""
    low, high = (change.low, change.high) if change.value > 0.0 else (-change.high, -change.low)
    bounds = "" if math.isnan(low) or math.isnan(high) else f" ({figure(low)} to {figure(high)})"
    return f"{figure(abs(change.value))} {unit}{bounds}"


def figure(value: float) -> str:
    """Format with tenths, hundredths below 1, no decimals at 100 and above."""
    digits = 0 if abs(value) >= 100.0 else 1 if abs(value) >= 1.0 else 2
    return f"{value:.{digits}f}"
