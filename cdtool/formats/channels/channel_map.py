"""Map the columns or topics of a log to channels and units: [channels] of the machine file."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeVar

from cdtool.base.errors import ConfigurationError, nearest
from cdtool.base.log_names import log_stem
from cdtool.base.tables import Table
from cdtool.base.value_words import value_in_words
from cdtool.recordings.recording import CHANNELS, CHECKED, GROUND_TRUTH, RIG_UNITS, TRIGGER, UNITLESS
from cdtool.recordings.units import RAW_UNITS, unit

_CLOCKS = ("log", "publish", "header")
# The axes of a force vector, in the order of its columns.
AXES = ("x", "y", "z")
# What stands for the log in the name of a file beside it.
_PLACEHOLDERS = ("{stem}", "{name}", "{folder}")
_PLACEHOLDER = re.compile(r"\{[^{}]*\}")

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


Alignment = Literal["offset", "epoch", "trigger"]


@dataclass(frozen=True)
class OwnFile:
    """The file of a load cell or pressure sensor that is not in the log, and how its clock is aligned with the log's.

    `pattern` is relative to the log's folder, with {stem}, {name} and {folder} of the log. "offset": the times differ
    by the channel's `time_offset`. "epoch": both count from 1970. "trigger": `log_trigger` and `file_trigger` are
    columns, in the log or a topic and its field, that rise at the same time.
    """

    pattern: str
    time: TimeSource
    align: Alignment
    log_trigger: str | int = ""
    file_trigger: str | int = ""

    def path_for(self, log: Path) -> Path:
        """Return the file that belongs to a log."""
        own = log if log.name else log.resolve()  # "." has no name; a link has its own
        texts = {"{stem}": log_stem(own), "{name}": own.name, "{folder}": own.absolute().parent.name}
        return own.parent / _PLACEHOLDER.sub(lambda match: texts[match[0]], self.pattern)


@dataclass(frozen=True)
class ChannelSource:
    """Source of one channel, and its conversion to SI: value * factor [unit]; `stated`: the log's unit.

    In the log's unit: the sensor saturates at the ends of `valid_range` and cannot measure below `least` or above
    `most`. `unit_confirmed`: the unit is `stated`, whatever the header says; False: it is a guess; None: the header
    decides. `confirmed`: the channel is right,
    whatever the mechanics of the machine say. `keys` are the columns by their names in the file, once these are known
    (resolve_columns). `words`: the column may contain texts, which are read as categories.

    A force may be a vector: `columns`, or `fields`, each of one of the `topics`, are then its axes. `direction` (axes,)
    is a unit vector: the force is the component along it; without one it is the magnitude. It may be in a file of its
    own. Of a label, `kinds` are the values that are contacts, each with its kind; without them, all above 0.5 are.
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
    topics: tuple[str, ...] = ()
    fields: tuple[str, ...] = ()
    direction: tuple[float, ...] = ()
    own_file: OwnFile | None = None
    kinds: tuple[tuple[float, str], ...] = ()
    words: bool = False
    unit_confirmed: bool | None = None
    confirmed: bool = False

    @property
    def described(self) -> str:
        """Return its name in the machine file, for messages."""
        if self.fields:
            return ", ".join(self.axes)
        if self.topic:
            return f"{self.topic} {self.field}"
        return ", ".join(str(column) for column in self.columns)

    @property
    def axes(self) -> tuple[str, ...]:
        """Return the names of the axes of a force vector in the machine file; empty for any other channel."""
        if self.channel != "force" or len(self.factor) == 1:
            return ()
        if self.fields:
            return tuple(f"{topic} {field}" for topic, field in zip(self.topics, self.fields, strict=True))
        return tuple(str(column) for column in self.columns)

    @property
    def reduction(self) -> str:
        """Return how the axes of a force become one number, in words; empty for any other channel."""
        if not self.axes:
            return ""
        names = ", ".join(self.axes)
        if not self.direction:
            return f"magnitude of {names}"
        return f"component of {names} along ({', '.join(f'{part:g}' for part in self.direction)})"

    @property
    def by_axis(self) -> tuple[ChannelSource, ...]:
        """Return one source per axis of a vector of fields, so that a reader of topics finds each; otherwise itself."""
        pairs = zip(self.topics, self.fields, strict=True)
        return tuple(replace(self, topic=topic, field=name, topics=(), fields=()) for topic, name in pairs) or (self,)


