"""Every contact's force against every step of its profile as a row of a CSV file."""

from __future__ import annotations

from cdtool.evaluation.results import Results
from cdtool.report.csv_text import csv_text

_NAMES = (
    "recording",
    "group",
    "contact",
    "point",
    "profile",
    "verdict",
    "peak_n",
    "step",
    "step_from_s",
    "step_at_most_n",
    "step_peak_n",
    "step_time_budget_ms",
    "step_verdict",
    "step_reason",
)


def forces_csv(results: Results) -> str:
    """One row a contact and step, in the order of results.json; empty = no figure, or the limit was never exceeded."""
    return csv_text(
        _NAMES,
        (
            (
                force.recording,
                force.group,
                force.contact,
                force.point,
                force.profile,
                force.verdict,
                force.peak_n,
                step.name,
                step.from_s,
                step.at_most_n,
                step.peak_n,
                step.time_budget_ms,
                step.verdict,
                step.reason,
            )
            for force in results.forces
            for step in force.steps
        ),
    )
