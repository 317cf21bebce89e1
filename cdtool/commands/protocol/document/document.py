"""The document of a test protocol: the verdict first, then what it rests on, then the signatures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import accumulate

from cdtool.base.plain_text import plain
from cdtool.commands.protocol.assessment.assessment import LAST_STEP_S, PointAssessment, Repetition, required_record
from cdtool.commands.protocol.assessment.plan import Instrument
from cdtool.commands.protocol.assessment.pressure import PressureRecord
from cdtool.commands.protocol.assessment.protocol import Protocol
from cdtool.commands.protocol.document.blocks import (
    Block,
    CurveDrawing,
    Document,
    Facts,
    HeadedTable,
    Items,
    Paragraph,
    SectionHeading,
    Signatures,
    VerdictBox,
)
from cdtool.commands.protocol.document.curve_drawing import curve_drawings
from cdtool.commands.protocol.document.pressure_parts import (
    pressure_columns,
    pressure_curves,
    pressure_deviations,
    pressure_limit_rows,
    pressures_without_limit,
    worst_outcome,
)
from cdtool.commands.protocol.document.words import Words, words_of
from cdtool.truth.force.limits import ForceProfile
from cdtool.truth.force.verdict import PointVerdict

# Names of measuring points on the first page: so many characters.
_NAMED = 200
# A page is as wide as so many forces beside each other; the next steps are in another table.
_STEPS_IN_TABLE = 5


@dataclass(frozen=True)
class ProtocolReport:
    """What the writers of a protocol write: the protocol, and its document, which is made once."""

    protocol: Protocol

    @cached_property
    def document(self) -> Document:
        """The document in the language of the plan."""
        return protocol_document(self.protocol)


def protocol_document(protocol: Protocol) -> Document:
    """Return the document of a protocol in the language of its plan; the same for the same protocol."""
    words = words_of(protocol.plan.language)
    day = protocol.plan.test.date
    number = protocol.plan.number
    return Document(
        title=words("document.title"),
        number=words("document.number", number=plain(number)) if number else "",
        language=words.language,
        data_hash=words("document.data_hash", hash=protocol.data_sha256),
        page=words("document.page", page="{page}", pages="{pages}"),
        day=(day.year, day.month, day.day) if day else None,
        blocks=(
            *_cover(protocol, words),
            *_machine(protocol, words),
            *_instruments(protocol, words),
            *_plan(protocol, words),
            *_results(protocol, words),
            *_curves(protocol, words),
            *_latencies(protocol, words),
            *_checks(protocol, words),
            *_deviations(protocol, words),
            *_limits(protocol, words),
            *_provenance(protocol, words),
            *_signatures(protocol, words),
        ),
    )


def protocol_statement(protocol: Protocol) -> tuple[str, ...]:
    """Return outcome, sentence and reasons of a protocol in English, for the screen and `Evaluated.with_protocol`."""
    words, outcome = words_of("en"), protocol.verdict.outcome
    reasons = [sentence for _, sentences in _reasons(protocol, words) for sentence in sentences]
    return outcome, f"test protocol: {outcome}: {_verdict_text(protocol, words).removesuffix('.')}", *reasons


def _verdict_text(protocol: Protocol, words: Words) -> str:
    points = protocol.points
    failed = sum(point.outcome == "fail" for point in points)
    return words(f"verdict.{protocol.verdict.outcome}_text", points=len(points), failed=failed)


def _cover(protocol: Protocol, words: Words) -> Iterator[Block]:
    verdict, points = protocol.verdict, protocol.points
    text = _verdict_text(protocol, words)
    is_open = verdict.outcome == "fail" and verdict.of("incomplete")
    if is_open:
        text += " " + words("verdict.open_items", count=len(words.reasons(verdict, "incomplete")))
    yield VerdictBox(verdict.outcome, words(f"verdict.{verdict.outcome}"), text)
    plan = protocol.plan
    shown = (
        ("type", plan.machine.type),
        ("serial_number", plan.machine.serial_number),
        ("date", plan.test.date),
        ("place", plan.test.place),
        ("tester", plan.test.tester),
        ("organisation", plan.test.organisation),
        ("points", _first_names([point.point.name for point in points], words)),
    )
    yield Facts(tuple((words(f"field.{name}"), plain(words.value(value or None))) for name, value in shown))
    # The notices before the reasons: these may need more than the first page.
    yield SectionHeading(words("verdict.notices"))
    yield Items(tuple(map(plain, _notices(protocol, words))))
    for outcome, sentences in _reasons(protocol, words):
        yield SectionHeading(words(f"verdict.why_{outcome}"))
        yield Items(tuple(map(plain, sentences)))


def _first_names(names: Sequence[str], words: Words) -> str:
    """Return names in a list, or the first ones that fit into a few lines and how many more there are."""
    lengths = accumulate(len(name) + 2 for name in names)
    count = max(1, sum(length <= _NAMED for length in lengths))
    listed = ", ".join(names[:count])
    return listed if count >= len(names) else words("verdict.more_names", names=listed, count=len(names) - count)


def _reasons(protocol: Protocol, words: Words) -> list[tuple[str, list[str]]]:
    """Return the sentences of each outcome that has any, those of a fail first."""
    found = [(outcome, words.reasons(protocol.verdict, outcome)) for outcome in ("fail", "incomplete")]
    return [(outcome, sentences) for outcome, sentences in found if sentences]


def _notices(protocol: Protocol, words: Words) -> Iterator[str]:
    profiles = {point.profile.name: point.profile for point in protocol.points if point.profile}
    for profile in profiles.values():
        if not profile.checked:
            sources = "; ".join(filter(None, (profile.source, profile.pressure_source)))
            yield words("notice.unchecked", profile=profile.name, source=sources)
    yield from _unstated(protocol, profiles.values(), words)
    for point in protocol.points:
        if point.verdict and point.profile and point.profile.average_of > 1:
            for step in point.verdict.steps:
                if step.above and step.outcome != "fail":
                    values = {
                        "count": step.above,
                        "tests": point.verdict.tests,
                        "step": words.name("step", step.step.name),
                    }
                    yield words("notice.single_above", point=point.point.name, **values)
    for profile_name, names in pressures_without_limit(protocol.points).items():
        yield words("notice.pressure", points=_first_names(names, words), profile=profile_name)
    if unconfirmed := [
        item.point.name for item in protocol.points if any(one.speed is None for one in item.repetitions)
    ]:
        yield words("notice.no_speed", points=_first_names(unconfirmed, words))
    yield words("notice.certificate")


def _unstated(protocol: Protocol, profiles: Iterable[ForceProfile], words: Words) -> Iterator[str]:
    """Yield what profiles do not state about the measurement, and what the protocol requires instead."""
    without_rate = [profile.name for profile in profiles if not profile.sample_rate_at_least_hz]
    if without_rate:
        rates = [
            item.sample_rate
            for point in protocol.points
            if point.profile and point.profile.name in without_rate
            for item in point.repetitions
        ]
        key = "notice.no_rate" if rates else "notice.no_rate_measured"
        yield words(key, profiles=", ".join(without_rate), rate=min(rates, default=math.nan))
    without_record = [profile.name for profile in profiles if not profile.record_at_least_s]
    if without_record:
        yield words("notice.no_record", profiles=", ".join(without_record), length=LAST_STEP_S)


def _machine(protocol: Protocol, words: Words) -> Iterator[Block]:
    yield SectionHeading(words("section.machine"), page_break=True)
    plan = protocol.plan
    rows = [
        (words(f"field.{item.name}"), plain(words.value(getattr(part, item.name) or None)))
        for part in (plan.machine, plan.test)
        for item in fields(part)
        if getattr(part, item.name) not in ("", None) or item.metadata["due"] != "never"
    ]
    if plan.test.temperature_c == 0.0:
        zero = words("field.temperature_c")
        rows = [(label, words.number(0.0) if label == zero else value) for label, value in rows]
    yield Facts(tuple(rows))


def _instruments(protocol: Protocol, words: Words) -> Iterator[Block]:
    yield SectionHeading(words("section.instruments"))
    names = ("quantity", "model", "serial_number", "range", "accuracy_class", "sample_rate", "filter")
    rows = []
    for item in protocol.plan.instruments:
        reach = f"{words.number(item.range_n)} N" if item.range_n else item.range
        reach = f"{words.number(item.range_n_per_cm2)} N/cm²" if item.range_n_per_cm2 else reach
        values = (
            words.name("quantity", item.quantity),
            item.model,
            item.serial_number,
            reach,
            item.accuracy_class,
            item.sample_rate_hz,
        )
        rows.append((*values, item.filter, item.calibrated_on, item.calibration_valid_until))
    columns = (*names, "calibrated_on", "calibration_valid_until")
    yield _grid(words, columns, rows, widths=(5, 8, 6, 5, 5, 5, 6, 6, 6), numeric=(5,))


def _plan(protocol: Protocol, words: Words) -> Iterator[Block]:
    yield SectionHeading(words("section.plan"))
    names = ("point", "position", "region", "obstacle", "stiffness", "area", "speed", "repetitions")
    rows = []
    for item in protocol.plan.points:
        numbers = (item.obstacle_stiffness_n_per_mm, item.contact_area_mm2, item.speed_m_per_s, item.repetitions)
        rows.append((item.name, item.position, item.region, item.obstacle, *numbers))
    if rows:
        yield _grid(words, names, rows, widths=(8, 12, 9, 9, 6, 5, 5, 6), numeric=(4, 5, 6, 7))
    else:
        yield Paragraph(words("text.no_point"))


def _results(protocol: Protocol, words: Words) -> Iterator[Block]:
    yield SectionHeading(words("section.results"))
    yield Paragraph(words("text.results"), "note")
    for point in protocol.points:
        yield SectionHeading(plain(point.point.name), level=2)
        yield from _matrix(point, words)


def _matrix(point: PointAssessment, words: Words) -> Iterator[Block]:
    """Yield the repetitions of a point with the mean and the limits of its profile, all steps of it."""
    if point.profile is None:
        yield Paragraph(words("text.not_assessed"))
    elif point.verdict is None or not point.repetitions:
        yield Paragraph(words("text.nothing_measured"))
    else:
        steps = range(len(point.profile.steps))
        for begin in steps[::_STEPS_IN_TABLE]:
            yield _forces(point, point.profile, point.verdict, steps[begin : begin + _STEPS_IN_TABLE], words)


def _forces(
    point: PointAssessment, profile: ForceProfile, verdict: PointVerdict, steps: range, words: Words
) -> HeadedTable:
    """Return the table of some steps: a row for each repetition, then their mean and the limits."""
    items = point.repetitions
    kind = "mean" if profile.average_of > 1 else "highest"
    numbers = [str(number) for number in range(1, len(items) + 1)]
    columns = [
        (words("column.repetition"), [*numbers, words(f"row.{kind}"), words("row.limit")]),
        (words("column.recording"), [*(item.recording for item in items), "", profile.name]),
    ]
    if not steps.start:
        planned = words("column.planned", speed=point.point.speed_m_per_s)
        columns.append((words("column.measured_speed"), [*(words.value(item.speed) for item in items), "", planned]))
    for number in steps:
        step, limit = profile.steps[number], profile.steps[number].at_most_n
        forces = [*(item.verdict.steps[number].peak for item in items), verdict.steps[number].force]
        columns.append(
            (words.force_of(step.name), [*(words.beside(force, limit) for force in forces), words.limit(limit)])
        )
        if number == 0 and len(profile.steps) > 1:
            times = [item.dynamic_time for item in items]
            of_all = sum(times) / len(times) if kind == "mean" else max(times)
            cells = [_time(time, words) for time in (*times, of_all)]
            columns.append((words("column.dynamic_time"), [*cells, words.limit(1e3 * profile.steps[1].from_s)]))
    if not steps.start:
        columns += [(words(f"column.{name}"), cells) for name, cells in pressure_columns(point, words)]
    outcomes = [*map(worst_outcome, items, point.pressures), f"outcome.{point.outcome}"]
    columns.append((words("column.result"), [*map(words, outcomes), ""]))
    rows = zip(*(cells for _, cells in columns), strict=True)
    numeric = tuple(range(2, len(columns) - 1))
    widths = (6, 12, *(6 for _ in numeric), 9)
    strong = (len(items), len(items) + 1)
    return _table([name for name, _ in columns], rows, widths=widths, numeric=numeric, strong=strong)


def _time(seconds: float, words: Words) -> str:
    """Return a time above a limit in ms, or that it has not ended."""
    return words("document.never_ends") if math.isinf(seconds) else words.number(1e3 * seconds)


def _curves(protocol: Protocol, words: Words) -> Iterator[Block]:
    shown = [point for point in protocol.points if point.profile and point.repetitions]
    if not shown:
        return
    yield SectionHeading(words("section.curves"), page_break=True)
    for point in shown:
        assert point.profile is not None
        yield SectionHeading(plain(point.point.name), level=2)
        names = {"point": plain(point.point.name), "profile": point.profile.name}
        for svg, count in curve_drawings(point, words):
            yield CurveDrawing(svg, words("text.curve_caption", **names), words("text.curve_alt", count=count, **names))
        if pressures := pressure_curves(point):
            for svg, count in curve_drawings(pressures, words, "curve.pressure"):
                alt = words("text.pressure_curve_alt", count=count, **names)
                yield CurveDrawing(svg, words("text.pressure_curve_caption", **names), alt)


def _latencies(protocol: Protocol, words: Words) -> Iterator[Block]:
    yield SectionHeading(words("section.latencies"))
    known = [item for point in protocol.points for item in point.repetitions if item.latencies_ms]
    if not known:
        yield Paragraph(words("text.no_latencies"))
        return
    yield Paragraph(words("text.latencies", nothing=words("document.nothing")), "note")
    detectors = [name for name in protocol.detectors if any(name in item.latencies_ms for item in known)]
    columns = [words("column.point"), words("column.repetition"), *(name.replace("_", " ") for name in detectors)]
    rows = [
        map(words.value, (point.point.name, number, *(item.latencies_ms.get(name) for name in detectors)))
        for point in protocol.points
        for number, item in enumerate(point.repetitions, 1)
    ]
    numeric = tuple(range(1, len(columns)))
    yield _table(columns, rows, widths=(5, 2, *(3 for _ in detectors)), numeric=numeric)


def _checks(protocol: Protocol, words: Words) -> Iterator[Block]:
    yield SectionHeading(words("section.checks"))
    plan, points = protocol.plan, protocol.points
    if plan.instruments:
        columns: tuple[str, ...] = ("model", "calibration_valid_until", "valid_on_test_day")
        rows = [
            (item.model or item.quantity, item.calibration_valid_until, _validity(protocol, item, words))
            for item in plan.instruments
        ]
        yield _grid(words, columns, rows, widths=(5, 3, 4))
    names = ("point", "repetition", "sample_rate", "record", "missing", "saturated")
    most = plan.force_instrument.range_n if plan.force_instrument else None
    forces = [
        _check_row(point, number, item, most, words)
        for point in points
        for number, item in enumerate(point.repetitions, 1)
    ]
    if forces:
        columns, widths = (*names, "largest_reading", "rest", "drift"), (5, 2, 5, 5, 3, 3, 5, 3, 2)
        yield _grid(words, columns, forces, widths=widths, numeric=(1, 2, 3, 6, 7, 8))
    most = plan.pressure_instrument.range_n_per_cm2 if plan.pressure_instrument else None
    pressures = [
        _check_row(point, number, item.record, most, words)
        for point in points
        for number, item in enumerate(point.pressures, 1)
        if item.record
    ]
    if pressures:
        yield SectionHeading(words("section.pressure_checks"), level=2)
        columns, widths = (*names, "largest_pressure", "pressure_rest", "pressure_drift"), (4, 2, 4, 4, 4, 5, 5, 5, 5)
        yield _grid(words, columns, pressures, widths=widths, numeric=(1, 2, 3, 6, 7, 8))


def _validity(protocol: Protocol, item: Instrument, words: Words) -> str:
    """Return whether a calibration is valid on the day of the test; a dash where one of the days is not known."""
    day, since, until = protocol.plan.test.date, item.calibrated_on, item.calibration_valid_until
    if day is None or since is None or until is None:
        return words("document.nothing")
    return words("document.yes" if since <= day <= until else "document.no")


def _check_row(
    point: PointAssessment, number: int, item: Repetition | PressureRecord, most: float | None, words: Words
) -> tuple[object, ...]:
    """Return what the data of a force or pressure are like; `most` is the range of the instrument."""
    profile, rate, record = point.profile, words.number(item.sample_rate), words.number(item.curve.end)
    if isinstance(item, Repetition):
        assert profile is not None, "a repetition has a profile"
        rate = _needed(item.sample_rate, profile.sample_rate_at_least_hz, words)
        record = _needed(item.curve.end, required_record(profile), words)
    missing, saturated = (
        words("document.yes" if is_so else "document.no")
        for is_so in (item.curve.has_missing_samples, item.curve.saturated)
    )
    reading = words.number(item.largest_reading)
    if most:
        reading = f"{words.beside(item.largest_reading, most)} / {words.limit(most)}"
    return point.point.name, number, rate, record, missing, saturated, reading, item.rest, item.drift


def _needed(measured: float, needed: float, words: Words) -> str:
    """Return a measured value, with the required one if there is one."""
    if not needed:
        return words.number(measured)
    return words("column.measured_needed", measured=words.beside(measured, needed), needed=words.limit(needed))


def _deviations(protocol: Protocol, words: Words) -> Iterator[Block]:
    yield SectionHeading(words("section.deviations"))
    rows = [
        (f"{item.point}: {item.text}" if item.point else item.text, item.reason) for item in protocol.plan.deviations
    ]
    excluded = words("role.excluded")
    rows += [(f"{item.recording} ({excluded})", item.reason) for item in protocol.excluded]
    rows += pressure_deviations(protocol.points, words)
    if rows:
        yield _grid(words, ("what", "reason"), rows, widths=(1, 1))
    else:
        yield Paragraph(words("text.no_deviations"))


def _limits(protocol: Protocol, words: Words) -> Iterator[Block]:
    profiles = {point.profile.name: point.profile for point in protocol.points if point.profile}
    if not profiles:
        return
    yield SectionHeading(words("section.limits"))
    for profile in profiles.values():
        yield SectionHeading(plain(profile.name), level=2)
        checked = words("document.yes" if profile.checked else "document.no")
        yield Facts(
            (
                (words("column.profile"), plain(profile.title)),
                (words("column.source"), plain(profile.source)),
                (words("column.checked"), checked),
            )
        )
        rows = [
            (words.name("step", step.name), words.limit(step.from_s), words.limit(step.at_most_n))
            for step in profile.steps
        ]
        yield _grid(words, ("step", "from", "at_most"), rows, widths=(4, 2, 2), numeric=(1, 2))
        if profile.pressures:
            yield Facts(((words("column.pressure_source"), plain(profile.pressure_source)),))
            columns, limits = ("body_area", "transient", "quasi_static", "applies_to"), pressure_limit_rows
            yield _grid(words, columns, limits(profile, protocol.points, words), widths=(5, 3, 3, 4), numeric=(1, 2))
        yield Facts(tuple(_measuring(profile, words)))


def _measuring(profile: ForceProfile, words: Words) -> Iterator[tuple[str, str]]:
    """Yield what a profile requires of the measurement, and what is required instead where it states nothing."""
    rate, stiffness = profile.sample_rate_at_least_hz, profile.obstacle_stiffness_n_per_mm
    at_least = words("measuring.rate", rate=rate) if rate else words("measuring.no_rate")
    yield words("column.sample_rate"), at_least
    key = "record" if profile.record_at_least_s else "no_record"
    yield words("column.record"), words(f"measuring.{key}", record=required_record(profile), length=LAST_STEP_S)
    yield words("column.stiffness"), words.limit(stiffness) if stiffness else words("measuring.nothing")
    if profile.measuring_source:
        yield words("column.measuring_source"), plain(profile.measuring_source)


def _provenance(protocol: Protocol, words: Words) -> Iterator[Block]:
    yield SectionHeading(words("section.provenance"))
    yield Paragraph(words("text.provenance", version=protocol.tool_version))
    yield Paragraph(plain(protocol.command), "code")
    rows = [(item.name, words(f"role.{item.role}"), item.sha256) for item in protocol.files]
    yield _grid(words, ("file", "role", "sha256"), rows, widths=(5, 4, 12), typed=(2,))
    yield Paragraph(words("text.hash"), "note")
    yield Facts(((words("document.data_hash_label"), protocol.data_sha256),))


def _signatures(protocol: Protocol, words: Words) -> Iterator[Block]:
    yield SectionHeading(words("section.signature"))
    yield Paragraph(words("text.signature"))
    people = ((words("sign.tester"), plain(protocol.plan.test.tester)), (words("sign.reviewer"), ""))
    yield Signatures(people, words("sign.place_date"), words("sign.signature"))


def _grid(
    words: Words,
    columns: Sequence[str],
    rows: Iterable[Sequence[object]],
    *,
    widths: Sequence[int],
    numeric: Sequence[int] = (),
    typed: Sequence[int] = (),
) -> HeadedTable:
    """Return a table of values; `columns` are names in the texts."""
    headings = tuple(words(f"column.{name}") for name in columns)
    return _table(headings, [map(words.value, row) for row in rows], widths=widths, numeric=numeric, typed=typed)


def _table(
    headings: Sequence[str],
    rows: Iterable[Iterable[str]],
    *,
    widths: Sequence[int],
    numeric: Sequence[int] = (),
    strong: Sequence[int] = (),
    typed: Sequence[int] = (),
) -> HeadedTable:
    is_numeric = tuple(number in numeric for number in range(len(headings)))
    shown = tuple(tuple(map(plain, row)) for row in rows)
    return HeadedTable(tuple(map(plain, headings)), shown, is_numeric, tuple(widths), tuple(strong), tuple(typed))
