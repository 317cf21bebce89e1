"""Read `[protocol]`: of a benchmark file, or of a file of its own. Paths are relative to the file."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.base.files.bounded_loading import read_bytes
from cdtool.base.remote.remote_path import joined, location
from cdtool.base.tables import Table, read_toml
from cdtool.base.value_words import value_in_words
from cdtool.commands.protocol.assessment.plan import (
    Deviation,
    Exclusion,
    Instrument,
    MachineParticulars,
    MeasuringPoint,
    TestParticulars,
    TestPlan,
)
from cdtool.truth.force.limits import ForceProfile, profile_of, read_force_limits

TABLE = "protocol"
_LANGUAGES = ("en", "de")
Entries = TypeVar("Entries")


@dataclass(frozen=True)
class ProtocolFile:
    """A read `[protocol]`: the plan, its benchmark file (None: not named), and the force profiles by name.

    `limits` is the file of the profiles; None: those that ship with cdtool.
    """

    path: Path
    plan: TestPlan
    benchmark: Path | None
    profiles: Mapping[str, ForceProfile]
    limits: Path | None = None

    def profile_of(self, point: MeasuringPoint, of_group: ForceProfile | None = None) -> ForceProfile | None:
        """Return the force profile of a point: its own, else that of its recordings' group; None without both.

        Raises ConfigurationError if the profile has no pressure for the point's area of the body.
        """
        profile = self.profiles[point.profile] if point.profile else of_group
        if profile is not None and point.body_area:
            try:
                profile.pressure_limit(point.body_area)
            except UsageError as fault:
                where = f"{self.path}: protocol.point '{point.name}': body_area"
                raise ConfigurationError(f"{where}: {fault.message}", fault.hint) from fault
        return profile


def has_protocol(path: Path) -> bool:
    """Return whether a benchmark file has a table [protocol]; raises ConfigurationError if it cannot be read."""
    return TABLE in read_toml(path, "a benchmark file")


def read_protocol_file(path: str | Path) -> ProtocolFile:
    """Read and check `[protocol]`; values that are not known yet may be missing or empty.

    Parameters
    ----------
    path : str or Path
        The file with the table: a protocol file, or a benchmark file.

    Returns
    -------
    ProtocolFile
        The plan with its force profiles. Of a benchmark file, it is itself the benchmark of the protocol.

    Raises
    ------
    ConfigurationError
        A key is unknown, a value has the wrong type, or a profile does not exist; the message names file and key.

    Examples
    --------
    >>> file = read_protocol_file("sample_logs/gate/protocol.toml")
    >>> [(point.name, point.repetitions) for point in file.plan.points]
    [('closing edge', 4), ('closing edge with bumper', 4)]
    """
    file = location(path)
    root = Table(read_toml(file, "a protocol file"), str(file))
    if TABLE not in root:
        raise ConfigurationError(f"{file}: has no table [protocol]", "draft one: cdtool protocol init BENCHMARK")
    is_benchmark = "machine" in root.values
    if not is_benchmark:
        root.finish()
    table = root.table(TABLE, required=True)
    limits = joined(file.parent, table.text("limits")) if table.text("limits", "") else None
    profiles = read_force_limits(limits)
    benchmark = table.text("benchmark", "")
    if is_benchmark and benchmark:
        raise table.fault("benchmark", "is only for a file of its own", "remove the key")
    try:
        plan = TestPlan(
            number=table.text("number", ""),
            language=table.choice("language", _LANGUAGES, "en"),  # type: ignore[arg-type]  # a checked choice
            machine=_entries(table.table("machine"), MachineParticulars),
            test=_entries(table.table("test"), TestParticulars),
            instruments=_list(table, "instrument", Instrument),
            points=_list(table, "point", MeasuringPoint),
            deviations=_list(table, "deviation", Deviation),
            exclusions=_list(table, "exclusion", Exclusion),
        )
    except UsageError as fault:
        raise ConfigurationError(f"{file}: {fault.message}", fault.hint) from fault
    table.finish()
    _check_profiles(plan, profiles, table)
    base = file if is_benchmark else joined(file.parent, benchmark) if benchmark else None
    return ProtocolFile(file, plan, base, profiles, limits)


def digest_of_file(path: Path) -> str:
    """Return the SHA-256 of a small file; raises ConfigurationError if it cannot be read."""
    import hashlib

    return hashlib.sha256(read_bytes(path, ConfigurationError)).hexdigest()


def _check_profiles(plan: TestPlan, profiles: Mapping[str, ForceProfile], table: Table) -> None:
    for number, point in enumerate(plan.points, 1):
        if point.profile:
            try:
                profile_of(profiles, point.profile)
            except UsageError as fault:
                raise ConfigurationError(
                    f"{table.where}: protocol.point[{number}].profile: {fault.message}", fault.hint
                ) from fault


def _list(table: Table, name: str, kind: type[Entries]) -> tuple[Entries, ...]:
    """Return the tables [[protocol.NAME]]."""
    values = table.raw(name, [])
    if not isinstance(values, list) or not all(isinstance(item, dict) for item in values):
        raise table.fault(name, f"is {value_in_words(values)}", f"write each as a table [[protocol.{name}]]")
    prefix = f"{table.prefix}{name}"
    return tuple(_entries(Table(item, table.where, f"{prefix}[{n}]."), kind) for n, item in enumerate(values, 1))


def _entries(table: Table, kind: type[Entries]) -> Entries:
    """Return the values of a table by the fields of its dataclass; a missing or empty value is not known."""
    hints = get_type_hints(kind)
    values = {}
    for item in fields(kind):  # type: ignore[arg-type]  # a dataclass
        value = table.raw(item.name)
        if value is None or value == "":
            continue
        values[item.name] = _value(table, item.name, hints[item.name])
    table.finish()
    return kind(**values)


def _value(table: Table, name: str, hint: Any) -> Any:
    if hint == dt.date | None:
        return _date(table, name)
    if hint == float | None:
        # Only a temperature may be negative.
        return table.number(name) if name == "temperature_c" else table.number(name, minimum=0.0)
    if hint is int:
        return table.whole(name, 0, minimum=0)
    if hint == tuple[float, ...]:
        value = table.raw(name)
        return table.numbers(name, len(value) if isinstance(value, list) else 1, minimum=0.0)
    if hint == tuple[str, ...]:
        return table.texts(name)
    return table.text(name)


def _date(table: Table, name: str) -> dt.date:
    """Return a day, written as a date of TOML or as a text."""
    value = table.raw(name)
    if isinstance(value, dt.date) and not isinstance(value, dt.datetime):
        return value
    try:
        return dt.date.fromisoformat(table.text(name))
    except (ValueError, ConfigurationError) as fault:
        shown = str(value) if isinstance(value, dt.datetime | dt.time) else value_in_words(value)
        raise table.fault(name, f"is {shown}", "write a day as 2026-03-31") from fault
