"""benchmark.toml: the logs to learn from and to score, and the detectors. Paths are relative to the file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Protocol

from cdtool.alarms.activation import Activation
from cdtool.base.errors import ConfigurationError, UsageError, nearest
from cdtool.base.files.bounded_loading import read_bytes, read_toml
from cdtool.base.plain_text import counted, digits
from cdtool.base.registry import Registry
from cdtool.base.remote.remote_path import joined, location
from cdtool.base.settings import Place, Positive, read, setting, tables_of
from cdtool.base.version import __version__
from cdtool.commands.judging.log_groups import Split
from cdtool.commands.judging.named_logs import (
    LogList,
    LogsOf,
    LogsTable,
    labels_of,
    named_file,
    named_logs,
    read_label_file,
)
from cdtool.commands.judging.part_to_learn_from import PartToLearnFrom
from cdtool.commands.judging.runs import RunReading, resolve_all, shown_path
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.commands.judging.settings_table import (
    ForceTable,
    JudgingTable,
    LearnPart,
    ReportTable,
    TriggersTable,
    apply_settings,
    full_keys,
    note_other_units,
)
from cdtool.detectors import DETECTORS
from cdtool.detectors.base import Detector
from cdtool.execution.workers import Execution, Workers
from cdtool.formats.channels.channel_map import ChannelMap, TimeSource
from cdtool.formats.channels.run_reading import split_run
from cdtool.formats.labels.labels import Labels
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.machines import MACHINES
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.motion.applicable import GRACE
from cdtool.recordings.operations import RunCut
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.results.limits import ALL, Bounds, LimitRule, limit_rules
from cdtool.results.results import ConditionResult, Skipped
from cdtool.results.summary import kind_group
from cdtool.thresholds.base import Threshold, is_per_run
from cdtool.thresholds.signature import Signature
from cdtool.truth.force.limits import ForceProfile, profile_of, read_force_limits
from cdtool.truth.onset_rule import OnsetRule

HOLDOUT = "holdout"


@dataclass(frozen=True)
class ImpactGroup:
    """One group of logs with impacts: an alarm belongs to a contact up to `window` [s] after its onset.

    A group of injected contacts has its own `machine_file`, exact `labels`, and detectors that it cannot test, each
    with the reason (`refused`). `injected` states how the contacts were made, for provenance; `made_from` has the
    impact-free log of each of its logs. A group that `is_impact_free` has no contacts: each alarm is a false one. A
    group of a changed `condition` of the machine is compared with its `counterpart`, the same of the unchanged one.
    """

    logs: tuple[Path, ...]
    window: float
    force: ForceProfile | None = None
    machine_file: MachineFile | None = None
    labels: Labels | None = None
    refused: Mapping[str, str] = field(default_factory=dict)
    injected: Mapping[str, Any] | None = None
    made_from: Mapping[Path, Path] = field(default_factory=dict)
    is_impact_free: bool = False
    condition: str = ""
    counterpart: str = ""


class MadeGroups(Protocol):
    """Groups of logs that a command makes for a benchmark, by a section of its own in the benchmark file."""

    @classmethod
    def read(
        cls, table: Mapping[str, Any], place: Place, found: LogsOf, operations: str, groups: Mapping[str, ImpactGroup]
    ) -> MadeGroups | None:
        """Read the section `table` of the file at `place`; `groups` are the others. Raises ConfigurationError."""
        ...

    def names(self, machine_file: MachineFile) -> tuple[str, ...]:
        """Return the names of the groups."""
        ...

    def added(self, setup: BenchmarkFile, workers: Workers) -> BenchmarkFile:
        """Return the benchmark with the groups, whose logs are made if they are not there; without `made`."""
        ...

    def found(self, setup: BenchmarkFile) -> tuple[BenchmarkFile, int]:
        """Return the benchmark with the groups if their logs are there, or else how many contacts are to be made."""
        ...


# The sections that a command of their own reads and carries out: groups of logs, documents, searches.
SECTIONS = Registry(
    "section",
    {
        "inject": "cdtool.commands.inject.with_injected:InjectedGroups",
        "protocol": "cdtool.commands.protocol.of_benchmark:ProtocolOfBenchmark",
        "tune": "cdtool.commands.tune.options:TuningOptions",
    },
)


_ALL_BUT_SCORE = ("benchmark", "tune", "inject", "detect", "explain")
_ALL_BUT_DETECT = ("benchmark", "score", "tune", "inject")
_OF_DETECTORS = ("joints", "threshold", "signature", "learn", "activation.debounce", "activation.hysteresis")
# Keys that only these commands read: --set refuses them in the others, whose file may have them.
_READ_BY: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(_OF_DETECTORS, _ALL_BUT_SCORE),
    "detectors": ("benchmark", "tune", "inject"),
    **dict.fromkeys(("limits", "campaigns", "points", "execution"), _ALL_BUT_DETECT),
    "false_alarm_budget": ("benchmark", "inject", "detect", "explain"),
    "inject": ("benchmark", "tune", "inject"),
    "triggers": ("score",),
    "report": ("benchmark", "score"),
    "tune": ("tune",),
    "protocol": (),
}


def readers_of(key: str) -> tuple[str, ...]:
    """Return the commands that read a key of a benchmark file, by its full name; empty for one read by none."""
    known = (name for name in _READ_BY if f"{key}.".startswith(f"{name}."))
    return _READ_BY.get(next(known, ""), (*_ALL_BUT_SCORE, "score"))


@dataclass(frozen=True, kw_only=True)
class LearnTable(LearnPart, LogsTable):
    """[learn]: the logs that limits are learned from."""


@dataclass(frozen=True, kw_only=True)
class ImpactsTable(LogsTable):
    """[impacts.NAME]: a group of logs with impacts; any name but holdout."""

    window_s: Annotated[Positive | None, setting("the window for this group; default: the file's", unit="s")] = None
    force_profile: Annotated[str | None, setting("the force limits for this group; default: force.profile")] = None


@dataclass(frozen=True, kw_only=True)
class ConditionTable:
    """[conditions.NAME]: logs of the machine under a changed condition."""

    holdout: Annotated[LogsTable | None, setting("impact-free logs")] = None
    impacts: Annotated[
        dict[str, LogsTable],
        setting("logs of impacts by a group of [impacts], whose window and force profile they have"),
    ] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class BenchmarkTable(JudgingTable):
    """A benchmark file as it is written: the logs to learn from and to score, and the detectors."""

    machine: Annotated[
        str, setting("the machine file", hint="give the path of the machine file, which has its own keys")
    ]
    detectors: Annotated[
        tuple[str, ...] | None,
        setting("full or short names, each once, or all; required unless the command names them", empty=True),
    ] = None
    learn: Annotated[LearnTable | None, setting("impact-free logs to learn from")] = None
    holdout: Annotated[
        LogsTable | None, setting("impact-free logs for false alarms, none of which is learned from")
    ] = None
    impacts: Annotated[
        dict[str, ImpactsTable],
        setting("groups of logs with impacts", hint="define groups of impact logs: [impacts.stiff] logs = [...]"),
    ] = field(default_factory=dict)
    conditions: Annotated[dict[str, ConditionTable], setting("changed conditions of the machine")] = field(
        default_factory=dict
    )
    campaigns: Annotated[dict[str, LogList], setting("test campaigns: intervals count each as one")] = field(
        default_factory=dict
    )
    points: Annotated[dict[str, LogList], setting("tests at one point of the machine: their forces are averaged")] = (
        field(default_factory=dict)
    )
    limits: Annotated[
        dict[str, Bounds],
        setting("what a pipeline checks: detector.group.metric", hint="give { max = 50 }, { min = 1 } or both"),
    ] = field(default_factory=dict)
    inject: Annotated[dict[str, Any] | None, setting("contacts that are put into impact-free logs")] = None
    protocol: Annotated[dict[str, Any] | None, setting("the test protocol of the benchmark")] = None
    tune: Annotated[dict[str, Any] | None, setting("what cdtool tune minimises and tries")] = None


@dataclass(frozen=True)
class BenchmarkFile:
    """A validated benchmark file with resolved globs.

    `impacts` are the scored groups: those of impacts, the hold-out, then those of changed conditions.

    `rule` is the threshold rule with its settings. `synchronisation` [s]: largest offset of the load cell's clock.
    `mass_before_cell` [kg]. `window` [s] and `section` apply to a log outside all groups; without a file, `detect` has
    only those, and `checks_channels`: of each log by the mechanics of the machine. `sections` are the parts of scored
    logs that are used, `learned_sections` those of the logs learned from, which end `guard` [s] before
    their first contact; None: they have no contact. `split`: which runs stay together where runs set a limit for
    others. `made`: the groups that a command makes before they are scored; `not_made`: their logs and contacts that
    were left out. `force_limits`: the file of the force profiles; None: the shipped ones. `settings`: what took the
    place of keys of the file. `tune`: the section [tune]; None: it has none.
    """

    path: Path
    machine_file: MachineFile
    detectors: tuple[str, ...]
    watched: tuple[str, ...]
    operations: str
    budget: Budget | None
    signature: Signature
    rule: Threshold
    activation: Activation
    onset: OnsetRule
    labels: Labels | None
    synchronisation: float
    mass_before_cell: float
    learn: tuple[Path, ...] = ()
    impacts: Mapping[str, ImpactGroup] = field(default_factory=dict)
    campaigns: Mapping[Path, str] = field(default_factory=dict)
    points: Mapping[Path, str] = field(default_factory=dict)
    limits: tuple[LimitRule, ...] = ()
    digest: str = ""
    window: float = 1.0
    section: LogSection = LogSection()
    checks_channels: bool = False
    sections: Mapping[Path, LogSection] = field(default_factory=dict)
    learned_sections: Mapping[Path, LogSection] = field(default_factory=dict)
    guard: float | None = None
    split: Split = Split.RECORDING
    made: MadeGroups | None = None
    not_made: tuple[Skipped, ...] = ()
    force_limits: Path | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    tune: Any = None
    triggers: TriggersTable = field(default_factory=TriggersTable)
    report: ReportTable = field(default_factory=ReportTable)
    execution: Execution = field(default_factory=Execution)

    def with_made(self, workers: Workers) -> BenchmarkFile:
        """Return the benchmark with the groups that a command makes for it; unchanged without one."""
        return self if self.made is None else self.made.added(self, workers)

    @property
    def limits_by_hand(self) -> tuple[float, ...]:
        """Return the limits of the signal that were set by hand; empty if they are learned."""
        return tuple(getattr(self.rule, "limits", ()))

    @property
    def identity(self) -> dict[str, Any]:
        """Return what identifies the benchmark, for provenance, and how its tables are written if it says so."""
        return {
            "tool": "cdtool",
            "tool_version": __version__,
            "benchmark_sha256": self.digest,
            **({"settings": dict(self.settings)} if self.settings else {}),
            **({"report": asdict(self.report)} if self.report != ReportTable() else {}),
            "machine": self.machine_file.machine.name,
            "machine_sha256": self.machine_file.digest,
            **({"simulated": True} if self.machine_file.simulated else {}),
        }

    @property
    def scoring(self) -> dict[str, Any]:
        """Return the settings that determine the results, for provenance; only results with equal settings compare."""
        reduction = self.machine_file.force_reduction
        return {
            "onset": self.onset.described if self.machine_file.maps("force") else "as labelled",
            **({"force": reduction} if reduction else {}),
            "separation_s": self.onset.separation,
            "window_s": {name: self.impacts[name].window for name in self.groups_of_impacts},
            "operations": self.operations,
            "watched_joints": ", ".join(self.watched) or None,
            "label_file": self.labels.source if self.labels else None,
            **({"not_contacts": list(self.labels.not_contacts)} if self.labels and self.labels.not_contacts else {}),
            "synchronisation_s": self.synchronisation,
            "mass_before_cell_kg": self.mass_before_cell,
            "force_profiles": {
                name: profile.described for name in self.groups_of_impacts if (profile := self.impacts[name].force)
            },
            "sections": self._in_words(self.sections),
        }

    @property
    def learned_parts(self) -> dict[str, Any]:
        """Return which parts of the logs are learned from, for provenance."""
        until = None if self.guard is None else f"{digits(self.guard)} s before the first contact of each log"
        others = [shown_path(path, self.path.parent) for path in self.both]
        return {
            "learned_until": until,
            "learned_sections": self._in_words(self.learned_sections),
            "scored_without_own_part": others,
            **({"split": self.split.value} if self.split is not Split.RECORDING else {}),
        }

    @property
    def grace(self) -> float:
        """Return how long a class of motion is monitored after its motion [s]: for the longest matching window."""
        return max(GRACE, *([group.window for group in self.impacts.values()] or [self.window]))

    @cached_property
    def both(self) -> tuple[Path, ...]:
        """Return the scored logs that are also learned from: each is scored with what the others gave."""
        if self.guard is None and not self.learned_sections:
            return ()
        logs = _scored(self.impacts)
        if self.has_runs:
            return tuple(log for log in logs if any(_may_share_a_run(log, other) for other in self.learn))
        learned = set(resolve_all(self.learn))
        return tuple(path for path, true in zip(logs, resolve_all(logs), strict=True) if true in learned)

    def _in_words(self, sections: Mapping[Path, LogSection]) -> dict[str, str]:
        return {shown_path(path, self.path.parent): str(section) for path, section in sections.items()}

    def run_reading(self, workers: Workers | None = None) -> RunReading:
        """Return how the logs to learn from are read."""
        rules = ScoringRules(self.onset, self.window, self.labels, self.synchronisation, self.mass_before_cell)
        part = PartToLearnFrom(rules, self.learned_sections, self.guard)
        needed = self.guard is not None or self.learned_sections or self.labels
        return RunReading(
            self.operations,
            onset=self.onset,
            base=self.path.parent,
            part=part if needed else None,
            scored=self.is_scored_too if self.both else None,
            workers=workers or Workers(),
        )

    def is_scored_too(self, learned: Path) -> bool:
        """Return whether a log or run that is learned from is also scored, by what is learned from the others."""
        if self.has_runs:
            return any(_may_share_a_run(learned, log) for log in self.both)
        return learned.resolve() in self._both_resolved

    @cached_property
    def _both_resolved(self) -> frozenset[Path]:
        return frozenset(resolve_all(self.both))

    def rules_of(self, group: str) -> ScoringRules:
        """Return the settings that determine the results of a log in that group, or in no group."""
        window = self.impacts[group].window if group in self.impacts else self.window
        if group in self.impacts and (exact := self.impacts[group].labels):
            return ScoringRules(self.onset, window, exact)
        return ScoringRules(self.onset, window, self.labels, self.synchronisation, self.mass_before_cell)

    def machine_file_of(self, group: str) -> MachineFile:
        """Return the machine file by which the logs of a group are read."""
        own = self.impacts[group].machine_file if group in self.impacts else None
        return own or self.machine_file

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Return every file that is read for the benchmark; none of them may be overwritten."""
        logs = (*self.learn, *(path for group in self.impacts.values() for path in group.logs))
        labels = (location(self.labels.source),) if self.labels else ()
        limits = (self.force_limits,) if self.force_limits else ()
        files = tuple(dict.fromkeys(split_run(log)[0] if self.has_runs else log for log in logs))
        beside = (path for log in files for path in self.machine_file.files_beside(log))
        return (self.path, self.machine_file.path, *files, *labels, *beside, *limits)

    @property
    def has_runs(self) -> bool:
        """Whether each log is cut into runs."""
        return RunCut.of(self.operations) is not None

    @property
    def groups(self) -> tuple[str, ...]:
        """Return the impact groups, then the hold-out, without those of changed conditions."""
        return tuple(name for name, group in self.impacts.items() if not group.condition)

    @property
    def groups_of_impacts(self) -> tuple[str, ...]:
        """Return the groups of impacts of the unchanged machine."""
        return tuple(name for name in self.groups if not self.impacts[name].is_impact_free)

    @property
    def conditions(self) -> tuple[ConditionResult, ...]:
        """Return the groups of changed conditions."""
        return tuple(
            ConditionResult(name, group.condition, group.counterpart, group.is_impact_free)
            for name, group in self.impacts.items()
            if group.condition
        )

    def is_impact_free(self, group: str) -> bool:
        """Return whether the logs of a group are free of impacts; of a log in no group it is not known."""
        return group in self.impacts and self.impacts[group].is_impact_free

    def is_condition(self, group: str) -> bool:
        """Return whether the logs of a group are of a changed condition."""
        return group in self.impacts and bool(self.impacts[group].condition)


