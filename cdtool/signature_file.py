"""What a signature file holds: the thresholds of one machine and one detector, and where they come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from cdtool.activation import Activation
from cdtool.dynamics import Gain, Machine
from cdtool.errors import SignatureError
from cdtool.machine_file import fingerprint
from cdtool.plain_text import counted, digits
from cdtool.plausible import PlausibleRanges
from cdtool.thresholds.base import FittedThreshold, Threshold
from cdtool.thresholds.normal_motion import NormalMotion


@dataclass(frozen=True)
class LearnedRun:
    """A run that a signature was learned from: its name, the SHA-256 of its file, and which operation of it."""

    name: str
    sha256: str
    operation: int = 0


@dataclass(frozen=True)
class FactorOrigin:
    """Where a safety factor comes from: the rule's default, a hand, or a false-alarm budget.

    With a budget: its text, the impact-free operations that the factor was set on, and the alarms it gives on them.
    `added`: runs that a signature was updated with since.
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


@dataclass(frozen=True)
class SignatureFile:
    """The thresholds of one machine and one detector with its gains: of a signature, one for each class of motion.

    `rule` is the threshold's with its settings, `origin` where its safety factor comes from. `first` keeps what was
    first learned; `current` is what counts. `joints` are those that are watched: the columns of the signal.
    `operations`: how the logs were cut. `plausible`: what values the runs' channels had; None in older files. `normal`:
    what every channel looks like in the runs, one for each class of motion with enough of them; None in a file that
    was written before there was such a thing.
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

    @property
    def threshold(self) -> str:
        """The threshold's name."""
        return str(self.rule.name)

    @property
    def of_earlier_version(self) -> str:
        """What a file of an earlier version has not, and how to migrate it, in a line; empty of one of this version.

        Runs that are added to such a file do not make up for it.
        """
        if self.normal is not None:
            return ""
        parts = "the speed profiles, plausible ranges and normal motions of its runs"
        return f"of an earlier version, without {parts}: learn it again with cdtool learn-signature to have them"

    @property
    def learns_limits(self) -> bool:
        """Whether the runs decide the limits, and no hand."""
        return not getattr(self.rule, "limits", ())

    @property
    def settings(self) -> dict[str, Any]:
        """The rule's settings that differ from its defaults, its safety factor apart."""
        plain = asdict(type(self.rule)())
        return {
            name: value
            for name, value in asdict(self.rule).items()
            if value != plain[name] and name not in ("safety_factor", "signature")
        }

    @property
    def described(self) -> str:
        """The threshold with its safety factor or limits, and where those come from."""
        if by_hand := getattr(self.rule, "limits", ()):
            return f"{self.threshold} {', '.join(map(digits, by_hand))} {self.unit} {self.origin}"
        return f"{self.threshold}, safety factor {self.current[0].safety_factor:.4g} {self.origin}"

    def check(self, machine: Machine, detector: Any) -> None:
        """Raise SignatureError unless this was learned on that machine with that detector and those gains."""
        where = self.source or "signature"
        if detector.name != self.detector:
            raise SignatureError(f"{where}: learned with {self.detector}, not {detector.name}", "learn one for it")
        if fingerprint(machine) != self.machine_fingerprint:
            raise SignatureError(
                f"{where}: learned on another machine ('{self.machine}', other parameters than '{machine.name}')",
                "learn a signature with this machine file",
            )
        gains = asdict(detector)
        for name, value in gains.items():
            if self.gains.get(name) != value:
                raise SignatureError(
                    f"{where}: learned with {name} = {self.gains.get(name)}, the machine file has {value}",
                    "learn again, or restore the gain in [detectors]",
                )


def with_run(
    signature: SignatureFile,
    index: int,
    updated: FittedThreshold,
    run: LearnedRun,
    normal: tuple[NormalMotion, ...] | None = None,
) -> SignatureFile:
    """The file with the class at `index` and the normal motions replaced, and the run noted; the first signature stays.

    Without `normal` the file keeps its own.
    """
    current = list(signature.current)
    current[index] = updated
    origin = replace(signature.origin, added=signature.origin.added + 1)
    changed = replace(signature, current=tuple(current), runs=(*signature.runs, run), origin=origin)
    return changed if normal is None else replace(changed, normal=normal)
