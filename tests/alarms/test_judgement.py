"""Several classes of motion over one log: the merged band compared with the rule written for whole arrays."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from cdtool.alarms.judgement import Judgement, judgement_of
from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import Band, Signal, Status
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.motion.applicable import speed_is_recent
from cdtool.recordings.recording import Recording
from cdtool.thresholds.base import with_limits
from tests.bits import assert_same_bits
from tests.recordings.motion.speed_logs import log

SLOW, FAST, BACK = MotionClass(1, 0.2), MotionClass(1, 0.3), MotionClass(-1, 0.3)
LEVELS = np.array([-np.inf, -2.0, -1.0, -0.0, 0.0, 1.0, 2.0, np.inf, np.nan])


@dataclass(frozen=True)
class MadeUp:
    """Limits drawn at random, the same for the same rows; linear in the safety factor."""

    motion: MotionClass
    seed: int
    safety_factor: float = 2.0

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:  # noqa: ARG002
        rng = np.random.default_rng(self.seed)
        lower, upper = (rng.choice(LEVELS, signal.values.shape) for _ in range(2))
        with np.errstate(invalid="ignore"):
            return with_limits(signal, 0.5 * self.safety_factor * lower, 0.5 * self.safety_factor * upper)

    def with_safety_factor(self, factor: float) -> MadeUp:
        return replace(self, safety_factor=factor)


def merged_by_arrays(judgement: Judgement, share_of_factor: float) -> tuple[FloatArray, FloatArray, Band]:
    """Values, status and band of all classes that judge, by the rule for whole arrays."""
    signal, shape = judgement.signal, judgement.signal.values.shape
    values = signal.values.copy()
    recent = speed_is_recent(judgement.recording, judgement.classes, signal.time, judgement.grace)[:, np.newaxis]
    status = np.where(signal.valid, np.where(recent, Status.OTHER_SPEED, Status.GAP), signal.status).astype(np.uint8)
    lower, upper, least = (np.full(shape, start) for start in (np.nan, np.nan, np.inf))
    open_below, open_above, limited = (np.zeros(shape, dtype=bool) for _ in range(3))
    for part in judgement._evaluations:
        factor = share_of_factor * part.threshold.safety_factor
        statistic, band = part.threshold.with_safety_factor(factor).evaluate(part.recording, part.signal)
        rows, judges = part.rows, part.applies[:, np.newaxis]
        valid = statistic.valid & judges
        with np.errstate(invalid="ignore"):
            over = np.fmax(statistic.values - band.upper, band.lower - statistic.values)
        outside = np.where(valid, over, np.inf)
        taken = valid & ((outside < least[rows]) | (status[rows] != Status.VALID))
        unknown = judges & ~statistic.valid & (status[rows] == Status.OTHER_SPEED)
        sources = ((values, statistic.values), (lower, band.lower), (upper, band.upper), (least, outside))
        for target, source in sources:
            target[rows] = np.where(taken, source, target[rows])
        status[rows] = np.where(taken, Status.VALID, np.where(unknown, statistic.status, status[rows]))
        open_below[rows] |= valid & np.isneginf(band.lower)
        open_above[rows] |= valid & np.isposinf(band.upper)
        limited[rows] |= valid & (np.isfinite(band.lower) | np.isfinite(band.upper))
    status[open_below & open_above & limited] = Status.NO_LIMIT
    return values, status, Band(lower, upper)


def met_at_by_arrays(judgement: Judgement) -> FloatArray:
    met = np.full(judgement.signal.values.shape, np.inf)
    judges = np.zeros(met.shape, dtype=bool)
    for part in judgement._evaluations:
        statistic, exceeded = part.exceedance
        use = statistic.valid & part.applies[:, np.newaxis]
        met[part.rows] = np.where(use, np.minimum(met[part.rows], exceeded), met[part.rows])
        judges[part.rows] |= use
    return np.where(judges, met, -np.inf)


def made_up_signal(recording: Recording, seed: int, joints: int, shift: float) -> Signal:
    rng = np.random.default_rng(seed)
    time = recording["speed"].time + shift
    status = rng.choice(np.array([0, 0, 0, 1, 3], dtype=np.uint8), (len(time), joints))
    values = np.where(status == 0, rng.choice([-1.0, 0.0, 0.5, 3.0], status.shape), np.nan)
    # In the order of columns, as a detector that computes joint by joint may return them.
    return Signal(time, np.asfortranarray(values), np.asfortranarray(status), "N", joints=tuple("ab"[:joints]))


@pytest.mark.parametrize("cut", ["whole", "motion"])
@pytest.mark.parametrize("shift", [0.0, 0.3e-3])
@pytest.mark.parametrize("classes", [(FAST,), (SLOW, FAST), (FAST, BACK, SLOW)])
def test_the_merged_band_and_its_factors_have_the_bits_of_the_rule_for_arrays(classes, shift, cut):
    for seed in range(4):
        recording = log((0.3, 1.2), (0.0, 1.3), (-0.3, 1.2), (0.0, 1.5), seed=seed)
        signal = made_up_signal(recording, seed, 1 + seed % 2, shift)
        thresholds = [MadeUp(item, 10 * seed + number) for number, item in enumerate(classes)]
        judgement = judgement_of(recording, signal, thresholds, cut)
        assert len(judgement._evaluations) >= len(classes)
        for share in (1.0, 0.9):
            values, status, band = merged_by_arrays(judgement, share)
            ours = judgement.narrower(share) if share < 1.0 else judgement.evaluated[1]
            assert_same_bits(ours.lower, band.lower)
            assert_same_bits(ours.upper, band.upper)
            if share == 1.0:
                assert_same_bits(judgement.evaluated[0].values, values)
                assert_same_bits(judgement.evaluated[0].status, status)
        assert_same_bits(judgement.met_at, met_at_by_arrays(judgement))
