"""Map the columns or topics of a log to channels and units: [channels] of the machine file."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from cdtool.errors import ConfigurationError, nearest
from cdtool.recording import CHANNELS, GROUND_TRUTH, TRIGGER, UNITLESS
from cdtool.tables import Table
from cdtool.units import RAW_UNITS, unit
from cdtool.value_words import value_in_words

_CLOCKS = ("log", "publish", "header")

AcceptedUnits = Callable[[str], tuple[str, ...]]


@dataclass(frozen=True)
class Duty:
    """Motor torque from the applied voltage if the current is not measured (thesis 6.2.2, DC equivalent circuit).

    tau = k_t (u - k_e omega) / R with u = duty * supply voltage (or the voltage itself); units V, ohm, V s/rad, N m/A.
    """

    supply_voltage: float
    resistance: float
    back_emf_constant: float
    torque_constant: float


@dataclass(frozen=True)
class ChannelSource:
    """Source of one channel, and its conversion to SI: value * factor [unit]; `stated`: the log's unit.

    In the log's unit: the sensor saturates at the ends of `valid_range` and cannot measure below `least` or above
    `most`. `keys` are the columns by their names in the file, once these are known (resolve_columns). `words`: the
    column may contain texts, which are read as categories.
    """

    channel: str
    columns: tuple[str | int, ...] = ()
    topic: str = ""
    field: str = ""
    factor: tuple[float, ...] = (1.0,)
    unit: str = "1"
    stated: str = ""
    time_offset: float = 0.0
    valid_range: tuple[float, float] | None = None
    least: float = -math.inf
    most: float = math.inf
    duty: Duty | None = None
    keys: tuple[str, ...] = ()
    words: bool = False

    @property
    def described(self) -> str:
        """Return its name in the machine file, for messages."""
        if self.topic:
            return f"{self.topic} {self.field}"
        return ", ".join(str(column) for column in self.columns)


@dataclass(frozen=True)
class TimeSource:
    """The clock: a column and its factor to seconds, a fixed rate, or (MCAP) one of a message's clocks.

    With both a column and a rate, the column counts samples: a gap in it is a gap in time. `unit` is the column's.
    `key` is the column by its name in the file, once this is known (resolve_columns).
    """

    column: str | int | None = None
    factor: float = 1.0
    unit: str = ""
    rate: float | None = None
    clock: Literal["log", "publish", "header"] = "log"
    key: str = ""


@dataclass(frozen=True)
class TablePins:
    """Settings of a table's format in `[csv]`; the others are found in the file.

    None, for a mark, text or line, means not set; `header` and `units` False: the table has none.
    """

    separator: str = ""
    decimal: str = ""
    thousands: str | None = None
    encoding: str = ""
    header: int | bool | None = None
    units: int | bool | None = None
    skip_lines: int = 0
    comment: str | None = None
    missing: tuple[str, ...] = ()
    time_format: str = ""


@dataclass(frozen=True)
class ChannelMap:
    """All channels of a log; `topics` distinguishes the MCAP map from the map of columns, `pins` is for text tables.

    `named`: the machine file names its joints. Otherwise a single joint has the machine's name.
    """

    time: TimeSource
    sources: tuple[ChannelSource, ...]
    joints: tuple[str, ...]
    topics: bool = False
    speed_low_pass: float = 50.0
    pins: TablePins = TablePins()
    named: bool = True

    @property
    def worded(self) -> frozenset[str | int]:
        """Return the columns that may contain texts, by their names or numbers."""
        return frozenset(column for source in self.sources if source.words for column in source.columns)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Return the names of the joints in the messages of a log; empty if none are given."""
        return self.joints if self.named else ()

    def __contains__(self, channel: str) -> bool:
        return any(source.channel == channel for source in self.sources)


def read_channel_map(table: Table, joints: tuple[str, ...], accepted: AcceptedUnits, topics: bool) -> ChannelMap:
    """Return the map in `[channels]` (columns) or `[channels.mcap]` (topics); `accepted`: SI units per channel."""
    time = _time_source(table, topics)
    low_pass = table.number("speed_low_pass_hz", 50.0, above=0.0)
    sources = []
    for name in table.values:
        if name in ("time", "speed_low_pass_hz") or (name == "mcap" and not topics):
            table.raw(name)
            continue
        if name not in CHANNELS:
            raise table.fault(name, "unknown channel", nearest(name, ["time", *CHANNELS]))
        try:
            sources.append(_source(table.table(name), name, joints, accepted(name), topics))
        except ConfigurationError as fault:
            fault.channel = name
            raise
    return ChannelMap(time, tuple(sources), joints, topics, low_pass)


