"""Size of a test, calculated in advance: the work of `cdtool plan`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from cdtool.base.errors import UsageError, nearest
from cdtool.base.plain_text import counted, digits
from cdtool.base.remote.remote_path import location
from cdtool.results.comparison import SIGNIFICANT, check_significance
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.results.files.results_file import read_results
from cdtool.results.results import ContactResult, Results
from cdtool.results.summary import campaigns
from cdtool.statistics.sample_size import (
    exposure_for_rate,
    impacts_for_difference,
    impacts_for_missed_share,
    impacts_for_unpaired,
)
from cdtool.statistics.spread import Spread, spread_of


@dataclass(frozen=True)
class Need:
    """A number of impacts, recordings, operations or hours, with `allowed` misses or false alarms among them."""

    amount: float
    unit: str
    purpose: Literal["see", "set", "show"]
    allowed: int = 0


@dataclass(frozen=True)
class Answer:
    """The answer to one question, in words and as numbers."""

    question: Literal["difference", "missed", "false alarms"]
    words: str
    needs: tuple[Need, ...]


@dataclass(frozen=True)
class PlannedDeviation:
    """A standard deviation [ms] to plan with: given, or measured on the contacts described by `source`."""

    std: float
    source: str = ""
    spreads: tuple[Spread, ...] = ()


@dataclass(frozen=True, repr=False)
class Plan:
    """The answers in the order of the questions; `measured` if a difference was given."""

    answers: tuple[Answer, ...]
    measured: PlannedDeviation | None = None

    def __repr__(self) -> str:
        return f"Plan({'; '.join(item.words for item in self.answers)})"


def plan(  # noqa: PLR0913  # the public function: a keyword for each setting
    *,
    difference_ms: float | None = None,
    std_ms: float | PlannedDeviation | None = None,
    unpaired: bool = False,
    power: float = 0.8,
    missed_at_most: str = "",
    false_alarms_at_most: str = "",
    allowed: int | None = None,
    significance: float = SIGNIFICANT,
) -> Plan:
    """Compute how many impacts, operations or hours a test needs.

    Parameters
    ----------
    difference_ms : float, optional
        Difference of the mean latency of two detectors that the test has to show [ms].
    std_ms : float or PlannedDeviation, optional
        Standard deviation of the differences within pairs, or within a group if `unpaired` [ms]: a number, or the
        result of `measured_std`.
    unpaired : bool, optional
        The two detectors are tested on different impacts.
    power : float, optional
        Chance that the test shows the difference.
    missed_at_most : str, optional
        Share of missed contacts that the test has to exclude, as "5%" or "0.05".
    false_alarms_at_most : str, optional
        Rate of false alarms that the test has to exclude, as "1/1000op" or "0.1/h".
    allowed : int, optional
        Number of misses or false alarms to plan for as well as for none; by default one.
    significance : float, optional
        Chance of a wrong conclusion.

    Returns
    -------
    Plan
        One answer per question, in words and numbers.

    Raises
    ------
    UsageError
        No question is given, or one is incomplete or outside its range.

    Notes
    -----
    `cdtool.statistics.sample_size` has the equations.

    Examples
    --------
    >>> import cdtool
    >>> plan = cdtool.plan(missed_at_most="5%")
    >>> [(need.amount, need.unit, need.allowed) for need in plan.answers[0].needs]
    [(59, 'impacts', 0), (93, 'impacts', 1)]
    """
    check_significance(significance)
    level = 1.0 - significance
    counts = (0, 1) if allowed is None else tuple(dict.fromkeys((0, allowed)))
    answers: list[Answer] = []
    measured = std_ms if isinstance(std_ms, PlannedDeviation) or std_ms is None else PlannedDeviation(std_ms)
    if difference_ms is not None:
        if measured is None:
            raise UsageError(
                f"a difference of {difference_ms:g} ms without a standard deviation",
                "give --std-ms 8, or --std-ms results.json of an earlier test",
            )
        answers.append(_difference(difference_ms, measured, unpaired, power, level))
    if missed_at_most:
        answers.append(_missed(_share(missed_at_most), counts, level))
    if false_alarms_at_most:
        answers.append(_false_alarms(Budget.parse(false_alarms_at_most), counts, level))
    if not answers:
        raise UsageError(
            "there is no question",
            "give --difference-ms 5 --std-ms 8, --missed-at-most 5% or --false-alarms-at-most 1/1000op (or 0.1/h)",
        )
    return Plan(tuple(answers), measured if difference_ms is not None else None)


def measured_std(
    results: str | Path | Results, detectors: Sequence[str] = (), group: str = "", *, unpaired: bool = False
) -> PlannedDeviation:
    """Return the standard deviation [ms] of the paired differences of two detectors, or of latencies if `unpaired`.

    By recording or campaign, see `spread_of`; for two detectors unpaired, the root of the mean square. `detectors` are
    full or short names; `group` is required if there are several. Raises UsageError for an unknown name, a wrong number
    of detectors or fewer than two recordings; RecordingError if the file is not a results file.
    """
    known = results if isinstance(results, Results) else read_results(location(results))
    names = _detectors(known, detectors, unpaired)
    chosen = _group(known, group)
    rows = [{(item.recording, item.contact): item for item in _contacts(known, name, chosen)} for name in names]
    if unpaired:
        samples = [[(item.recording, item.latency_ms) for item in row.values()] for row in rows]
        words = f"the latencies of {' and '.join(names)}"
    else:
        samples = [[(a.recording, _difference_of(a, rows[1][key])) for key, a in rows[0].items() if key in rows[1]]]
        words = f"{' minus '.join(names)}"
    spreads = tuple(_spread(known, sample, words, chosen) for sample in samples)
    std = math.sqrt(sum(item.std**2 for item in spreads) / len(spreads))
    cluster = "campaign" if any(item.campaign for item in known.recordings if item.group == chosen) else "recording"
    where = " and ".join(_counted(item, len(sample), cluster) for item, sample in zip(spreads, samples, strict=True))
    return PlannedDeviation(std, f"{words} in {chosen}, {where}", spreads)


def _difference(difference: float, std: PlannedDeviation, unpaired: bool, power: float, level: float) -> Answer:
    count = (impacts_for_unpaired if unpaired else impacts_for_difference)(difference, std.std, power, level)
    # If recordings contain several contacts, the spread is that of recordings.
    grouped = any(item.clusters < item.n for item in std.spreads)
    unit = "recordings or campaigns" if grouped else "impacts"
    each = " in each of two sets" if unpaired else ", each with both builds or detectors"
    like = f"{each}, with as many contacts in each as measured" if grouped else each
    of = "within a set" if unpaired else "of the differences"
    source = f", measured: {std.source}" if std.source else ""
    words = (
        f"to detect a difference of {difference:g} ms with {100.0 * power:g} % power "
        f"(standard deviation {of} {std.std:.3g} ms{source}): {count} {unit}{like}"
    )
    return Answer("difference", words, (Need(count, unit, "see"),))


def _missed(share: float, counts: Sequence[int], level: float) -> Answer:
    needs = tuple(Need(impacts_for_missed_share(share, count, level), "impacts", "show", count) for count in counts)
    several = ("miss", "misses")
    rest = "".join(f"; {digits(item.amount)} with {_named(item.allowed, *several)} allowed" for item in needs[1:])
    words = (
        f"to show that at most {digits(100.0 * share)} % are missed: "
        f"{counted(needs[0].amount, 'impact')} without a miss{rest}"
    )
    return Answer("missed", words, needs)


def _false_alarms(budget: Budget, counts: Sequence[int], level: float) -> Answer:
    unit = f"{budget.per}s"

    def whole(exposure: float) -> float:
        # Operations are whole; hours are rounded up to three digits.
        step = 1.0 if budget.per == "operation" else 10.0 ** (math.floor(math.log10(exposure)) - 2)
        return float(f"{math.ceil(exposure / step - 1e-9) * step:.12g}")

    shown = tuple(Need(whole(exposure_for_rate(budget.rate, count, level)), unit, "show", count) for count in counts)
    several = ("false alarm", "false alarms")
    rest = "".join(f"; {digits(item.amount)} with {_named(item.allowed, *several)} allowed" for item in shown[1:])
    needed = Need(whole(budget.needed), unit, "set")
    words = (
        f"a budget of {budget} false alarms: to set a safety factor for it, "
        f"{counted(needed.amount, f'impact-free {budget.per}')} to learn from; "
        f"to show that it is met, {digits(shown[0].amount)} others without a false alarm{rest}"
    )
    return Answer("false alarms", words, (needed, *shown))


def _share(text: str) -> float:
    """5%, 5 % or 0.05."""
    number, percent, rest = text.strip().partition("%")
    try:
        share = math.nan if rest else float(number) * (0.01 if percent else 1.0)
    except ValueError:
        share = math.nan
    if not 0.0 < share < 1.0:
        raise UsageError(f"missed share is '{text}'", "give 5% or 0.05: above 0 and below 1")
    return share


def _detectors(results: Results, names: Sequence[str], unpaired: bool) -> list[str]:
    short = results.provenance.get("short_names")
    full = {str(key): str(name) for name, key in short.items()} if isinstance(short, dict) else {}
    full |= {name: name for name in results.detectors}
    for name in names:
        if full.get(name) not in results.detectors:
            raise UsageError(f"detector '{name}' is not in the results", nearest(name, results.detectors))
    wanted, words = ((1, 2), "one detector or two") if unpaired else ((2,), "two detectors")
    found = list(dict.fromkeys(full[name] for name in names))
    if len(found) not in wanted:
        raise UsageError(f"{len(found)} detectors are given", f"give {words} of {', '.join(results.detectors)}")
    return found


def _group(results: Results, name: str) -> str:
    """Return the given group, or the only one with contacts."""
    known = [group for group in results.groups if any(item.group == group for item in results.scored_contacts)]
    if not name and len(known) == 1:
        return known[0]
    if name not in known:
        raise UsageError(f"group '{name}' has no contacts" if name else "no group is given", nearest(name, known))
    return name


def _contacts(results: Results, detector: str, group: str) -> list[ContactResult]:
    return [item for item in results.scored_contacts if (item.detector, item.group) == (detector, group)]


def _difference_of(first: ContactResult, second: ContactResult) -> float | None:
    if first.latency_ms is None or second.latency_ms is None:
        return None
    return first.latency_ms - second.latency_ms


def _spread(results: Results, sample: Sequence[tuple[str, float | None]], what: str, group: str) -> Spread:
    known = [(recording, value) for recording, value in sample if value is not None]
    labels = campaigns(results)
    found = spread_of([value for _, value in known], [labels.get(name, name) for name, _ in known])
    if math.isnan(found.std):
        raise UsageError(
            f"{what}: detected contacts in {found.clusters} recordings or campaigns of {group}",
            "at least 2 are required for a standard deviation",
        )
    return found


def _counted(spread: Spread, of: int, cluster: str) -> str:
    """Describe how the contacts are clustered, and how many are left out."""
    clusters = f"one per {cluster}" if spread.n == spread.clusters else f"in {spread.clusters} {cluster}s"
    without = f", {of - spread.n} missed or not assessable left out" if of > spread.n else ""
    return f"{spread.n} contacts, {clusters}{without}"


def _named(count: int, singular: str, plural: str) -> str:
    return f"one {singular}" if count == 1 else f"{count} {plural}"
