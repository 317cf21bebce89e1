"""`cdtool protocol init`: draft a protocol file, with what the benchmark file and its recordings show filled in."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from statistics import median
from typing import Any

from cdtool.base.errors import UsageError
from cdtool.base.files.writing import write_texts
from cdtool.base.plain_text import counted, digits
from cdtool.base.remote.remote_path import relative_name
from cdtool.base.toml_text import comment_lines, commented
from cdtool.commands.console.json_schema import refuse_other_schema, with_schema
from cdtool.commands.judging.matched_log import CutLog
from cdtool.commands.protocol.assessment.plan import (
    FILL_IN,
    FORCE,
    Instrument,
    MachineParticulars,
    MeasuringPoint,
    TestParticulars,
)
from cdtool.commands.protocol.assessment.speed import speed_before
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.commands.scoring.scoring import logs_to_score
from cdtool.results.results import Skipped
from cdtool.truth.force.limits import ForceProfile, read_force_limits
from cdtool.truth.missing_samples import cell_samples


@dataclass(frozen=True)
class DraftedProtocol:
    """The text of a drafted protocol file, and how many of its values are to be filled in."""

    path: Path
    text: str
    to_fill_in: int


@dataclass(frozen=True)
class _Point:
    """A point as the benchmark file shows it: its name and its recordings, by group or by name."""

    name: str
    key: str
    value: str
    logs: tuple[tuple[str, Path], ...]
    profile: ForceProfile | None


def draft_protocol(benchmark: str | Path | None, output: Path, *, force: bool = False) -> DraftedProtocol:
    """Draft a protocol file from a benchmark file; what is not known is marked FILL IN.

    Parameters
    ----------
    benchmark : str, Path or None
        The benchmark file: its test points, or else its groups of impacts, become measuring points. None: an empty
        plan with one point, before anything was recorded.
    output : Path
        The file to write.
    force : bool, optional
        Replace an existing file.

    Returns
    -------
    DraftedProtocol
        The file's text. Speed and sample rate are measured in the recordings and marked CHECK.

    Raises
    ------
    UsageError
        The output exists, or is not a TOML file.
    ConfigurationError
        The benchmark file is wrong.

    Examples
    --------
    `cdtool protocol init sample_logs/gate/benchmark.toml -o protocol.toml` writes a file.
    """
    if output.suffix.lower() != ".toml":
        raise UsageError(f"--output is {output}", "give a name that ends in .toml")
    if output.exists() and not force:
        raise UsageError(f"{output}: already exists", "choose another name, or overwrite it with --force")
    refuse_other_schema("protocol", output, force=force)
    setup = read_benchmark_file(benchmark, learning=False, detectors=["all"]) if benchmark is not None else None
    points = _points(setup, output.parent) if setup else []
    read = {point.name: list(_read(setup, point.logs)) for point in points} if setup else {}
    name = relative_name(setup.path, output.parent) if setup else ""
    lines = [
        *comment_lines("Draft by cdtool protocol init: fill in what is marked FILL IN, check what is marked CHECK."),
        "[protocol]",
        f"benchmark = {_text(name)}"
        if name
        else 'benchmark = ""  # FILL IN: the benchmark file, relative to this file',
        'number = ""  # of the protocol',
        'language = "en"  # or "de"',
        *([] if any(point.profile for point in points) else _profiles_known()),
        *_table("[protocol.machine]", MachineParticulars, {}),
        *_table("[protocol.test]", TestParticulars, {}),
        *_table("[[protocol.instrument]]", Instrument, _instrument(read), Instrument(FORCE).not_its_own),
    ]
    for point in points:
        lines += _table("[[protocol.point]]", MeasuringPoint, _point(point, read[point.name]))
    if not points:
        empty = {"logs": ('["point_1/*.csv"]', "CHECK: the recordings, relative to this file")}
        lines += _table("[[protocol.point]]", MeasuringPoint, empty)
    lines += ["", "# [[protocol.deviation]]", '# text = ""', '# reason = ""']
    lines += ["", "# [[protocol.exclusion]]", '# logs = ["point_1/03.csv"]', '# reason = ""']
    written = with_schema("protocol", output, "\n".join(lines) + "\n")
    write_texts(written)
    return DraftedProtocol(output, written[output], sum(f"# {FILL_IN}:" in line for line in lines))


def _points(setup: BenchmarkFile, folder: Path) -> list[_Point]:
    """Return the test points of a benchmark file, or else its groups of impacts; logs are relative to a folder."""
    groups = {name: group for name, group in setup.impacts.items() if not (group.is_impact_free or group.condition)}
    if not setup.points:
        return [
            _Point(name, "group", _text(name), tuple((name, log) for log in group.logs), group.force)
            for name, group in groups.items()
        ]
    group_of = {log: name for name, group in groups.items() for log in group.logs}
    found: dict[str, list[Path]] = {}
    for log, name in setup.points.items():
        if log in group_of:
            found.setdefault(name, []).append(log)
    return [
        _Point(
            name,
            "logs",
            json.dumps([relative_name(log, folder) for log in logs], ensure_ascii=False),
            tuple((group_of[log], log) for log in logs),
            groups[group_of[logs[0]]].force,
        )
        for name, logs in found.items()
    ]


def _read(setup: BenchmarkFile, logs: Sequence[tuple[str, Path]]) -> Iterator[CutLog]:
    for group, log in logs:
        for read in logs_to_score(setup, group, log):
            if not isinstance(read, Skipped):
                yield read


def _instrument(read: Mapping[str, Sequence[CutLog]]) -> dict[str, tuple[str, str]]:
    """Return what the recordings show of the instrument that measured the force."""
    recordings = [item.recording for items in read.values() for item in items if "force" in item.recording]
    periods = [cell_samples(item["force"]).clock.period for item in recordings]
    rates = [1.0 / period for period in periods if period > 0.0]
    known = {"quantity": ('"force"', "")}
    if rates:
        known["sample_rate_hz"] = (digits(median(rates), 4), "CHECK: measured in the recordings")
    return known


def _point(point: _Point, read: Sequence[CutLog]) -> dict[str, tuple[str, str]]:
    contacts = sum(len(item.contacts) for item in read)
    least = point.profile.average_of if point.profile else 1
    known = {
        "name": (_text(point.name), ""),
        "repetitions": (str(max(contacts, least)), f"CHECK: {counted(contacts, 'contact')} recorded"),
        point.key: (point.value, "the recordings"),
    }
    known["profile"] = ('""', f"{FILL_IN}: name of the force profile, see docs/force-limits.md")
    if point.profile:
        known["profile"] = (_text(point.profile.name), "as in the benchmark file")
        if stiffness := point.profile.obstacle_stiffness_n_per_mm:
            known["obstacle_stiffness_n_per_mm"] = (digits(stiffness), "CHECK: as the profile requires")
    speeds = [speed_before(item.recording, contact) for item in read for contact in item.contacts]
    if speeds := [speed for speed in speeds if speed is not None and math.isfinite(speed)]:
        known["speed_m_per_s"] = (digits(round(median(speeds), 3)), "CHECK: measured before the contacts")
    return known


def _profiles_known() -> list[str]:
    names = list(read_force_limits())
    return [
        '# Force profiles that come with cdtool, or limits = "FILE" with your own:',
        *comment_lines(", ".join(names)),
    ]


def _table(
    heading: str, kind: type[Any], known: Mapping[str, tuple[str, str]], without: Sequence[str] = ()
) -> list[str]:
    """Return a table of the draft: known values, then what is to be filled in; the rest as comments."""
    lines = ["", heading]
    for item in fields(kind):
        meaning = item.metadata["meaning"]
        if item.name in known:
            value, comment = known[item.name]
            lines += commented(f"{item.name} = {value}", comment)
        elif item.name in without:
            continue
        elif item.metadata["due"] == "never":
            lines += commented(f"# {item.name} =", meaning)
        else:
            lines += commented(f'{item.name} = ""', f"{FILL_IN}: {meaning}")
    return lines


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)
