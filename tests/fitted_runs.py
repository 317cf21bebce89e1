"""What a rule learns from impact-free operations, without a benchmark file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from cdtool.commands.learning.fitting import Fitted, fitting, for_machine, signals_of
from cdtool.machines.dynamics import Machine
from cdtool.recordings.operations import Operation
from cdtool.thresholds.base import Threshold


def fit_operations(
    operations: Sequence[Operation], machine: Machine, detector: Any, rule: Threshold, watched: Sequence[str] = ()
) -> Fitted:
    """Learn the rule from operations of a machine with a detector; raises SignatureError."""
    pairs, skipped = signals_of(operations, machine, detector, watched)
    fitted = fitting(for_machine(rule, machine))(pairs)
    return replace(fitted, skipped=(*skipped, *fitted.skipped))
