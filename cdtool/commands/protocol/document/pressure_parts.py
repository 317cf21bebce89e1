"""What a protocol shows of the contact pressures: columns of the results, checks, curves, limits and deviations."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

from cdtool.commands.protocol.assessment.assessment import PointAssessment, Repetition
from cdtool.commands.protocol.assessment.pressure import PressureAssessment, as_profile
from cdtool.commands.protocol.document.words import Words
from cdtool.truth.force.limits import ForceProfile


class Pressures(NamedTuple):
    """Pressures of a point [N/cm2]: the column, the value of each repetition, the highest one, the limit."""

    name: str
    values: tuple[float | None, ...]
    limit: float | None

    @property
    def highest(self) -> float | None:
        """Return the highest value; None without one."""
        return max((value for value in self.values if value is not None and math.isfinite(value)), default=None)


def pressures_of(point: PointAssessment) -> Iterator[Pressures]:
    """Yield the largest pressures of a point, and if they were recorded those where the quasi-static limit applies."""
    found = point.pressures
    limit = found[0].limit if found else None
    first, quasi_static = (limit.first, limit.quasi_static) if limit else (None, None)
    if any(item.is_known for item in found):
        yield Pressures("pressure", tuple(item.peak for item in found), first)
    if any(item.record for item in found):
        yield Pressures("late_pressure", tuple(item.late_peak for item in found), quasi_static)


def pressures_without_limit(points: Sequence[PointAssessment]) -> list[str]:
    """Return the names of the points whose pressure is known and not limited."""
    free = [point for point in points if point.profile and not point.profile.pressures]
    return [point.point.name for point in free if any(item.is_known for item in point.pressures)]


def pressure_deviations(points: tuple[PointAssessment, ...], words: Words) -> Iterator[tuple[str, str]]:
    """Yield what deviates, and why: pressures that are not measured, and two peaks of one contact that differ."""
    for point in points:
        if point.profile and point.profile.pressures and point.point.no_pressure_reason:
            yield words("deviation.no_pressure", point=point.point.name), point.point.no_pressure_reason
        for number, item in enumerate(point.pressures, 1):
            if item.peaks_differ and item.record is not None:
                values = {"entered": item.entered, "recorded": item.record.peak}
                what = words("deviation.peaks_differ", point=point.point.name, repetition=number, **values)
                yield what, words("deviation.both_compared")


def pressure_curves(point: PointAssessment) -> PointAssessment | None:
    """Return a point whose curves are the recorded pressures, with their limits; None without a record or a limit."""
    limit = point.pressures[0].limit if point.pressures else None
    repetitions = tuple(
        replace(one, curve=item.record.curve, verdict=item.verdict)
        for one, item in zip(point.repetitions, point.pressures, strict=True)
        if item.record and item.verdict
    )
    if point.profile is None or limit is None or not repetitions:
        return None
    return replace(point, profile=as_profile(point.profile, limit), repetitions=repetitions)


def pressure_limit_rows(
    profile: ForceProfile, points: tuple[PointAssessment, ...], words: Words
) -> list[tuple[object, ...]]:
    """Return a row for each area of the body: its limits, and the points to which they apply."""
    rows: list[tuple[object, ...]] = []
    for item in profile.pressures:
        names = [point.point.name for point in points if _applies(point, profile, item.area)]
        rows.append((words.name("of_limits", item.area), item.transient, item.quasi_static, ", ".join(names)))
    return rows


def _applies(point: PointAssessment, profile: ForceProfile, area: str) -> bool:
    limit = profile.pressure_limit(point.point.body_area) if point.profile == profile else None
    return limit is not None and limit.area == area


def worst_outcome(item: Repetition, pressure: PressureAssessment) -> str:
    """Return the key of the outcome of a repetition: the worse one of its force and its pressure."""
    order = ("fail", "not_assessable", "pass")
    return f"outcome.{min(item.verdict.outcome, pressure.outcome, key=order.index)}"
