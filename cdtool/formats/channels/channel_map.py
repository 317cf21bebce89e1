"""Map the columns or topics of a log to channels and units: [channels] of the machine file."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, make_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from cdtool.base.errors import RecordingError, nearest
from cdtool.base.log_names import log_stem
from cdtool.base.settings import CountFromZero, NotNegative, Place, Positive, Text, read, setting
from cdtool.base.value_words import value_in_words
from cdtool.formats.messages.fields import parse_field
from cdtool.recordings.recording import CHANNELS, CHECKED, GROUND_TRUTH, RIG_UNITS, TRIGGER, UNITLESS
from cdtool.recordings.units import RAW_UNITS, unit

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

    A force may be a vector: `columns`, or `fields` of its topic, are then its axes. `direction` (axes,)
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
            return tuple(f"{self.topic} {field}" for field in self.fields)
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
        return tuple(replace(self, field=name, fields=()) for name in self.fields) or (self,)


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


_COLUMN_HINT = "give a column's name, or its number counted from 0"
Column = Text | CountFromZero
_ColumnKey = Annotated[Column | None, setting("a column's name, or its number counted from 0", hint=_COLUMN_HINT)]


@dataclass(frozen=True, kw_only=True)
class ClockTable:
    """The clock of a table: a column, a rate, or both, then the column counts samples."""

    column: _ColumnKey = None
    unit: Annotated[str, setting("s, ms, us, ns or min")] = ""
    rate_hz: Annotated[Positive | None, setting("a fixed rate", unit="Hz")] = None
    nanoseconds: _ColumnKey = None


@dataclass(frozen=True, kw_only=True)
class MessageClockTable:
    """Which of a message's clocks counts."""

    clock: Annotated[
        Literal["log", "publish", "header"], setting("when it was logged, published, or the stamp in its header")
    ] = "log"


@dataclass(frozen=True, kw_only=True)
class TriggerTable:
    """Columns, in the log (or a topic and its field) and in the file beside it, that rise at the same time."""

    log: _ColumnKey = None
    file: _ColumnKey = None


@dataclass(frozen=True, kw_only=True)
class ChannelTable:
    """Where a channel is in a log, and its unit; some keys are for some channels only."""

    column: _ColumnKey = None
    columns: Annotated[
        tuple[Column, ...] | None, setting("one column for each joint; of a force, its axes", hint=_COLUMN_HINT)
    ] = None
    topic: Annotated[str, setting("MCAP and bags: the topic")] = ""
    field: Annotated[str, setting("MCAP and bags: the field of its messages")] = ""
    fields: Annotated[tuple[str, ...], setting("of a force with several axes: a field for each")] = ()
    unit: Annotated[str, setting("unit of the log; required in a table")] = ""
    scale: Annotated[
        tuple[float, ...],
        setting("factor on the way to that unit, not 0, such as N m per A; one for each joint, or for all"),
    ] = ()
    time_offset: Annotated[float | None, setting("added to the channel's times; default: 0", unit="s")] = None
    saturation: Annotated[
        tuple[float, float] | None,
        setting(
            "[lowest, highest] reading of the sensor, in the log's unit",
            hint="give [lowest, highest] reading of the sensor, in the log's unit",
        ),
    ] = None
    min: Annotated[float | None, setting("the sensor cannot measure less, in the log's unit")] = None
    max: Annotated[float | None, setting("the sensor cannot measure more, in the log's unit")] = None
    unit_confirmed: Annotated[
        bool | None, setting("true: the unit is right, whatever the header says; false: it is a guess")
    ] = None
    confirmed: Annotated[bool, setting("the channel is right, whatever the mechanics of the machine say")] = False
    kind: Annotated[Literal["measured", "duty"], setting("torque: duty, from the applied voltage")] = "measured"
    supply_voltage: Annotated[Positive, setting("of a duty", unit="V")] = 1.0
    resistance: Annotated[Positive | None, setting("of a duty: of the windings; required", unit="ohm")] = None
    back_emf_constant: Annotated[NotNegative | None, setting("of a duty; required", unit="V s/rad")] = None
    torque_constant: Annotated[Positive | None, setting("of a duty; required", unit="N m/A")] = None
    direction: Annotated[
        str | tuple[float, ...] | None,
        setting(
            "of a force with several axes: the component along an axis (z, -z) or a vector; default: the magnitude"
        ),
    ] = None
    kinds: Annotated[
        dict[str, str] | None,
        setting('of a label: its values that are contacts, each with its kind, as { 1 = "hard", 2 = "soft" }'),
    ] = None
    file: Annotated[
        Text | None, setting("of a load cell or pressure sensor: a file beside the log, as cell_{stem}.csv")
    ] = None
    time: Annotated[ClockTable | None, setting("the clock of that file")] = None
    clock: Annotated[Literal["epoch"] | None, setting("both clocks count from 1970")] = None
    trigger: Annotated[TriggerTable | None, setting("what rises at the same time in both")] = None