def read_benchmark_file(
    path: str | Path,
    learning: bool = True,
    also_known: Sequence[str] = (),
    detectors: Sequence[str | Detector] = (),
    settings: Mapping[str, Any] | None = None,
    command: str = "benchmark",
) -> BenchmarkFile:
    """Read and check a benchmark file; raises ConfigurationError with every mistake.

    `detectors` are used if the file does not name any; `all` selects every registered detector. Without `learning`, for
    external alarms, the file needs neither detectors nor logs to learn from, and [limits] may be set for the detectors
    `also_known`. `settings` take the place of keys of the file, as "activation.debounce", which `command` reads.
    """
    file = location(path)
    place = Place(str(file), by_option=full_keys(settings), tables=_tables)
    values = read_toml(file, "a benchmark file", place)
    if isinstance(values.get("machine"), dict):
        text = f"{file}: is a machine file, not a benchmark file"
        raise ConfigurationError(text, f'reference it from a benchmark file: machine = "{file.name}"')
    note_other_units(BenchmarkTable, place)
    _note_unread(place, command)
    table = read(BenchmarkTable, apply_settings(values, settings or {}), place)
    if table is None:
        place.finish()
    assert table is not None
    named = joined(file.parent, table.machine)
    machine_file = place.tried(None, lambda: read_machine_file(named_file(place, "machine", named)))
    stated = {key: value for key, value in (settings or {}).items() if key.partition(".")[0] != "execution"}
    wanted = _Wanted(learning, tuple(also_known), tuple(detectors), stated)
    if machine_file is None:  # the rest is checked with another one, but for what depends on its channels and model
        machine_file = _other_machine(table.joints)
    benchmark = _resolved(file, table, place, machine_file, wanted)
    place.finish()
    if learning:
        _refuse_unknown_locations(benchmark)
    return benchmark


