"""benchmark.toml: which logs to learn from, which to score, with which detectors. Paths are relative to the file."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from cdtool.activation import Activation
from cdtool.detectors import DETECTORS
from cdtool.errors import ConfigurationError, UsageError, nearest
from cdtool.evaluation.false_alarm_budget import Budget
from cdtool.evaluation.force.limits import ForceProfile, profile_of, read_force_limits
from cdtool.evaluation.limits import ALL, LimitRule, read_limits
from cdtool.evaluation.truth.labels import Labels, read_labels
from cdtool.evaluation.truth.named_rows import by_recording
from cdtool.evaluation.truth.onset import OnsetRule
from cdtool.machine_file import MachineFile, read_machine_file
from cdtool.operations import HOW_TO_CUT
from cdtool.tables import Table, read_toml
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.alignment import ALIGNMENTS
from cdtool.thresholds.fitted_signature import RULES, SIDES
from cdtool.thresholds.signature import Signature
from cdtool.workflows.runs import find_logs, shown_path

HOLDOUT = "holdout"


@dataclass(frozen=True)
class Group:
    """One group of logs of impacts: an alarm belongs to a contact up to `window` [s] after its onset."""

    logs: tuple[Path, ...]
    window: float
    force: ForceProfile | None = None


@dataclass(frozen=True)
class BenchmarkFile:
    """A validated benchmark file with its globs resolved; `impacts` are the groups that are scored, hold-out last.

    `synchronisation` [s]: how far the load cell's clock may be off; `mass_before_cell` [kg].
    """

    path: Path
    machine_file: MachineFile
    detectors: tuple[str, ...]
    watched: tuple[str, ...]
    operations: str
    threshold: str
    budget: Budget | None
    signature: Signature
    debounce: int | None
    onset: OnsetRule
    labels: Labels | None
    synchronisation: float
    mass_before_cell: float
    learn: tuple[Path, ...]
    impacts: Mapping[str, Group]
    campaigns: Mapping[Path, str]
    points: Mapping[Path, str]
    limits: tuple[LimitRule, ...]
    digest: str

    @property
    def activation(self) -> Activation:
        """Debounce and re-arming."""
        return Activation(self.debounce)

    @property
    def scoring(self) -> dict[str, Any]:
        """How figures come about, for provenance: results can be compared only where all this is the same."""
        return {
            "onset": self.onset.described,
            "separation_s": self.onset.separation,
            "window_s": {name: group.window for name, group in self.impacts.items() if name != HOLDOUT},
            "operations": self.operations,
            "watched_joints": ", ".join(self.watched) or None,
            "label_file": self.labels.source if self.labels else None,
            "synchronisation_s": self.synchronisation,
            "mass_before_cell_kg": self.mass_before_cell,
            "force_profiles": {name: asdict(group.force) for name, group in self.impacts.items() if group.force},
        }

    @property
    def groups(self) -> tuple[str, ...]:
        """The impact groups, then the hold-out."""
        return tuple(self.impacts)


def read_benchmark_file(path: str | Path, learning: bool = True, also_known: Sequence[str] = ()) -> BenchmarkFile:
    """Read and check a benchmark file; raises ConfigurationError naming the key.

    Without `learning`, where alarms come from elsewhere, it needs neither detectors nor logs to learn from, and
    [limits] may be on the detectors `also_known`.
    """
    file = Path(path)
    root = Table(read_toml(file), str(file))
    base = file.parent
    machine_file = read_machine_file(base / root.text("machine"))
    wanted = root.texts("detectors", None if learning else ())
    names = tuple(machine_file.detector(name).name for name in wanted)
    if len(set(names)) < len(names):
        raise root.fault("detectors", "names a detector twice", "name each once")
    signature, debounce = _signature(root.table("signature"), machine_file.machine.default_sides)
    learn = _logs(root.table("learn", required=True), base) if learning or "learn" in root else ()
    force = root.table("force")
    impacts = _groups(root, base, root.number("window_s", 1.0, above=0.0), force)
    onset = root.table("onset")
    benchmark = BenchmarkFile(
        path=file,
        machine_file=machine_file,
        detectors=names,
        watched=_watched(root, machine_file.machine.joints),
        operations=root.choice("operations", HOW_TO_CUT, "whole"),
        threshold=root.choice("threshold", THRESHOLDS.names(plugins=True), "signature"),
        budget=_budget(root),
        signature=signature,
        debounce=debounce,
        labels=_labels(onset, base, impacts),
        synchronisation=onset.number("synchronisation_s", 0.0, minimum=0.0),
        onset=_onset(onset),
        mass_before_cell=force.number("mass_before_cell_kg", 0.0, minimum=0.0),
        learn=learn,
        impacts=impacts,
        campaigns=_named(root.table("campaigns"), base),
        points=_named(root.table("points"), base),
        limits=read_limits(
            root.table("limits"), [*_names(machine_file, names), *((name, name) for name in also_known)], tuple(impacts)
        ),
        digest=hashlib.sha256(file.read_bytes()).hexdigest(),
    )
    force.finish()
    root.finish()
    _refuse_overlap(benchmark)
    return benchmark


def with_detectors(setup: BenchmarkFile, names: Sequence[str]) -> BenchmarkFile:
    """The same with other detectors, each named once, or with all that are registered where `all` is named.

    Raises ConfigurationError for an unknown name, UsageError for one that is named twice.
    """
    known = DETECTORS.usable_names() if list(names) == ["all"] else names
    chosen = tuple(setup.machine_file.detector(name).name for name in known)
    if len(set(chosen)) < len(chosen):
        raise UsageError(f"detectors {', '.join(names)} name one twice", "name each once")
    return with_only(setup, chosen)


def with_only(setup: BenchmarkFile, detectors: Sequence[str]) -> BenchmarkFile:
    """The same with these detectors, and with the limits that are on them or on every one."""
    limits = tuple(rule for rule in setup.limits if rule.detector in (ALL, *detectors))
    return replace(setup, detectors=tuple(detectors), limits=limits)


def _groups(root: Table, base: Path, window: float, force: Table) -> dict[str, Group]:
    """The groups of impacts, then the hold-out."""
    tables = root.table("impacts")
    if HOLDOUT in tables.values:
        raise tables.fault(HOLDOUT, "is the name of the impact-free group", "choose another name for the impacts")
    profiles = read_force_limits(base / force.text("limits") if "limits" in force else None)
    profile = force.text("profile", "")
    groups = {}
    for name in tables.values:
        table = tables.table(name)
        wanted = table.text("force_profile", profile)
        own = table.number("window_s", window, above=0.0)
        groups[name] = Group(_logs(table, base), own, profile_of(profiles, wanted) if wanted else None)
    if HOLDOUT in root:
        groups[HOLDOUT] = Group(_logs(root.table(HOLDOUT), base), window)
    if not groups:
        raise root.fault("impacts", "is missing", "name groups of impact logs: [impacts.stiff] logs = [...]")
    return groups


def _logs(table: Table, base: Path) -> tuple[Path, ...]:
    logs = tuple(find_logs(table.texts("logs"), base, table.key("logs")))
    table.finish()
    return logs


def _named(table: Table, base: Path) -> dict[Path, str]:
    """Which campaign or test point each log belongs to."""
    found: dict[Path, str] = {}
    for name in table.values:
        for path in _logs(table.table(name), base):
            if path in found:
                raise table.fault(name, f"names {path}, which '{found[path]}' does too", "a log belongs to one")
            found[path] = name
    return found


def _names(machine_file: MachineFile, detectors: Sequence[str]) -> list[tuple[str, str]]:
    return [(name, machine_file.detector(name).short_name) for name in detectors]


def _budget(table: Table) -> Budget | None:
    text = table.text("false_alarm_budget", "")
    try:
        return Budget.parse(text) if text else None
    except UsageError as fault:
        raise table.fault("false_alarm_budget", f"is '{text}'", fault.hint) from fault


def _labels(onset: Table, base: Path, groups: Mapping[str, Group]) -> Labels | None:
    """The label file; a file's name alone may not fit several of the recordings that are scored."""
    if "labels" not in onset:
        return None
    path = base / onset.text("labels")
    labels = read_labels(path)
    by_recording(path, labels.contacts, {shown_path(log, base) for group in groups.values() for log in group.logs})
    return labels