# What says where a channel is: in a table, in messages, or in a file beside the log, which is a table.
_IN_TABLE, _IN_MESSAGES = ("column", "columns"), ("topic", "field")
_IN_FILE = ("file", "time", "clock", "trigger")
_OF_DUTY = ("supply_voltage", "resistance", "back_emf_constant", "torque_constant")
_CHANNELS = [(name, Annotated[ChannelTable | None, setting(f"the channel {name}")], None) for name in CHANNELS]
_LOW_PASS = Annotated[Positive, setting("low-pass of a speed that is derived from the position", unit="Hz")]
TopicsTable: Any = make_dataclass(
    "TopicsTable",
    [
        ("time", Annotated[MessageClockTable, setting("the clock of the messages")], MessageClockTable()),
        ("speed_low_pass_hz", _LOW_PASS, 50.0),
        *_CHANNELS,
    ],
    frozen=True,
)
ColumnsTable: Any = make_dataclass(
    "ColumnsTable",
    [
        ("time", Annotated[ClockTable | None, setting("the clock of a table")], None),
        ("speed_low_pass_hz", _LOW_PASS, 50.0),
        ("mcap", Annotated[TopicsTable, setting("the channels in messages")], TopicsTable()),
        *_CHANNELS,
    ],
    frozen=True,
)


def channel_maps(
    given: Any, place: Place, joints: tuple[str, ...], accepted: AcceptedUnits
) -> tuple[ChannelMap, ChannelMap]:
    """Return the maps of columns, [channels], and of topics, [channels.mcap], with the mistakes in `place`.

    `accepted`: SI units per channel. `joints`: empty if they are not known, because the machine is wrong.
    """
    nothing = ChannelMap(TimeSource(), (), joints)
    if not isinstance(given, dict):
        place.note("", f"is {value_in_words(given)}", "add a table [channels]")
        return nothing, nothing
    table = read(ColumnsTable, given, place) or ColumnsTable()
    time = TimeSource()
    if table.time or set(given) - {"mcap"}:
        time = place.tried(time, _column_time, table.time, place)
    of_columns = _Sources(joints, accepted, False).of(table, given, place)
    below = place.below("mcap")
    of_topics = _Sources(joints, accepted, True).of(table.mcap, given.get("mcap", {}), below)
    maps = []
    for sources, clock, low_pass, topics in (
        (of_columns, time, table.speed_low_pass_hz, False),
        (of_topics, TimeSource(clock=table.mcap.time.clock), table.mcap.speed_low_pass_hz, True),
    ):
        in_log = tuple(source for source in sources if source.own_file is None)
        beside = tuple(source for source in sources if source.own_file is not None)
        maps.append(ChannelMap(clock, in_log, joints, topics, low_pass, beside=beside))
    return maps[0], maps[1]


def _column_time(table: ClockTable | None, above: Place) -> TimeSource:
    """Return the clock of a table: a column, a rate, or both."""
    place = above.below("time")
    if table is None:
        raise above.fault("time", "is missing", f"add a table [{above.prefix}time]")
    if table.rate_hz is not None:
        if table.column is None:
            return TimeSource(rate=table.rate_hz)
        return TimeSource(column=table.column, factor=1.0 / table.rate_hz, rate=table.rate_hz)
    if place.has_mistake(f"{place.prefix}rate_hz"):
        return TimeSource()
    if table.column is None:
        place.note("column", "is missing", _COLUMN_HINT)
    if not table.unit:
        raise place.fault("unit", "is missing", "give s, ms, us, ns or min")
    with place.at("unit"):
        found = unit(table.unit)
    if found.si != "s":
        raise place.fault("unit", f"'{table.unit}' is not a unit of time", "give s, ms, us, ns or min")
    return TimeSource(column=table.column, factor=found.factor, unit=table.unit, nanoseconds=table.nanoseconds)


