"""The HTML page of a tuning: choices with honest results, what led to them, and how sure they are. Without script."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from cdtool.base.plain_text import counted
from cdtool.commands.tune.search.objective import Goal
from cdtool.commands.tune.search.tuned import ChoiceResults, GroupResults, Sensitivity, TunedDetector
from cdtool.commands.tune.tuned_files import described_choice
from cdtool.commands.tune.tuned_rows import Tuning
from cdtool.report.html.page_tables import visible
from cdtool.report.html.sections_page import PageSection, SectionsPage, left_out_sections
from cdtool.report.model import NO_CERTIFICATE
from cdtool.report.number_text import NOTHING, number, percent, short
from cdtool.report.table import Cell, Heading, Table, count_cell, interval_cell, number_cell, tabulate

_GOALS = {
    Goal.LATENCY: "mean latency",
    Goal.P95: "95th percentile of latency",
    Goal.FORCE: "mean force at the alarm",
}
NESTED_NOTE = (
    "Nested results: the search is repeated five times without a fifth of the recordings, and each choice is assessed "
    "on the fifth that neither chose it nor set its limit. Apparent results are from the recordings used for the "
    "choice."
)
APPARENT_NOTE = (
    "Apparent results are from the recordings used for the choice. Expect latencies 2 to 8 % longer, and more false "
    "alarms, on others."
)


def tuning_html(tuning: Tuning) -> str:
    """Return the page: the same text for the same input."""
    tone, headline = tuning.verdict
    sections = [
        PageSection(
            "Detectors",
            (_detectors_table(tuning),),
            note=NESTED_NOTE if tuning.is_nested else " ".join((APPARENT_NOTE, *apparent_words(tuning))),
        )
    ]
    for tuned in tuning.detectors:
        sections += _sections_of(tuned)
    if tuning.unusable:
        rows = [[Cell(visible(name)), Cell(visible(reason))] for name, reason in tuning.unusable.items()]
        table = Table("unusable", "Detectors that could not be tuned", (Heading("detector"), Heading("reason")), rows)
        sections.append(PageSection("Not tuned", (table,)))
    sections += left_out_sections(tuning.left_out, tuning.findings)
    sections.append(PageSection("What this is", note=f"{injected_words(tuning)}{NO_CERTIFICATE}"))
    contacts = ", ".join(f"{count} {name}" for name, count in tuning.groups.items())
    return SectionsPage(
        "Tuning",
        f"Detectors of {visible(tuning.setup.machine_file.machine.name)} at {tuning.options.budget} false alarms",
        visible(headline),
        visible(f"From {counted(len(tuning.runs.operations), 'impact-free run')} and contacts: {contacts}."),
        tone,
        (f"minimised: {_GOALS[tuning.options.objective]}", f"seed {tuning.options.seed}"),
        tuple(section for section in sections if section.tables or section.note),
    ).html()


def injected_words(tuning: Tuning) -> str:
    """Return a sentence about injected contacts; empty if all are real."""
    names = [name for name, group in tuning.setup.impacts.items() if group.injected is not None]
    if not names:
        return ""
    return f"The contacts of {', '.join(map(visible, names))} were computed (injected), not measured. "


def _detectors_table(tuning: Tuning) -> Table:
    groups = list(tuning.groups)

    def mean(name: str, item: TunedDetector) -> Cell:
        figures = item.honest.groups.get(name)
        return Cell(NOTHING) if figures is None else _mean_cell(figures)

    def default(name: str, item: TunedDetector) -> Cell:
        figures = item.default_nested or item.default_apparent
        found = figures.groups.get(name) if figures else None
        return Cell(NOTHING) if found is None else number_cell(found.mean_ms)

    fields = [
        (Heading("detector"), lambda item: Cell(visible(item.detector))),
        (Heading("threshold"), lambda item: Cell(item.choice.rule.name, (described_choice(item),))),
        (Heading("debounce"), lambda item: Cell(debounce_words(item))),
    ]
    for name in groups:
        fields.append((Heading(f"{visible(name)}, default [ms]", numeric=True), partial(default, name)))
        fields.append((Heading(f"{visible(name)}, tuned [ms]", numeric=True), partial(mean, name)))
    fields.append((Heading("alarming free runs", numeric=True), lambda item: _alarms_cell(item.honest)))
    return tabulate("detectors", "Mean latency, a missed contact counted as its window", fields, tuning.detectors)


def _mean_cell(figures: GroupResults) -> Cell:
    """Return the cell of a mean with its interval, or with the range of values too few for one."""
    if not figures.interval_ms.reason:
        return interval_cell(figures.interval_ms)
    return replace(number_cell(figures.mean_ms), details=(range_words(figures),))


def range_words(figures: GroupResults) -> str:
    """Return the range of latencies in words."""
    return f"range {number(figures.range_ms[0])} to {number(figures.range_ms[1])}"


def _alarms_cell(figures: ChoiceResults) -> Cell:
    return Cell(f"{figures.alarming} of {figures.free}", (alarms_words(figures),))


def alarms_words(figures: ChoiceResults) -> str:
    """Return the 95 % interval of the share of alarming runs in words."""
    share = figures.alarm_share
    return f"{number(100.0 * share.low, 2)} to {percent(share.high)}"


def debounce_words(tuned: TunedDetector) -> str:
    """Return the debounce of a choice in words."""
    return "9 ms" if tuned.debounce is None else counted(tuned.debounce, "sample")


def apparent_words(tuning: Tuning) -> list[str]:
    """Return a sentence per detector without nested results: the reason."""
    return [
        f"{visible(item.detector)}: no nested results: {visible(item.why_not_nested)}."
        for item in tuning.detectors
        if item.nested is None
    ]


def rejection_words(tuned: TunedDetector) -> list[str]:
    """Return why kinds of rules that were best are not chosen, a sentence each, without its full stop."""
    return [
        f"Not chosen: {item.rule} as tuned: {visible(item.group)} is {percent(item.ratio - 1.0)} worse with it "
        "than by default on recordings not used for the choice"
        for item in tuned.rejected
    ]


def _sections_of(tuned: TunedDetector) -> list[PageSection]:
    name = visible(tuned.detector)
    note = "" if not tuned.default_reason else f"The default cannot be used: {visible(tuned.default_reason)}. "
    note += " ".join(f"{words}." for words in rejection_words(tuned))
    more = [_sensitivity_table(tuned.sensitivities)]
    if tuned.chosen_in_folds:
        rows = [[Cell(str(number)), Cell(visible(text))] for number, text in enumerate(tuned.chosen_in_folds, 1)]
        columns = (Heading("without fold"), Heading("choice"))
        more.append(Table("folds", "What is chosen without a fifth of the recordings", columns, rows))
    return [
        PageSection(f"{name}: results", (_results_table(tuned),), note=note),
        PageSection(f"{name}: around the choice", tuple(more)),
    ]


def _results_table(tuned: TunedDetector) -> Table:
    kinds = (
        ("default, nested", tuned.default_nested),
        ("tuned, nested", tuned.nested),
        ("default, apparent", tuned.default_apparent),
        ("tuned, apparent", tuned.apparent),
    )
    items = [(words, figures, name) for words, figures in kinds if figures is not None for name in figures.groups]

    fields = (
        (Heading("results"), lambda item: Cell(item[0])),
        (Heading("group"), lambda item: Cell(visible(item[2]))),
        (Heading("contacts", numeric=True), lambda item: count_cell(item[1].groups[item[2]].contacts)),
        (Heading("missed", numeric=True), lambda item: count_cell(item[1].groups[item[2]].missed, "bad")),
        (
            Heading("not assessable", numeric=True),
            lambda item: count_cell(item[1].groups[item[2]].not_assessable, "unknown"),
        ),
        (Heading("mean [ms]", numeric=True), lambda item: _mean_cell(item[1].groups[item[2]])),
        (Heading("P95 [ms]", numeric=True), lambda item: number_cell(item[1].groups[item[2]].p95_ms)),
        (Heading("force at alarm [N]", numeric=True), lambda item: number_cell(item[1].groups[item[2]].force_n)),
        (Heading("alarming free runs", numeric=True), lambda item: _alarms_cell(item[1])),
    )
    return tabulate("results", "Latency by group, with the 95 % interval of the mean", fields, items)


def _sensitivity_table(items: Sequence[Sensitivity]) -> Table:
    fields = (
        (Heading("gain or setting"), lambda item: Cell(visible(item.name))),
        (Heading("chosen", numeric=True), lambda item: Cell(short(item.chosen))),
        (Heading("tried", numeric=True), lambda item: Cell(str(len(item.tried)))),
        (
            Heading("at most 5 % more cost", numeric=True),
            lambda item: Cell(f"{short(item.flat_from)} to {short(item.flat_to)}" if len(item.tried) > 1 else NOTHING),
        ),
        (
            Heading("edge"),
            lambda item: Cell("at the edge of the search", tone="unknown") if item.is_at_edge else Cell(""),
        ),
    )
    return tabulate("sensitivity", "How flat the optimum is", fields, items)
