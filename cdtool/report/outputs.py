"""Where a report goes: by the suffix of each target, or a folder with all of it."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cdtool.errors import CdtoolError, UsageError
from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.results_file import to_json
from cdtool.evaluation.traces.file import as_read, encode_traces, traces_path
from cdtool.evaluation.traces.trace import Trace
from cdtool.plain_text import plain
from cdtool.report.files import write_text, write_whole
from cdtool.report.plots.figures import SUFFIXES
from cdtool.workflows.written_file import refuse_other_kind

_LONGEST_NAME = 40


@dataclass(frozen=True)
class Report:
    """What a report shows: results with their statistics, and the traces that were kept."""

    evaluated: Evaluated
    traces: tuple[Trace, ...]


def _write_json(report: Report, target: Path) -> None:
    """results.json, and the traces beside it."""
    text = to_json(report.evaluated.results)
    write_text(target, text)
    write_whole(traces_path(target), lambda stream: stream.write(encode_traces(report.traces, text)))


def _write_markdown(report: Report, target: Path) -> None:
    from cdtool.report.markdown.markdown import to_markdown

    write_text(target, to_markdown(report.evaluated))


def _write_csv(report: Report, target: Path) -> None:
    from cdtool.report.contacts_csv import contacts_csv

    write_text(target, contacts_csv(report.evaluated.results))


def _write_junit(report: Report, target: Path) -> None:
    from cdtool.report.junit import to_junit

    write_text(target, to_junit(report.evaluated))


def _write_html(report: Report, target: Path) -> None:
    from cdtool.report.html.page import to_html

    write_text(target, to_html(report.evaluated, report.traces))


def _write_latencies(report: Report, target: Path) -> None:
    from cdtool.report.plots.latency_plot import plot_latencies

    plot_latencies(report.evaluated, target)


_WRITERS: dict[str, Callable[[Report, Path], None]] = {
    ".json": _write_json,
    ".html": _write_html,
    ".md": _write_markdown,
    ".xml": _write_junit,
    ".csv": _write_csv,
    **dict.fromkeys(SUFFIXES, _write_latencies),
}
# What the first lines of each hold; figures have no such mark, and no input is one.
_MARKS: dict[str, tuple[bytes, str]] = {
    ".json": (b'"tool": "cdtool"', "results of cdtool benchmark"),
    ".html": (b"<title>Collision detection", "HTML report of cdtool"),
    ".md": (b"# Collision detection: ", "Markdown report of cdtool"),
    ".xml": (b'<testsuites name="cdtool"', "JUnit report of cdtool"),
    ".csv": (b"recording,group,", "table of cdtool"),
}
_IN_FOLDER = ("results.json", "contacts.csv", "forces.csv", "junit.xml", "report.html", "report.md")


def check_outputs(targets: Sequence[Path]) -> None:
    """Raise UsageError where a target cannot be written: unknown suffix, no such folder, no permission.

    A report may be written anew, and nothing but a report is ever replaced: no recording, no file of another program.
    """
    for path in (path for target in targets for path in _texts(target)):
        refuse_other_kind(path, *_MARKS[path.suffix.lower()])
    for target in targets:
        if target == Path():
            raise UsageError("--output names no file or folder", "give a name, such as report or results.json")
        if target.is_dir():
            _check_writable(target, target)
            continue
        if target.suffix and target.suffix.lower() not in _WRITERS:
            known = ", ".join(_WRITERS)
            raise UsageError(f"--output is '{plain(target)}'", f"a folder, or a name that ends in {known}")
        if not target.suffix and target.exists():
            raise UsageError(f"--output '{plain(target)}' exists and is no folder", "choose another name")
        if not target.parent.is_dir():
            raise UsageError(f"--output is '{plain(target)}': no folder {plain(target.parent)}", "make it first")
        _check_writable(target, target.parent)


def write_outputs(report: Report, targets: Sequence[Path]) -> list[Path]:
    """Write every target; returns what to show: the files, and of a folder its report. Raises CdtoolError."""
    check_outputs(targets)
    if targets:
        report = replace(report, traces=as_read(report.traces))
    written = []
    for target in targets:
        if _is_folder(target):
            written.append(_write_folder(report, target))
        else:
            _WRITERS[target.suffix.lower()](report, target)
            written.append(target)
    return written


def slug(name: str, taken: set[str]) -> str:
    """A file name's part for a group or detector: letters, digits, hyphens; unlike any in `taken`, and added to it."""
    letters = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    base = re.sub(r"[^a-z0-9]+", "-", letters.lower())[:_LONGEST_NAME].strip("-") or "unnamed"
    found, number = base, 1
    while found in taken:
        number += 1
        found = f"{base}-{number}"
    taken.add(found)
    return found


def _write_folder(report: Report, folder: Path) -> Path:
    """Everything: data, figures, and the report as HTML and as Markdown that links the figures."""
    from cdtool.report.forces_csv import forces_csv
    from cdtool.report.markdown.markdown import to_markdown
    from cdtool.report.plots.folder_figures import write_figures

    try:
        folder.mkdir(exist_ok=True)
    except OSError as fault:
        raise CdtoolError(f"{plain(folder)} cannot be made: {fault.strerror}", "choose another --output") from fault
    for name in (item for item in _IN_FOLDER if item not in ("forces.csv", "report.md")):
        _WRITERS[Path(name).suffix](report, folder / name)
    if report.evaluated.results.forces:
        write_text(folder / "forces.csv", forces_csv(report.evaluated.results))
    images = write_figures(report, folder)
    write_text(folder / "report.md", to_markdown(report.evaluated, images))
    return folder / "report.html"


def _texts(target: Path) -> list[Path]:
    """The files with a mark that a target stands for."""
    return [
        path
        for path in ([target / name for name in _IN_FOLDER] if target.is_dir() else [target])
        if path.suffix.lower() in _MARKS
    ]


def _is_folder(target: Path) -> bool:
    return target.is_dir() or not target.suffix


def _check_writable(target: Path, folder: Path) -> None:
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UsageError(f"--output is '{plain(target)}': {plain(folder)} may not be written to", "choose another")
