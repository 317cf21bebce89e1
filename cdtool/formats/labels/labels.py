"""Contacts from a label file: a CSV with a row per contact, in seconds, dates, or rows of the log.

Conventions: `recording` is the path below the benchmark file, or the file's name alone where that is unique. The
columns of start and end state what they contain: `start_s`, `start_ms`, `start_us`, `start_ns` a number of that unit,
`start_time` a date and time of ISO 8601, `start_row` the number of a row in the log's table, the first being 0. Numbers
are on the recording's own clock, as cdtool shows it, or on the source's (`clock`), an epoch for example; a date is
always on the source's. A recording that is named without a time has no contact. A contact that is named twice is one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta, timezone
from decimal import Decimal
from pathlib import Path, PurePosixPath
from typing import Literal

from cdtool.base.errors import ConfigurationError, RecordingError, nearest
from cdtool.base.findings import Finding
from cdtool.formats.labels.named_rows import NamedRow, read_cells, read_named_rows
from cdtool.recordings.recording import MEASURED, Contact, Recording

_OPTIONAL = ("kind", "uncertainty_s")
# Units of numbers, per second.
_UNITS = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}
_FORMS = (*_UNITS, "time", "row")
_FRACTION = re.compile(r"[.,](\d+)")
_ZONE = re.compile(r"(?P<sign>[+-])(?P<hours>\d\d):?(?P<minutes>\d\d)|[Zz]")
_DATED = re.compile(r"\d{4}-?\d\d-?\d\d[T ]\d\d")

LabelClock = Literal["recording", "source"]


@dataclass(frozen=True)
class Labels:
    """The contacts of each recording that a label file names.

    `contacts` are on the file's own clock: seconds of `clock`, or with "row" numbers of rows. `lines`: the origin of
    each contact, as "FILE line N", in the order of `contacts`; without contacts, its only row. Labels of a kind in
    `not_contacts` are no contacts. `findings` concern the file.
    """

    source: str
    contacts: Mapping[str, tuple[Contact, ...]]
    lines: Mapping[str, tuple[str, ...]]
    clock: Literal["recording", "source", "row"] = "recording"
    not_contacts: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()

    @property
    def kinds(self) -> tuple[str, ...]:
        """Return the kinds of the contacts, in the order of the file."""
        kinds = dict.fromkeys(item.kind for items in self.contacts.values() for item in items if item.kind)
        return tuple(kind for kind in kinds if kind not in self.not_contacts)

    def name_of(self, recording: str) -> str | None:
        """Return the name of a recording in the file: its path, or only the file's name; None if it is not there.

        The name of a run may contain slashes after the file's name: `logs/cycles.csv#push/2`.
        """
        if recording in self.contacts:
            return recording
        file, mark, run = recording.partition("#")
        names = (PurePosixPath(recording).name, f"{PurePosixPath(file).name}{mark}{run}")
        return next((name for name in names if name in self.contacts), None)

    def contacts_in(self, recording: Recording) -> list[Contact]:
        """Return the contacts of a recording that the file names, on the recording's clock.

        Raises RecordingError, naming the row, if a label begins outside the recording.
        """
        name = self.name_of(recording.name)
        if name is None:
            return []
        found = []
        for label, line in zip(self.contacts[name], self.lines[name], strict=False):
            contact = self._placed(label, line, recording)
            if label.kind not in self.not_contacts:
                found.append(contact)
        return found

    def why_none(self, name: str) -> str:
        """Return why a recording has no contact, by its name in the file."""
        if not self.contacts[name]:
            return f"{self.lines[name][0]} does not list one"
        return f"every label of it in {self.source} is of a kind in not_contacts"

    def _placed(self, label: Contact, line: str, recording: Recording) -> Contact:
        """Return a label as a contact on the recording's clock."""
        if math.isnan(label.uncertainty):
            steps = (recording[name].period for name in MEASURED if name in recording and len(recording[name]) > 1)
            doubt = max(label.resolution, 0.5 * max(steps, default=0.0))
            label = replace(label, uncertainty=doubt, resolution=math.nan)
        if self.clock == "row":
            return _at_row(label, line, recording)
        shift = recording.origin if self.clock == "source" else 0.0
        start, end = label.start - shift, label.end - shift
        if not recording.start <= start <= recording.end:
            raise RecordingError(
                f"{line}: the contact begins at {label.start:.10g} s, outside "
                f"{recording.start + shift:.3f} to {recording.end + shift:.3f} s on the {self.clock}'s clock",
                self._other_clock(label.start, recording),
            )
        return replace(label, start=start, end=max(end, start))

    def _other_clock(self, start: float, recording: Recording) -> str:
        other, shift = ("recording", 0.0) if self.clock == "source" else ("source", recording.origin)
        if recording.start <= start - shift <= recording.end:
            return f'set labels_clock = "{other}"'
        if self.clock == "source":
            return "check the zone of the label file (labels_zone) and that of the log"
        return "give seconds on the recording's own clock, as cdtool shows them"


