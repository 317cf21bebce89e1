"""The report as Markdown that a pull request can hold: verdict, limits, figures, and the rest folded away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from cdtool.errors import UsageError
from cdtool.evaluation.alike import Reason, alike
from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.limits import not_met
from cdtool.evaluation.results import ContactResult, LimitResult, Results, onset_words
from cdtool.plain_text import counted
from cdtool.report.few_contacts import explained
from cdtool.report.figure_text import NOTHING, number, percent
from cdtool.report.markdown.figures import (
    comparison_section,
    force_sections,
    force_verdict,
    group_section,
    limit_sections,
    named,
    part_of,
    steps_words,
    time_budget,
)
from cdtool.report.markdown.text import Section, Table, escape, fitted
from cdtool.report.verdict_words import NO_CERTIFICATE, counts_words, verdict_words
from cdtool.report.writers.base import Image

# Room for the verdict and how to read the figures, whatever names there are.
_LEAST = 4_000
_LIMITS_NAMED = 5
_REASONS_NAMED = 4
_LONGEST_NAME = 40
# Provenance in words; gains and hashes have tables of their own.
_PROVENANCE_WORDS = (
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
_CONTACT = ("recording", "group", "contact", "onset [s]", "detector", "watched for [ms]", "peak force [N]", "why")
_ALARM = ("recording", "group", "detector", "joint", "at [s]", "crossed", "value", "limit")
_NOT_JUDGED = ("group", "detector", "share of its samples", "operations judged nowhere", "why")
_FORCE = ("recording", "group", "contact", "profile", "verdict", "steps", "first limit exceeded", "why")
_BUDGET = ("detector", "allowed", "safety factor set", "alarms with it", "operations", "hours")
_GAINS = ("detector", "gains", "SHA-256 of its threshold")
_RECORDING = ("recording", "group", "contacts", "operations", "length [s]", "campaign", "test point", "SHA-256")
_Rows = Sequence[Sequence[object]]


def to_markdown(evaluated: Evaluated, images: Sequence[Image] = (), most: int = 60_000) -> str:
    """The report as GitHub-flavoured Markdown in at most `most` characters; text from files is never markup.

    Where all of it would be longer, tables are cut and say how many rows results.json has; the verdict and the limits
    go before figures, figures before what is folded. Raises UsageError for `most` below 4,000.
    """
    if most < _LEAST:
        raise UsageError(f"a report of at most {most} characters", f"give it {_LEAST} or more")
    results = evaluated.results
    figures = [Section("", " ".join(part for part in (_how_to_read(results), explained(evaluated.summaries)) if part))]
    figures += [Section("", _image(image)) for image in images if image.group is None]
    for group in results.groups:
        own = [_image(image) for image in images if image.group == group]
        figures.append(group_section(evaluated, group, "\n\n".join(own)))
    figures += [*comparison_section(evaluated), *force_sections(results)]
    return fitted(_head(evaluated), (*limit_sections(results), figures, _details(results)), most)


def _head(evaluated: Evaluated) -> str:
    results = evaluated.results
    parts = [f"# Collision detection: {verdict_words(evaluated)}", f"{counts_words(evaluated)}."]
    failing = not_met(results.limits)
    if failing:
        named = "; ".join(_limit_words(item) for item in failing[:_LIMITS_NAMED])
        more = f"; and {len(failing) - _LIMITS_NAMED} more" if len(failing) > _LIMITS_NAMED else ""
        parts.append(f"**Not met:** {named}{more}.")
    reasons = results.conclusion.reasons
    if reasons:
        lines = [escape(reason) for reason in reasons[:_REASONS_NAMED]]
        lines += [f"and {len(reasons) - _REASONS_NAMED} more"] if len(reasons) > _REASONS_NAMED else []
        parts.append(f"**Force, missed contacts, not assessable:** {'; '.join(lines)}.")
    lost = len(results.skipped) + len(results.losses)
    if lost:
        parts.append(f"**Left out or lost: {counted(lost, 'item')}**, named below.")
    return "\n\n".join([*parts, NO_CERTIFICATE])


def _how_to_read(results: Results) -> str:
    onset = escape(onset_words(results.provenance))
    return (
        f"Latency: from the onset of the contact ({onset}) to the alarm, with debounce. In brackets: 95 % interval. "
        "Mean and std are those of the n detected contacts; median and P95 take a missed contact as later than all. "
        '"At most": one-sided 95 % bound. Read a latency beside missed, not assessable and false alarms.'
    )


def _limit_words(item: LimitResult) -> str:
    where = ", ".join(escape(name, _LONGEST_NAME) for name in (item.detector, item.group, item.figure))
    return f"{where}: {escape(item.reason or item.outcome, 2 * _LONGEST_NAME)}"


def _image(image: Image) -> str:
    return f"![{escape(image.caption)}]({quote(image.name)})"


def _details(results: Results) -> list[Section]:
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
        _folded("Damaged but used", ("recording", "loss"), _reasons(alike(results.losses)), "findings"),
        _folded("Findings", ("recording", "finding"), _reasons(alike(results.warnings)), "findings"),
        _folded("False-alarm budget", _BUDGET, _calibration(results), "calibration"),
        _folded("Provenance", ("what", "value"), _one_line(results.provenance), "provenance"),
        _folded("Gains and thresholds", _GAINS, _gains(results), "provenance"),
        _folded("Recordings scored", _RECORDING, _recordings(results), "recordings"),
        _folded("Recordings learned from", ("recording", "SHA-256"), _learned(results.provenance), "provenance"),
    ]
    return [section for section in sections if section.table and section.table.rows]


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


def _reasons(items: Sequence[Reason]) -> _Rows:
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
        for key, words in _PROVENANCE_WORDS
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