def _tables() -> Mapping[str, Any]:
    """Return the models of the tables of a benchmark file."""
    return {**tables_of(BenchmarkTable), **{name: SECTIONS.load(name).table for name in SECTIONS.names()}}


def _note_unread(place: Place, command: str) -> None:
    """Note each key that --set gives and the command does not read."""
    for key in sorted(place.by_option):
        if command not in (others := readers_of(key)):
            hint = f"cdtool {others[0]} reads it" if others else "write it into the file"
            place.note(key, "has no effect in this command", hint)


def _other_machine(joints: Sequence[str]) -> MachineFile:
    values = {"joints": list(dict.fromkeys(joints)) or ["axis"], "load_mass": 1.0, "transmission_ratio": 1.0}
    machine = MACHINES.load("linear_axis").read(values, Place(""))
    no_channels = ChannelMap(TimeSource(), (), machine.joints)
    return MachineFile(Path(), machine, no_channels, no_channels, {}, "")


@dataclass(frozen=True)
class _Wanted:
    """What a command needs of a benchmark file; see `read_benchmark_file`."""

    learning: bool
    also_known: tuple[str, ...]
    detectors: tuple[str | Detector, ...]
    settings: Mapping[str, Any]


def _resolved(
    file: Path, table: BenchmarkTable, place: Place, machine_file: MachineFile, wanted: _Wanted
) -> BenchmarkFile:
    """Return the benchmark that the tables describe, its logs found, with the mistakes in `place`."""
    machine, settings = machine_file.machine, wanted.settings
    names: tuple[str, ...] = place.tried((), _detectors, table, place, machine_file, wanted)
    signature = table.signature.sided(machine.default_sides)
    otherwise: Threshold = signature
    rule = place.tried(otherwise, table.rule, place, signature)
    cut = place.tried(None, table.run_cut, place)
    found = LogsOf(file.parent, machine_file, cut is not None)
    if found.runs and (machine_file.columns.beside or machine_file.topics.beside):
        hint = "write each run to a log of its own, or map a channel of the log"
        place.note("operations", "cannot divide a channel that is in a file of its own into runs", hint)
    needs_runs = wanted.learning and not getattr(rule, "limits", ()) and not is_per_run(rule)
    learn: dict[Path, LogSection] = place.tried({}, _learned, table, place, found, needs_runs)
    impacts, sections = _groups(table, place, found)
    groups_known = place.is_whole and not place.has_mistake("impacts", HOLDOUT, "conditions")
    scored, with_impacts = _scored(impacts, impact_free=True), _scored(impacts)
    made, machine_known = None, bool(machine_file.digest)  # one in place of another has none
    if table.inject is not None and machine_known:
        made = place.tried(None, SECTIONS.load("inject").read, table.inject, place, found, table.operations, impacts)
    elif table.inject is not None:
        read(SECTIONS.load("inject").table, table.inject, place.below("inject"))
    learn = _under_scored_paths(learn, scored)
    onset = place.below("onset")
    of_file = place.tried(None, read_label_file, table.onset, onset, file.parent)
    labels = place.tried(of_file, labels_of, of_file, found, scored, tuple(learn)) if groups_known else of_file
    named = (table.campaigns, table.points) if groups_known else ({}, {})
    meant = names if place.is_whole and not place.has_mistake("detectors") else DETECTORS.usable_names()
    benchmark = BenchmarkFile(
        path=file,
        machine_file=machine_file,
        detectors=names,
        watched=table.joints,
        operations=table.operations,
        budget=place.tried(None, _budget, table, place),
        signature=signature,
        rule=rule,
        activation=table.activation,
        labels=labels,
        synchronisation=table.onset.synchronisation_s,
        onset=table.onset.rule,
        mass_before_cell=table.force.mass_before_cell_kg,
        learn=tuple(learn),
        impacts=impacts,
        campaigns=place.tried({}, named_logs, named[0], place.below("campaigns"), found, scored),
        points=place.tried({}, named_logs, named[1], place.below("points"), found, with_impacts),
        limits=limit_rules(
            table.limits,
            place.below("limits"),
            [*_names(machine_file, meant), *((name, name) for name in wanted.also_known)],
            (*impacts, *(place.tried((), made.names, machine_file) if made else ())),
            [
                kind_group(name, kind)
                for name, group in impacts.items()
                if not group.condition
                for kind in _kinds(machine_file, labels)
            ],
            complete=place.is_whole and machine_known and not place.has_mistake("inject"),
        ),
        digest=_digest(file, settings),
        window=table.window_s,
        sections=sections,
        learned_sections={path: section for path, section in learn.items() if section},
        guard=table.learn.guard if table.learn else None,
        split=table.learn.split if table.learn else Split.RECORDING,
        made=made,
        force_limits=_force_limits(table.force, file.parent),
        settings=settings,
        tune=None if table.tune is None else read(SECTIONS.load("tune").table, table.tune, place.below("tune")),
        triggers=table.triggers,
        report=table.report,
        execution=table.execution,
    )
    table.check_joints(place, machine)
    if table.points and not (any(group.force for group in impacts.values()) or place.has_mistake("force", "impacts")):
        place.note("points", "there is no force profile to check them against", "set [force] profile")
    with place.noting():
        _refuse_overlap(benchmark)
    if not wanted.detectors:  # with others, the command knows how many they are
        with place.noting():
            refuse_limits_by_hand(benchmark)
    return benchmark


