"""Results of fictitious builds: latencies chosen by the test, everything else as written by a benchmark."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cdtool.results.results import ContactResult, ExposureResult, FalseAlarmResult, RecordingResult, Results

MISSED, NOT_ASSESSABLE = "missed", "not_assessable"
Outcome = float | str
"""A latency [ms], or another outcome of the contact."""

RULES = {
    "onset": "load cell above 20 N for 3 ms, followed back to 8 N",
    "label_file": None,
    "synchronisation_s": 0.0,
    "window_s": {"stiff": 1.0, "soft": 1.0},
    "operations": "whole",
    "watched_joints": None,
    "mass_before_cell_kg": 0.0,
    "force_profiles": {"stiff": {"name": "gate", "steps": ({"from_s": 0.0, "at_most_n": 400.0},)}},
}
SETTINGS = {
    "tool_version": "1.0",
    "machine": "gate",
    "gains": {"momentum": {"bandwidth": 10.0}, "pure_torque": {}},
    "debounce_samples": 9,
    "short_names": {"momentum": "gm", "pure_torque": "pt"},
    "learned_sha256": {f"free/{i}.csv": f"free{i}" for i in range(10)},
}
ONSET, UNCERTAINTY = 5.0, 0.001


def build_results(
    outcomes: Mapping[tuple[str, str], Sequence[Outcome]],
    *,
    bytes_of: str = "run",
    names: str = "",
    begins: float = ONSET,
    force: float | None = 100.0,
    campaigns: Sequence[str] = (),
    false_alarms: Mapping[tuple[str, str], int] | None = None,
    hours: float = 1.0,
    holdout: Sequence[str] = (),
    **provenance: object,
) -> Results:
    """Return results with one contact per recording for each (detector, group).

    The force at the alarm grows with the latency. `bytes_of` and `names` distinguish the recordings of two builds by
    hash and by name. `holdout` detectors monitored 40 impact-free operations. Every contact `begins` at that time [s].
    `campaigns` has one entry per recording of a group.
    """
    groups = list(dict.fromkeys(group for _, group in outcomes))
    detectors = list(dict.fromkeys([*(detector for detector, _ in outcomes), *holdout]))
    counts = {group: max(len(items) for key, items in outcomes.items() if key[1] == group) for group in groups}
    alarms = false_alarms or {}
    watched = [*outcomes, *((name, "holdout") for name in holdout)]
    return Results(
        provenance={**RULES, **SETTINGS, **provenance},
        detectors=tuple(detectors),
        groups=(*groups, *(["holdout"] if holdout else [])),
        recordings=tuple(
            RecordingResult(
                name_of(names, group, i),
                group,
                f"{bytes_of}-{group}-{i}" if bytes_of else "",
                7.0,
                1,
                1,
                campaign=campaigns[i] if campaigns else None,
            )
            for group in groups
            for i in range(counts[group])
        ),
        contacts=tuple(
            contact(name_of(names, group, i), group, detector, outcome, begins, force)
            for (detector, group), items in outcomes.items()
            for i, outcome in enumerate(items)
        ),
        false_alarms=tuple(
            FalseAlarmResult(f"{group}/{i}", group, detector, "gate", 1.0)
            for (detector, group), count in alarms.items()
            for i in range(count)
        ),
        exposure=tuple(ExposureResult(group, detector, 40, 40, hours) for detector, group in watched),
    )


def name_of(names: str, group: str, number: int) -> str:
    return f"{group}/{names}{number:02d}.csv"


def contact(
    recording: str, group: str, detector: str, outcome: Outcome, onset: float, force: float | None
) -> ContactResult:
    latency = None if isinstance(outcome, str) else float(outcome)
    return ContactResult(
        recording=recording,
        group=group,
        detector=detector,
        joint="gate" if latency is not None else None,
        onset_s=onset,
        onset_uncertainty_s=UNCERTAINTY,
        alarm_s=None if latency is None else onset + 1e-3 * latency,
        latency_ms=latency,
        outcome=outcome if isinstance(outcome, str) else "detected",
        force_at_alarm_n=None if force is None or latency is None else force + 10.0 * latency,
        peak_force_n=4000.0,
        watched_ms=1000.0,
    )