def read_labels(
    path: Path, *, clock: LabelClock = "recording", zone: str = "", not_contacts: Collection[str] = ()
) -> Labels:
    r"""Read and check a label file.

    Parameters
    ----------
    path : Path
        A CSV with the columns recording, start_s, end_s (or another unit, start_time, start_row) and, optionally, kind
        and uncertainty_s.
    clock : {"recording", "source"}
        The clock of times that are numbers.
    zone : str
        The offset of dates without a zone, such as "+02:00"; by default they are UTC, as in a log.
    not_contacts : collection of str
        Kinds of labels that are not contacts.

    Returns
    -------
    Labels
        The contacts of each recording, in order of time.

    Raises
    ------
    ConfigurationError
        The file is wrong; the message names the line.

    Examples
    --------
    >>> _ = Path("labels.csv").write_text("recording,start_s,end_s\nstiff/01.mcap,5.94,6.2\n")
    >>> read_labels(Path("labels.csv")).contacts["stiff/01.mcap"][0].start
    5.94
    """
    form = _form(read_cells(path, "label")[0][1])
    columns = (f"start_{form}", f"end_{form}")
    offset = _offset(path, zone) if zone else None
    first: dict[str, str] = {}
    rows: dict[str, dict[tuple[float, float, str], tuple[Contact, str]]] = {}
    zoned: dict[bool, str] = {}
    for row in read_named_rows(path, ("recording", *columns), _OPTIONAL, "label"):
        first.setdefault(row.recording, row.where)
        contacts = rows.setdefault(row.recording, {})
        start, end = (_moment(row, column, form, offset, zoned) for column in columns)
        if start is not None:
            end = start if end is None else end
            contacts.setdefault((start, end, row.text("kind")), (_contact(row, start, end, form), row.where))
    if len(zoned) > 1:
        raise ConfigurationError(f"{zoned[False]}: a date without a zone, {zoned[True]} has one", "give all a zone")
    if zone and form != "time":
        raise ConfigurationError(f"{path}: labels_zone is {zone}, but the labels are no dates", "remove labels_zone")
    if clock == "source" and form == "row":
        raise ConfigurationError(f"{path}: labels_clock is source, but the labels count rows", "remove labels_clock")
    findings = [Finding("labels_without_zone")] if False in zoned and not zone else []
    # The finest digit of the file counts for all labels: many programs drop zeros at the end, and write 2 for 2.000.
    digits = [contact.resolution for items in rows.values() for contact, _ in items.values()]
    finest = min((digit for digit in digits if not math.isnan(digit)), default=math.nan)
    found = {}
    for name, items in rows.items():
        ordered = sorted(items.values(), key=lambda item: item[0].start)
        found[name] = [(replace(item, resolution=min(item.resolution, finest)), where) for item, where in ordered]
    excluded = _excluded(path, found, not_contacts)
    if excluded:
        findings.append(Finding("kinds_excluded", "", {"count": excluded, "kinds": tuple(dict.fromkeys(not_contacts))}))
    return Labels(
        str(path),
        {name: tuple(contact for contact, _ in items) for name, items in found.items()},
        {name: tuple(where for _, where in items) or (first[name],) for name, items in found.items()},
        "row" if form == "row" else "source" if form == "time" else clock,
        tuple(dict.fromkeys(not_contacts)),
        tuple(findings),
    )


def _form(header: Sequence[str]) -> str:
    """Return what the columns of start and end contain, by the first of them in the header; "s" without one."""
    return next((form for name in header for form in _FORMS if name in (f"start_{form}", f"end_{form}")), "s")


