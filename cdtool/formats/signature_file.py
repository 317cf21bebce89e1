"""The content of a signature file: the thresholds of one machine and one detector, and their origin."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from cdtool.alarms.activation import Activation
from cdtool.base.errors import SignatureError
from cdtool.base.plain_text import counted, digits, first_of
from cdtool.base.value_words import value_in_words
from cdtool.formats.machine_file import fingerprint, machine_parameters
from cdtool.machines.dynamics import Gain, Machine
from cdtool.recordings.plausible import PlausibleRanges
from cdtool.thresholds.base import FittedThreshold, Threshold
from cdtool.thresholds.normal_motion import NormalMotion


@dataclass(frozen=True)
class LearnedRun:
    """A run that a signature was learned from: its name, the SHA-256 of its file, and the number of its operation."""

    name: str
    sha256: str
    operation: int = 0


@dataclass(frozen=True)
class FactorOrigin:
    """Origin of a safety factor: the rule's default, set by hand, or a false-alarm budget.

    With a budget: its text, the impact-free operations used to set the factor, and the alarms on them. `added`: runs
    added to the signature later.
    """

    by: Literal["default", "hand", "budget"] = "default"
    budget: str | None = None
    operations: int = 0
    alarms: int = 0
    added: int = 0

    def __str__(self) -> str:
        if self.by != "budget":
            return "by default" if self.by == "default" else "set by hand"
        set_on = f"set for {self.budget} on {counted(self.operations, 'operation')}, {counted(self.alarms, 'alarm')}"
        return f"{set_on}, before {counted(self.added, 'more run')}" if self.added else set_on


@dataclass(frozen=True, repr=False)
class SignatureFile:
    """The thresholds of one machine and one detector with its gains: for a signature, one per class of motion.

    `rule` is the threshold rule with its settings, `origin` the origin of its safety factor. `first` is what was first
    learned; `current` is in use. `joints` are the monitored joints: the columns of the signal. `operations`: how the
    logs were cut. `plausible`: value ranges of the runs' channels; None in older files. `normal`: the normal motion of
    every channel, one per class of motion with enough runs; None in older files. `machine_parameters`: those of
    `cdtool.formats.machine_file.machine_parameters`; None in older files.
    """

    machine: str
    machine_fingerprint: str
    detector: str
    gains: Mapping[str, Gain]
    unit: str
    joints: tuple[str, ...]
    rule: Threshold
    origin: FactorOrigin
    activation: Activation
    current: tuple[FittedThreshold, ...]
    first: tuple[FittedThreshold, ...]
    runs: tuple[LearnedRun, ...]
    operations: str = "whole"
    source: str = ""
    plausible: PlausibleRanges | None = None
    normal: tuple[NormalMotion, ...] | None = ()
    machine_parameters: Mapping[str, Any] | None = None

    def __repr__(self) -> str:
        return f"SignatureFile({self.machine}, {self.detector}, {self.threshold} of {len(self.runs)} runs)"

    @property
    def threshold(self) -> str:
        """Return the threshold's name."""
        return str(self.rule.name)

    @property
    def of_earlier_version(self) -> str:
        """Return what is missing from a file of an earlier version, and how to migrate it; empty for the current one.

        Runs added to such a file do not complete it.
        """
        if self.normal is not None:
            return ""
        parts = f"the {'' if self.plausible else 'speed profiles, plausible ranges and '}normal motions of its runs"
        return f"of an earlier version, without {parts}: relearn it with cdtool learn-signature to add them"

    @property
    def learns_limits(self) -> bool:
        """Whether the limits are learned from the runs, not set by hand."""
        return not getattr(self.rule, "limits", ())

    @property
    def settings(self) -> dict[str, Any]:
        """Return the rule's settings that differ from its defaults, without the safety factor."""
        plain = asdict(type(self.rule)())
        return {
            name: value
            for name, value in asdict(self.rule).items()
            if value != plain[name] and name not in ("safety_factor", "signature")
        }

    @property
    def described(self) -> str:
        """Return the threshold in words, with its safety factor or limits and their origin."""
        if by_hand := getattr(self.rule, "limits", ()):
            return f"{self.threshold} {', '.join(map(digits, by_hand))} {self.unit} {self.origin}"
        return f"{self.threshold}, safety factor {self.current[0].safety_factor:.4g} {self.origin}"

    def check(self, machine: Machine, detector: Any) -> None:
        """Raise SignatureError unless this was learned on that machine with that detector and those gains."""
        where = self.source or "signature"
        if detector.name != self.detector:
            raise SignatureError(
                f"{where}: learned with {self.detector}, not {detector.name}", "learn a signature for it"
            )
        if fingerprint(machine) != self.machine_fingerprint:
            raise SignatureError(
                f"{where}: learned on another machine ({self._other_than(machine)})",
                "learn a signature with this machine file",
            )
        gains = asdict(detector)
        for name, value in gains.items():
            if self.gains.get(name) != value:
                raise SignatureError(
                    f"{where}: learned with {name} = {self.gains.get(name)}, but the machine file has {value}",
                    "relearn it, or restore the gain in [detectors]",
                )

    def _other_than(self, machine: Machine) -> str:
        """Return the parameters in which a machine differs from that of the runs, in words."""
        differing: list[str] = []
        if self.machine_parameters is not None:
            differing = list(_differences(self.machine_parameters, machine_parameters(machine)))
        return first_of(differing) or f"'{self.machine}', with other parameters than '{machine.name}'"


def _differences(learned: Any, given: Any, name: str = "") -> Iterator[str]:
    """Yield in words where parameters that were learned with differ from the given ones."""
    if isinstance(learned, Mapping) and isinstance(given, Mapping):
        for key in dict.fromkeys((*learned, *given)):
            yield from _differences(learned.get(key), given.get(key), f"{name}.{key}" if name else str(key))
    elif isinstance(learned, list) and isinstance(given, list) and len(learned) == len(given):
        for number, pair in enumerate(zip(learned, given, strict=True)):
            yield from _differences(*pair, f"{name}[{number}]" if len(given) > 1 else name)
    elif learned != given:
        was, now = value_in_words(learned), value_in_words(given)
        if was == now:  # they differ in digits that are not shown
            was, now = f"{learned!r:.40}", f"{given!r:.40}"
        yield f"{name[:80]} was {was}, is {now}"


def with_run(
    signature: SignatureFile,
    index: int,
    updated: FittedThreshold,
    run: LearnedRun,
    normal: tuple[NormalMotion, ...] | None = None,
) -> SignatureFile:
    """Return the file with the class at `index` and the normal motions replaced, and the run added; `first` stays.

    Without `normal` the file keeps its own.
    """
    current = list(signature.current)
    current[index] = updated
    origin = replace(signature.origin, added=signature.origin.added + 1)
    changed = replace(signature, current=tuple(current), runs=(*signature.runs, run), origin=origin)
    return changed if normal is None else replace(changed, normal=normal)
