"""A gate with signatures: detections of simulated runs, as workflows pass them to a report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, detect_operation, run_detector
from cdtool.detectors import DETECTORS
from cdtool.machines.linear_axis import LinearAxis
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Recording
from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.results import ExposureResult, FalseAlarmResult, RecordingResult, Results, Skipped
from cdtool.thresholds.signature import Signature
from tests.report.bench import NAMES, Bench, contacts_of


@pytest.fixture(scope="session")
def bench(gate: LinearAxis, simulated: Callable[[str, int], Recording]) -> Bench:
    free = [operations_of(simulated("none", seed))[0] for seed in range(10)]
    detectors = {name: DETECTORS.load(name)() for name in NAMES}
    learned = {
        name: Signature().fit([(op.recording.without_ground_truth(), run_detector(op, gate, detector)) for op in free])
        for name, detector in detectors.items()
    }

    def detect(recording: Recording, name: str) -> Detection:
        operation = operations_of(recording)[0]
        learned_for_it = replace(learned[name], joints=recording.joints)  # hostile names are tried on a gate's run
        return detect_operation(operation, gate, detectors[name], (learned_for_it,), Activation())

    return Bench(detect)


@pytest.fixture
def results() -> Results:
    """Two detectors; slow latencies of `momentum`, one miss, one not assessable, one false alarm."""
    rng = np.random.default_rng(3)
    soft = [float(late) for late in rng.uniform(300.0, 400.0, 30)]
    contacts = contacts_of("friction_ekf", "stiff", [30.0, 34.0, 38.0, "standing still"])
    contacts += contacts_of("momentum", "stiff", [60.0, 70.0, None])
    contacts += contacts_of("momentum", "soft", soft)
    logs = {"stiff": 4, "soft": 30, "holdout": 40}
    return Results(
        provenance={
            "tool_version": "9.8.7",
            "onset": "above 20 N, back to 8 N",
            "machine_sha256": "c0ffee" * 10,
            "short_names": {"friction_ekf": "feekf"},
            "gains": {"momentum": {"bandwidth": 30.0}},
            "signature_sha256": {"momentum": "5eed" * 16},
            "learned_sha256": {"free/01.csv": "ab12" * 16},
            "units": {"momentum": "N"},
        },
        detectors=("friction_ekf", "momentum"),
        groups=("stiff", "soft", "holdout"),
        contacts=tuple(contacts),
        false_alarms=(FalseAlarmResult("holdout/01.csv", "holdout", "momentum", "gate", 1.0, "above", 25.0, 20.0, 2),),
        exposure=(
            ExposureResult("stiff", "friction_ekf", 4, 4, 0.01, 1, {"standing still": 0.25}),
            ExposureResult("stiff", "momentum", 3, 3, 0.01),
            ExposureResult("soft", "momentum", 30, 30, 0.06),
            ExposureResult("holdout", "momentum", 40, 40, 0.1),
        ),
        recordings=tuple(
            RecordingResult(f"{group}/{i:02}.csv", group, "cd34" * 16, 7.0, 1, int(group != "holdout"))
            for group, count in logs.items()
            for i in range(1, count + 1)
        ),
        skipped=(Skipped("broken.csv", "broken.csv: empty file"),),
    )


@pytest.fixture
def evaluated(results: Results) -> Evaluated:
    """The same with its statistics."""
    return evaluate(results)
