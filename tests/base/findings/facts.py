"""What a finding says, without where: its kind and numbers, equal to a tuple of both."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from cdtool.base.findings import Finding


class Fact(NamedTuple):
    kind: str
    numbers: Mapping[str, Any]


def fact_of(finding: Finding) -> Fact:
    return Fact(finding.kind, finding.numbers)