@dataclass(frozen=True)
class _Sources:
    """The sources of a log's channels, for these joints, with their accepted SI units."""

    joints: tuple[str, ...]
    accepted: AcceptedUnits
    topics: bool

    def of(self, table: Any, given: Mapping[str, Any], place: Place) -> list[ChannelSource]:
        """Return the sources of the channels that a table has; `given` is the table as it is written."""
        found = []
        for name in given:
            if name in CHANNELS and (channel := getattr(table, name)) is not None:
                known = len(place.mistakes)
                with place.noting():
                    found.append(self.source(name, channel, given[name], place.below(name)))
                for fault in place.mistakes[known:]:
                    fault.channel = name
        return found

    def source(self, channel: str, table: ChannelTable, given: Mapping[str, Any], place: Place) -> ChannelSource:
        """Return the source of a channel, with the mistakes in `place`; raises ConfigurationError for some of them."""
        if channel not in RIG_UNITS:
            table = replace(table, file=None)
        self._refuse_others(channel, table, given, place)
        count = 1 if channel in (*GROUND_TRUTH, *TRIGGER) else len(self.joints)
        columns: tuple[str | int, ...] = ()
        fields: tuple[str, ...] = ()
        topics = self.topics and table.file is None
        if topics:
            fields = place.tried((), _fields, table, place)
        else:
            columns = place.tried((), _columns, table, channel, count, place)
            count = len(columns) or count
        if len(fields) > 1:
            count = len(fields)
        duty = _duty(table, place) if table.kind == "duty" else None
        scaled = _Scaled(channel, self.accepted(channel), count, topics)
        nothing: tuple[str, str, tuple[float, ...]] = ("", "", ())
        stated, si, factor = place.tried(nothing, scaled.unit_and_factor, table, duty, place)
        least = -math.inf if table.min is None else table.min
        most = math.inf if table.max is None else table.max
        if least >= most:
            place.note("min", f"is {least:g}, max is {most:g}", "give the sensor's smallest and largest value")
        if table.saturation and table.saturation[0] >= table.saturation[1]:
            hint = "give [lowest, highest] reading of the sensor, in the log's unit"
            place.note("saturation", f"is {value_in_words(table.saturation)}", hint)
        return ChannelSource(
            channel=channel,
            columns=columns,
            topic=table.topic if topics else "",
            field=fields[0] if len(fields) == 1 else "",
            factor=factor,
            unit=si,
            stated=stated,
            time_offset=table.time_offset or 0.0,
            valid_range=table.saturation,
            least=least,
            most=most,
            duty=duty,
            fields=fields if len(fields) > 1 else (),
            direction=() if table.direction is None else place.tried((), _direction, table.direction, count, place),
            own_file=None if table.file is None else _own_file(table, place, in_messages=self.topics),
            kinds=() if table.kinds is None else _kinds(table.kinds, place),
            unit_confirmed=table.unit_confirmed,
            confirmed=table.confirmed,
        )

    def _refuse_others(self, channel: str, table: ChannelTable, given: Mapping[str, Any], place: Place) -> None:
        """Note the keys that this channel, or a log of this kind, does not have."""
        allowed = {"unit", "scale", "time_offset", "saturation", "min", "max", "unit_confirmed", "kind"}
        allowed -= {"unit", "unit_confirmed"} if channel in UNITLESS else set()
        allowed |= {"confirmed"} if channel in CHECKED else set()
        allowed |= {"file"} if channel in RIG_UNITS else set()
        allowed |= set(_OF_DUTY) if table.kind == "duty" else set()
        allowed |= {"direction"} if channel == "force" else set()
        allowed |= {"kinds"} if channel == "label" else set()
        in_messages = self.topics and table.file is None
        allowed |= set(_IN_MESSAGES if in_messages else _IN_TABLE)
        allowed |= {"fields"} if in_messages and channel == "force" else set()
        allowed |= set(_IN_FILE) if table.file is not None else set()
        for name in given:
            if name not in allowed:
                place.note(name, "unknown key", nearest(name, allowed))
        if table.kind == "duty" and channel != "torque":
            place.note("kind", "'duty' is only for the torque channel", "remove it")