def _kinds(machine_file: MachineFile, labels: Labels | None) -> tuple[str, ...]:
    """Return the kinds of contacts that a limit may name; empty if none has a kind."""
    kinds = dict.fromkeys((*machine_file.label_kinds, *(labels.kinds if labels else ())))
    return (*kinds, "") if kinds else ()


def _digest(file: Path, settings: Mapping[str, Any]) -> str:
    """Return the SHA-256 of the file, and of the settings that took the place of its keys, if there are any."""
    content = read_bytes(file, ConfigurationError)
    return hashlib.sha256(content + (json.dumps(settings, sort_keys=True).encode() if settings else b"")).hexdigest()


def _detectors(table: BenchmarkTable, place: Place, machine_file: MachineFile, wanted: _Wanted) -> tuple[str, ...]:
    """Return the full names of a file's detectors, or else of those given; a force rig's recordings may need none."""
    # An empty list means no detector; with learning it leaves the choice to the command.
    is_open = wanted.learning or table.detectors is None
    given: Sequence[str | Detector] = table.detectors or (wanted.detectors if is_open else ())
    if wanted.learning and not given:
        if table.detectors is None:
            raise place.fault("detectors", "is missing", "give a list of texts")
        hint = "name detectors, or write a protocol without them: cdtool protocol init"
        raise place.fault("detectors", "is empty: nothing can be scored", f"{hint} {place.where}")
    names: tuple[str, ...] = ()
    for number, item in enumerate(_all_or(given), 1):
        with place.noting(), place.at(f"detectors[{number}]"):
            name = machine_file.detector(item).name
            if name in names:
                raise UsageError(f"is '{item}', a detector that is already listed", "list each detector once")
            names += (name,)
    return names


