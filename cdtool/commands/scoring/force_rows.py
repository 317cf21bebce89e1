"""Force verdicts as rows of the results: per contact, and per test point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cdtool.base.files.strict_json import finite
from cdtool.results.results import ForceResult, ForceStepResult, PointResult, RecordingResult
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.limits import ForceProfile
from cdtool.truth.force.verdict import ForceVerdict, averaged


def force_rows(
    recording: RecordingResult, verdicts: Mapping[int, ForceVerdict], curves: Mapping[int, ForceTimeCurve]
) -> list[ForceResult]:
    """Return a row for each contact of a recording, by its number."""
    return [
        ForceResult(
            recording=recording.recording,
            group=recording.group,
            contact=number,
            profile=verdict.profile,
            verdict=verdict.outcome,
            peak_n=curves[number].peak,
            steps=tuple(
                ForceStepResult(
                    name=item.step.name,
                    from_s=item.step.from_s,
                    at_most_n=item.step.at_most_n,
                    peak_n=finite(item.peak),
                    time_budget_ms=finite(1e3 * item.time_budget),
                    verdict=item.outcome,
                    reason=item.reason or None,
                )
                for item in verdict.steps
            ),
            point=recording.point,
            time_budget_ms=finite(1e3 * verdict.time_budget),
            reason=verdict.reason or None,
        )
        for number, verdict in verdicts.items()
    ]


def point_rows(
    tests: Mapping[tuple[str, str], Sequence[ForceVerdict]], profiles: Mapping[str, ForceProfile | None]
) -> list[PointResult]:
    """Return a row for each (group, point) with tests; `profiles` are those of the groups."""
    rows = []
    for (group, point), verdicts in tests.items():
        profile = profiles[group]
        if profile is None:
            continue
        verdict = averaged(verdicts, profile)
        steps = tuple(
            ForceStepResult(
                name=item.step.name,
                from_s=item.step.from_s,
                at_most_n=item.step.at_most_n,
                peak_n=finite(item.force),
                time_budget_ms=None,
                verdict=item.outcome,
                reason=item.reason or None,
            )
            for item in verdict.steps
        )
        note, reason = verdict.note, verdict.reason or None
        rows.append(PointResult(point, group, profile.name, verdict.tests, verdict.outcome, steps, note, reason))
    return rows
