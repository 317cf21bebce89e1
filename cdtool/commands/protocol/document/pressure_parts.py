"""What a protocol shows of the contact pressures: columns of the results, checks, curves, limits and deviations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from cdtool.commands.protocol.assessment.assessment import PointAssessment, Repetition
from cdtool.commands.protocol.assessment.pressure import PressureAssessment, as_profile, highest
from cdtool.commands.protocol.document.words import Words
from cdtool.truth.force.limits import ForceProfile


def pressure_columns(point: PointAssessment, words: Words) -> Iterator[tuple[str, list[str]]]:
    """Yield name and cells of the columns: a cell per repetition, the highest value, the limit; none without values."""
    found = point.pressures
    if not any(item.is_known for item in found):
        return
    most, limit = highest(found), found[0].limit
    first, quasi_static = (limit.first, limit.quasi_static) if limit else (None, None)
    yield "pressure", _cells([*(item.peak for item in found), most["peak"]], first, words)
    if any(item.record for item in found):
        yield "late_pressure", _cells([*(item.late_peak for item in found), most["late_peak"]], quasi_static, words)


def _cells(values: list[float | None], limit: float | None, words: Words) -> list[str]:
    if limit is None:
        return [*map(words.value, values), ""]
    return [*(words.beside(value, limit) for value in values), words.limit(limit)]


def pressures_without_limit(points: Sequence[PointAssessment]) -> dict[str, list[str]]:
    """Return the names of the points whose pressure is known and not limited, by profile."""
    found: dict[str, list[str]] = {}
    for point in points:
        if point.profile and not point.profile.pressures and any(item.is_known for item in point.pressures):
            found.setdefault(point.profile.name, []).append(point.point.name)
    return found


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
    pairs = [(one, item.record) for one, item in zip(point.repetitions, point.pressures, strict=True) if item.record]
    if point.profile is None or limit is None or not pairs:
        return None
    repetitions = tuple(replace(one, curve=record.curve) for one, record in pairs)
    return replace(point, profile=as_profile(point.profile, limit), repetitions=repetitions)


def pressure_limit_rows(
    profile: ForceProfile, points: tuple[PointAssessment, ...], words: Words
) -> list[tuple[object, ...]]:
    """Return a row for each area of the body: its limits, and the points to which they apply."""
    rows: list[tuple[object, ...]] = []
    for item in profile.pressures:
        names = [point.point.name for point in points if _applies(point, profile, item.area)]
        rows.append((words.name("area", item.area), item.transient, item.quasi_static, ", ".join(names)))
    return rows


def _applies(point: PointAssessment, profile: ForceProfile, area: str) -> bool:
    limit = profile.pressure_limit(point.point.body_area) if point.profile == profile else None
    return limit is not None and limit.area == area


def worst_outcome(item: Repetition, pressure: PressureAssessment) -> str:
    """Return the key of the outcome of a repetition: the worse one of its force and its pressure."""
    order = ("fail", "not_assessable", "pass")
    return f"outcome.{min(item.verdict.outcome, pressure.outcome, key=order.index)}"