def _budget(table: BenchmarkTable, place: Place) -> Budget | None:
    """Return `false_alarm_budget`; None if it is missing."""
    with place.at("false_alarm_budget", table.false_alarm_budget):
        return None if table.false_alarm_budget is None else Budget.parse(table.false_alarm_budget)


def _learned(table: BenchmarkTable, place: Place, found: LogsOf, needed: bool) -> dict[Path, LogSection]:
    if table.learn is None:
        if needed and place.is_whole:
            raise place.fault("learn", "is missing", "add a table [learn]")
        return {}
    return found.sections(table.learn, place.below("learn"))


def refuse_limits_by_hand(setup: BenchmarkFile) -> None:
    """Raise ConfigurationError if limits set by hand are combined with a budget or with more than one detector."""
    if setup.limits_by_hand and (setup.budget or len(setup.detectors) > 1):
        what = "a false-alarm budget" if setup.budget else f"{counted(len(setup.detectors), 'detector')}"
        raise ConfigurationError(
            f"{setup.path}: threshold.limits: set by hand together with {what}", "use them with a single detector"
        )


def with_detectors(setup: BenchmarkFile, detectors: Sequence[str | Detector]) -> BenchmarkFile:
    """Return the benchmark with other detectors, with the gains of objects, or with all registered ones for `all`.

    Raises UsageError for an unknown detector or a repeated one.
    """
    setup = replace(setup, machine_file=setup.machine_file.with_gains_of(detectors))
    chosen = tuple(setup.machine_file.detector(item).name for item in _all_or(detectors))
    if len(set(chosen)) < len(chosen):
        raise UsageError(f"detectors {', '.join(chosen)} contain a repetition", "list each detector once")
    return with_only(setup, chosen)


