"""A draft of a machine file: TOML in which every guess says why, and every placeholder asks to be checked."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap

from cdtool.recording import UNITLESS
from cdtool.workflows.draft_streams import Channels
from cdtool.workflows.draft_units import Logged, Side, logged_unit

_WIDEST = 118


@dataclass(frozen=True)
class Clock:
    """How the draft takes the time: a column with its unit, a rate as a placeholder, or a message's stamp."""

    column: str | int | None = None
    unit: str = "s"
    why: str = ""


@dataclass(frozen=True)
class Draft:
    """What is written: the machine's kind, its joints, the clock and the channels with their units."""

    name: str
    log: str
    side: Side
    joints: tuple[str, ...]
    joints_why: str
    clock: Clock
    channels: Channels
    topics: bool

    @property
    def units(self) -> dict[str, Logged]:
        """Unit and scale of each channel that has one."""
        found = (name for name in self.channels.found if name not in UNITLESS)
        return {name: logged_unit(name, self.channels, self.side, self.topics) for name in found}


def draft_text(draft: Draft, left_out: Sequence[str] = (), turned: bool = False) -> str:
    """The machine file; the channels in `left_out` stand there as comments. `turned`: the accelerometer's sign."""
    lines = [
        f"# Draft by cdtool init from {_plain(draft.log)}: guesses, not measurements.",
        '# "guessed" says why; "CHECK" marks what cdtool cannot know. Delete the mark when you have checked the line.',
        "",
        "[machine]",
        *_commented(f"type = {_text(draft.side.type)}", f"guessed: {draft.side.why}"),
        f"name = {_text(draft.name)}",
        *_commented(f"joints = {_list([_text(joint) for joint in draft.joints])}", draft.joints_why),
        *_commented(f"coordinates = {_text(draft.side.coordinates)}", _coordinates_why(draft.side)),
        *_placeholders(draft.side, len(draft.joints)),
        "",
        "[channels.mcap]" if draft.topics else "[channels]",
        *([] if draft.topics else _time(draft.clock)),
    ]
    units = draft.units
    for name, found in draft.channels.found.items():
        sign = -1.0 if turned and name == "acceleration" else 1.0
        line, why = f"{name} = {_channel(draft, name, units.get(name), sign)}", f"guessed: {found.why}"
        logged = units.get(name)
        if logged is not None and logged.why:
            why += f"; unit: {logged.why}"
        if sign < 0.0:
            why += "; its sign is the other one of the speed's derivative: turned"
        check = logged.check if logged is not None else ""
        if name == "force":
            check = f"{check}; ground truth only: is it the load cell of the test?".removeprefix("; ")
        made = _commented(line, f"{why}. CHECK: {check}" if check else why)
        lines += [f"# {text}" if text and name in left_out else text for text in made]
    absent = [name for name in ("torque", "speed", "position") if name not in draft.channels.found]
    if absent:
        lines.append(f"# CHECK: found no {', no '.join(absent)}: see cdtool info for what the log has")
    return "\n".join(lines) + "\n"


def _coordinates_why(side: Side) -> str:
    if side.coordinates == "motor":
        return "guessed: the log holds the motor's torque, speed and angle"
    return 'guessed: the log holds the load\'s own force, speed and position ("motor" if a gear is between)'


def _placeholders(side: Side, joints: int) -> list[str]:
    """Inertia 0: a detector with a model refuses it, so that a placeholder can never pass for a value."""

    def each(value: str) -> str:
        return value if joints == 1 else _list([value] * joints)

    key, unit = ("load_mass", "kg") if side.type == "linear_axis" else ("load_inertia", "kg m2")
    ratio = "m/rad" if side.type == "linear_axis" else "rad/rad"
    refused = "0 is a placeholder: detectors with a model refuse it"
    made = _commented(f"{key} = {each('0.0')}", f"CHECK: {unit}, not in the log; {refused}")
    if side.coordinates == "motor":
        made += _commented(f"motor_inertia = {each('0.0')}", "CHECK: kg m2, not in the log; 0 is a placeholder")
        text = (
            f"CHECK: {ratio}, load travel per motor angle; 1 is a placeholder: figures of the load are wrong until then"
        )
        made += _commented(f"transmission_ratio = {each('1.0')}", text)
    return made


def _time(clock: Clock) -> list[str]:
    if clock.column is None:
        return _commented("time = { rate_hz = 1000.0 }", f"CHECK: a placeholder: {clock.why}")
    column = clock.column if isinstance(clock.column, int) else _text(clock.column)
    return _commented(f"time = {{ column = {column}, unit = {_text(clock.unit)} }}", f"guessed: {clock.why}")


def _channel(draft: Draft, name: str, logged: Logged | None, sign: float) -> str:
    stream = draft.channels.found[name].stream
    if draft.topics:
        parts = [f"topic = {_text(stream.topic)}", f"field = {_text(stream.field)}"]
    elif len(stream.columns) == 1:
        parts = [f"column = {_column(stream.columns[0])}"]
    else:
        parts = [f"columns = {_list([_column(column) for column in stream.columns])}"]
    if logged is None:
        return f"{{ {', '.join(parts)} }}"
    if not draft.topics:
        parts.append(f"unit = {_text(logged.unit)}")
    if logged.scale is not None or sign < 0.0:
        scale = [sign * value for value in logged.scale or (1.0,)]
        shown = [f"{value!r}" for value in scale]
        parts.append(f"scale = {shown[0] if len(set(shown)) == 1 else _list(shown)}")
    return f"{{ {', '.join(parts)} }}"


def _column(name: str) -> str:
    """A column of a table without a header is named by its number."""
    return str(int(name)) if name.isdigit() else _text(name)


def _commented(line: str, why: str) -> list[str]:
    """A line with its comment behind it, or before it where both are too long for one."""
    why = _plain(why)
    if not why:
        return [line]
    joined = f"{line}  # {why}"
    if len(joined) <= _WIDEST:
        return [joined]
    return [*(f"# {part}" for part in wrap(why, _WIDEST - 2, break_long_words=False)), line]


def _list(items: Sequence[str]) -> str:
    return f"[{', '.join(items)}]"


def _text(value: str) -> str:
    """A TOML string: JSON's escapes are TOML's, but DEL."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _plain(text: str) -> str:
    """Without characters that would end a comment or are refused in one."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
