"""The document of a test protocol: the verdict first, then what it rests on, then the signatures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields

from cdtool.base.plain_text import plain
from cdtool.commands.protocol.assessment.assessment import LAST_STEP_S, PointAssessment, Repetition, required_record
from cdtool.commands.protocol.assessment.pressure import PressureRecord
from cdtool.commands.protocol.assessment.protocol import Protocol
from cdtool.commands.protocol.document.blocks import (
    Block,
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
    pressure_curves,
    pressure_deviations,
    pressure_limit_rows,
    pressures_of,
    pressures_without_limit,
    worst_outcome,
)
from cdtool.commands.protocol.document.words import Words, words_of
from cdtool.truth.force.limits import ForceProfile
from cdtool.truth.force.verdict import PointVerdict


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
            *_results(protocol, words),
            *_latencies(protocol, words),
            *_checks(protocol, words),
            *_plan(protocol, words),
            *_deviations(protocol, words),
            *_limits(protocol, words),
            *_provenance(protocol, words),
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
    """Yield the first page: the verdict, the reasons, what was tested and with what, the points, and who signs."""
    verdict, outcome = protocol.verdict, protocol.verdict.outcome
    text = [_verdict_text(protocol, words), *_worst_text(protocol, words)]
    if outcome == "fail" and (sentences := words.reasons(verdict, "incomplete")):
        text.append(words("verdict.open_items", count=len(sentences)))
    yield VerdictBox(outcome, words(f"verdict.{outcome}"), plain(" ".join(text)))
    for why, sentences in _reasons(protocol, words):
        yield SectionHeading(words(f"verdict.why_{why}"))
        yield Items(tuple(map(plain, sentences)))
    yield Facts(tuple(_particulars(protocol, words)), columns=2)
    limits = "; ".join(_title(profile, words) for profile in _profiles(protocol))
    deviating = [] if _deviating(protocol, words) else [(words("section.deviations"), words("text.no_deviations"))]
    yield Facts(((words("section.limits"), limits or words("document.nothing")), *deviating))
    yield SectionHeading(words("field.points"))
    columns = ("point", "worst", "value", "limit", "share", "result")
    yield _grid(words, columns, [_of_point(point, words) for point in protocol.points], numeric=(2, 3, 4))
    yield from _instruments(protocol, words)
    yield SectionHeading(words("verdict.notices"))
    yield Items(tuple(map(plain, _notices(protocol, words))))
    yield SectionHeading(words("section.signature"), keep=True)
    yield Paragraph(words("text.signature"))
    people = ((words("sign.tester"), plain(protocol.plan.test.tester)), (words("sign.reviewer"), ""))
    yield Signatures(people, words("sign.place_date"), words("sign.signature"))


def _particulars(protocol: Protocol, words: Words) -> Iterator[tuple[str, str]]:
    for part in (protocol.plan.machine, protocol.plan.test):
        for item in fields(part):
            value = getattr(part, item.name)
            if value not in ("", None) or item.metadata["due"] != "never":
                yield words(f"field.{item.name}"), plain(words.value(None if value == "" else value))


def _profiles(protocol: Protocol) -> list[ForceProfile]:
    return list({point.profile.name: point.profile for point in protocol.points if point.profile}.values())


def _title(profile: ForceProfile, words: Words) -> str:
    return plain(words.name("of_limits", profile.title))


def _worst(point: PointAssessment, words: Words) -> tuple[str, str, float, float] | None:
    """Return the value of a point that is the largest share of its limit: its symbol and unit, the value, the limit."""
    steps = point.verdict.steps if point.verdict else ()
    compared = [(words.symbol(item.step.name), "N", item.force, item.step.at_most_n) for item in steps]
    compared += [
        (words.symbol(item.name), "N/cm²", item.highest, item.limit)
        for item in pressures_of(point)
        if item.highest is not None and item.limit
    ]
    return max((item for item in compared if math.isfinite(item[2])), key=_share, default=None)


def _share(compared: tuple[str, str, float, float]) -> float:
    return compared[2] / compared[3]


def _of_point(point: PointAssessment, words: Words) -> tuple[object, ...]:
    worst, result = _worst(point, words), words(f"outcome.{point.outcome}")
    if worst is None:
        return point.point.name, None, None, None, None, result
    symbol, unit, value, limit = worst
    numbers = f"{words.beside(value, limit)} {unit}", f"{words.limit(limit)} {unit}"
    return point.point.name, symbol, *numbers, f"{words.beside(100.0 * _share(worst), 100.0)} %", result


def _worst_text(protocol: Protocol, words: Words) -> Iterator[str]:
    """Yield which value is the largest share of its limit."""
    worst = {point.point.name: item for point in protocol.points if (item := _worst(point, words))}
    name = max(worst, key=lambda name: _share(worst[name]), default="")
    keys = {("fail", True): "verdict.exceeds_most", ("pass", False): "verdict.closest"}
    if worst and (key := keys.get((protocol.verdict.outcome, _share(worst[name]) > 1.0))):
        symbol, unit, value, limit = worst[name]
        share = words.beside(100.0 * _share(worst[name]), 100.0)
        yield words(key, point=name, symbol=symbol, unit=unit, value=value, share=share, limit=limit)


def _reasons(protocol: Protocol, words: Words) -> list[tuple[str, list[str]]]:
    """Return the sentences of each outcome that has any, those of a fail first."""
    found = [(outcome, words.reasons(protocol.verdict, outcome)) for outcome in ("fail", "incomplete")]
    return [(outcome, sentences) for outcome, sentences in found if sentences]


def _notices(protocol: Protocol, words: Words) -> Iterator[str]:
    profiles = _profiles(protocol)
    if unchecked := [_title(profile, words) for profile in profiles if not profile.checked]:
        yield words("notice.unchecked", profiles="; ".join(unchecked))
    if without_rate := [_title(profile, words) for profile in profiles if not profile.sample_rate_at_least_hz]:
        yield words("notice.no_rate", profiles="; ".join(without_rate))
    if without_record := [_title(profile, words) for profile in profiles if not profile.record_at_least_s]:
        yield words("notice.no_record", profiles="; ".join(without_record), length=LAST_STEP_S)
    for point in protocol.points:
        if point.verdict and point.profile and point.profile.average_of > 1:
            for step in point.verdict.steps:
                if step.above and step.outcome != "fail":
                    values = {"count": step.above, "tests": point.verdict.tests, "symbol": words.symbol(step.step.name)}
                    yield words("notice.single_above", point=point.point.name, **values)
    if points := pressures_without_limit(protocol.points):
        yield words("notice.pressure", points=words.names(points))
    if unconfirmed := [
        item.point.name for item in protocol.points if any(one.speed is None for one in item.repetitions)
    ]:
        yield words("notice.no_speed", points=words.names(unconfirmed))
    yield words("notice.certificate")


def _instruments(protocol: Protocol, words: Words) -> Iterator[Block]:
    if not protocol.plan.instruments:
        return
    yield SectionHeading(words("section.instruments"))
    names = ("quantity", "model", "serial_number", "range", "accuracy_class", "sample_rate", "filter")
    columns, rows = (*names, "calibrated_on", "calibration_valid_until"), []
    for item in protocol.plan.instruments:
        reach = f"{words.limit(item.range_n)} N" if item.range_n else item.range
        reach = f"{words.limit(item.range_n_per_cm2)} N/cm²" if item.range_n_per_cm2 else reach
        shown = {"quantity": words.name("quantity", item.quantity), "range": reach, "sample_rate": item.sample_rate_hz}
        rows.append([shown[name] if name in shown else getattr(item, name) for name in columns])
    yield _grid(words, columns, rows, numeric=(5,))


def _plan(protocol: Protocol, words: Words) -> Iterator[Block]:
    if not protocol.points:
        return
    yield SectionHeading(words("section.plan"))
    names = ("point", "position", "region", "obstacle", "stiffness", "area", "speed", "repetitions")
    rows = []
    for item in protocol.plan.points:
        numbers = (item.obstacle_stiffness_n_per_mm, item.contact_area_mm2, item.speed_m_per_s, item.repetitions)
        rows.append((item.name, item.position, item.region, item.obstacle, *numbers))
    yield _grid(words, names, rows, numeric=(4, 5, 6, 7))


def _results(protocol: Protocol, words: Words) -> Iterator[Block]:
    """Yield the values of each point with its curves, then what they mean."""
    if not protocol.points:
        return
    yield SectionHeading(words("section.results"), page_break=True)
    for point in protocol.points:
        name, profile = plain(point.point.name), point.profile
        heading = words("text.point", point=name, profile=_title(profile, words)) if profile else name
        yield SectionHeading(heading, level=2, keep=True)
        if profile is None or point.verdict is None:
            yield Paragraph(words("text.not_assessed"))
        elif not point.repetitions:
            yield Paragraph(words("text.nothing_measured"))
        else:
            yield _forces(point, profile, point.verdict, words)
            yield from curve_drawings(point, words)
            if pressures := pressure_curves(point):
                yield from curve_drawings(pressures, words, "pressure_curve")
    if any(point.repetitions for point in protocol.points):
        yield SectionHeading(words("section.explanations"), keep=True)
        yield Paragraph(words("text.results"), "note")
        yield Paragraph(words("text.curves"), "note")


def _forces(point: PointAssessment, profile: ForceProfile, verdict: PointVerdict, words: Words) -> HeadedTable:
    """Return a row for each repetition, then their mean and the limits."""
    items = point.repetitions
    kind = "mean" if profile.average_of > 1 else "highest"
    numbers = [str(number) for number in range(1, len(items) + 1)]
    columns = [
        (words("column.repetition"), [*numbers, words(f"row.{kind}"), words("row.limit")]),
        (words("column.recording"), [*(item.recording for item in items), "", ""]),
        (
            words("column.measured_speed"),
            [*(words.number(item.speed) for item in items), "", words.value(point.point.speed_m_per_s)],
        ),
    ]
    for number, step in enumerate(profile.steps):
        limit, heading = step.at_most_n, words("column.force_in", symbol=words.symbol(step.name))
        forces = [*(item.verdict.steps[number].peak for item in items), verdict.steps[number].force]
        columns.append((heading, [*(words.beside(force, limit) for force in forces), words.limit(limit)]))
        if number == 0 and len(profile.steps) > 1:
            times = [item.dynamic_time for item in items]
            of_all = sum(times) / len(times) if kind == "mean" else max(times)
            longest = 1e3 * profile.steps[1].from_s
            cells = [_time(time, longest, words) for time in (*times, of_all)]
            columns.append((words("column.dynamic_time"), [*cells, words.limit(longest)]))
    for of in pressures_of(point):
        cells = [words.beside(value, of.limit) for value in (*of.values, of.highest)]
        columns.append((words(f"column.{of.name}"), [*cells, words.limit(of.limit) if of.limit else ""]))
    outcomes = [*map(worst_outcome, items, point.pressures), f"outcome.{point.outcome}"]
    columns.append((words("column.result"), [*map(words, outcomes), ""]))
    rows = zip(*(cells for _, cells in columns), strict=True)
    names, strong = [name for name, _ in columns], (len(items), len(items) + 1)
    return _table(names, rows, numeric=range(2, len(columns) - 1), strong=strong)


def _time(seconds: float, longest: float, words: Words) -> str:
    """Return a time above a limit in ms, or that it has not ended."""
    return words("document.never_ends") if math.isinf(seconds) else words.beside(1e3 * seconds, longest)


def _latencies(protocol: Protocol, words: Words) -> Iterator[Block]:
    known = [item for point in protocol.points for item in point.repetitions if item.latencies_ms]
    if not known:
        return
    yield SectionHeading(words("section.latencies"))
    yield Paragraph(words("text.latencies", nothing=words("document.nothing")), "note")
    detectors = protocol.detectors
    columns = [words("column.point"), words("column.repetition"), *(name.replace("_", " ") for name in detectors)]
    rows = []
    for point in protocol.points:
        for number, item in enumerate(point.repetitions, 1):
            latencies = [item.latencies_ms.get(name, (None, None)) for name in detectors]
            cells = [words.number(latency, error=error) for latency, error in latencies]
            rows.append((point.point.name, str(number), *cells))
    yield _table(columns, rows, numeric=range(1, len(columns)))


def _checks(protocol: Protocol, words: Words) -> Iterator[Block]:
    """Yield what the data of each force and each recorded pressure are like."""
    force, pressure = protocol.plan.force_instrument, protocol.plan.pressure_instrument
    most = force.range_n if force else None, pressure.range_n_per_cm2 if pressure else None
    rows = []
    for point in protocol.points:
        for number, item in enumerate(point.repetitions, 1):
            rows.append((point.point.name, number, *_check(item, point.profile, most[0], "force", words)))
        for number, of_pressure in enumerate(point.pressures, 1):
            if of_pressure.record:
                checked = _check(of_pressure.record, None, most[1], "pressure", words)
                rows.append((point.point.name, number, *checked))
    if rows:
        yield SectionHeading(words("section.checks"))
        columns = (
            "point",
            "repetition",
            "quantity",
            "sample_rate",
            "record",
            "missing",
            "saturated",
            "reading",
            "rest",
        )
        yield _grid(words, (*columns, "drift"), rows, numeric=(1, 3, 4, 7, 8, 9))


def _check(
    item: Repetition | PressureRecord, profile: ForceProfile | None, most: float | None, quantity: str, words: Words
) -> tuple[str, ...]:
    """Return the cells of a force or pressure; `profile`: what it requires, `most`: the range of the instrument."""
    rate, record = (profile.sample_rate_at_least_hz, required_record(profile)) if profile else (0.0, 0.0)
    answers = words("document.no"), words("document.yes")
    reading = words.beside(item.largest_reading, most) + (f" / {words.limit(most)}" if most else "")
    record_cells = _needed(item.sample_rate, rate, words), _needed(item.curve.end, record, words)
    flaws = answers[item.curve.has_missing_samples], answers[item.curve.saturated]
    rest = words.number(item.rest, 2), words.number(item.drift, 2)
    return words.name("measured", quantity), *record_cells, *flaws, reading, *rest


def _needed(measured: float, needed: float, words: Words) -> str:
    """Return a measured value, with the required one if there is one."""
    return words.beside(measured, needed or None) + (f" (≥ {words.limit(needed)})" if needed else "")


def _deviations(protocol: Protocol, words: Words) -> Iterator[Block]:
    if rows := _deviating(protocol, words):
        yield SectionHeading(words("section.deviations"))
        yield _grid(words, ("what", "reason"), rows)


def _deviating(protocol: Protocol, words: Words) -> list[tuple[str, str]]:
    rows = [
        (f"{item.point}: {item.text}" if item.point else item.text, item.reason) for item in protocol.plan.deviations
    ]
    excluded = words("role.excluded")
    rows += [(f"{item.recording} ({excluded})", item.reason) for item in protocol.excluded]
    return [*rows, *pressure_deviations(protocol.points, words)]


def _limits(protocol: Protocol, words: Words) -> Iterator[Block]:
    profiles = _profiles(protocol)
    if not profiles:
        return
    yield SectionHeading(words("section.limits"))
    for profile in profiles:
        yield SectionHeading(_title(profile, words), level=2, keep=True)
        rows = [(words.name("step", step.name), step.from_s, step.at_most_n) for step in profile.steps]
        yield _grid(words, ("step", "from", "at_most"), rows, numeric=(1, 2))
        if profile.pressures:
            columns, limits = ("body_area", "transient", "quasi_static", "applies_to"), pressure_limit_rows
            yield _grid(words, columns, limits(profile, protocol.points, words), numeric=(1, 2))
        yield Facts(tuple(_described(profile, words)))


def _described(profile: ForceProfile, words: Words) -> Iterator[tuple[str, str]]:
    """Yield where limits are from, what they require of the measurement, and what if they state nothing."""
    yield words("column.profile"), plain(profile.name)
    yield words("column.checked"), words("document.yes" if profile.checked else "document.no")
    rate, stiffness = profile.sample_rate_at_least_hz, profile.obstacle_stiffness_n_per_mm
    yield words("column.sample_rate"), words("measuring.rate", rate=rate) if rate else words("measuring.no_rate")
    key = "record" if profile.record_at_least_s else "no_record"
    yield words("column.record"), words(f"measuring.{key}", record=required_record(profile), length=LAST_STEP_S)
    yield words("column.stiffness"), words.limit(stiffness) if stiffness else words("measuring.nothing")
    for name in ("source", "pressure_source", "measuring_source"):
        if source := getattr(profile, name):
            yield words(f"column.{name}"), plain(words.name("of_limits", source))


def _provenance(protocol: Protocol, words: Words) -> Iterator[Block]:
    yield SectionHeading(words("section.provenance"))
    yield Paragraph(words("text.provenance", version=protocol.tool_version))
    yield Paragraph(plain(protocol.command), "code")
    rows = [(item.name, words(f"role.{item.role}"), item.sha256) for item in protocol.files]
    yield _grid(words, ("file", "role", "sha256"), rows, typed=(2,))
    yield Paragraph(words("text.hash"), "note")
    yield Facts(((words("document.data_hash_label"), protocol.data_sha256),))


def _grid(
    words: Words,
    columns: Sequence[str],
    rows: Iterable[Sequence[object]],
    *,
    numeric: Sequence[int] = (),
    typed: Sequence[int] = (),
) -> HeadedTable:
    """Return a table of values; `columns` are names in the texts."""
    headings = tuple(words(f"column.{name}") for name in columns)
    return _table(headings, [map(words.value, row) for row in rows], numeric=numeric, typed=typed)


def _table(
    headings: Sequence[str],
    rows: Iterable[Iterable[str]],
    *,
    numeric: Sequence[int] = (),
    strong: Sequence[int] = (),
    typed: Sequence[int] = (),
) -> HeadedTable:
    is_numeric = tuple(number in numeric for number in range(len(headings)))
    shown = tuple(tuple(map(plain, row)) for row in rows)
    return HeadedTable(tuple(map(plain, headings)), shown, is_numeric, tuple(strong), tuple(typed))
