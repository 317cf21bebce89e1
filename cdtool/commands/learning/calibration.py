"""The safety factor for a false-alarm budget, set on impact-free runs by cross-validation."""

from __future__ import annotations

from collections.abc import Sequence

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge_alone
from cdtool.base.errors import SignatureError, UsageError
from cdtool.commands.judging.log_groups import Split, split_names
from cdtool.commands.learning.fitting import Fit, Fitted, Pair
from cdtool.results.curves.false_alarm_budget import Budget, Calibrated, set_factor

# Runs are tested with thresholds learned from the other nine tenths.
FOLDS = 10


def in_fixed_order(pairs: Sequence[Pair]) -> list[Pair]:
    """Return the runs in an order independent of their files, so that the folds do not depend on it."""
    return sorted(pairs, key=lambda pair: (pair[0].recording.digest, pair[0].number, pair[0].name))


def kept(pairs: Sequence[Pair], fitted: Fitted) -> list[Pair]:
    """Return the runs that were not left out."""
    names = {item.recording for item in (*fitted.skipped, *fitted.creeping)}
    return [pair for pair in pairs if pair[0].name not in names]


def folds_of(pairs: Sequence[Pair], split: Split, count: int) -> list[int]:
    """Return for each run the number of its fold: up to `count`, and what stays together by `split` in one of them.

    Raises UsageError as `split_names`.
    """
    numbers: dict[str, int] = {}
    names = split_names(split, [operation for operation, _ in pairs])
    return [numbers.setdefault(name, len(numbers)) % count for name in names]


def calibrate(
    budget: Budget,
    detector: str,
    pairs: Sequence[Pair],
    fit: Fit,
    activation: Activation,
    split: Split = Split.RECORDING,
) -> Calibrated:
    """Return the safety factor for a budget, set on every run with thresholds learned from runs of other folds.

    Raises UsageError if there are too few runs for the budget, or to learn from nine tenths of them.
    """
    if budget.per == "operation":
        budget.check(len(pairs), detector)
    detections: list[Detection] = []
    fold_of = folds_of(pairs, split, FOLDS)
    for fold in sorted(set(fold_of)):
        others = [pair for own, pair in zip(fold_of, pairs, strict=True) if own != fold]
        try:
            fitted = fit(others)
        except SignatureError as fault:
            raise _too_few(budget, detector, fault.message) from fault
        if fitted.skipped:
            raise _too_few(budget, detector, fitted.skipped[0].reason)
        held_out = [pair for own, pair in zip(fold_of, pairs, strict=True) if own == fold]
        detections += [
            judge_alone(operation, detector, signal, fitted.thresholds, activation) for operation, signal in held_out
        ]
    return set_factor(budget, detector, detections, activation)


def _too_few(budget: Budget, detector: str, why: str) -> UsageError:
    return UsageError(
        f"false-alarm budget {budget}: {detector} cannot learn from nine tenths of the runs: {why}",
        "add runs (of each class of motion), or remove the budget",
    )
