"""A whole test protocol: plan, assessed points, verdict, and the files from which all of it was made."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Literal

from cdtool.commands.protocol.assessment.assessment import PointAssessment
from cdtool.commands.protocol.assessment.plan import TestPlan
from cdtool.commands.protocol.assessment.reasons import ProtocolVerdict

Role = Literal[
    "protocol", "benchmark", "machine", "robot", "limits", "labels", "measured", "excluded", "scored", "learned"
]


@dataclass(frozen=True)
class FileDigest:
    """A file with its SHA-256, and what it was used for."""

    name: str
    sha256: str
    role: Role


@dataclass(frozen=True)
class ExcludedRecording:
    """A recording that is not counted, and why."""

    recording: str
    reason: str


@dataclass(frozen=True)
class Protocol:
    """A test protocol; `command` made it, `detectors` are those whose latencies it shows."""

    plan: TestPlan
    points: tuple[PointAssessment, ...]
    verdict: ProtocolVerdict
    files: tuple[FileDigest, ...]
    excluded: tuple[ExcludedRecording, ...] = ()
    detectors: tuple[str, ...] = ()
    tool_version: str = ""
    command: str = ""

    @property
    def data_sha256(self) -> str:
        """Return the hash of the data, which stands on every page: of all files' names and hashes, in their order."""
        lines = "".join(f"{item.sha256}  {item.name}\n" for item in self.files)
        return hashlib.sha256(lines.encode("utf-8", "surrogatepass")).hexdigest()
