"""What the Markdown report folds away: single contacts and alarms, what was left out, where it all came from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cdtool.evaluation.alike import alike
from cdtool.evaluation.results import ContactResult, Results, Skipped
from cdtool.report.figure_text import NOTHING, number, percent
from cdtool.report.markdown.figures import force_verdict, named, part_of, steps_words, time_budget
from cdtool.report.markdown.text import Section, Table, escape

# Provenance in words; gains and hashes have tables of their own.
_ONE_LINE = (
    ("tool_version", "cdtool version"),
    ("machine", "machine"),
    ("watched_joints", "joints watched, of all"),
    ("threshold", "threshold"),
    ("signature_rule", "how the normal band is made"),
    ("safety_factor_set", "safety factor or limits set"),
    ("false_alarm_budget", "false-alarm budget"),
    ("operations", "operations cut by"),
    ("window_s", "matching window [s]"),
    ("debounce_samples", "debounce [samples]"),
    ("rearm_s", "armed again after [s]"),
    ("hysteresis", "hysteresis, share of the safety factor"),
    ("latch", "alarms latch"),
    ("onset", "onset"),
    ("label_file", "label file"),
    ("synchronisation_s", "synchronisation of the load cell [s]"),
    ("mass_before_cell_kg", "mass before the load cell [kg]"),
    ("benchmark_sha256", "SHA-256 of the benchmark file"),
    ("machine_sha256", "SHA-256 of the machine file"),
    ("plugins", "plug-ins"),
)


def details(results: Results) -> list[Section]:
    """Every folded section that has something to say."""
    missed = [item for item in results.contacts if item.outcome == "missed"]
    blind = [item for item in results.contacts if item.outcome == "not_assessable"]
    begun = [_contact_row(results, item) for item in results.contacts if item.in_progress]
    sections = [
        _folded("Contacts missed", _CONTACT, [_contact_row(results, item) for item in missed], "contacts"),
        _folded("False alarms", _ALARM, _false_alarm_rows(results), "false_alarms"),
        _folded("Contacts not assessable", _CONTACT, [_contact_row(results, item) for item in blind], "contacts"),
        _folded("Contacts in progress at the start", _CONTACT, begun, "contacts"),
        _folded("What could not be judged", _NOT_JUDGED, _not_judged(results), "exposure"),
        _folded("Force limits not met", _FORCE, _force_rows(results), "forces"),
        _folded("Left out", ("recording", "reason"), _reasons(alike(results.skipped)), "skipped"),
        _folded("Findings", ("recording", "finding"), _reasons(alike(results.findings)), "findings"),
        _folded("False-alarm budget", _BUDGET, _calibration(results), "calibration"),
        _folded("Provenance", ("what", "value"), _one_line(results.provenance), "provenance"),
        _folded("Gains and thresholds", _GAINS, _gains(results), "provenance"),
        _folded("Recordings scored", _RECORDING, _recordings(results), "recordings"),
        _folded("Recordings learned from", ("recording", "SHA-256"), _learned(results.provenance), "provenance"),
    ]
    return [section for section in sections if section.table and section.table.rows]


_CONTACT = ("recording", "group", "contact", "onset [s]", "detector", "watched for [ms]", "peak force [N]", "why")
_ALARM = ("recording", "group", "detector", "joint", "at [s]", "crossed", "value", "limit")
_NOT_JUDGED = ("group", "detector", "share of its samples", "operations judged nowhere", "why")
_FORCE = ("recording", "group", "contact", "profile", "verdict", "steps", "first limit exceeded", "why")
_BUDGET = ("detector", "allowed", "safety factor set", "alarms with it", "operations", "hours")
_GAINS = ("detector", "gains", "SHA-256 of its threshold")
_RECORDING = ("recording", "group", "contacts", "operations", "length [s]", "campaign", "test point", "SHA-256")

_Rows = Sequence[Sequence[object]]


def _folded(title: str, headings: Sequence[str], rows: _Rows, source: str) -> Section:
    return Section(f"{title} ({len(rows)})", table=Table(headings, rows), folded=True, source=source)


def _contact_row(results: Results, item: ContactResult) -> tuple[object, ...]:
    why = item.reason or ("no alarm in its window" if item.outcome == "missed" else "")
    return (
        escape(item.recording),
        escape(item.group),
        item.contact,
        f"{item.onset_s:.3f}",
        named(results, item.detector),
        number(item.watched_ms),
        number(item.peak_force_n),
        escape(why),
    )


def _false_alarm_rows(results: Results) -> _Rows:
    units = part_of(results.provenance, "units")
    return [
        (
            escape(item.recording),
            escape(item.group),
            named(results, item.detector),
            escape(item.joint),
            f"{item.time_s:.3f}",
            escape(item.side or NOTHING),
            *(_with_unit(value, units.get(item.detector, "")) for value in (item.statistic, item.limit)),
        )
        for item in results.false_alarms
    ]


def _with_unit(value: float | None, unit: object) -> str:
    return NOTHING if value is None else f"{number(value)} {escape(unit)}".strip()


def _not_judged(results: Results) -> _Rows:
    return [
        (
            escape(item.group),
            named(results, item.detector),
            percent(sum(item.not_judged.values())),
            f"{item.not_assessable} of {item.operations}",
            escape(", ".join(f"{reason} {percent(share)}" for reason, share in item.not_judged.items())),
        )
        for item in results.exposure
        if item.not_judged or item.not_assessable
    ]


def _force_rows(results: Results) -> _Rows:
    return [
        (
            escape(item.recording),
            escape(item.group),
            item.contact,
            escape(item.profile),
            force_verdict(item.verdict),
            steps_words(item.steps),
            time_budget(item),
            escape(item.reason or ""),
        )
        for item in results.forces
        if item.verdict != "pass"
    ]


def _reasons(items: Sequence[Skipped]) -> _Rows:
    return [(escape(item.recording), escape(item.reason.removeprefix(f"{item.recording}: "))) for item in items]


def _calibration(results: Results) -> _Rows:
    return [
        (
            named(results, item.detector),
            escape(item.budget),
            number(item.safety_factor),
            item.alarms,
            item.operations,
            number(item.hours),
        )
        for item in results.calibration
    ]


def _one_line(provenance: Mapping[str, Any]) -> _Rows:
    return [
        (words, escape(_in_words(provenance[key])))
        for key, words in _ONE_LINE
        if provenance.get(key) not in (None, "", {}, [])
    ]


def _in_words(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} = {item}" for key, item in value.items())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(map(str, value))
    return str(value)


def _gains(results: Results) -> _Rows:
    signatures = part_of(results.provenance, "signature_sha256")
    return [
        (named(results, name), escape(_in_words(gains)), escape(signatures.get(name, NOTHING)))
        for name, gains in part_of(results.provenance, "gains").items()
    ]


def _recordings(results: Results) -> _Rows:
    return [
        (
            escape(item.recording),
            escape(item.group),
            item.contacts,
            item.operations,
            number(item.seconds),
            escape(item.campaign or ""),
            escape(item.point or ""),
            escape(item.sha256),
        )
        for item in results.recordings
    ]


def _learned(provenance: Mapping[str, Any]) -> _Rows:
    return [(escape(name), escape(digest)) for name, digest in part_of(provenance, "learned_sha256").items()]
