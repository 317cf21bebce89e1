"""A report of more recordings than it lists."""

from __future__ import annotations

from cdtool.report.writers.base import Report
from cdtool.results.evaluated import evaluate
from cdtool.results.limits import LimitRule
from tests.synthetic.many_results import many_results, traces_of_many

# More than a report lists where tests lower the limits.
COUNT = 900
LIMITS = {"MOST_RECORDINGS": 500, "_MOST_ROWS": 100}


def report_of_many(count: int = COUNT, *, limit: bool = False) -> Report:
    """Return the report of that many recordings with traces of missed contacts; `limit`: no contact may be missed."""
    results = many_results(count)
    rules = [LimitRule("*.missed", "*", "*", "missed", largest=0.0)] if limit else []
    return Report(evaluate(results, rules), traces_of_many(results, 20))