@dataclass(frozen=True)
class TimeSource:
    """The clock: a column and its factor to seconds, a fixed rate, or (MCAP) one of a message's clocks.

    With both a column and a rate, the column counts samples: a gap in it is a gap in time. `unit` is the column's.
    `nanoseconds` is the column with the rest of each stamp within the second. `key` and `nanoseconds_key` are the
    columns by their names in the file, once these are known (resolve_columns).
    """

    column: str | int | None = None
    factor: float = 1.0
    unit: str = ""
    rate: float | None = None
    clock: Literal["log", "publish", "header"] = "log"
    key: str = ""
    nanoseconds: str | int | None = None
    nanoseconds_key: str = ""


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

    `named`: the machine file names its joints. Otherwise a single joint has the machine's name. `beside` are the
    channels in files of their own, which are not among the `sources`.
    """

    time: TimeSource
    sources: tuple[ChannelSource, ...]
    joints: tuple[str, ...]
    topics: bool = False
    speed_low_pass: float = 50.0
    pins: TablePins = TablePins()
    named: bool = True
    beside: tuple[ChannelSource, ...] = ()

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
    in_log = tuple(source for source in sources if source.own_file is None)
    beside = tuple(source for source in sources if source.own_file is not None)
    return ChannelMap(time, in_log, joints, topics, low_pass, beside=beside)


def _time_source(table: Table, topics: bool) -> TimeSource:
    if topics:
        part = table.table("time")
        clock = part.choice("clock", _CLOCKS, "log")
        part.finish()
        return TimeSource(clock=clock)  # type: ignore[arg-type]
    if not table.values or set(table.values) == {"mcap"}:
        return TimeSource()
    return _column_time(table.table("time", required=True))


def _column_time(part: Table) -> TimeSource:
    """Return the clock of a table: a column, a rate, or both."""
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
    rest = _column(part, part.raw("nanoseconds"), "nanoseconds") if "nanoseconds" in part else None
    part.finish()
    return TimeSource(column=column, factor=found.factor, unit=name, nanoseconds=rest)


def _source(
    table: Table, channel: str, joints: tuple[str, ...], accepted: tuple[str, ...], topics: bool
) -> ChannelSource:
    count = 1 if channel in (*GROUND_TRUTH, *TRIGGER) else len(joints)
    columns: tuple[str | int, ...] = ()
    topic = field = ""
    axes: tuple[tuple[str, str], ...] = ()
    own_file = _own_file(table, topics) if channel in RIG_UNITS and "file" in table else None
    topics = topics and own_file is None
    if topics and channel == "force" and ("fields" in table or "topics" in table):
        axes = _field_axes(table)
        count = len(axes)
        if count == 1:
            ((topic, field),), axes = axes, ()
    elif topics:
        topic, field = table.text("topic"), table.text("field")
    else:
        columns = _columns(table, channel, count)
        count = len(columns)
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
        topics=tuple(topic for topic, _ in axes),
        fields=tuple(field for _, field in axes),
        direction=_direction(table, count) if channel == "force" and "direction" in table else (),
        own_file=own_file,
        kinds=_kinds(table) if channel == "label" and "kinds" in table else (),
        unit_confirmed=table.flag("unit_confirmed", False)
        if channel not in UNITLESS and "unit_confirmed" in table
        else None,
        confirmed=channel in CHECKED and table.flag("confirmed", False),
    )
    table.finish()
    return source


def _kinds(table: Table) -> tuple[tuple[float, str], ...]:
    """Return the values of a label that are contacts, each with its kind: { 1 = "hard", 2 = "soft" }."""
    part = table.table("kinds")
    kinds = []
    for value in part.values:
        try:
            code = float(value)
        except ValueError:
            code = math.nan
        if not math.isfinite(code):
            raise part.fault(value, "is not a number", 'give values of the column: kinds = { 1 = "hard", 2 = "soft" }')
        kind = part.text(value).strip()
        if not kind:
            raise part.fault(value, "has no name", "name the kind; leave out values that are not contacts")
        kinds.append((code, kind))
    if not kinds or len({code for code, _ in kinds}) < len(kinds):
        raise table.fault("kinds", "is empty, or has a value twice", 'give each value once: { 1 = "hard", 2 = "soft" }')
    return tuple(kinds)


def _own_file(table: Table, topics: bool) -> OwnFile:
    """Return the file beside the log of a load cell or pressure sensor; raises ConfigurationError for a wrong clock."""
    pattern = table.text("file")
    placeholders = _PLACEHOLDER.findall(pattern)
    if not placeholders or "\0" in pattern:
        raise table.fault("file", f"is {value_in_words(pattern)}", "name the log in it, e.g. cell_{stem}.csv")
    for name in placeholders:
        if name not in _PLACEHOLDERS:
            raise table.fault("file", f"has {name}", f"use {', '.join(_PLACEHOLDERS)}")
    given = [key for key in ("trigger", "clock") if key in table]
    if len(given) == 2 or not (given or "time_offset" in table):
        raise table.fault(
            "file", "the clocks are not aligned", 'give time_offset, clock = "epoch" or trigger = { log = , file = }'
        )
    time = _column_time(table.table("time", required=True))
    if "clock" in given:
        table.choice("clock", ("epoch",))
        return OwnFile(pattern, time, "epoch")
    if not given:
        return OwnFile(pattern, time, "offset")
    part = table.table("trigger")
    log, file = (_column(part, part.raw(key), key) for key in ("log", "file"))
    if topics and (not isinstance(log, str) or " " not in log.strip()):
        raise part.fault("log", f"is {value_in_words(log)}", 'give topic and field, e.g. "/sync data"')
    part.finish()
    return OwnFile(pattern, time, "trigger", log, file)


def _columns(table: Table, channel: str, count: int) -> tuple[str | int, ...]:
    """Return the columns of a channel: `count`, or for a force up to one per axis."""
    given = table.raw("columns")
    if given is not None and "column" in table:
        raise table.fault("columns", "cannot be combined with 'column'", "remove one of the two")
    listed = given if isinstance(given, list) else [table.raw("column")]
    columns = tuple(_column(table, item, "column" if given is None else "columns") for item in listed)
    if channel == "force" and given is not None:
        return _distinct_axes(table, "columns", columns)
    if len(columns) != count:
        raise table.fault("columns", f"names {len(columns)} columns", f"give {count}: one per joint")
    return columns


def _field_axes(table: Table) -> tuple[tuple[str, str], ...]:
    """Return topic and field of each axis of a force: several fields of a topic, or fields of several topics."""
    for one, several in (("topic", "topics"), ("field", "fields")):
        if one in table and several in table:
            raise table.fault(several, f"cannot be combined with '{one}'", "remove one of the two")
    topics = table.texts("topics") if "topics" in table else (table.text("topic"),)
    fields = table.texts("fields") if "fields" in table else (table.text("field"),)
    count = max(len(topics), len(fields))
    if len(topics) not in (1, count) or len(fields) not in (1, count):
        raise table.fault("topics", f"names {len(topics)} topics for {len(fields)} fields", "give one of each per axis")
    topics, fields = (names * count if len(names) == 1 else names for names in (topics, fields))
    for name in fields:
        if "[:]" in name:
            raise table.fault("fields", f"names '{name}', a whole array", "name one element per axis, e.g. data[0]")
    return _distinct_axes(table, "fields", tuple(zip(topics, fields, strict=True)))


_Name = TypeVar("_Name", "str | int", "tuple[str, str]")


def _distinct_axes(table: Table, key: str, names: tuple[_Name, ...]) -> tuple[_Name, ...]:
    if not 1 <= len(names) <= len(AXES):
        raise table.fault(key, f"names {len(names)} axes", "give up to three: the axes of the force")
    if len(set(names)) < len(names):
        raise table.fault(key, "names an axis twice", "name each axis once")
    return names


def _direction(table: Table, count: int) -> tuple[float, ...]:
    """Return the unit vector (axes,) of `direction`: the name of an axis, perhaps with a minus, or one number each."""
    value = table.raw("direction")
    known = [f"{sign}{axis}" for axis in AXES[:count] for sign in ("", "-")]
    if count == 1:
        raise table.fault("direction", "needs a force with several columns", "reverse one column with scale = -1")
    if isinstance(value, str):
        axis = table.choice("direction", known)
        return tuple((-1.0 if axis[0] == "-" else 1.0) * (name == axis[-1]) for name in AXES[:count])
    if not isinstance(value, list):
        raise table.fault("direction", f"is {value_in_words(value)}", f"give {count} numbers, or one of {known}")
    numbers = table.numbers("direction", count)
    length = math.hypot(*numbers)
    if length == 0.0 or not math.isfinite(length):
        raise table.fault("direction", "has no length", "give a vector other than 0, e.g. [0, 0, -1]")
    return tuple(number / length for number in numbers)


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
