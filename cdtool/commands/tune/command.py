"""`cdtool tune`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.commands.console.colour import Toned
from cdtool.commands.console.console import (
    leave,
    number,
    print_json,
    print_next,
    print_skipped,
    print_written,
    progress,
    say,
    table,
)
from cdtool.commands.console.options import DetectorsOption, ForceOption, JsonOption, QuietOption, SetOption, listed
from cdtool.commands.console.place import Place, location

if TYPE_CHECKING:
    from cdtool.commands.tune.tuned_rows import Tuning


def tune(
    file: Annotated[
        Place,
        typer.Argument(
            parser=location,
            help="Benchmark file with [learn] and [impacts] or [inject].",
        ),
    ],
    false_alarm_budget: Annotated[
        str,
        typer.Option(
            "--false-alarm-budget", help="As 1/100op or 0.1/h: met on average; 1/100op at 95%: with that confidence."
        ),
    ],
    output: Annotated[Place, typer.Option("--output", "-o", parser=location, help="Folder for what is tuned.")],
    detectors: DetectorsOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
    jobs: Annotated[int, typer.Option("--jobs", "-j", min=1, help="Number of candidates to measure in parallel.")] = 1,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Tune gains, threshold and debounce at a false-alarm budget, with results on recordings not used for the choice.

    Keys of [tune] say what is minimised and tried, as --set tune.objective=p95; docs/tuning.md has all of them.

    Example: cdtool tune benchmark.toml --false-alarm-budget 1/100op --detectors feekf,igm --jobs 2 -o tuned
    """
    from cdtool.commands.judging.settings_table import detectors_of, given_settings
    from cdtool.commands.scoring.benchmark_file import read_benchmark_file
    from cdtool.commands.tune.files import open_folder, write_tuning
    from cdtool.commands.tune.options import TuningOptions
    from cdtool.commands.tune.tuned_files import tuning_summary
    from cdtool.commands.tune.tuning import tune_detectors
    from cdtool.execution.workers import Workers
    from cdtool.results.results import Skipped

    names, others = detectors_of(listed(detectors or ""), given_settings(settings or ()))
    setup = read_benchmark_file(file, detectors=names, settings=others, command="tune")
    options = TuningOptions.of(setup, false_alarm_budget, detectors=names)
    open_folder(output, setup.inputs, setup.detectors, force=force)
    with progress("tuning", quiet=quiet) as advance:
        done = tune_detectors(setup, replace(options, workers=Workers(jobs, progress=advance)))
    write_tuning(done, output)
    left_out = [*done.left_out, *(Skipped(name, f"not tuned: {reason}") for name, reason in done.unusable.items())]
    if as_json:
        print_json(tuning_summary(done))
    else:
        _show(done, quiet=quiet)
    print_skipped(left_out, done.findings)
    if not (as_json or quiet):
        print_written([output], first="tuning.html")
        print_next("cdtool", "benchmark", output / "benchmark.toml")
    leave(left_out, done.findings)


def _show(done: Tuning, *, quiet: bool) -> None:
    from cdtool.commands.tune.page import injected_words, rejection_words
    from cdtool.commands.tune.tuned_files import described_choice

    tone, headline = done.verdict
    say(headline, tone=tone)
    if not quiet:
        _show_table(done)
    for tuned in done.detectors:
        settings = described_choice(tuned)
        edges = [item.name for item in tuned.sensitivities if item.is_at_edge]
        text = f"{tuned.short_name}: {settings or 'default settings'}"
        text += f"; at the edge of the search: {', '.join(edges)}" if edges else ""
        say(text)
        if tuned.default_reason:
            say(f"The default cannot be used: {tuned.default_reason}", indent="  ")
        for words in rejection_words(tuned):
            say(words, indent="  ")
    if not quiet:
        say(_meaning(done) + injected_words(done))


def _show_table(done: Tuning) -> None:
    from cdtool.commands.tune.page import alarms_words, debounce_words, range_words

    rows = []
    for tuned in done.detectors:
        before = tuned.default_nested or tuned.default_apparent
        for place, (group, figures) in enumerate(tuned.honest.groups.items()):
            first = place == 0
            interval = figures.interval_ms
            rows.append(
                (
                    tuned.short_name if first else "",
                    tuned.choice.rule.name if first else "",
                    debounce_words(tuned) if first else "",
                    group,
                    number(before.groups[group].mean_ms) if before else "-",
                    number(figures.mean_ms),
                    range_words(figures) if interval.reason else f"{number(interval.low)} to {number(interval.high)}",
                    Toned(f"{figures.missed} of {figures.contacts}", "bad" if figures.missed else ""),
                    f"{tuned.honest.alarming} of {tuned.honest.free}" if first else "",
                    alarms_words(tuned.honest) if first else "",
                )
            )
    kind = "nested" if done.is_nested else "apparent"
    columns = [("detector", "left"), ("threshold", "left"), ("debounce", "left"), ("group", "left")]
    columns += [
        ("default\nms", "right"),
        ("tuned\nms", "right"),
        ("95 % interval\nor range, ms", "right"),
        ("missed", "right"),
    ]
    columns += [("alarming\nfree runs", "right"), ("95 % interval", "right")]
    table(columns, rows, title=f"mean latency at {done.options.budget}, {kind} results")


def _meaning(done: Tuning) -> str:
    from cdtool.commands.tune.page import apparent_words

    if done.is_nested:
        return "nested: each result is of recordings that neither chose the settings nor set the limit. "
    return f"apparent: on the recordings used to choose the settings. {' '.join(apparent_words(done))} "