def _all_or(names: Sequence[str | Detector]) -> Sequence[str | Detector]:
    return DETECTORS.usable_names() if list(names) == ["all"] else names


def with_only(setup: BenchmarkFile, detectors: Sequence[str]) -> BenchmarkFile:
    """Return the benchmark with only these detectors, and the limits set for them or for every detector."""
    limits = tuple(rule for rule in setup.limits if rule.detector in (ALL, *detectors))
    return replace(setup, detectors=tuple(detectors), limits=limits)


def _may_share_a_run(one: Path, other: Path) -> bool:
    """Return whether two logs, each as FILE or FILE#PATTERN, can name the same run."""
    (file, first), (other_file, second) = split_run(one), split_run(other)
    if file.resolve() != other_file.resolve():
        return False
    return not first or not second or fnmatchcase(first, second) or fnmatchcase(second, first)


def _groups(
    table: BenchmarkTable, place: Place, found: LogsOf
) -> tuple[dict[str, ImpactGroup], dict[Path, LogSection]]:
    """Return the groups of impacts, the hold-out and those of changed conditions, and the sections of their logs."""
    force, below = table.force, place.below("force")
    profiles: dict[str, ForceProfile] = place.tried({}, _profiles, force, below, found.base)
    profile = place.tried(None, _profile, profiles, force, below, "profile", force.profile) if profiles else None
    groups: dict[str, ImpactGroup] = {}
    sections: dict[Path, LogSection] = {}
    for name, group in table.impacts.items():
        own = place.below("impacts").below(name)
        if name.strip() in ("", ALL, HOLDOUT):
            hint = f"choose another name; {ALL} stands for every group, {HOLDOUT} for the impact-free one"
            place.below("impacts").note(name, "is not a valid group name", hint)
        if not group.logs and any(key.startswith(f"impacts.{name}.") for key in place.by_option):
            known = nearest(name, [other for other, given in table.impacts.items() if given.logs])
            place.below("impacts").note(name, "is not a group of the file", known)
        logs: dict[Path, LogSection] = place.tried({}, found.sections, group, own)
        limits = profile
        if group.force_profile is not None and profiles:
            limits = place.tried(None, _profile, profiles, force, own, "force_profile", group.force_profile)
        sections |= logs
        groups[name] = ImpactGroup(tuple(logs), group.window_s or table.window_s, limits)
    if table.holdout:
        logs = place.tried({}, found.sections, table.holdout, place.below(HOLDOUT))
        sections |= logs
        groups[HOLDOUT] = ImpactGroup(tuple(logs), table.window_s, is_impact_free=True)
    is_selected = any(group.force for group in groups.values()) or place.has_mistake("force.profile", "impacts")
    if force.limits and profiles and not is_selected:
        below.note("limits", "is given, but no profile is selected", f"set profile to one of {', '.join(profiles)}")
    if not groups and table.inject is None and not place.has_mistake(HOLDOUT, "inject"):
        place.note("impacts", "is missing", "define groups of impact logs: [impacts.stiff] logs = [...]")
    changed, of_changed = _conditions(table, place.below("conditions"), found, groups)
    sections |= of_changed
    return groups | changed, {path: section for path, section in sections.items() if section}


