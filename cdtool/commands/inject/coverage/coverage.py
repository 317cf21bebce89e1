"""The map of injected contacts: where a machine notices a contact, over position and stiffness."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from cdtool.base.errors import ConfigurationError
from cdtool.commands.inject.coverage.coverage_map import (
    CellKey,
    CoverageMap,
    MappedContact,
    coverage_map,
    speed_classes,
)
from cdtool.commands.inject.inject_section import INJECTED, InjectSection
from cdtool.commands.inject.injected_logs import InjectedCase
from cdtool.commands.inject.with_injected import injected_logs, section_of, with_groups
from cdtool.commands.judging.runs import shown_path
from cdtool.commands.scoring.benchmark import benchmark
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.execution.workers import Workers
from cdtool.machines.dynamics import has_links
from cdtool.results.results import RecordingFinding, Skipped
from cdtool.results.traces.choice import MOST_SAMPLED, MOST_SLOW
from cdtool.results.traces.trace import Trace

# The most trigger plots; more make no page that a browser opens quickly.
_MOST_TRACES = 200
# A benchmark of so few logs keeps the trace of each: half of them are sampled, the others are among the slowest.
_ALL_TRACES_KEPT = min(2 * MOST_SAMPLED, MOST_SAMPLED + MOST_SLOW)


@dataclass(frozen=True, repr=False)
class Coverage:
    """The map of a machine with its name, what was left out, and the files read.

    `traces`: if asked for, the trigger plots by recording, those of the cells that matter most first.
    """

    machine: str
    map: CoverageMap
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]
    traces: Mapping[str, Trace] = field(default_factory=dict)
    inputs: tuple[Path, ...] = ()

    def __repr__(self) -> str:
        return f"Coverage({self.machine}, {len(self.skipped)} left out)"


def coverage(
    file: str | Path,
    *,
    settings: Mapping[str, Any] | None = None,
    with_traces: bool = False,
    workers: Workers | None = None,
) -> Coverage:
    """Score the injected contacts of a benchmark file, and return latency and force over position and stiffness.

    Parameters
    ----------
    file : str or Path
        A benchmark file with a section [inject].
    settings : mapping, optional
        Values in place of keys of the file, as {"inject.seed": 1, "detectors": ["gm"]}.
    with_traces : bool, optional
        Also return the trigger plot of the worst contact of each cell: missed, otherwise the slowest. At most 200.
    workers : Workers, optional
        How the work is done; in this process by default.

    Returns
    -------
    Coverage
        A cell per detector, position and stiffness, and per class of speed if the logs have clearly different speeds;
        and what was left out.

    Raises
    ------
    ConfigurationError
        The file is wrong, has no section [inject], or its positions have different units.
    RecordingError
        No contact can be made.
    SignatureError
        Nothing can be learned.

    Examples
    --------
    >>> import cdtool
    >>> done = cdtool.coverage("sample_logs/gate/inject.toml", settings={"detectors": ["gm"]})
    >>> done.map.positions, sorted(done.map.cells)
    ((0.99, 1.04), ['momentum'])
    """
    setup = read_benchmark_file(file, settings=settings, command="inject")
    workers = (workers or Workers()).limited_by(setup.execution)
    section = section_of(setup)
    units = {mark.unit for mark in section.positions}
    if len(units) > 1:
        raise ConfigurationError(
            f"{setup.path}: [inject] positions are in {' and '.join(sorted(units))}", "use one unit"
        )
    _require_different_stiffness(setup.path, section)
    injected = injected_logs(setup, section, workers)
    scored = with_groups(setup, section, injected)
    impacts = {name: group for name, group in scored.impacts.items() if name.startswith(f"{INJECTED}_")}
    scored = replace(scored, impacts=impacts, limits=())
    done = benchmark(scored, workers=workers)
    names = {shown_path(injected.folder / case.file, setup.path.parent): case for case in injected.cases}
    machine = setup.machine_file.machine
    speed_unit = "m/s" if has_links(machine) else machine.speed_unit
    made = coverage_map(
        done.results.contacts, _mapped(names), scored.detectors, (units.pop(), speed_unit), setup.limits
    )
    traces: Mapping[str, Trace] = {}
    if with_traces:
        paths = {name: injected.folder / case.file for name, case in names.items()}
        traces = _traces_of_worst(made, _by_recording(done.traces), scored, paths, workers)
    skipped, findings = tuple(done.results.skipped), tuple(done.results.findings)
    return Coverage(machine.name, made, skipped, findings, traces, (*setup.inputs, *section.logs))


def _mapped(cases: Mapping[str, InjectedCase]) -> dict[str, MappedContact]:
    """Return the cell of each injected recording by its name."""
    speeds: dict[str, list[float]] = {}
    for case in cases.values():
        speeds.setdefault(case.log, []).append(case.speed)
    classes = speed_classes(speeds)
    return {
        name: MappedContact(
            CellKey(round(case.position_value, 9), float(f"{case.stiffness:.3g}"), classes[case.log]),
            case.assumption,
            case.reliable_until,
            case.speed,
        )
        for name, case in cases.items()
    }


def _by_recording(traces: Iterable[Trace]) -> dict[str, Trace]:
    """Return the traces with a contact by the recording."""
    return {trace.log: replace(trace, chosen="") for trace in traces if trace.contact >= 0}


def _traces_of_worst(
    made: CoverageMap, known: dict[str, Trace], scored: BenchmarkFile, paths: Mapping[str, Path], workers: Workers
) -> dict[str, Trace]:
    """Return the trace of the worst contact of each cell, missed ones and the most telling cells first.

    A benchmark keeps a choice of traces: those that are absent from `known` are made by scoring their logs again.
    """
    cells = [cell for _, _, cell in made.missed()]
    cells += [item.cell for item in made.most_telling(_MOST_TRACES)]
    cells += [cell for of_detector in made.cells.values() for cell in of_detector.values()]
    wanted = list(dict.fromkeys(cell.recordings[0].recording for cell in cells if cell.assessable))[:_MOST_TRACES]
    absent = [name for name in wanted if name not in known]
    for start in range(0, len(absent), _ALL_TRACES_KEPT):
        logs = {paths[name] for name in absent[start : start + _ALL_TRACES_KEPT]}
        groups = {
            name: replace(group, logs=tuple(path for path in group.logs if path in logs))
            for name, group in scored.impacts.items()
        }
        impacts = {name: group for name, group in groups.items() if group.logs}
        again = benchmark(replace(scored, impacts=impacts), workers=workers)
        known = known | _by_recording(again.traces)
    return {name: known[name] for name in wanted if name in known}


def _require_different_stiffness(path: Path, section: InjectSection) -> None:
    """Raise ConfigurationError for two obstacles in one cell of the map."""
    names: dict[float, str] = {}
    for item in section.obstacles:
        stiffness = float(f"{item.stiffness:.3g}")
        if stiffness in names:
            raise ConfigurationError(
                f"{path}: obstacles {names[stiffness]} and {item.name} both begin with {stiffness / 1e3:g} N/mm",
                "map one of them at a time: a cell is a position and a stiffness",
            )
        names[stiffness] = item.name
