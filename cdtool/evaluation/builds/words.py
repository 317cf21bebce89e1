"""What was found of two builds, in words: each row, the whole, and how contacts were paired."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from cdtool.evaluation.builds.pairs import Pairing
from cdtool.evaluation.builds.questions import Figure
from cdtool.evaluation.builds.rows import NOTHING_SHOWN, BuildRow, Question
from cdtool.evaluation.statistics.interval import Interval
from cdtool.plain_text import shorten

# As many are named in the line of the verdict; all stand in `only_old`.
_NAMED = 3


def row_words(row: BuildRow, asked: int) -> str:
    """What is shown of a detector in a group; else that nothing is, and which change would have been.

    `asked`: questions that were corrected together.
    """
    words = [_SHOWN[item.figure](item) for item in row.questions if item.outcome in ("worse", "better")]
    words = words or [f"{NOTHING_SHOWN} ({_would_have_been(row, asked)})"]
    if row.one_not_assessable:
        words.append(f"{row.one_not_assessable} of {row.pairs} contacts apart: one build could not assess them")
    return "; ".join(words)


def overall_words(verdict: str, rows: Sequence[BuildRow], asked: int, significance: float) -> str:
    """The verdict in one sentence."""
    counts = [sum(item.outcome == way for row in rows for item in row.questions) for way in ("worse", "better")]
    if verdict == NOTHING_SHOWN and asked and not any(_could_show(row) for row in rows):
        return f"{NOTHING_SHOWN}, and none could have been: too few recordings for {asked} questions"
    if not asked:
        return f"{NOTHING_SHOWN}: nothing could be tested"
    how = f"of {asked} questions at a level of {significance:g} for all together"
    if verdict == NOTHING_SHOWN:
        return f"no change shown ({how})"
    ways = [f"{count} {way}" for count, way in zip(counts, ("worse", "better"), strict=True) if count]
    return f"{verdict}: {' and '.join(ways)} {how}"


def gone_words(only_old: Sequence[str]) -> str:
    """What is gone from the new results, to stand after the verdict: nothing is shown of it."""
    more = f" and {len(only_old) - _NAMED} more" if len(only_old) > _NAMED else ""
    return f"; only in old: {', '.join(shorten(name, 40) for name in only_old[:_NAMED])}{more}" if only_old else ""


def pairing_words(pairings: Mapping[str, Pairing]) -> list[str]:
    """How many recordings of each group are the same in both, where that is not all of them."""
    words = []
    for group, pairing in pairings.items():
        if not pairing.partners:
            if pairing.old_alone or pairing.new_alone:
                words.append(
                    f"{group}: unpaired, the recordings are others ({pairing.old_alone} and {pairing.new_alone})"
                )
        elif pairing.old_alone or pairing.new_alone:
            words.append(
                f"{group}: {len(pairing.partners)} recordings are paired; {pairing.old_alone} that only old holds and "
                f"{pairing.new_alone} that only new holds count in false alarms alone"
            )
    return words


def _latency(item: Question) -> str:
    way = "slower" if item.change.value > 0.0 else "faster"
    return f"{way} by {_interval(item.change, 'ms')}"


def _force(item: Question) -> str:
    way = "more" if item.change.value > 0.0 else "less"
    return f"{way} force at the alarm by {_interval(item.change, 'N')}"


def _missed(item: Question) -> str:
    return f"misses {'more' if item.outcome == 'worse' else 'fewer'}: {_counts(item)}"


def _not_assessable(item: Question) -> str:
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


def _would_have_been(row: BuildRow, asked: int) -> str:
    latency, alarms = row.question("latency_ms"), row.question("false_alarms")
    if latency is None:
        return _least_alarms(alarms) if alarms else "nothing could be tested"
    if latency.outcome == "not asked":
        return f"latency: {latency.reason}{_missed_unseen(row.question('missed'))}"
    if latency.detectable == math.inf:
        return f"none could have been in latency: too few recordings for {asked} questions"
    if latency.detectable == 0.0:
        return "every latency is the same"
    return f"a change of {figure(latency.detectable)} ms would have been"


def _missed_unseen(item: Question | None) -> str:
    """Misses that differ without being shown to."""
    if item is None or item.old == item.new:
        return ""
    why = "too few recordings" if item.detectable == math.inf else f"{item.detectable:g} would have been"
    return f"; missed {item.new:g} instead of {item.old:g}: not shown, {why}"


def _least_alarms(item: Question) -> str:
    if math.isnan(item.detectable):
        return f"false alarms: {item.reason}"
    if item.detectable == math.inf:
        return "none could have been in false alarms"
    return f"{item.detectable:g} false alarms instead of {item.old:g} would have been"


def _could_show(row: BuildRow) -> bool:
    return any(item.outcome != "not asked" and math.isfinite(item.detectable) for item in row.questions)


def _counts(item: Question) -> str:
    return f"{item.new:g} of {item.new_of:g}, before {item.old:g} of {item.old_of:g}"


def _interval(change: Interval, unit: str) -> str:
    """The size of a change with its interval, either way."""
    low, high = (change.low, change.high) if change.value > 0.0 else (-change.high, -change.low)
    bounds = "" if math.isnan(low) or math.isnan(high) else f" ({figure(low)} to {figure(high)})"
    return f"{figure(abs(change.value))} {unit}{bounds}"


def figure(value: float) -> str:
    """Tenths, hundredths below 1, none from 100 on."""
    digits = 0 if abs(value) >= 100.0 else 1 if abs(value) >= 1.0 else 2
    return f"{value:.{digits}f}"
