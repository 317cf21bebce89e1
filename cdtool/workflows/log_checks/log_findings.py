"""What is wrong with a log itself, whatever detector looks at it: one answer for every command."""

from __future__ import annotations

from collections.abc import Sequence

from cdtool.evaluation.results import Skipped
from cdtool.evaluation.truth.doubts import truth_findings
from cdtool.evaluation.truth.onset import OnsetRule
from cdtool.recording import Contact, Finding, Recording, worst_first
from cdtool.workflows.log_checks.accelerometer_check import accelerometer_findings
from cdtool.workflows.log_checks.motion_check import motion_findings

# Of a contact without an onset; where contacts are scored it is named as left out.
IN_PROGRESS = "a contact is in progress when it begins, until {end:.3f} s: its onset is not recorded"


def log_findings(recording: Recording, contacts: Sequence[Contact], rule: OnsetRule) -> tuple[Finding, ...]:
    """Return the findings of reading a log, and those about its motion, accelerometer and load cell, worst first.

    `contacts` are those that the log shows by `rule`.
    """
    found = [*recording.findings, *motion_findings(recording), *accelerometer_findings(recording, contacts)]
    return worst_first(dict.fromkeys([*found, *truth_findings(recording, contacts, rule)]))


def log_warnings(recording: Recording, contacts: Sequence[Contact], rule: OnsetRule) -> list[Skipped]:
    """Return the warnings among the findings of a log, under its name; losses are reported by `runs.lost`."""
    found = log_findings(recording, contacts, rule)
    return [Skipped(recording.name, str(item)) for item in found if item.severity == "warning"]
