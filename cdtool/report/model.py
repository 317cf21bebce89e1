"""What every report of a benchmark shows, computed once as plain values: headline, tables and notes.

Renderers (HTML, Markdown) add markup, choose what fits, and neither compute, format nor word anything.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import PureWindowsPath
from typing import Any

from cdtool.base.plain_text import counted, shorten
from cdtool.base.registry import Registry
from cdtool.report.best import BEST, best_table
from cdtool.report.few_contacts import explained
from cdtool.report.many import is_many, plotted_groups
from cdtool.report.number_text import NOT_ASSESSABLE, NOTHING, number
from cdtool.report.table import Log, Table
from cdtool.report.tables import forces, recordings
from cdtool.report.tables.attention import attention_table, failed_recordings
from cdtool.report.tables.conditions import conditions_table
from cdtool.report.tables.provenance import provenance_tables
from cdtool.report.tables.results import (
    calibration_table,
    comparisons_note,
    comparisons_table,
    every_result_table,
    limits_in_words,
    limits_table,
    part_of,
    results_table,
)
from cdtool.report.tables.worst_cases import worst_cases_table
from cdtool.results.evaluated import Evaluated
from cdtool.results.results import ContactResult, Results

# The tables of a command's own section of a benchmark file, and their lines on a terminal: `table` and `lines`.
SECTIONS = Registry("section of a report", {"injected": "cdtool.commands.inject.report_table:InjectedSection"})

NO_CERTIFICATE = "This is evidence from recordings, not a certificate of safety."
SIMULATED = "simulated recordings"
UNCHECKED = "Values to be checked against the standard."
AXES = {
    "latency": "latency from contact onset to alarm [ms]",
    "median": "median latency [ms]",
    "time": "time from contact onset [ms]",
    "force": "force [N]",
}
TITLES = {
    "page": "Collision detection",
    "attention": "What needs attention",
    "results": "Results",
    "latency": "Latency of each contact",
    "survival": "Share of contacts undetected over time",
    "amoc": "Median latency against false alarms",
    "comparisons": "Comparisons",
    "conditions": "Changed conditions",
    "force": "Force",
    "recordings": "Recordings",
    "cases": "Worst and failed cases",
    "left_out": "Left out and warnings",
    "calibration": "False-alarm budget",
    "provenance": "Details and provenance",
}
# Where only the worst and the failed cases are listed.
TITLES_OF_MANY = {"latency": "Distribution of the latency", "recordings": TITLES["cases"]}

_NOTES = {
    "latency": (
        "Each mark is a contact. Open marks: missed contacts, at the time up to which an alarm would have counted. "
        "Vertical line and bar: median and, with ten or more contacts, its interval; “≥”: missed contacts leave it "
        "without an upper end."
    ),
    "survival": (
        "Share of the assessable contacts still undetected at a time after the onset (Kaplan–Meier); lower and "
        "further left is better. With up to three detectors shown, the 95 % band is drawn for ten or more contacts."
    ),
    "amoc": (
        "Each point is a safety factor; the ringed point is in use. False alarms are those of the impact-free "
        "operations. The strip 0 has the points without any; this does not mean a rate of zero, and the upper bound "
        "is given below. Open points: contacts were missed. A triangle at the top: the median is not reached."
    ),
    "comparisons": (
        "Paired: the same contacts, as far as both detectors could assess them. Latency: over the contacts that both "
        "detected, with its 95 % interval from ten or more recordings or campaigns. The p are corrected by Holm over "
        "all tests of a group; a difference is shown if its p is below 0.05. “No difference shown” is not a proof of "
        "none."
    ),
    "force": (
        "Load cell minus its reading at rest, over the time since the onset; verdicts are corrected for the mass "
        "before the cell too. Coloured: the worst contact, and the detectors' alarms on it."
    ),
    "calibration": (
        "Each factor was set on impact-free operations, each assessed with a threshold that was not learned from it."
    ),
    "injected": (
        "Contacts of a model in impact-free recordings; no machine has hit anything. Medians; a range is that of the "
        "assumptions about what is not known of the machine."
    ),
    "conditions": (
        "The same thresholds on recordings of the machine under a changed condition. Alarming: impact-free operations "
        "with a false alarm, of those that were assessable, with the 95 % interval of their share. Latency: mean of "
        "the detected contacts with its 95 % interval; the median where fewer than ten were detected with or without "
        "the change. After each value: that of the unchanged machine. These recordings count in no other statistic, "
        "and in no limit that does not name them."
    ),
    "results": (
        "Median, range and P95 count a missed contact as later than all others. Force at alarm: median of the detected "
        "contacts."
    ),
    "provenance": "All results with all their digits, and the hash of every recording, are in results.json.",
}

_NOTES_OF_MANY = {
    "latency": (
        "Bars: number of contacts in each class of latency, by detector; the highest bar of each has the same height. "
        "Vertical line and bar below: median and its interval; “≥”: missed contacts leave it without an upper end. A "
        "missed contact has no latency."
    ),
}
_ALL_OF_THEM = (
    "These are the worst of each detector and group, those with a trigger plot first; all recordings are in "
    "results.json and results.parquet."
)


@dataclass(frozen=True)
class ProfileText:
    """The force profile of a group in sentences; `unchecked` is empty once its values have been checked."""

    source: str
    unchecked: str
    note: str


@dataclass(frozen=True)
class Model:
    """The plain values of a report. Texts from files are unchanged: renderers escape them.

    `tone` of the headline is good, bad, unknown, or empty if nothing was required. `simulated`: what says that the
    recordings are; empty if nothing does. `scope`: version, machine, number of detectors and recordings. `reasons`:
    the limits that are not met first. `tables`: by name, those with rows; `failed`: the
    recordings that need attention, the worst first (of very many, those that are listed); `notes`: how to read each
    part.
    """

    headline: str
    counts: str
    tone: str
    simulated: str
    scope: tuple[str, ...]
    reasons: tuple[str, ...]
    tables: Mapping[str, Table]
    provenance: tuple[Table, ...]
    profiles: Mapping[str, ProfileText]
    failed: tuple[Log, ...]
    notes: Mapping[str, str]

    def first_reasons(self, most: int) -> list[str]:
        """Return the first reasons behind the headline, and how many more there are."""
        more = len(self.reasons) - most
        return [*self.reasons[:most], *([f"and {more} more"] if more > 0 else [])]


def report_model(evaluated: Evaluated, traced: Collection[Log] = ()) -> Model:
    """Return everything that the reports of a benchmark show; `traced` are the recordings with a trace.

    Of very many recordings only the worst and the failed cases are listed.
    """
    results, summaries = evaluated.results, evaluated.summaries
    many = is_many(results)
    cases, counts = worst_cases_table(results, traced) if many else (None, "")
    failed = [] if many else failed_recordings(results)
    provenance = results.provenance
    version = provenance.get("tool_version")
    scope = (
        f"cdtool {version}" if version else "cdtool",
        str(provenance.get("machine") or ""),
        counted(len(results.detectors), "detector"),
        counted(len(results.recordings), "recording"),
    )
    tables = (
        attention_table(results, failed),
        limits_table(results, met=False),
        limits_table(results, met=True),
        best_table(evaluated),
        results_table(summaries),
        every_result_table(results, summaries),
        every_result_table(results, evaluated.kinds, kinds=True),
        conditions_table(evaluated),
        *(SECTIONS.load(name).table(evaluated) for name in SECTIONS.names()),
        comparisons_table(evaluated),
        forces.groups_table(results),
        forces.points_table(results),
        *([cases] if cases else [forces.contacts_table(results), recordings.recordings_table(results)]),
        forces.contacts_table(results, only_exceptions=True),
        *recordings.contact_tables(results),
        recordings.false_alarms_table(results),
        recordings.not_assessable_table(results),
        *recordings.reasons_tables(results),
        calibration_table(results),
    )
    return Model(
        headline=results.conclusion.headline,
        counts=counts_text(evaluated),
        tone=results.conclusion.tone,
        simulated=SIMULATED if provenance.get("simulated") is True else "",
        scope=tuple(part for part in scope if part),
        reasons=(*limits_in_words(results), *results.conclusion.reasons),
        tables={table.name: table for table in tables if table.rows},
        provenance=tuple(provenance_tables(results)),
        profiles=_profiles(results),
        failed=tuple(dict.fromkeys(_bad_logs(cases) if cases else (item.log for item in failed))),
        notes={
            **_NOTES,
            **(_NOTES_OF_MANY if many else {}),
            "groups": _groups_note(evaluated) if many else "",
            "cases": f"{counts} {_ALL_OF_THEM}" if many else "",
            "best": f"{BEST} {NO_CERTIFICATE}",
            "all_results": _results_note(evaluated),
            "pairs": comparisons_note(evaluated),
        },
    )


def counts_text(evaluated: Evaluated) -> str:
    """Return the outcomes of the contacts in one line, over all detectors and groups."""
    summaries, results = evaluated.summaries, evaluated.results
    if not any(item.contacts or item.operations for item in summaries):
        return "nothing was scored"
    unchanged = [item for item in results.contacts if item.group in results.groups]

    def numbers(is_counted: Callable[[ContactResult], bool]) -> int:
        return len({(item.group, item.recording, item.contact) for item in unchanged if is_counted(item)})

    contacts = counted(numbers(lambda item: not item.in_progress), "contact")
    counts = (
        ("detected", sum(item.detected for item in summaries)),
        ("missed", sum(item.missed for item in summaries)),
        (NOT_ASSESSABLE, sum(item.not_assessable for item in summaries)),
    )
    outcomes = ", ".join(f"{count} {outcome}" for outcome, count in counts)
    if clipped := sum(item.clipped for item in summaries):
        outcomes += f" ({clipped} before the onset, counted as 0 ms)"
    if holes := numbers(lambda item: item.onset_hole_ms is not None):
        outcomes += f"; {counted(holes, 'contact')} may have begun where load-cell samples are missing"
    if begun := numbers(lambda item: item.in_progress):
        outcomes += f"; {counted(begun, 'contact')} in progress at the start, not scored"
    assessed = any(item.watched and item.judged_operations for item in summaries)
    count = counted(sum(item.false_alarms for item in summaries), "false alarm")
    alarms = count if assessed else f"false alarms {NOT_ASSESSABLE}"
    return f"{contacts} with {counted(len(results.detectors), 'detector')}: {outcomes}; {alarms}"


def _bad_logs(cases: Table) -> list[Log]:
    """Return the recordings of the listed cases with a bad outcome."""
    return [log for log, cell in zip(cases.logs, cases.cells("outcome"), strict=True) if cell.tone == "bad"]


def _groups_note(evaluated: Evaluated) -> str:
    """Return which groups have plots; empty if all have."""
    plotted, every = plotted_groups(evaluated), {item.group for item in evaluated.summaries if item.contacts}
    if len(plotted) == len(every):
        return ""
    return f"Plotted are the {len(plotted)} of {len(every)} groups with the largest share of missed contacts."


def _results_note(evaluated: Evaluated) -> str:
    """Return how to read the results: from when to when, what is in brackets, what counts where."""
    results = evaluated.results
    # The name of a contact's channel comes from a file.
    onset = shorten(onset_words(results.provenance), 200)
    resolutions = [item.resolution_ms for item in results.contacts if item.resolution_ms is not None]
    resolution = f"; resolution up to {number(max(resolutions))} ms" if resolutions else ""
    note = (
        f"Latency: from the onset of the contact ({onset}) to the sample that raised the alarm, debounce "
        f"included{resolution}. In brackets: 95 % interval; “{NOTHING}” means no value. Mean and std are those of the "
        "detected contacts, peak force is the median of all contacts. Read a latency together with missed, not "
        "assessable and false alarms."
    )
    return f"{note} {explained(evaluated.summaries)}".rstrip()


def _profiles(results: Results) -> dict[str, ProfileText]:
    return {
        group: ProfileText(
            f"{profile.get('title') or ''} (source: {profile.get('source') or ''}).",
            "" if profile.get("checked") else UNCHECKED,
            str(profile.get("note") or ""),
        )
        for group, profile in part_of(results.provenance, "force_profiles").items()
        if isinstance(profile, Mapping)
    }


def onset_words(provenance: Mapping[str, Any]) -> str:
    """Return the rule of the onset in words, with the name of the label file where there is one.

    Parameters
    ----------
    provenance : mapping of str to any
        The provenance of results.

    Returns
    -------
    str
        For example "load cell above 20 N for 3 ms; label file labels.csv".

    Examples
    --------
    >>> onset_words({"onset": "load cell above 20 N for 3 ms", "label_file": "gate/labels.csv"})
    'load cell above 20 N for 3 ms; label file labels.csv'
    """
    rule, labels = provenance.get("onset") or "rule not stated", provenance.get("label_file")
    rule = f"{rule}; force: {provenance['force']}" if provenance.get("force") else rule
    return f"{rule}; label file {PureWindowsPath(str(labels)).name}" if labels else str(rule)
