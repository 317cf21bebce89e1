"""benchmark.toml: the logs to learn from and to score, and the detectors. Paths are relative to the file."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

from cdtool.alarms.activation import Activation
from cdtool.base.errors import ConfigurationError, UsageError, nearest
from cdtool.base.files.bounded_loading import read_bytes
from cdtool.base.plain_text import counted, digits
from cdtool.base.registry import Registry
from cdtool.base.remote.remote_path import joined, location
from cdtool.base.tables import Table, read_toml
from cdtool.commands.judging.log_groups import Split
from cdtool.commands.judging.named_logs import LogsOf, labels_of, named_logs
from cdtool.commands.judging.part_to_learn_from import PartToLearnFrom
from cdtool.commands.judging.runs import RunReading, resolve_all, shown_path
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.commands.learning.threshold_settings import read_signature, read_threshold
from cdtool.detectors import DETECTORS
from cdtool.detectors.base import Detector
from cdtool.execution.workers import Progress, Workers
from cdtool.formats.channels.run_reading import split_run
from cdtool.formats.labels.labels import Labels
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.operations import RunCut
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.results.limits import ALL, LimitRule, read_limits
from cdtool.results.results import ConditionResult, Skipped
from cdtool.results.summary import kind_group
from cdtool.thresholds.base import Threshold, is_per_run
from cdtool.thresholds.signature import Signature
from cdtool.truth.force.limits import ForceProfile, profile_of, read_force_limits
from cdtool.truth.onset_rule import LONGEST_HOLD, SAMPLE, OnsetRule

HOLDOUT = "holdout"

# Where a log that is learned from ends.
_UNTIL = ("end", "onset")
# How long before its first contact a log is no longer learned from [s].
GUARD = 0.2


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
    def read(cls, root: Table, found: LogsOf, operations: str, groups: Mapping[str, ImpactGroup]) -> MadeGroups:
        """Read and check the section in the file `root`; `groups` are the others. Raises ConfigurationError."""
        ...

    def names(self, machine_file: MachineFile) -> tuple[str, ...]:
        """Return the names of the groups."""
        ...

    def added(self, setup: BenchmarkFile, workers: Workers, progress: Progress | None) -> BenchmarkFile:
        """Return the benchmark with the groups, whose logs are made if they are not there; without `made`."""
        ...

    def found(self, setup: BenchmarkFile) -> tuple[BenchmarkFile, int]:
        """Return the benchmark with the groups if their logs are there, or else how many contacts are to be made."""
        ...


# The sections that a command of their own reads and carries out: groups of logs, and documents of the results.
SECTIONS = Registry(
    "section",
    {
        "inject": "cdtool.commands.inject.with_injected:InjectedGroups",
        "protocol": "cdtool.commands.protocol.of_benchmark:ProtocolOfBenchmark",
    },
)


@dataclass(frozen=True)
class BenchmarkFile:
    """A validated benchmark file with resolved globs.

    `impacts` are the scored groups: those of impacts, the hold-out, then those of changed conditions.

    `rule` is the threshold rule with its settings. `synchronisation` [s]: largest offset of the load cell's clock, or
    not known before the logs are audited if `measures_synchronisation`.
    `mass_before_cell` [kg]. `window` [s] applies to a log outside all groups. `migrated` reports how keys of earlier
    versions were read. `sections` are the parts of scored logs that are used, `learned_sections` those of the logs
    learned from, which end `guard` [s] before their first contact; None: they have no contact. `split`: which runs stay
    together where runs set a limit for others. `made`: the groups that a command
    makes before they are scored; `not_made`: their logs and contacts that were left out. `force_limits`: the file of
    the force profiles; None: the shipped ones.
    """

    path: Path
    machine_file: MachineFile
    detectors: tuple[str, ...]
    watched: tuple[str, ...]
    operations: str
    threshold: str
    budget: Budget | None
    signature: Signature
    rule: Threshold
    activation: Activation
    onset: OnsetRule
    labels: Labels | None
    synchronisation: float
    mass_before_cell: float
    learn: tuple[Path, ...]
    impacts: Mapping[str, ImpactGroup]
    campaigns: Mapping[Path, str]
    points: Mapping[Path, str]
    limits: tuple[LimitRule, ...]
    digest: str
    window: float = 1.0
    migrated: tuple[str, ...] = ()
    sections: Mapping[Path, LogSection] = field(default_factory=dict)
    learned_sections: Mapping[Path, LogSection] = field(default_factory=dict)
    guard: float | None = None
    split: Split = Split.RECORDING
    measures_synchronisation: bool = False
    made: MadeGroups | None = None
    not_made: tuple[Skipped, ...] = ()
    force_limits: Path | None = None

    def with_made(self, workers: Workers, progress: Progress | None = None) -> BenchmarkFile:
        """Return the benchmark with the groups that a command makes for it; unchanged without one."""
        return self if self.made is None else self.made.added(self, workers, progress)

    @property
    def limits_by_hand(self) -> tuple[float, ...]:
        """Return the limits of the signal that were set by hand; empty if they are learned."""
        return tuple(getattr(self.rule, "limits", ()))

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
            "synchronisation_s": "measured" if self.measures_synchronisation else self.synchronisation,
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
    path: str | Path, learning: bool = True, also_known: Sequence[str] = (), detectors: Sequence[str | Detector] = ()
) -> BenchmarkFile:
    """Read and check a benchmark file; raises ConfigurationError naming the key.

    `detectors` are used if the file does not name any; `all` selects every registered detector. Without `learning`, for
    external alarms, the file needs neither detectors nor logs to learn from, and [limits] may be set for the detectors
    `also_known`.
    """
    file = location(path)
    root = Table(read_toml(file, "a benchmark file"), str(file))
    root.raw("protocol")  # read by its command
    if isinstance(root.raw("machine"), dict):
        text = f"{file}: is a machine file, not a benchmark file"
        raise ConfigurationError(text, f'reference it from a benchmark file: machine = "{file.name}"')
    base = file.parent
    machine_file = read_machine_file(joined(base, root.text("machine")))
    wanted = _wanted_detectors(root, learning, detectors)
    names = tuple(machine_file.detector(name).name for name in wanted)
    if len(set(names)) < len(names):
        raise root.fault("detectors", "contains a detector twice", "list each detector once")
    signature = read_signature(root.table("signature"), machine_file.machine.default_sides)
    threshold, rule = read_threshold(root, signature)
    operations = _read_operations(root)
    found = LogsOf(base, machine_file, RunCut.of(operations) is not None)
    if found.runs and (machine_file.columns.beside or machine_file.topics.beside):
        hint = "write each run to a log of its own, or map a channel of the log"
        raise root.fault("operations", "cannot divide a channel that is in a file of its own into runs", hint)
    by_hand = bool(getattr(rule, "limits", ()))
    needs_runs = learning and not by_hand and not is_per_run(rule)
    learn_table = root.table("learn", required=needs_runs)
    guard = _guard(learn_table)
    split = Split(learn_table.choice("split", [item.value for item in Split], Split.RECORDING.value))
    learn = found.sections(learn_table) if needs_runs or "learn" in root else {}
    force = root.table("force")
    mass_before_cell = _mass_before_cell(force)
    window = root.number("window_s", 1.0, above=0.0)
    impacts, sections = _groups(root, found, window, force)
    made = SECTIONS.load("inject").read(root, found, operations, impacts) if "inject" in root else None
    learn = _under_scored_paths(learn, _scored(impacts, impact_free=True))
    onset = root.table("onset")
    migrated = migrated_onset(onset)
    labels = labels_of(onset, found, _scored(impacts, impact_free=True), tuple(learn))
    benchmark = BenchmarkFile(
        path=file,
        machine_file=machine_file,
        detectors=names,
        watched=_read_watched(root, machine_file.machine.joints),
        operations=operations,
        threshold=threshold,
        budget=_read_budget(root),
        signature=signature,
        rule=rule,
        activation=_read_activation(root.table("activation")),
        labels=labels,
        synchronisation=onset.number("synchronisation_s", 0.0, minimum=0.0),
        measures_synchronisation=_measures_synchronisation(onset),
        onset=read_onset(onset),
        mass_before_cell=mass_before_cell,
        learn=tuple(learn),
        impacts=impacts,
        campaigns=named_logs(root.table("campaigns"), found, _scored(impacts, impact_free=True)),
        points=named_logs(root.table("points"), found, _scored(impacts)),
        limits=read_limits(
            root.table("limits"),
            [*_names(machine_file, names), *((name, name) for name in also_known)],
            (*impacts, *(made.names(machine_file) if made else ())),
            [
                kind_group(name, kind)
                for name, group in impacts.items()
                if not group.condition
                for kind in _kinds(machine_file, labels)
            ],
        ),
        digest=hashlib.sha256(read_bytes(file, ConfigurationError)).hexdigest(),
        window=window,
        migrated=migrated,
        sections=sections,
        learned_sections={path: section for path, section in learn.items() if section},
        guard=guard,
        split=split,
        made=made,
        force_limits=_force_limits(force, base),
    )
    root.finish()
    if benchmark.points and not any(group.force for group in impacts.values()):
        raise root.fault("points", "there is no force profile to check them against", "set [force] profile")
    refuse_limits_by_hand(benchmark)
    _refuse_overlap(benchmark)
    if learning:
        _refuse_unknown_locations(benchmark)
    return benchmark


def _kinds(machine_file: MachineFile, labels: Labels | None) -> tuple[str, ...]:
    """Return the kinds of contacts that a limit may name; empty if none has a kind."""
    kinds = dict.fromkeys((*machine_file.label_kinds, *(labels.kinds if labels else ())))
    return (*kinds, "") if kinds else ()


def _measures_synchronisation(onset: Table) -> bool:
    measured = onset.choice("synchronisation", ("stated", "measured"), "stated") == "measured"
    if measured and "synchronisation_s" in onset:
        raise onset.fault(
            "synchronisation", "is measured, but synchronisation_s is stated too", "remove one of the two"
        )
    return measured


def _wanted_detectors(root: Table, learning: bool, detectors: Sequence[str | Detector]) -> Sequence[str | Detector]:
    """Return the detectors of a file, or else those given; the recordings of a force rig may need none."""
    if root.raw("detectors") != []:
        default: Any = _all_or(detectors) if detectors or not learning else None
        return root.texts("detectors", default)
    if learning and not detectors:
        hint = "name some, or write a protocol of the forces without detectors: cdtool protocol init"
        raise root.fault("detectors", "is empty: nothing can be scored", f"{hint} {root.where}")
    return _all_or(detectors) if learning else ()


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


def _guard(learn: Table) -> float | None:
    """Return how long before its first contact a log is no longer learned from [s]; None if it is used to its end."""
    if learn.choice("until", _UNTIL, "end") == "end":
        if "guard_s" in learn:
            raise learn.fault("guard_s", "is given without until", 'set until = "onset", or remove it')
        return None
    return learn.number("guard_s", GUARD, minimum=0.0)


def _groups(
    root: Table, found: LogsOf, window: float, force: Table
) -> tuple[dict[str, ImpactGroup], dict[Path, LogSection]]:
    """Return the groups of impacts, the hold-out and those of changed conditions, and the sections of their logs."""
    tables = root.table("impacts")
    if HOLDOUT in tables.values:
        raise tables.fault(
            HOLDOUT, "is the name of the impact-free group", "choose another name for the group of impacts"
        )
    profiles = read_force_limits(_force_limits(force, found.base))
    profile = force.text("profile", "")
    if profile:
        _profile(profiles, force, "profile", force)
    groups = {}
    sections: dict[Path, LogSection] = {}
    for name in tables.values:
        if name.strip() in ("", ALL):
            raise tables.fault(name, "is not a valid group name", f"choose another name; {ALL} stands for every group")
        table = tables.table(name)
        limits = _profile(profiles, table, "force_profile", force) if "force_profile" in table else None
        if profile and "force_profile" not in table:
            limits = profiles[profile]
        own = table.number("window_s", window, above=0.0)
        logs = found.sections(table)
        sections |= logs
        groups[name] = ImpactGroup(tuple(logs), own, limits)
    if HOLDOUT in root:
        logs = found.sections(root.table(HOLDOUT))
        sections |= logs
        groups[HOLDOUT] = ImpactGroup(tuple(logs), window, is_impact_free=True)
    if "limits" in force and not any(group.force for group in groups.values()):
        raise force.fault(
            "limits", "is given, but no profile is selected", f"set profile to one of {', '.join(profiles)}"
        )
    if not groups and "inject" not in root:
        raise root.fault("impacts", "is missing", "define groups of impact logs: [impacts.stiff] logs = [...]")
    changed, of_changed = _conditions(root.table("conditions"), found, window, groups)
    sections |= of_changed
    groups |= changed
    return groups, {path: section for path, section in sections.items() if section}


def _conditions(
    tables: Table, found: LogsOf, window: float, groups: Mapping[str, ImpactGroup]
) -> tuple[dict[str, ImpactGroup], dict[Path, LogSection]]:
    """Return the groups of changed conditions of the machine, as CONDITION/GROUP, and the sections of their logs.

    A group of impacts has the window and the force profile of the group of the unchanged machine with its name.
    """
    changed: dict[str, ImpactGroup] = {}
    sections: dict[Path, LogSection] = {}
    struck = [name for name in groups if name != HOLDOUT]
    for condition in tables.values:
        table = tables.table(condition)
        named = {HOLDOUT: table.table(HOLDOUT)} if HOLDOUT in table else {}
        impacts = table.table("impacts")
        for name in impacts.values:
            if name not in struck:
                raise impacts.fault(name, "is not a group of [impacts]", nearest(name, struck))
            named[name] = impacts.table(name)
        table.finish()
        if not condition.strip():
            raise tables.fault(condition, "has no name", "give it a name")
        if condition.strip() == ALL:
            raise tables.fault(condition, "is not a valid name", f"choose another name; {ALL} stands for every group")
        if not named:
            raise tables.fault(condition, "has no logs", "add holdout.logs, impacts.GROUP.logs or both")
        for name, table_of_logs in named.items():
            group = f"{condition}/{name}"
            if group in (*groups, *changed) or condition in groups:
                same = condition if condition in groups else group
                raise tables.fault(
                    condition, f"{same} is the name of another group", "choose another name for the condition"
                )
            logs = found.sections(table_of_logs)
            sections |= logs
            unchanged = groups.get(name, ImpactGroup((), window, is_impact_free=True))
            changed[group] = replace(unchanged, logs=tuple(logs), condition=condition, counterpart=name)
    return changed, sections


def _force_limits(force: Table, base: Path) -> Path | None:
    return joined(base, force.text("limits")) if "limits" in force else None


def _profile(profiles: Mapping[str, ForceProfile], table: Table, key: str, force: Table) -> ForceProfile | None:
    """Return the force profile that a key names, None for an empty text; ConfigurationError names key and file."""
    if not (name := table.text(key)):
        return None
    try:
        return profile_of(profiles, name)
    except UsageError as fault:
        where = (
            f" in {force.text('limits')}"
            if "limits" in force
            else "; [force] limits does not name a file with your own profiles"
        )
        raise table.fault(key, f"{fault.message}{where}", fault.hint) from fault


def _mass_before_cell(force: Table) -> float:
    """Return the mass before the cell [kg]; reads every key of [force] so that an unknown key is reported first."""
    mass = force.number("mass_before_cell_kg", 0.0, minimum=0.0)
    for name in ("limits", "profile"):
        force.raw(name)
    force.finish()
    return mass


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


def _read_operations(root: Table) -> str:
    """Return how logs are cut: `operations` as a text, or `by` in the table [operations]."""
    is_table = isinstance(root.raw("operations"), dict)
    table = root.table("operations") if is_table else root
    key = "by" if is_table else "operations"
    text = table.text(key, None if is_table else "whole")
    if is_table:
        table.finish()
    try:
        RunCut.of(text)
    except UsageError as fault:
        raise table.fault(key, f"is '{text}'", fault.hint) from fault
    return text


def _read_budget(table: Table) -> Budget | None:
    """Return `false_alarm_budget`; None if it is missing."""
    if "false_alarm_budget" not in table:
        return None
    text = table.text("false_alarm_budget")
    try:
        return Budget.parse(text)
    except UsageError as fault:
        raise table.fault("false_alarm_budget", f"is '{text}'", fault.hint) from fault


def _read_watched(table: Table, joints: Sequence[str]) -> tuple[str, ...]:
    """Return `joints`, the joints to monitor; empty: all of them."""
    watched = table.texts("joints", ())
    for joint in watched:
        if joint not in joints:
            raise table.fault(
                "joints", f"contains '{joint}', which is not a joint of the machine file", nearest(joint, joints)
            )
    return watched


def _read_activation(table: Table) -> Activation:
    """Return [activation]: how a signal outside the limits becomes an alarm."""
    activation = Activation(
        debounce=table.whole("debounce", 1, minimum=1) if "debounce" in table else None,
        rearm=table.number("rearm_s", Activation.rearm, minimum=0.0),
        hysteresis=_share(table, "hysteresis", Activation.hysteresis),
        latch=table.flag("latch", Activation.latch),
    )
    table.finish()
    return activation


def _share(table: Table, name: str, default: float) -> float:
    value = table.number(name, default, minimum=0.0)
    if value >= 1.0:
        raise table.fault(name, f"is {value:g}", "give a number from 0 to below 1")
    return value


def migrated_onset(table: Table) -> tuple[str, ...]:
    """Return how a setting of an earlier version is read; empty without such a setting."""
    if "samples" not in table:
        return ()
    return (f"{table.key('samples')}: read as hold_s = {_hold(table):g} (samples at 1 kHz): use hold_s instead",)


def _hold(table: Table) -> float:
    """Return `hold_s`, or `samples` of an earlier version at 1 kHz, independent of the load cell's actual rate."""
    if "samples" not in table:
        hold = table.number("hold_s", OnsetRule.hold, minimum=0.0)
        if hold > LONGEST_HOLD:
            raise table.fault("hold_s", f"is {hold:g}", f"give at most {LONGEST_HOLD:g} s")
        return hold
    samples = table.whole("samples", 3, minimum=1)
    if "hold_s" in table:
        raise table.fault(
            "samples", "cannot be combined with hold_s", "remove samples: the onset rule counts in seconds"
        )
    if samples * SAMPLE > LONGEST_HOLD:
        raise table.fault(
            "samples", f"is {samples}: the onset rule now counts in seconds", f"set hold_s, at most {LONGEST_HOLD:g}"
        )
    return samples * SAMPLE


def read_onset(table: Table) -> OnsetRule:
    """Return [onset]: when a contact begins."""
    above = table.number("above_n", above=0.0) if "above_n" in table else None
    back_to = table.number("back_to_n", above=0.0) if "back_to_n" in table else None
    if above is not None and back_to is not None and back_to > above:
        raise table.fault("back_to_n", f"is {back_to:g}, more than above_n", "give at most above_n")
    rule = OnsetRule(
        above=above,
        back_to=back_to,
        hold=_hold(table),
        sigmas=table.number("sigmas", OnsetRule.sigmas, above=0.0),
        separation=table.number("separation_s", OnsetRule.separation, above=0.0),
    )
    table.finish()
    return rule
