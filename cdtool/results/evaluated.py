"""Results with all that is derived from them once, for every report: statistics, comparisons, limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from cdtool.results.comparison import Comparison, compare_detectors
from cdtool.results.conclusion import conclude
from cdtool.results.limits import LimitRule, check_limits
from cdtool.results.results import Results
from cdtool.results.summary import Summary, at_worst, summarise, summarise_conditions, summarise_kinds


@dataclass(frozen=True)
class Evaluated:
    """What reports show: they compute nothing themselves.

    `kinds` are summaries of one kind of contacts each, `conditions` those of groups of changed conditions, which count
    in no other part.
    """

    results: Results
    summaries: tuple[Summary, ...]
    comparisons: tuple[Comparison, ...]
    kinds: tuple[Summary, ...] = ()
    conditions: tuple[Summary, ...] = ()

    def with_protocol(self, *protocol: str) -> Evaluated:
        """Return it with the verdict of a test protocol in its conclusion: outcome, sentence, and the reasons."""
        results = replace(self.results, conclusion=replace(self.results.conclusion, protocol=protocol))
        return replace(self, results=replace(results, conclusion=conclude(results, self.summaries)))


def evaluate(results: Results, limits: Sequence[LimitRule] = ()) -> Evaluated:
    """Derive all statistics, comparisons and the conclusion from results.

    Parameters
    ----------
    results : Results
        The rows of a benchmark.
    limits : sequence of LimitRule
        Limits to check; the outcomes become rows of the results. Without them, those in the results stay.

    Returns
    -------
    Evaluated
        The results with limits and conclusion, the summaries, also by kind and of changed conditions, and the
        comparisons of detectors.

    Raises
    ------
    ConfigurationError
        A limit names a metric that these results do not have.

    Examples
    --------
    `cdtool.benchmark` and `cdtool.score` return evaluated results.
    """
    summaries, kinds = tuple(summarise(results)), tuple(summarise_kinds(results))
    conditions = tuple(summarise_conditions(results))
    if limits:
        lost = any(item.onset_holes or item.force_holes for item in (*summaries, *conditions))
        largest = at_worst(results) if lost else None
        worst = [*summarise(largest), *summarise_kinds(largest), *summarise_conditions(largest)] if largest else ()
        results = replace(results, limits=check_limits(limits, summaries, worst, (*kinds, *conditions)))
    results = replace(results, conclusion=conclude(results, summaries))
    return Evaluated(results, summaries, tuple(compare_detectors(results)), kinds, conditions)