def _kinds(given: Mapping[str, str], place: Place) -> tuple[tuple[float, str], ...]:
    """Return the values of a label that are contacts, each with its kind: { 1 = "hard", 2 = "soft" }."""
    below, kinds = place.below("kinds"), []
    for value, kind in given.items():
        try:
            code = float(value)
        except ValueError:
            code = math.nan
        if not math.isfinite(code):
            hint = 'give values of the column: kinds = { 1 = "hard", 2 = "soft" }'
            below.note(value, "is not a number", hint)
        if not kind.strip():
            below.note(value, "has no name", "name the kind; leave out values that are not contacts")
        kinds.append((code, kind.strip()))
    if not kinds or len({code for code, _ in kinds}) < len(kinds):
        place.note("kinds", "is empty, or has a value twice", 'give each value once: { 1 = "hard", 2 = "soft" }')
    return tuple(kinds)


def _own_file(table: ChannelTable, place: Place, *, in_messages: bool) -> OwnFile:
    """Return the file beside the log of a load cell or pressure sensor, with the mistakes in `place`."""
    pattern = table.file or ""
    placeholders = _PLACEHOLDER.findall(pattern)
    if not placeholders or "\0" in pattern:
        place.note("file", f"is {value_in_words(pattern)}", "name the log in it, e.g. cell_{stem}.csv")
    for name in placeholders:
        if name not in _PLACEHOLDERS:
            place.note("file", f"has {name}", f"use {', '.join(_PLACEHOLDERS)}")
    hint = 'give time_offset, clock = "epoch" or trigger = { log = , file = }'
    is_given = table.clock or table.trigger or table.time_offset is not None
    wrong = place.has_mistake(f"{place.prefix}trigger", f"{place.prefix}time_offset")
    if (table.clock and table.trigger) or not (is_given or wrong):
        place.note("clock", "the clocks are not aligned", hint)
    time = place.tried(TimeSource(), _column_time, table.time, place)
    if table.clock:
        return OwnFile(pattern, time, "epoch")
    if table.trigger is None:
        return OwnFile(pattern, time, "offset")
    log, file, below = table.trigger.log, table.trigger.file, place.below("trigger")
    for name, value in (("log", log), ("file", file)):
        if value is None:
            below.note(name, "is missing", _COLUMN_HINT)
    if in_messages and (not isinstance(log, str) or " " not in log.strip()):
        below.note("log", f"is {value_in_words(log)}", 'give topic and field, e.g. "/sync data"')
    return OwnFile(pattern, time, "trigger", "" if log is None else log, "" if file is None else file)


def _columns(table: ChannelTable, channel: str, count: int, place: Place) -> tuple[str | int, ...]:
    """Return the columns of a channel: `count` unless that is 0, or for a force up to one per axis."""
    if table.columns is not None and table.column is not None:
        raise place.fault("columns", "cannot be combined with 'column'", "remove one of the two")
    if table.columns is None and table.column is None:
        raise place.fault("column", "is missing", _COLUMN_HINT)
    columns = (table.column,) if table.columns is None else table.columns
    if channel == "force" and table.columns is not None:
        _check_axes("columns", columns, place)
    elif count and len(columns) != count:
        place.note("columns", f"names {len(columns)} columns", f"give {count}: one per joint")
    return tuple(column for column in columns if column is not None)