def _watched(table: Table, joints: Sequence[str]) -> tuple[str, ...]:
    watched = table.texts("joints", ())
    for joint in watched:
        if joint not in joints:
            raise table.fault("joints", f"names '{joint}', which the machine file does not", nearest(joint, joints))
    return watched


def _signature(table: Table, default_sides: str) -> tuple[Signature, int | None]:
    settings: dict[str, Any] = {
        "rule": table.choice("rule", RULES, "pooled"),
        "sides": table.choice("sides", SIDES, default_sides),
        "alignment": table.choice("alignment", ALIGNMENTS, "time_then_position"),
        "position_step": table.number("position_step", Signature.position_step, above=0.0),
        "position_window": table.number("position_window", Signature.position_window, above=0.0),
        "force": table.flag("force", False),
    }
    if "safety_factor" in table:
        settings["safety_factor"] = table.number("safety_factor", above=0.0)
    debounce = None
    if "debounce" in table:
        debounce = table.whole("debounce", 1, minimum=1)
    table.finish()
    return Signature(**settings), debounce


def _onset(table: Table) -> OnsetRule:
    above = table.number("above_n", above=0.0) if "above_n" in table else None
    back_to = table.number("back_to_n", above=0.0) if "back_to_n" in table else None
    if above is not None and back_to is not None and back_to > above:
        raise table.fault("back_to_n", f"is {back_to:g}, more than above_n", "at most above_n")
    rule = OnsetRule(
        above=above,
        back_to=back_to,
        samples=table.whole("samples", OnsetRule.samples, minimum=1),
        sigmas=table.number("sigmas", OnsetRule.sigmas, above=0.0),
        separation=table.number("separation_s", OnsetRule.separation, above=0.0),
    )
    table.finish()
    return rule


def _refuse_overlap(benchmark: BenchmarkFile) -> None:
    learned = {path.resolve() for path in benchmark.learn}
    scored = [path for group in benchmark.impacts.values() for path in group.logs]
    for path in scored:
        if path.resolve() in learned:
            raise ConfigurationError(
                f"{benchmark.path}: {path} is learned from and scored",
                "a recording may be in [learn] or scored, not both",
            )
