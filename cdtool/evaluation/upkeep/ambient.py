"""Tables of ambient temperatures: date and temperature of each recording, and the temperatures to be expected.

Conventions: CSV as in `named_rows`. `date` is a day or a day and time of ISO 8601, `temperature_c` in °C; a cell of it
may be empty. Recordings are named by their path from the table's folder, or by their file name where that is unique.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from pathlib import Path

from cdtool.errors import ConfigurationError
from cdtool.evaluation.truth.named_rows import TableRow, by_recording, read_named_rows, read_table_rows

# No machine works outdoors below or above [°C].
_COLDEST, _HOTTEST = -100.0, 200.0
# Dates of other years are mistakes, and near the ends of the calendar there is no forecast.
_FIRST_YEAR, _LAST_YEAR = 1900, 2200


@dataclass(frozen=True)
class Ambient:
    """When a run took place, or will, and the temperature then [°C]; NaN if unknown.

    `when` has no zone; one that was given is UTC. `day` is the day as written.
    """

    when: datetime
    day: date
    temperature: float


def read_ambient(path: Path, recordings: Sequence[str]) -> dict[str, Ambient]:
    """Read date and ambient temperature of recordings.

    Parameters
    ----------
    path : Path
        A CSV with the columns recording, date and temperature_c.
    recordings : sequence of str
        Paths of the recordings from the folder of the table; names of runs end with # and the run.

    Returns
    -------
    dict of str to Ambient
        Those of the recordings that are named; rows of other recordings are ignored.

    Raises
    ------
    ConfigurationError
        The file is wrong, or no row is of any recording; the message names the line.

    Examples
    --------
    >>> found = read_ambient(Path("docs/examples/ambient.csv"), ["free/01.csv", "free/02.csv"])
    >>> found["free/02.csv"].when.isoformat(), found["free/02.csv"].temperature
    ('2025-07-01T18:00:00', 23.1)
    """
    rows = read_named_rows(path, ("recording", "date"), ("temperature_c",), "temperature")
    zoned: dict[bool, str] = {}
    rows_of = {row.recording: row for row in rows}
    read: dict[str, Ambient] = {}
    for row in rows:
        if row.recording in read:
            raise row.fault(f"'{row.recording}' is named again", "give one row per recording")
        read[row.recording] = _ambient(row, zoned)
    found: dict[str, Ambient] = {}
    for name, recording in by_recording(path, read, recordings, runs=True).items():
        if recording in found:
            raise rows_of[name].fault(f"'{name}' is {recording}, which is named before", "give one row per recording")
        if recording is not None:
            found[recording] = read[name]
    if not found:
        first = f"'{rows[0].recording}' of {rows[0].where} is none of them" if rows else "it contains no row"
        raise ConfigurationError(
            f"{path}: no row is of any log: {first}", "name the logs by their path from the folder of the table"
        )
    return found


def read_expected(path: Path) -> list[Ambient]:
    """Read the temperatures to be expected.

    Parameters
    ----------
    path : Path
        A CSV with the columns date and temperature_c, any number of rows per day. A column recording is ignored.

    Returns
    -------
    list of Ambient
        In order of time.

    Raises
    ------
    ConfigurationError
        The file is wrong, or empty; the message names the line.

    Examples
    --------
    >>> [item.temperature for item in read_expected(Path("docs/examples/expected.csv"))][:3]
    [6.0, 10.0, 14.0]
    """
    zoned: dict[bool, str] = {}
    found = []
    for row in read_table_rows(path, ("date", "temperature_c"), ("recording",), "temperature"):
        ambient = _ambient(row, zoned)
        if math.isnan(ambient.temperature):
            raise row.fault("temperature_c is empty", "give a temperature in °C, or leave the row out")
        found.append(ambient)
    if not found:
        raise ConfigurationError(f"{path}: contains no row", "give a date and a temperature in °C per row")
    return sorted(found, key=lambda item: item.when)


def _ambient(row: TableRow, zoned: dict[bool, str]) -> Ambient:
    """Return date and temperature of a row; `zoned` remembers a row with and one without a zone, for messages."""
    text = row.text("date")
    try:
        when = datetime.fromisoformat(text)
    except ValueError as fault:
        raise row.fault(f"date is '{text}'", "give a day, or day and time, such as 2025-07-01T08:30") from fault
    day = when.date()
    if not _FIRST_YEAR <= day.year <= _LAST_YEAR:
        raise row.fault(f"date is '{text}'", f"give a date from {_FIRST_YEAR} to {_LAST_YEAR}")
    has_zone = when.tzinfo is not None
    zoned.setdefault(has_zone, row.where)
    if len(zoned) > 1:
        words = ("with a zone", "without one") if has_zone else ("without a zone", "with one")
        raise row.fault(f"date is '{text}', {words[0]}; {zoned[not has_zone]}: {words[1]}", "give all dates alike")
    if when.tzinfo is not None:
        when = when.astimezone(UTC).replace(tzinfo=None)
    temperature = row.number("temperature_c", "°C")
    if temperature is not None and not _COLDEST <= temperature <= _HOTTEST:
        raise row.fault(
            f"temperature_c is {temperature:g}", f"give °C from {_COLDEST:g} to {_HOTTEST:g}; 300 K are 26.85 °C"
        )
    return Ambient(when, day, math.nan if temperature is None else temperature)