def _fields(table: ChannelTable, place: Place) -> tuple[str, ...]:
    """Return the field of a channel in its topic, or the fields that are the axes of a force."""
    if table.field and table.fields:
        raise place.fault("fields", "cannot be combined with 'field'", "remove one of the two")
    for key, given in (("topic", table.topic), ("field", table.field or table.fields)):
        if not given:
            place.note(key, "is missing", "give a text")
    for name in filter(None, table.fields or (table.field,)):
        try:
            parse_field(name, place.where)
        except RecordingError as fault:
            place.note("fields" if table.fields else "field", f"is '{name}'", fault.hint)
    for name in table.fields:
        if "[:]" in name:
            hint = "name one element per axis, e.g. data[0]"
            raise place.fault("fields", f"names '{name}', a whole array", hint)
    if table.fields:
        _check_axes("fields", table.fields, place)
    return table.fields or (table.field,)


def _check_axes(key: str, names: Sequence[object], place: Place) -> None:
    if not 1 <= len(names) <= len(AXES):
        place.note(key, f"names {len(names)} axes", "give up to three: the axes of the force")
    if len(set(names)) < len(names):
        place.note(key, "names an axis twice", "name each axis once")


def _direction(given: str | tuple[float, ...], count: int, place: Place) -> tuple[float, ...]:
    """Return the unit vector (axes,) of `direction`: the name of an axis, perhaps with a minus, or one number each."""
    known = [f"{sign}{axis}" for axis in AXES[:count] for sign in ("", "-")]
    if count == 1:
        raise place.fault("direction", "needs a force with several columns", "reverse one column with scale = -1")
    if isinstance(given, str):
        if given not in known:
            raise place.fault("direction", f"is '{given}'", nearest(given, known))
        return tuple((-1.0 if given[0] == "-" else 1.0) * (name == given[-1]) for name in AXES[:count])
    if len(given) != count:
        raise place.fault("direction", f"has {len(given)} values", f"give {count} numbers, or one of {known}")
    length = math.hypot(*given)
    if length == 0.0 or not math.isfinite(length):
        raise place.fault("direction", "has no length", "give a vector other than 0, e.g. [0, 0, -1]")
    return tuple(number / length for number in given)


@dataclass(frozen=True)
class _Scaled:
    """How the values of a channel become SI: `accepted` units, `count` columns, in messages with `topics`."""

    channel: str
    accepted: tuple[str, ...]
    count: int
    topics: bool

    def unit_and_factor(
        self, table: ChannelTable, duty: Duty | None, place: Place
    ) -> tuple[str, str, tuple[float, ...]]:
        """Return the unit as stated, the channel's own unit, and the factors between them."""
        if len(table.scale) not in (0, 1, self.count):
            hint = f"give one number, or {self.count}: one per joint"
            place.note("scale", f"has {len(table.scale)} values", hint)
        scale = (table.scale or (1.0,)) * (1 if len(table.scale) == self.count else self.count)
        if 0.0 in scale:
            place.note("scale", "is 0", "give a factor other than 0, e.g. N m per A")
        if self.channel in UNITLESS:  # a unit is meaningless and refused as an unknown key
            return "", "1", scale
        if not table.unit and (not self.topics or duty is not None):
            raise place.fault("unit", "is missing", f"give the unit of the log, e.g. {self.accepted[0]}")
        name = table.unit or self.accepted[0]
        with place.at("unit"):
            found = unit(name)
        factor = tuple(found.factor * item for item in scale)
        if duty is not None:
            if found.si not in ("1", "V"):
                raise place.fault("unit", f"is '{name}'", "kind = 'duty' takes %, 1 or V")
            return name, found.si, factor
        if found.si in self.accepted:
            return name, found.si, factor
        if found.si not in RAW_UNITS:
            others = f"{' or '.join(self.accepted)}, or {', '.join(RAW_UNITS)} with a scale"
            raise place.fault("unit", f"'{name}' does not measure {self.channel} here", f"use units of {others}")
        if not table.scale:
            raise place.fault("scale", f"is missing for unit '{name}'", f"give the {self.accepted[0]} per {found.si}")
        return name, self.accepted[0], factor


def _duty(table: ChannelTable, place: Place) -> Duty:
    for name in _OF_DUTY:
        if getattr(table, name) is None:
            place.note(name, "is missing", "give a number")
    return Duty(*(float(getattr(table, name) or 0.0) for name in _OF_DUTY))
