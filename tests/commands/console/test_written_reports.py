"""The end of a command that scores: progress until the last figure is written, and what --quiet leaves out."""

from __future__ import annotations

from dataclasses import replace

from cdtool.commands.console.written_reports import show_results, write_reports
from cdtool.report.outputs import write_outputs
from cdtool.report.plots.folder_figures import FOLDER_FIGURES
from cdtool.report.writers.base import Report
from tests.commands.console.test_pulsing_bar import terminal
from tests.report.html.html_case import case


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


def test_a_bar_is_drawn_while_reports_are_written_unless_quiet(tmp_path, monkeypatch):
    stderr = terminal(monkeypatch)
    write_reports(report(), [tmp_path / "quiet"], force=False, quiet=True)
    assert stderr.text == ""
    write_reports(report(), [tmp_path / "report"], force=False, quiet=False)
    assert "writing reports" in stderr.text


def test_quiet_prints_the_verdict_and_what_is_not_met_only(tmp_path, capsys):
    evaluated, _ = case()
    show_results(evaluated, [tmp_path / "report.html"], quiet=True)
    quiet = capsys.readouterr().out
    assert " ".join(quiet.split()).startswith(evaluated.results.conclusion.headline) and "limit violated" in quiet
    show_results(evaluated, [tmp_path / "report.html"], quiet=False, more=["store: 1 recording computed"])
    whole = capsys.readouterr().out
    assert whole.startswith(quiet)
    assert all(part in whole and part not in quiet for part in ("written: ", "store: 1", "latency from contact onset"))
