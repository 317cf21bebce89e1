"""`cdtool inject`: a folder of recordings with injected contacts, with everything that a benchmark of it needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cdtool.base.files.bounded_loading import read_toml
from cdtool.base.files.writing import replaced_folder
from cdtool.base.log_names import log_stem
from cdtool.base.remote.remote_path import location
from cdtool.base.version import __version__
from cdtool.commands.inject.inject_section import InjectSection
from cdtool.commands.inject.injected_logs import CONTACTS, InjectedLogs, write_injected, write_recording
from cdtool.commands.inject.with_injected import mark_as_made, section_of
from cdtool.commands.judging.settings_table import apply_settings
from cdtool.commands.scoring.benchmark_file import HOLDOUT, BenchmarkFile, read_benchmark_file
from cdtool.execution.workers import Workers
from cdtool.formats.channels.channel_assembly import file_digest
from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.written_files import require_free_folder
from cdtool.recordings.log_section import LogSection
from cdtool.results.results import Skipped

# Tables of the benchmark file that name logs of its own.
_OF_LOGS = ("inject", "impacts", "conditions", "learn", "holdout", "limits", "campaigns", "points", "onset", "machine")
# Keys of [learn] beside its logs and the parts of them.
_OF_LEARNING = ("until", "guard_s")


@dataclass(frozen=True, repr=False)
class Injected:
    """The folder that was written, its cases, and what was left out."""

    folder: str
    logs: InjectedLogs
    copied: int

    def __repr__(self) -> str:
        return f"Injected({self.folder!r}, {self.copied} copied)"

    @property
    def skipped(self) -> tuple[Skipped, ...]:
        """Return the logs and contacts that were left out, with the reason."""
        return self.logs.skipped


def inject(
    file: str | Path,
    output: str | Path,
    *,
    settings: Mapping[str, Any] | None = None,
    workers: Workers | None = None,
) -> Injected:
    """Put the contacts of a benchmark file's section [inject] into its impact-free logs, and write them as logs.

    Parameters
    ----------
    file : str or Path
        The benchmark file.
    output : str or Path
        A new or empty folder: a group of recordings per obstacle, contacts.csv with the exact contacts, injected.json
        with the origin of each, copies of the logs to learn from, and machine.toml and benchmark.toml for all of them.
    settings : mapping, optional
        Values in place of keys of the file, as {"inject.format": "mcap", "detectors": ["gm"]}.
    workers : Workers, optional
        How the work is done; in this process by default.

    Returns
    -------
    Injected
        The recordings with their contacts, and what was left out.

    Raises
    ------
    ConfigurationError
        The benchmark file has no section [inject], or the model of the machine is incomplete.
    RecordingError
        No contact can be made.
    UsageError
        The folder is not empty.

    Examples
    --------
    >>> import cdtool
    >>> done = cdtool.inject("sample_logs/gate/inject.toml", "injected")
    >>> len(done.logs.cases), done.logs.cases[0].group
    (32, 'injected_stiff')
    """
    setup = read_benchmark_file(file, settings=settings, command="inject")
    workers = (workers or Workers()).limited_by(setup.execution)
    section = section_of(setup)
    folder = location(output)
    require_free_folder(folder)
    with replaced_folder(folder) as part:
        injected = write_injected(section, setup.machine_file, setup.onset, part, setup.path.parent, workers)
        copied = _copy_learned(setup, section, part)
        _write_benchmark(setup, injected, copied, part)
        mark_as_made(part, setup, section)
    return Injected(str(folder), replace(injected, folder=folder), sum(map(len, copied.values())))


def _copy_learned(setup: BenchmarkFile, section: InjectSection, folder: Path) -> dict[str, list[Any]]:
    """Write the logs to learn from and the hold-out with the same channels, so that one machine file reads all."""
    groups = {"learn": setup.learn}
    if HOLDOUT in setup.impacts:
        groups[HOLDOUT] = setup.impacts[HOLDOUT].logs
    copied: dict[str, list[Any]] = {}
    for group, logs in groups.items():
        for number, log in enumerate(logs, 1):
            recording = read_as_logged(log, setup.machine_file, unread="loss").recording
            name = f"{group}/{number:03d}_{log_stem(log)}.{section.file_format}"
            provenance = {
                "source": log.name,
                "sha256": file_digest(log),
                "version": __version__,
                "origin_s": repr(recording.origin),
            }
            write_recording(folder / name, recording, provenance, setup.machine_file)
            used = (setup.learned_sections if group == "learn" else setup.sections).get(log)
            copied.setdefault(group, []).append(_entry(name, used))
    return copied


def _entry(name: str, used: LogSection | None) -> str | dict[str, str]:
    """Return a log of a benchmark file: its path, with the part of it that is used."""
    if not used:
        return name
    marks = {"from": used.begin, "to": used.end}
    return {"path": name, **{key: f"{mark.value!r}{mark.unit}" for key, mark in marks.items() if mark is not None}}


def _write_benchmark(
    setup: BenchmarkFile, injected: InjectedLogs, copied: Mapping[str, list[Any]], folder: Path
) -> None:
    import tomlkit

    given = apply_settings(read_toml(setup.path, "a benchmark file"), setup.settings)
    values: dict[str, Any] = {"machine": "machine.toml"}
    values |= {key: value for key, value in given.items() if key not in _OF_LOGS}
    values.setdefault("detectors", list(setup.detectors))
    kept = {key: value for key, value in given.get("learn", {}).items() if key in _OF_LEARNING}
    values |= {group: {**(kept if group == "learn" else {}), "logs": logs} for group, logs in copied.items()}
    groups: dict[str, list[str]] = {}
    for case in injected.cases:
        groups.setdefault(case.group, []).append(case.file)
    values["impacts"] = {group: {"logs": logs} for group, logs in groups.items()}
    onset = {key: value for key, value in given.get("onset", {}).items() if not key.startswith("labels")}
    values["onset"] = {**onset, "labels": CONTACTS}
    text = "# Made by cdtool inject: every contact in [impacts] is simulated and was added to an impact-free log.\n"
    (folder / "benchmark.toml").write_text(text + tomlkit.dumps(values), encoding="utf-8", newline="\n")
