"""The groups of injected contacts of a benchmark: its section [inject] carried out, or found as it was carried out.

Which detectors an injected contact can test: those whose channels the model gives what they need.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar

from cdtool.base.errors import ConfigurationError, OutputError
from cdtool.base.files.writing import replaced_folder
from cdtool.base.remote.remote_path import joined
from cdtool.base.settings import Place, read
from cdtool.commands.inject.assumption import Assumption, ControllerReaction, assumptions_of
from cdtool.commands.inject.inject_section import INJECTED, InjectSection, InjectTable, NamedObstacle, inject_section
from cdtool.commands.inject.injected_logs import InjectedCase, InjectedLogs, model_of, read_injected, write_injected
from cdtool.commands.judging.named_logs import LogsOf
from cdtool.commands.judging.runs import shown_path
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, ImpactGroup
from cdtool.detectors import DETECTORS
from cdtool.execution.store.digest import code_version, digest_of
from cdtool.execution.workers import Workers
from cdtool.formats.channels.channel_assembly import file_digest
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.machines.axis_model.parameters import AxisModel


class Refusal(Enum):
    """Why the latency of a detector from injected contacts would be wrong, with what to add."""

    CONTROLLER = "its signal is the reaction of the controller: identify [model.controller]"
    ACCELEROMETER = "the accelerometer's bandwidth is not known: give [model.sensors] accelerometer_hz"
    DRIVE = (
        "the stiffness of the drive is not known: identify it from starts at rest, or state [model.drive] rigid = true"
    )


def refusal(needs: Sequence[str], model: AxisModel, reaction: ControllerReaction) -> Refusal | None:
    """Return why a detector with these `needs` (channels) is not tested; None if it is.

    Torque alone shows a contact only when the controller reacts. A rigid drive in the place of an elastic one reports
    a contact to the motor far too early (45 ms on the simulated gate), and only the acceleration is not affected.
    """
    if "acceleration" in needs and model.sensors.accelerometer_hz == 0.0:
        return Refusal.ACCELEROMETER
    senses_motion = any(channel in needs for channel in ("speed", "position", "acceleration"))
    if not senses_motion and reaction is not ControllerReaction.KNOWN:
        return Refusal.CONTROLLER
    if "acceleration" not in needs and model.drive.is_rigid and not model.drive.stated_rigid:
        return Refusal.DRIVE
    return None


_DIGEST = "digest.txt"


@dataclass(frozen=True)
class InjectedGroups:
    """The groups of [inject], a `MadeGroups` of a benchmark file."""

    section: InjectSection

    table: ClassVar[type[InjectTable]] = InjectTable

    @classmethod
    def read(
        cls, table: Mapping[str, Any], place: Place, found: LogsOf, operations: str, groups: Mapping[str, ImpactGroup]
    ) -> InjectedGroups | None:
        """Read [inject] with the mistakes in `place`; None if it cannot be used. Raises ConfigurationError."""
        if found.runs:
            hint = "write each run to its own log"
            raise place.fault("inject", f"cannot be used with operations = '{operations}'", hint)
        for name in groups:
            if name.startswith(f"{INJECTED}_"):
                place.note("impacts", f"{name} is the name of an injected group", "choose another name")
        real = tuple(name for name, group in groups.items() if not group.is_impact_free and not group.condition)
        given = read(InjectTable, table, place.below("inject"))
        return None if given is None else cls(inject_section(given, place.below("inject"), found, real))

    def names(self, machine_file: MachineFile) -> tuple[str, ...]:
        """Return the names of the groups: one per obstacle, and per assumption about the machine."""
        return tuple(self.section.groups(assumptions_of(model_of(self.section, machine_file))))

    def added(self, setup: BenchmarkFile, workers: Workers) -> BenchmarkFile:
        """Return the benchmark with a group per injected obstacle.

        The recordings are kept in the folder that [inject] names and used again as long as nothing they depend on has
        changed. Raises OutputError if that folder holds something else.
        """
        return with_groups(setup, self.section, injected_logs(setup, self.section, workers))

    def found(self, setup: BenchmarkFile) -> tuple[BenchmarkFile, int]:
        """Return the benchmark with the recordings that are there, or else how many contacts are not."""
        section = self.section
        made = made_before(setup, section)
        if made is None:
            return setup, len(section.logs) * len(section.positions) * len(section.obstacles)
        return with_groups(setup, section, made), 0


def section_of(setup: BenchmarkFile) -> InjectSection:
    """Return [inject] of a benchmark file; raises ConfigurationError if it has none."""
    if not isinstance(setup.made, InjectedGroups):
        raise ConfigurationError(f"{setup.path}: has no section [inject]", "see docs/injection.md for one")
    return setup.made.section


def injected_logs(setup: BenchmarkFile, section: InjectSection, workers: Workers) -> InjectedLogs:
    """Return the injected recordings of a section, from its folder if it has them already."""
    if (found := made_before(setup, section)) is not None:
        return found
    folder = joined(setup.path.parent, section.folder)
    if folder.exists() and not _may_replace(folder):
        other = "contacts that cdtool inject made with other settings" if (folder / _DIGEST).exists() else "other files"
        raise OutputError(f"{folder}: exists and holds {other}", "set another [inject] folder, or remove it")
    with replaced_folder(folder, _may_replace) as part:
        write_injected(section, setup.machine_file, setup.onset, part, setup.path.parent, workers)
        mark_as_made(part, setup, section)
    return read_injected(folder)


def mark_as_made(folder: Path, setup: BenchmarkFile, section: InjectSection) -> None:
    """Write what the recordings of a folder depend on, so that `cdtool benchmark` uses them until that changes."""
    (folder / _DIGEST).write_text(_digest(setup, section) + "\n", encoding="utf-8", newline="\n")


def made_before(setup: BenchmarkFile, section: InjectSection) -> InjectedLogs | None:
    """Return the injected recordings of a section if its folder has all of them, and nothing has changed since."""
    folder = joined(setup.path.parent, section.folder)
    mark = folder / _DIGEST
    if not (mark.is_file() and mark.read_bytes().decode().strip() == _digest(setup, section)):
        return None
    found = read_injected(folder)
    return found if all((folder / case.file).is_file() for case in found.cases) else None


def _digest(setup: BenchmarkFile, section: InjectSection) -> str:
    logs = {log: file_digest(log) for log in section.logs}
    return digest_of(code_version(), setup.machine_file.digest, section, setup.onset, logs)


def with_groups(setup: BenchmarkFile, section: InjectSection, injected: InjectedLogs) -> BenchmarkFile:
    """Return the benchmark with the groups of injected contacts before its hold-out."""
    model = model_of(section, setup.machine_file)
    machine_file = read_machine_file(injected.machine_path)
    labels = injected.labels(setup.path.parent)
    log_of = {shown_path(log, setup.path.parent): log for log in section.logs}
    groups = {}
    for name, (obstacle, assumption) in section.groups(assumptions_of(model)).items():
        cases = [case for case in injected.cases if case.group == name]
        made_from = {injected.folder / case.file: log_of[case.log] for case in cases}
        if made_from:
            refused = _refused(setup, section, assumption.controller)
            stated = _stated(obstacle, assumption, cases)
            groups[name] = ImpactGroup(
                tuple(made_from), setup.window, None, machine_file, labels, refused, stated, made_from
            )
    others = {name: group for name, group in setup.impacts.items() if group.is_impact_free or group.condition}
    real = {name: group for name, group in setup.impacts.items() if name not in others}
    return replace(setup, impacts={**real, **groups, **others}, made=None, not_made=injected.skipped)


def _refused(setup: BenchmarkFile, section: InjectSection, reaction: ControllerReaction) -> dict[str, str]:
    """Return the detectors that these contacts cannot test, with the reason."""
    model = model_of(section, setup.machine_file)
    found = {name: refusal(DETECTORS.load(name).needs, model, reaction) for name in setup.detectors}
    return {name: reason.value for name, reason in found.items() if reason is not None}


def _stated(obstacle: NamedObstacle, assumption: Assumption, cases: Sequence[InjectedCase]) -> dict[str, Any]:
    """Return how the contacts of a group were made, for provenance."""
    doubts = Counter(doubt for case in cases for doubt in case.doubts)
    return {
        "obstacle": obstacle.name,
        "stiffness_n_per_m": obstacle.stiffness,
        "controller": assumption.controller.value,
        "assumed": [item.value for item in assumption.deviations],
        "contacts": len(cases),
        "doubts": dict(sorted(doubts.items())),
        "compared_with": obstacle.compare_with or None,
    }


def _may_replace(folder: Path) -> bool:
    """Return whether a folder is empty or made by `cdtool benchmark`; one of `cdtool inject` belongs to the user."""
    is_made = (folder / _DIGEST).is_file() and not (folder / "benchmark.toml").exists()
    return folder.is_dir() and (is_made or not any(folder.iterdir()))