def _moment(row: NamedRow, column: str, form: str, offset: timezone | None, zoned: dict[bool, str]) -> float | None:
    """Return a time [s] or the number of a row; None if the cell is empty. `zoned`: the first date with and without."""
    text = row.text(column) if form == "time" else row.decimal(column)
    if not text:
        return None
    if form == "time":
        return _date(row, column, text, offset, zoned)
    if form == "row":
        if not text.isascii() or not text.isdigit() or len(text) > 15:  # digits, which a float64 represents
            raise row.fault(f"{column} is '{text[:40]}'", "give the number of a row, the first being 0")
        return float(text)
    try:  # whole numbers, such as nanoseconds since 1970, are divided without rounding them first
        value = int(text) / _UNITS[form] if text.isascii() and text.isdigit() else float(text) / _UNITS[form]
    except (ValueError, OverflowError):
        value = math.nan
    if not math.isfinite(value):
        raise row.fault(f"{column} is '{text}'", f"give a number of {form}")
    return value


def _date(row: NamedRow, column: str, text: str, offset: timezone | None, zoned: dict[bool, str]) -> float:
    """Return seconds since 1970 of a date and time; one without a zone is at `offset`, else UTC."""
    fraction = _FRACTION.search(text)
    whole = text if fraction is None else text[: fraction.start()] + text[fraction.end() :]
    try:
        date = datetime.fromisoformat(whole) if _DATED.match(whole) else None
    except ValueError:
        date = None
    if date is None:
        hint = "give date and time of ISO 8601, e.g. 2025-04-03T12:00:00.250Z"
        raise row.fault(f"{column} is '{text}'", hint)
    zoned.setdefault(date.tzinfo is not None, row.where)
    if date.tzinfo is None:
        date = date.replace(tzinfo=offset or UTC)
    return (date - datetime(1970, 1, 1, tzinfo=UTC)).total_seconds() + (float(f"0.{fraction[1]}") if fraction else 0.0)


def _offset(path: Path, zone: str) -> timezone:
    match = _ZONE.fullmatch(zone)
    if match is None or int(match["hours"] or 0) > 14 or int(match["minutes"] or 0) > 59:
        raise ConfigurationError(f"{path}: labels_zone is '{zone}'", "give an offset such as +02:00, or Z")
    minutes = 60 * int(match["hours"] or 0) + int(match["minutes"] or 0)
    return timezone(timedelta(minutes=-minutes if match["sign"] == "-" else minutes))


def _contact(row: NamedRow, start: float, end: float, form: str) -> Contact:
    """Return a label as a contact; of one that states no uncertainty, `resolution` is its last printed digit [s]."""
    uncertainty = row.seconds("uncertainty_s")
    if uncertainty is None:
        uncertainty, digit = math.nan, _last_digit(row.decimal(f"start_{form}"), form)
    else:
        digit = math.nan
    if end < start:
        raise row.fault(f"start {start:.10g} s, end {end:.10g} s", "the end must be after the start")
    if uncertainty < 0.0:
        raise row.fault(f"uncertainty {uncertainty:g} s", "it must not be negative")
    return Contact(start, end, uncertainty, found_by="label file", kind=row.text("kind"), resolution=digit)


def _last_digit(text: str, form: str) -> float:
    """Return what the last printed digit of a label stands for [s]; 0 for the number of a row."""
    if form == "row":
        return 0.0
    if form == "time":
        fraction = _FRACTION.search(text)
        return 10.0 ** -len(fraction[1]) if fraction else 1.0
    return 10.0 ** min(int(Decimal(text).as_tuple().exponent), 0) / _UNITS[form]


def _excluded(path: Path, found: Mapping[str, list[tuple[Contact, str]]], not_contacts: Collection[str]) -> int:
    """Return how many labels are of a kind in `not_contacts`; raises ConfigurationError for a kind that none has."""
    kinds = [contact.kind for items in found.values() for contact, _ in items]
    for kind in not_contacts:
        if kind not in kinds:
            known = [name for name in dict.fromkeys(kinds) if name]
            raise ConfigurationError(f"{path}: not_contacts has '{kind}', which no label has", nearest(kind, known))
    return sum(kind in not_contacts for kind in kinds)


def _at_row(label: Contact, line: str, recording: Recording) -> Contact:
    """Return a label that counts rows as a contact; one on a dropped row begins at the next, from the one before on."""
    rows = recording.rows
    if rows is None:
        raise RecordingError(
            f"{line}: counts rows, but {recording.name} is no table with one clock", "give times: start_s or start_time"
        )
    start, before = rows.time_of(int(label.start))
    if math.isnan(start):
        raise RecordingError(
            f"{line}: the contact begins at row {label.start:.0f}, {recording.name} has {rows.count} rows",
            "rows count from 0, from the first row of numbers on",
        )
    end, _ = rows.time_of(int(label.end))
    last = rows.time[-1] if math.isnan(end) else end
    return replace(label, start=start, end=max(float(last), start), uncertainty=label.uncertainty + start - before)
