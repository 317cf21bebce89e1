"""`cdtool coverage`: where a machine notices a contact, from injected contacts over position and stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cdtool.errors import ConfigurationError
from cdtool.evaluation.coverage_map import CellKey, CoverageMap, MappedContact, coverage_map
from cdtool.evaluation.results import RecordingFinding, Skipped
from cdtool.workflows.benchmark.benchmark import benchmark
from cdtool.workflows.benchmark.benchmark_file import read_benchmark_file, with_detectors
from cdtool.workflows.benchmark.with_injected import injected_logs, with_groups
from cdtool.workflows.execution.workers import Progress, Workers
from cdtool.workflows.injection.inject_section import INJECTED, InjectSection, require_section
from cdtool.workflows.runs import shown_path


@dataclass(frozen=True)
class Coverage:
    """The map of a machine with its name, and what was left out."""

    machine: str
    map: CoverageMap
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]


def coverage(
    file: str | Path,
    *,
    detectors: Sequence[str] = (),
    workers: Workers | None = None,
    progress: Progress | None = None,
) -> Coverage:
    """Score the injected contacts of a benchmark file, and return latency and force over position and stiffness.

    Parameters
    ----------
    file : str or Path
        A benchmark file with a section [inject].
    detectors : sequence of str, optional
        Detectors in place of the file's.
    workers : Workers, optional
        How the work is done; in this process by default.
    progress : callable, optional
        Called after each piece of work with the amount done and the total.

    Returns
    -------
    Coverage
        A cell per detector, position and stiffness, and what was left out.

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
    >>> done = cdtool.coverage("sample_logs/gate/inject.toml", detectors=["gm"])
    >>> done.map.positions, sorted(done.map.cells)
    ((0.9, 1.0), ['momentum'])
    """
    workers = workers or Workers()
    setup = read_benchmark_file(file)
    setup = with_detectors(setup, detectors) if detectors else setup
    section = require_section(setup.inject, setup.path)
    units = {mark.unit for mark in section.positions}
    if len(units) > 1:
        raise ConfigurationError(
            f"{setup.path}: [inject] positions are in {' and '.join(sorted(units))}", "use one unit"
        )
    _require_different_stiffness(setup.path, section)
    injected = injected_logs(setup, section, workers, progress)
    scored = with_groups(setup, section, injected)
    impacts = {name: group for name, group in scored.impacts.items() if name.startswith(f"{INJECTED}_")}
    done = benchmark(replace(scored, impacts=impacts, limits=()), workers=workers, progress=progress)
    contacts = {
        shown_path(injected.folder / case.file, setup.path.parent): MappedContact(
            CellKey(round(case.position_value, 9), float(f"{case.stiffness:.3g}")), case.assumption, case.reliable_until
        )
        for case in injected.cases
    }
    made = coverage_map(done.results.contacts, contacts, scored.detectors, units.pop())
    skipped = tuple(done.results.skipped)
    return Coverage(setup.machine_file.machine.name, made, skipped, tuple(done.results.findings))


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
