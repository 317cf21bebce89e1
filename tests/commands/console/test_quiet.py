"""--quiet: the conclusion and what is wrong, without tables and progress, in every command that prints a table."""

from __future__ import annotations

import re
import sys
from dataclasses import replace

import pytest

from cdtool.commands.console.written_reports import show_results
from cdtool.report.outputs import write_outputs
from cdtool.report.plots.folder_figures import FOLDER_FIGURES
from cdtool.report.writers.base import Report
from cdtool.results.files.results_file import to_json
from tests.command import Outcome, cdtool
from tests.report.html.html_case import case
from tests.synthetic.builds import build_results

_HEADINGS = re.compile(r"^ *(detector|group|recording|stiffness|key|class|run) {2,}\w", re.MULTILINE)


def both(*arguments: object) -> tuple[Outcome, Outcome]:
    return cdtool(*arguments), cdtool(*arguments, "--quiet")


def test_quiet_compare_prints_the_verdict_and_what_is_worse_without_the_table(tmp_path):
    old, new = tmp_path / "old.json", tmp_path / "new.json"
    old.write_text(to_json(build_results({("gm", "stiff"): [40.0 + 0.1 * i for i in range(30)]})), encoding="utf-8")
    new.write_text(to_json(build_results({("gm", "stiff"): [60.0 + 0.1 * i for i in range(30)]})), encoding="utf-8")
    whole, quiet = both("compare", old, new)
    assert whole.status == quiet.status == 1
    assert _HEADINGS.search(whole.out) and not _HEADINGS.search(quiet.out)
    lines = quiet.out.splitlines()
    assert lines[0] == whole.out.splitlines()[0] and "worse" in lines[0]
    assert len(lines) < 0.5 * len(whole.out.splitlines()) and any("slower by" in line for line in lines[1:])


def test_quiet_detect_counts_verdicts_and_contacts(gate_folder, feekf_signature):
    logs = sorted((gate_folder / "stiff").glob("*.csv"))
    arguments = ("detect", *logs, "-m", gate_folder / "machine.toml", "-s", feekf_signature)
    whole, quiet = both(*arguments)
    assert _HEADINGS.search(whole.out) and not _HEADINGS.search(quiet.out)
    count = len(logs)
    assert quiet.out.startswith(f"{count} operations: {count} alarm; {count} contacts: {count} detected")


@pytest.mark.parametrize(
    "arguments",
    [
        ("learn-signature", "FREE", "-m", "MACHINE", "-d", "gm", "-o", "OUT/gm.json"),
        ("identify", "FREE", "-m", "MACHINE"),
        ("signature", "check", "SIGNATURE", "FREE", "-m", "MACHINE"),
    ],
    ids=lambda arguments: " ".join(arguments[:2]),
)
def test_quiet_leaves_out_the_table_and_draws_no_bar(arguments, gate_folder, feekf_signature, tmp_path, monkeypatch):
    free = sorted((gate_folder / "free").glob("*.csv"))
    known = {"MACHINE": gate_folder / "machine.toml", "SIGNATURE": feekf_signature, "LOG": free[0]}
    given: list[object] = []
    for item in arguments:
        given += free if item == "FREE" else [known.get(item, item.replace("OUT", str(tmp_path)))]
    drawn: list[bool] = []

    def noted(what, *, pulses=False, quiet=False):
        from contextlib import nullcontext

        drawn.append(not quiet)
        return nullcontext()

    for name in list(sys.modules):
        if name.startswith("cdtool.commands.") and hasattr(sys.modules[name], "progress"):
            monkeypatch.setattr(f"{name}.progress", noted)
    done = cdtool(*given, "--quiet")
    assert done.status in (0, 1), done.err
    assert not any(drawn) and not _HEADINGS.search(done.out)


def report() -> Report:
    """Return a report without forces, whose figures need a complete profile."""
    evaluated, traces = case()
    provenance = {key: value for key, value in evaluated.results.provenance.items() if key != "force_profiles"}
    return Report(replace(evaluated, results=replace(evaluated.results, provenance=provenance, forces=())), traces)


def test_progress_counts_every_file_and_figure_up_to_the_last_one(tmp_path):
    seen: list[tuple[int, int]] = []
    targets = [tmp_path / "summary.md", tmp_path / "report"]
    write_outputs(report(), targets, progress=lambda done, total: seen.append((done, total)))
    total = seen[-1][1]
    assert seen == [(done, total) for done in range(1, total + 1)]
    in_folder = {path.name for path in (tmp_path / "report").iterdir() if path.suffix not in (".png", ".gz")}
    assert total == 1 + len(FOLDER_FIGURES) + len(in_folder)


def test_quiet_prints_the_verdict_and_what_is_not_met_only(tmp_path, capsys):
    evaluated, _ = case()
    show_results(evaluated, [tmp_path / "report.html"], quiet=True)
    quiet = capsys.readouterr().out
    assert " ".join(quiet.split()).startswith(evaluated.results.conclusion.headline) and "limit violated" in quiet
    show_results(evaluated, [tmp_path / "report.html"], quiet=False, more=["store: 1 recording computed"])
    whole = capsys.readouterr().out
    assert whole.startswith(quiet)
    assert all(part in whole and part not in quiet for part in ("written: ", "store: 1", "latency from contact onset"))
