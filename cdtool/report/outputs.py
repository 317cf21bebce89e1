"""Where a report goes: by the suffix of each target, or a folder with all of it."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cdtool.errors import UsageError
from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.results_file import to_json
from cdtool.evaluation.traces.file import as_read, encode_traces, traces_path
from cdtool.evaluation.traces.trace import Trace
from cdtool.file_locks import is_temporary
from cdtool.files import replaced, replaced_folder, resolved, write_text
from cdtool.foreign_files import FIGURES, Kind, refuse_inputs, refuse_other_kind
from cdtool.plain_text import plain
from cdtool.report.plots.figures import SUFFIXES

_LONGEST_NAME = 40


@dataclass(frozen=True)
class Report:
    """What a report shows: results with their statistics, and the traces that were kept."""

    evaluated: Evaluated
    traces: tuple[Trace, ...]


def _write_json(report: Report, target: Path) -> None:
    """results.json, and the traces beside it: both or neither."""
    text = to_json(report.evaluated.results)
    if target.exists() and not target.is_file():
        write_text(target, text)  # a device or pipe has nothing beside it
        return
    with replaced(target, traces_path(target)) as (results, traces):
        results.write_bytes(text.encode("utf-8", "replace"))
        traces.write_bytes(encode_traces(report.traces, text))


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
_KINDS: dict[str, Kind] = {
    ".json": Kind(b'"tool": "cdtool"', "results of cdtool benchmark"),
    ".html": Kind(b"<title>Collision detection", "HTML report of cdtool"),
    ".md": Kind(b"# Collision detection: ", "Markdown report of cdtool"),
    ".xml": Kind(b'<testsuites name="cdtool"', "JUnit report of cdtool"),
    ".csv": Kind(b"recording,group,", "table of cdtool"),
    ".gz": Kind(b'"results_sha256":', "traces of cdtool benchmark"),
    **FIGURES,
}
_IN_FOLDER = ("results.json", "contacts.csv", "forces.csv", "junit.xml", "report.html", "report.md")
_ALSO_IN_FOLDER = re.compile(
    r"results\.traces\.json\.gz|(latency|survival|amoc|forces|(forces|triggers)_[a-z0-9-]+)\.png"
)


def check_outputs(targets: Sequence[Path], *, force: bool = False) -> None:
    """Raise UsageError where a target cannot be written: unknown suffix, no such folder, no permission, a dead link.

    A report may be rewritten. What cdtool did not write is replaced with `force` only: a recording, a file of
    another program, a folder that holds anything but a report.
    """
    for target in targets:
        resolved(target)
        if target == Path():
            raise UsageError("--output names no file or folder", "give a name, such as report or results.json")
        if target.is_dir():
            _check_writable(target, target)
            _whole_report(target, force=force)
            continue
        if target.suffix and target.suffix.lower() not in _WRITERS:
            known = ", ".join(_WRITERS)
            raise UsageError(f"--output is '{plain(target)}'", f"a folder, or a name that ends in {known}")
        if not target.suffix and target.exists():
            raise UsageError(f"--output '{plain(target)}' exists and is not a folder", "choose another name")
        if not target.parent.is_dir():
            raise UsageError(f"--output is '{plain(target)}': no folder {plain(target.parent)}", "make it first")
        _check_writable(target, target.parent)
        for path in (target, traces_path(target)) if target.suffix.lower() == ".json" else (target,):
            if path.suffix:
                refuse_other_kind(path, _KINDS[path.suffix.lower()], force=force)


def write_outputs(
    report: Report, targets: Sequence[Path], *, force: bool = False, inputs: Sequence[Path] = ()
) -> list[Path]:
    """Write every target; returns what to show: the files, and of a folder its report. Raises CdtoolError.

    `inputs` were read and are never written to, `force` or not.
    """
    folders = [target for target in targets if target.is_dir()]
    refuse_inputs([*targets, *(folder / name for folder in folders for name in _IN_FOLDER)], inputs)
    check_outputs(targets, force=force)
    if targets:
        report = replace(report, traces=as_read(report.traces))
    written = []
    for target in targets:
        if _is_folder(target):
            written.append(_write_folder(report, target, force=force))
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


def _write_folder(report: Report, target: Path, *, force: bool) -> Path:
    """Everything, swapped in as a whole: data, figures, the report as HTML and as Markdown that links the figures."""
    from cdtool.report.forces_csv import forces_csv
    from cdtool.report.markdown.markdown import to_markdown
    from cdtool.report.plots.folder_figures import write_figures

    with replaced_folder(target, lambda old: _whole_report(old, force=force)) as folder:
        for name in (item for item in _IN_FOLDER if item not in ("forces.csv", "report.md")):
            _WRITERS[Path(name).suffix](report, folder / name)
        if report.evaluated.results.forces:
            write_text(folder / "forces.csv", forces_csv(report.evaluated.results))
        images = write_figures(report, folder)
        write_text(folder / "report.md", to_markdown(report.evaluated, images))
    return target / "report.html"


def _whole_report(folder: Path, *, force: bool) -> bool:
    """Whether a folder holds nothing but reports, so that all of it may go; if not, UsageError unless `force`."""
    held = [path for path in sorted(folder.iterdir()) if not is_temporary(path.name)]
    known = [path for path in held if path.name in _IN_FOLDER or _ALSO_IN_FOLDER.fullmatch(path.name)]
    for path in known:
        refuse_other_kind(path, _KINDS[path.suffix], force=force)
    others = [path for path in held if path not in known or path.is_symlink() or not path.is_file()]
    if others and not force:
        raise UsageError(
            f"{plain(others[0])}: is not part of a cdtool report, and the folder would be replaced as a whole",
            "choose another folder, or keep what else is in it with --force",
        )
    return not others and all(_KINDS[path.suffix].is_kind_of(path) for path in known)


def _is_folder(target: Path) -> bool:
    return target.is_dir() or not target.suffix


def _check_writable(target: Path, folder: Path) -> None:
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UsageError(f"--output is '{plain(target)}': {plain(folder)} may not be written to", "choose another")