def _conditions(
    table: BenchmarkTable, place: Place, found: LogsOf, groups: Mapping[str, ImpactGroup]
) -> tuple[dict[str, ImpactGroup], dict[Path, LogSection]]:
    """Return the groups of changed conditions of the machine, as CONDITION/GROUP, and the sections of their logs.

    A group of impacts has the window and the force profile of the group of the unchanged machine with its name.
    """
    changed: dict[str, ImpactGroup] = {}
    sections: dict[Path, LogSection] = {}
    struck = [name for name in groups if name != HOLDOUT]
    for condition, own in table.conditions.items():
        below = place.below(condition)
        named = {HOLDOUT: (own.holdout, below.below(HOLDOUT))} if own.holdout else {}
        for name, logs_of in own.impacts.items():
            if name not in struck and not place.has_mistake(f"impacts.{name}"):
                below.below("impacts").note(name, "is not a group of [impacts]", nearest(name, struck))
            named[name] = logs_of, below.below("impacts").below(name)
        if condition.strip() in ("", ALL):
            place.note(condition, "is not a valid name", f"choose another name; {ALL} stands for every group")
        if not named:
            place.note(condition, "has no logs", "add holdout.logs, impacts.GROUP.logs or both")
        for name, (logs_of, at) in named.items():
            group = f"{condition}/{name}"
            if group in (*groups, *changed) or condition in groups:
                same = condition if condition in groups else group
                place.note(condition, f"{same} is the name of another group", "choose another name for the condition")
            logs: dict[Path, LogSection] = place.tried({}, found.sections, logs_of, at)
            sections |= logs
            unchanged = groups.get(name, ImpactGroup((), table.window_s, is_impact_free=True))
            changed[group] = replace(unchanged, logs=tuple(logs), condition=condition, counterpart=name)
    return changed, sections