def _time_source(table: Table, topics: bool) -> TimeSource:
    if topics:
        part = table.table("time")
        clock = part.choice("clock", _CLOCKS, "log")
        part.finish()
        return TimeSource(clock=clock)  # type: ignore[arg-type]
    if not table.values or set(table.values) == {"mcap"}:
        return TimeSource()
    part = table.table("time", required=True)
    if "rate_hz" in part:
        rate = part.number("rate_hz", above=0.0)
        counter = part.raw("column")
        part.finish()
        if counter is None:
            return TimeSource(rate=rate)
        return TimeSource(column=_column(part, counter, "column"), factor=1.0 / rate, rate=rate)
    column = _column(part, part.raw("column"), "column")
    name = part.text("unit", "")
    if not name:
        raise part.fault("unit", "is missing", "give s, ms, us, ns or min")
    found = unit(name, part.key("unit"))
    if found.si != "s":
        raise part.fault("unit", f"'{name}' is not a unit of time", "give s, ms, us, ns or min")
    part.finish()
    return TimeSource(column=column, factor=found.factor, unit=name)


def _source(
    table: Table, channel: str, joints: tuple[str, ...], accepted: tuple[str, ...], topics: bool
) -> ChannelSource:
    count = 1 if channel in (*GROUND_TRUTH, *TRIGGER) else len(joints)
    columns: tuple[str | int, ...] = ()
    topic = field = ""
    if topics:
        topic, field = table.text("topic"), table.text("field")
    else:
        given = table.raw("columns")
        if given is not None and "column" in table:
            raise table.fault("columns", "cannot be combined with 'column'", "remove one of the two")
        listed = given if isinstance(given, list) else [table.raw("column")]
        columns = tuple(_column(table, item, "column" if given is None else "columns") for item in listed)
        if len(columns) != count:
            raise table.fault("columns", f"names {len(columns)} columns", f"give {count}: one per joint")
    kind = table.choice("kind", ("measured", "duty"), "measured")
    duty = _duty(table, channel) if kind == "duty" else None
    stated, si, factor = _unit_factor(table, channel, accepted, count, topics, duty)
    least, most = _possible_range(table)
    source = ChannelSource(
        channel=channel,
        columns=columns,
        topic=topic,
        field=field,
        factor=factor,
        unit=si,
        stated=stated,
        time_offset=table.number("time_offset", 0.0),
        valid_range=_valid_range(table),
        least=least,
        most=most,
        duty=duty,
    )
    table.finish()
    return source


def _unit_factor(
    table: Table, channel: str, accepted: tuple[str, ...], count: int, topics: bool, duty: Duty | None
) -> tuple[str, str, tuple[float, ...]]:
    """Return the unit as stated, the channel's own unit, and the factors between them."""
    scale = table.numbers("scale", count, 1.0)
    if any(item == 0.0 for item in scale):
        raise table.fault("scale", "is 0", "give a factor other than 0, e.g. N m per A")
    if channel in UNITLESS:  # a unit is meaningless and refused as an unknown key
        return "", "1", scale
    name = table.text("unit", "")
    if not name:
        if not topics or duty is not None:
            raise table.fault("unit", "is missing", f"give the unit of the log, e.g. {accepted[0]}")
        name = accepted[0]
    found = unit(name, table.key("unit"))
    factor = tuple(found.factor * item for item in scale)
    if duty is not None:
        if found.si not in ("1", "V"):
            raise table.fault("unit", f"is '{name}'", "kind = 'duty' takes %, 1 or V")
        return name, found.si, factor
    if found.si in accepted:
        return name, found.si, factor
    if found.si in RAW_UNITS:
        if "scale" not in table.values:
            raise table.fault("scale", f"is missing for unit '{name}'", f"give the {accepted[0]} per {found.si}")
        return name, accepted[0], factor
    raise table.fault(
        "unit",
        f"'{name}' does not measure {channel} here",
        f"use units of {' or '.join(accepted)}, or {', '.join(RAW_UNITS)} with a scale",
    )


def _duty(table: Table, channel: str) -> Duty:
    if channel != "torque":
        raise table.fault("kind", "'duty' is only for the torque channel", "remove it")
    return Duty(
        supply_voltage=table.number("supply_voltage", 1.0, above=0.0),
        resistance=table.number("resistance", above=0.0),
        back_emf_constant=table.number("back_emf_constant", minimum=0.0),
        torque_constant=table.number("torque_constant", above=0.0),
    )


def _valid_range(table: Table) -> tuple[float, float] | None:
    value = table.raw("saturation")
    if value is None:
        return None
    if isinstance(value, list) and len(value) == 2 and all(isinstance(item, int | float) for item in value):
        low, high = float(value[0]), float(value[1])
        if math.isfinite(low) and math.isfinite(high) and low < high:
            return low, high
    raise table.fault(
        "saturation", f"is {value_in_words(value)}", "give [lowest, highest] reading of the sensor, in the log's unit"
    )


def _possible_range(table: Table) -> tuple[float, float]:
    least = table.number("min") if "min" in table else -math.inf
    most = table.number("max") if "max" in table else math.inf
    if least >= most:
        raise table.fault("min", f"is {least:g}, max is {most:g}", "give the sensor's smallest and largest value")
    return least, most


def _column(table: Table, value: object, key: str) -> str | int:
    if isinstance(value, str) and value:
        return value
    if isinstance(value, int) and not isinstance(value, bool) and value >= 0:
        return value
    problem = "is missing" if value is None else f"is {value_in_words(value)}"
    raise table.fault(key, problem, "give a column's name, or its number counted from 0")
