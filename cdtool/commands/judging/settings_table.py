"""The settings by which recordings are judged: keys of a benchmark file, which `--set` also sets."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from cdtool.alarms.activation import Activation
from cdtool.base.errors import FieldsError, UsageError, nearest
from cdtool.base.files.bounded_loading import ContentError, parse_toml
from cdtool.base.settings import Model, NotNegative, Place, Positive, keys_of, read, setting, tables_of
from cdtool.base.value_words import value_in_words
from cdtool.commands.judging.log_groups import Split
from cdtool.commands.judging.named_logs import LogPart, OnsetTable, read_label_file
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.execution.workers import Execution
from cdtool.machines.dynamics import Machine
from cdtool.recordings.operations import RunCut
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.base import Threshold
from cdtool.thresholds.settings import with_context
from cdtool.thresholds.signature import Signature
from cdtool.truth.onset_rule import OnsetRule

#: A detector, by its name or as an object.
Named = TypeVar("Named")

# How long before its first contact a log is no longer learned from [s].
GUARD = 0.2
_DEFAULT = "signature"
# Settings of a signature that another threshold cannot follow, and why.
_OF_SIGNATURE = (("adaptive_level", "does not follow a run"), ("speed_range", "has no limits between speeds"))
_NAME = re.compile(r"""(["'])(.*?)\1|([^.]+)""")


@dataclass(frozen=True, kw_only=True)
class MassTable:
    """[force] for a single log: the mass before the load cell."""

    mass_before_cell_kg: Annotated[
        NotNegative,
        setting("mass between load cell and contact: the cell does not measure its inertial force", unit="kg"),
    ] = 0.0


@dataclass(frozen=True, kw_only=True)
class ForceTable(MassTable):
    """[force]: limits of the contact force, and the mass before the load cell."""

    profile: Annotated[str, setting("name of the force limits for all groups")] = ""
    limits: Annotated[str, setting("your own file of force limits; default: the shipped one")] = ""


@dataclass(frozen=True, kw_only=True)
class LearnPart:
    """[learn] without its logs: until when each is learned from, and which of them stay together."""

    until: Annotated[
        Literal["end", "onset"], setting("onset: learn from each log up to its first contact, by load cell or labels")
    ] = "end"
    guard_s: Annotated[
        NotNegative | None,
        setting('with until = "onset": how long before the contact learning ends; default: 0.2', unit="s"),
    ] = None
    split: Annotated[
        Split,
        setting(
            "what stays together where runs set a limit for other runs (a budget, tune): with day, no run is assessed "
            "by what was learned on its day; the day is the date in the path, or that of the clock"
        ),
    ] = Split.RECORDING

    def __post_init__(self) -> None:
        if self.guard_s is not None and self.until == "end":
            raise FieldsError(("guard_s", "until"), "is given without until", 'set until = "onset", or remove it')

    @property
    def guard(self) -> float | None:
        """Return how long before its first contact a log is no longer learned from [s]; None: it is used to its end."""
        return None if self.until == "end" else GUARD if self.guard_s is None else self.guard_s


Window = Annotated[
    Positive,
    setting("an alarm belongs to a contact up to this long after its onset, or until the next contact", unit="s"),
]


@dataclass(frozen=True, kw_only=True)
class DetectorTable:
    """How a detector is run, whatever for."""

    joints: Annotated[
        tuple[str, ...], setting("the joints whose signal is monitored, as in the machine file; default: all")
    ] = ()
    operations: Annotated[
        str,
        setting(
            "how a log is cut: whole, motion or trigger; into runs, which count as recordings: column:NAME, label:NAME "
            "or clock-reset"
        ),
    ] = "whole"
    threshold: Annotated[
        str | dict[str, Any],
        setting(
            'the threshold\'s name, or a table with `name` and its settings; name = "limit" with limits sets fixed ones'
        ),
    ] = "signature"
    activation: Annotated[Activation, setting("how an exit from the limits becomes an alarm")] = field(
        default_factory=Activation
    )
    onset: Annotated[OnsetTable, setting("when a contact begins")] = field(default_factory=OnsetTable)

    def run_cut(self, place: Place) -> RunCut | None:
        """Return how a log is cut into runs, None if it is not; raises ConfigurationError for an unknown word."""
        with place.at("operations", self.operations):
            return RunCut.of(self.operations)

    def rule(self, place: Place, signature: Signature) -> Threshold:
        """Return the threshold's rule, with the mistakes of single keys in `place`.

        Raises ConfigurationError for an unknown threshold, and for settings that do not fit together.

        `limits` without a name are those of the threshold `limit`. The settings of the signature, also if another rule
        learns one, are in [signature]; so is the safety factor of any rule if [threshold] does not set it.
        """
        given = self.threshold
        table: dict[str, Any] = (
            {"name": given} if isinstance(given, str) else {"name": "limit" if "limits" in given else _DEFAULT, **given}
        )
        name = table.pop("name")
        below = place if isinstance(given, str) else place.below("threshold")
        key = "threshold" if isinstance(given, str) else "name"
        known = THRESHOLDS.names_for(name)
        if name not in known:
            raise below.fault(key, f"is {name!r}", nearest(str(name), known))
        if name == _DEFAULT:
            for other in table:
                hint = "name its threshold with threshold.name; the signature's settings are in [signature]"
                below.note(other, "is not a key of the threshold signature", hint)
            return signature
        for own, problem in _OF_SIGNATURE:
            if getattr(signature, own):
                what = f"'{name}' {problem}: {own} of [signature] is for the threshold 'signature'"
                raise place.fault("threshold", what, f"remove {own}, or choose that threshold")
        kind = THRESHOLDS.load(name)
        if "safety_factor" in keys_of(kind) and "safety_factor" not in table and signature.safety_factor is not None:
            table["safety_factor"] = signature.safety_factor
        if "limits" in table and "safety_factor" in table:
            raise below.fault("safety_factor", "cannot be combined with limits set by hand", "remove one of the two")
        rule: Threshold | None = read(kind, table, below)
        if rule is None:
            return signature
        try:
            return with_context(rule, signature.sides, signature)
        except UsageError as fault:
            raise below.whole(fault) from fault

    def check_joints(self, place: Place, machine: Machine) -> None:
        """Note each joint that the machine does not have."""
        for joint in self.joints:
            if joint not in machine.joints:
                problem = f"contains '{joint}', which is not a joint of the machine file"
                place.note("joints", problem, nearest(joint, machine.joints))

    def rules(self, place: Place, **others: float) -> ScoringRules:
        """Return the rules for logs that no benchmark file names, the label file read; raises ConfigurationError."""
        onset, below = self.onset, place.below("onset")
        labels = read_label_file(onset, below, Path())
        return ScoringRules(onset.rule, labels=labels, synchronisation=onset.synchronisation_s, **others)


@dataclass(frozen=True, kw_only=True)
class TriggersTable:
    """[triggers]: how `cdtool score` reads the trigger file."""

    clock: Annotated[
        Literal["recording", "source"],
        setting("clock of the trigger times: recording, as cdtool shows it, or source, the log's own"),
    ] = "recording"
    listed_only: Annotated[
        bool, setting("leave out recordings without a row; else each counts as watched without an alarm")
    ] = False


@dataclass(frozen=True, kw_only=True)
class ReportTable:
    """[report]: how tables for spreadsheets are written."""

    decimal: Annotated[
        Literal["point", "comma"],
        setting("of contacts.csv and forces.csv; comma: with semicolons, as a German or French Excel opens them"),
    ] = "point"


@dataclass(frozen=True, kw_only=True)
class JudgingTable(DetectorTable):
    """The settings that `score`, `benchmark` and `tune` share."""

    window_s: Window = 1.0
    false_alarm_budget: Annotated[
        str | None, setting('"1/1000op" or "0.1/h": sets each detector\'s safety factor for it; default: none')
    ] = None
    signature: Annotated[Signature, setting("how the normal band is learned")] = field(default_factory=Signature)
    force: Annotated[ForceTable, setting("limits of the contact force")] = field(default_factory=ForceTable)
    triggers: Annotated[TriggersTable, setting("how a trigger file is read")] = field(default_factory=TriggersTable)
    report: Annotated[ReportTable, setting("how tables are written")] = field(default_factory=ReportTable)
    execution: Annotated[Execution, setting("how the work is done")] = field(default_factory=Execution)


@dataclass(frozen=True, kw_only=True)
class DetectionTable(DetectorTable, LogPart):
    """The settings of `detect` and `explain` without a benchmark file."""

    window_s: Window = 1.0
    force: Annotated[MassTable, setting("the mass before the load cell")] = field(default_factory=MassTable)


@dataclass(frozen=True, kw_only=True)
class LearningTable(DetectorTable, LogPart):
    """The settings of `learn-signature`."""

    signature: Annotated[Signature, setting("how the normal band is learned")] = field(default_factory=Signature)
    learn: Annotated[LearnPart, setting("what is learned from each log")] = field(default_factory=LearnPart)
    execution: Annotated[Execution, setting("how the work is done")] = field(default_factory=Execution)


@dataclass(frozen=True, kw_only=True)
class UpkeepTable:
    """The settings of `signature check` and `signature update`; all others are in the signature file."""

    onset: Annotated[OnsetRule, setting("when a contact begins")] = field(default_factory=OnsetRule)
    execution: Annotated[Execution, setting("how the work is done")] = field(default_factory=Execution)


def read_settings(model: type[Model], settings: Mapping[str, Any]) -> tuple[Model, Place]:
    """Return the model that settings describe by their keys, and their place, which has the mistakes so far.

    Raises ConfigurationError with all mistakes if there is no model, as for values that do not fit together.
    """
    place = Place("--set", by_option=full_keys(settings), tables=partial(tables_of, model))
    note_other_units(model, place)
    table = read(model, apply_settings({}, settings), place)
    if table is None:
        place.finish()
    assert table is not None
    return table, place


def note_other_units(model: Any, place: Place) -> None:
    """Note each key of --set that is one of the model but for a unit behind it, as activation.debounce_ms."""
    for key in sorted(place.by_option):
        table, _, name = key.rpartition(".")
        known = keys_of(tables_of(model)[table]) if table in tables_of(model) else {}
        meant = known.get(name.rpartition("_")[0])
        if meant and name not in known:
            place.note(key, "unknown key", f"give {table}.{meant.name}: {meant.meaning}")


def refuse_beside_signature(values: Mapping[str, Any], place: Place, names: Sequence[str]) -> None:
    """Note each setting that a signature has of its own."""
    for name in names:
        if name in values:
            place.note(name, "cannot be combined with a signature, which has its own", "omit one of the two")


def apply_settings(values: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a file with those of `--set`, whose keys have dots between the tables.

    >>> apply_settings({"threshold": "glr"}, {"threshold.order": 4, 'impacts."stiff 1.5".window_s': 2})
    {'threshold': {'name': 'glr', 'order': 4}, 'impacts': {'stiff 1.5': {'window_s': 2}}}
    """
    found = dict(values)
    for key, value in settings.items():
        *tables, name = names_in(key)
        table = found
        for above in tables:
            inner = table.get(above)
            # threshold = "cusum" and [threshold] name = "cusum" say the same.
            table[above] = dict(inner) if isinstance(inner, dict) else {"name": inner} if isinstance(inner, str) else {}
            table = table[above]
        table[name] = value
    return found


def full_keys(settings: Mapping[str, Any] | None) -> frozenset[str]:
    """Return the full keys of settings, as a message names them."""
    return frozenset(".".join(names_in(key)) for key in settings or ())


def names_in(key: str) -> list[str]:
    """Return the tables and the name of a key; one with a dot is in quotes, as in impacts."stiff 1.5".window_s.

    >>> names_in("limits.gm.stiff.p95_ms.max")  # the name of a limit always has dots
    ['limits', 'gm.stiff.p95_ms', 'max']
    """
    first, *names = [quoted or bare for _, quoted, bare in _NAME.findall(key)] or [key]
    if first != "limits" or not names:
        return [first, *names]
    bound = names[-1:] if names[-1] in ("min", "max") else []
    return [first, ".".join(names[: len(names) - len(bound)]), *bound]


def detectors_of(given: Sequence[Named], settings: Mapping[str, Any] | None) -> tuple[Sequence[Named], dict[str, Any]]:
    """Return the detectors in place of the file's, `given` or by the setting `detectors`, and the other settings.

    Raises UsageError if both are there, and for a value that is not a list of names.
    """
    others = dict(settings or {})
    if "detectors" not in others:
        return given, others
    if given:
        raise UsageError("--set detectors: cannot be combined with --detectors", "omit one of the two")
    value = others.pop("detectors")
    named: Any = [part.strip() for part in value.split(",")] if isinstance(value, str) else value
    if not (isinstance(named, list | tuple) and named and all(isinstance(name, str) for name in named)):
        raise UsageError(f"--set detectors: is {value_in_words(value)}", "give names of detectors, as gm,eo")
    return named, others


def given_settings(texts: Iterable[str]) -> dict[str, Any]:
    """Return the values of --set KEY=VALUE, as TOML has them; a bare word is a text. Raises UsageError.

    >>> given_settings(["activation.debounce=9", "threshold.name=cusum", "threshold.limits=40,inf"])
    {'activation.debounce': 9, 'threshold.name': 'cusum', 'threshold.limits': [40, inf]}
    """
    found = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            hint = "give KEY=VALUE; the page of the command in docs/ has the keys"
            raise UsageError(f"--set is '{text}'", hint)
        found[name] = _value_of(value)
    return found


def _value_of(text: str) -> Any:
    """Return a value as TOML has it, also a list without its brackets; a text that is neither as it is."""
    for written in (text, f"[{text}]"):
        try:
            return parse_toml(f"value = {written}")["value"]
        except ContentError:
            continue
    return text