def _force_limits(force: ForceTable, base: Path) -> Path | None:
    return joined(base, force.limits) if force.limits else None


def _profiles(force: ForceTable, place: Place, base: Path) -> dict[str, ForceProfile]:
    path = _force_limits(force, base)
    return read_force_limits(path and named_file(place, "limits", path))


def _profile(
    profiles: Mapping[str, ForceProfile], force: ForceTable, place: Place, key: str, name: str
) -> ForceProfile | None:
    """Return the force profile that a key names, None for an empty text; ConfigurationError names key and file."""
    if not name:
        return None
    try:
        return profile_of(profiles, name)
    except UsageError as fault:
        where = (
            f" in {force.limits}" if force.limits else "; [force] limits does not name a file with your own profiles"
        )
        raise place.fault(key, f"{fault.message}{where}", fault.hint) from fault


def _scored(groups: Mapping[str, ImpactGroup], *, impact_free: bool = False) -> list[Path]:
    """Return the logs of all groups of impacts, and with `impact_free` those of the others."""
    return [path for group in groups.values() if impact_free or not group.is_impact_free for path in group.logs]


def _under_scored_paths(learn: Mapping[Path, LogSection], scored: Sequence[Path]) -> dict[Path, LogSection]:
    """Return the logs to learn from under the paths of the scored ones where they are the same files.

    A log is scored by what is learned from the others, and logs are distinguished by their names.
    """
    logs = [file for file, _ in map(split_run, scored)]
    files = dict(zip(resolve_all(logs), logs, strict=True))
    found: dict[Path, LogSection] = {}
    for path, section in learn.items():
        file, ids = split_run(path)
        known = files.get(file.resolve(), file)
        found[location(f"{known}#{ids}") if ids else known] = section
    return found


def _names(machine_file: MachineFile, detectors: Sequence[str]) -> list[tuple[str, str]]:
    return [(name, machine_file.detector(name).short_name) for name in detectors]


def _refuse_overlap(benchmark: BenchmarkFile) -> None:
    learned = set(resolve_all(benchmark.learn))
    scored: dict[Path, str] = {}
    logs = [(name, path) for name, group in benchmark.impacts.items() for path in group.logs]
    for (name, path), true in zip(logs, resolve_all(path for _, path in logs), strict=True):
        if true in learned and (benchmark.is_impact_free(name) or not _ends_early(benchmark, true)):
            hint = "use a recording either in [learn] or for scoring"
            if not benchmark.is_impact_free(name):
                hint += ', or learn from what is before its contact: [learn] until = "onset"'
            raise ConfigurationError(f"{benchmark.path}: {path} is both learned from and scored", hint)
        if true in scored:
            where = f"in {scored[true]} and in {name}" if scored[true] != name else f"twice in {name}"
            raise ConfigurationError(
                f"{benchmark.path}: {path} is scored {where}", "list a recording in one group only, under one path"
            )
        scored[true] = name


def _refuse_unknown_locations(benchmark: BenchmarkFile) -> None:
    """Raise ConfigurationError if limits by location are learned only up to the contacts, where none is learned."""
    rule, scored = benchmark.rule, set(resolve_all(_scored(benchmark.impacts)))
    if benchmark.guard is None or "position" not in rule.needs or not scored.issuperset(resolve_all(benchmark.learn)):
        return
    raise ConfigurationError(
        f"{benchmark.path}: learn.until is onset: the threshold {rule.name} would know no limit where the contacts are",
        'add impact-free logs to [learn], or set threshold = "limit"',
    )


def _ends_early(benchmark: BenchmarkFile, log: Path) -> bool:
    """Return whether only a part of a log is learned from that ends before the log does."""
    if benchmark.guard is not None:
        return True
    return log in resolve_all(path for path, section in benchmark.learned_sections.items() if section.end)
