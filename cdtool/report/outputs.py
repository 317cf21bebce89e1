"""Where reports are written: by the writer of each target's suffix, or all of them into a folder."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from cdtool.base.errors import CdtoolError, OutputError, UsageError
from cdtool.base.files.foreign import FIGURES, Kind, refuse_inputs, refuse_other_kind
from cdtool.base.files.locks import is_temporary
from cdtool.base.files.writing import replaced_folder, resolved
from cdtool.base.plain_text import plain
from cdtool.base.remote.remote_path import check_place, is_remote
from cdtool.base.value_words import fault_and_place
from cdtool.report.writers import WRITERS, known_suffixes, own_writers, writer_of
from cdtool.report.writers.base import Report, Subject, Writer

_FIGURES_IN_FOLDER = re.compile(r"(latency|survival|amoc|forces|(forces|triggers)_[a-z0-9-]+)\.png")


def check_outputs(targets: Sequence[Path], *, force: bool = False, subject: Subject = "benchmark") -> None:
    """Raise UsageError for a target that cannot be written: unknown suffix, missing folder, no permission, a dead link.

    A report may be rewritten. A file that cdtool did not write is replaced only with `force`: a recording, a file of
    another program, a folder that contains anything but a report.
    """
    for target in targets:
        resolved(target)
        if target == Path():
            raise UsageError("--output is empty", "give a name, such as report or results.json")
        if _is_folder(target, subject) and _has_folders(subject):
            _check_folder(target, force=force)
            continue
        writer = _writer_of(target, subject)
        _check_parent(target)
        writer.check(target)
        if not writer.writes_folder:
            for path in writer.files(target):
                refuse_other_kind(path, writer.kinds[path.suffix.lower()], force=force)


def check_output_names(targets: Sequence[Path], suffixes: Sequence[str]) -> None:
    """Raise UsageError for a name with another suffix, a name given twice, or one in a folder that does not exist."""
    for target in targets:
        if target.suffix.lower() not in suffixes:
            *others, last = suffixes
            raise UsageError(f"--output is '{plain(target)}'", f"the name must end in {', '.join(others)} or {last}")
        if targets.count(target) > 1:
            raise UsageError(f"--output is '{plain(target)}' twice", "give each name once")
        resolved(target)
        _check_parent(target)


def write_outputs(
    report: Any,
    targets: Sequence[Path],
    *,
    force: bool = False,
    inputs: Sequence[Path] = (),
    subject: Subject = "benchmark",
    progress: Callable[[int, int], None] | None = None,
) -> list[Path]:
    """Write every target and return what to show: the files, and of a folder its report. Raises CdtoolError.

    `report` is what the writers of the subject write. `inputs` were read and are never overwritten, `force` or not.
    `progress` is called with the number of files and kinds of figures written, and of all of them.
    """
    folders = [target for target in targets if target.is_dir()]
    in_folder = [writer.in_folder for writer in own_writers(subject) if writer.in_folder]
    refuse_inputs([*targets, *(folder / name for folder in folders for name in in_folder)], inputs)
    check_outputs(targets, force=force, subject=subject)
    written = []
    step = _steps(progress, sum(_folder_steps(report) if _is_folder(target, subject) else 1 for target in targets))
    for target in targets:
        if _is_folder(target, subject):
            written.append(_write_folder(report, target, force=force, step=step))
        else:
            _write_file(_writer_of(target, subject), report, target)
            written.append(target)
            step()
    return written


def _steps(progress: Callable[[int, int], None] | None, total: int) -> Callable[[], None]:
    """Return a function that reports one more of `total` steps at each call."""
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, total)

    return step


def _folder_steps(report: Report) -> int:
    """Return how many kinds of figures and files are written into a folder."""
    from cdtool.report.plots.folder_figures import FOLDER_FIGURES

    return len(FOLDER_FIGURES) + len(_writers_in_folder(report))


def _writers_in_folder(report: Report) -> list[Writer[Any]]:
    return [writer for writer in own_writers("benchmark") if writer.in_folder and writer.has_content(report)]


def _write_file(writer: Writer[Any], report: Any, target: Path) -> None:
    """Write one file; an error in a plug-in becomes one line."""
    try:
        writer.write(report, target)
    except (CdtoolError, OSError, MemoryError):
        raise
    except Exception as fault:
        if writer.name in WRITERS.table:  # an error in cdtool itself
            raise
        raise OutputError(
            f"{plain(target)}: writer {writer.name} fails: {fault_and_place(fault)}",
            "an error in the writer: see docs/own-detector.md",
        ) from fault


def _writer_of(target: Path, subject: Subject) -> Writer[Any]:
    writer = writer_of(target, subject)
    if writer is None or (target.is_dir() and not writer.writes_folder):
        *others, last = known_suffixes(subject)
        known = f"{', '.join(others)} or {last}" if others else last
        folder = "a folder, or " if _has_folders(subject) else ""
        raise UsageError(f"--output is '{plain(target)}'", f"{folder}a name that ends in {known}")
    return writer


def _has_folders(subject: Subject) -> bool:
    return any(writer.in_folder for writer in own_writers(subject))


def _write_folder(report: Report, target: Path, *, force: bool, step: Callable[[], None]) -> Path:
    """Write all reports and figures, and replace the folder by them as a whole."""
    from cdtool.report.plots.folder_figures import write_figures

    with replaced_folder(target, lambda old: _whole_report(old, force=force)) as folder:
        report = replace(report, images=tuple(write_figures(report, folder, step)))
        for writer in _writers_in_folder(report):
            writer.write(report, folder / writer.in_folder)
            step()
    return target / "report.html"


def _whole_report(folder: Path, *, force: bool) -> bool:
    """Return whether a folder contains only reports, so that all of it may be replaced; else UsageError or `force`."""
    held = [path for path in sorted(folder.iterdir()) if not is_temporary(path.name)]
    kinds = {path: kind for path in held if (kind := _kind_in_folder(path.name))}
    for path, kind in kinds.items():
        refuse_other_kind(path, kind, force=force)
    others = [path for path in held if path not in kinds or path.is_symlink() or not path.is_file()]
    if others and not force:
        raise UsageError(
            f"{plain(others[0])}: is not part of a cdtool report, and the folder would be replaced as a whole",
            "choose another folder, or keep its other files with --force",
        )
    return not others and all(kind.is_kind_of(path) for path, kind in kinds.items())


def _kind_in_folder(name: str) -> Kind | None:
    """Return what marks a file of that name in a report folder; None for a name that no report has."""
    if _FIGURES_IN_FOLDER.fullmatch(name):
        return FIGURES[".png"]
    for writer in own_writers("benchmark"):
        if writer.in_folder and name in {path.name for path in writer.files(Path(writer.in_folder))}:
            return writer.kinds[Path(name).suffix]
    return None


def _is_folder(target: Path, subject: Subject) -> bool:
    """Return whether all reports are written into a folder of that name."""
    if not target.suffix:
        return True
    return target.is_dir() and not ((writer := writer_of(target, subject)) and writer.writes_folder)


def _check_folder(target: Path, *, force: bool) -> None:
    if target.is_dir():
        _check_writable(target, target)
        _whole_report(target, force=force)
        return
    if target.exists():
        raise UsageError(f"--output '{plain(target)}' exists and is not a folder", "choose another name")
    _check_parent(target)


def _check_parent(target: Path) -> None:
    if is_remote(target):
        check_place(target)
        return
    if not target.parent.is_dir():
        raise UsageError(f"--output is '{plain(target)}': no folder {plain(target.parent)}", "create the folder first")
    _check_writable(target, target.parent)


def _check_writable(target: Path, folder: Path) -> None:
    if not is_remote(folder) and not os.access(folder, os.W_OK | os.X_OK):
        raise UsageError(f"--output is '{plain(target)}': {plain(folder)} is not writable", "choose another")
