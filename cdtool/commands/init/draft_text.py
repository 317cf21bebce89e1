"""The text of a draft machine file: TOML in which every guess states its reason and every placeholder is marked."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from textwrap import wrap
from typing import Any

import numpy as np

from cdtool.base.findings import Finding
from cdtool.commands.init.derived_speed import LowPassGuess
from cdtool.commands.init.machine_side import Side
from cdtool.commands.init.names.units import Evidence, Logged
from cdtool.commands.init.stream import Stream
from cdtool.commands.init.streams import Channels
from cdtool.commands.init.unmapped import Unmapped
from cdtool.recordings.recording import CONTACT_PRESSURE, RIG_UNITS, UNITLESS

_WIDEST = 100
_MOST_LISTED = 200


@dataclass(frozen=True)
class Clock:
    """Time in the draft: a column with its unit or the rate [Hz] of its counts, or only a rate."""

    column: str | int | None = None
    unit: str = "s"
    why: str = ""
    check: str = ""
    rate: float | None = None
    nanoseconds: str = ""


@dataclass(frozen=True)
class UnreadWord:
    """A word in a column of numbers, and where it is first."""

    text: str
    column: str
    line: int


@dataclass(frozen=True)
class Draft:
    """The content to write: kind of machine, joints, clock, and channels with units.

    `csv` are given settings of `[csv]`; `words` are in columns of numbers, perhaps for missing values.
    """

    name: str
    log: str
    side: Side
    joints: tuple[str, ...]
    joints_why: str
    clock: Clock
    channels: Channels
    topics: bool
    evidence: Evidence
    unmapped: tuple[Unmapped, ...] = ()
    low_pass: LowPassGuess | None = None
    csv: Mapping[str, Any] = field(default_factory=dict)
    words: tuple[UnreadWord, ...] = ()

    @property
    def units(self) -> dict[str, Logged]:
        """Return unit and scale of each channel that has one."""
        return {name: self.evidence.logged(name) for name in self.channels.found if name not in UNITLESS}


def draft_text(draft: Draft, left_out: Mapping[str, str], reverse: Sequence[Finding]) -> str:
    """Return the machine file; channels `left_out` become comments with the reason, those to `reverse` change sign."""
    side = draft.side
    lines = [
        f"# Draft by cdtool init from {_plain(draft.log)}: guessed, not measured.",
        '# "guessed" gives the reason; "CHECK" marks what cdtool cannot know: delete the mark after checking.',
        "",
        "[machine]",
        *_commented(f"type = {_text(side.type)}", _marked(f"guessed: {side.why}", side.check)),
        f"name = {_text(draft.name)}",
        *_commented(f"joints = {_list([_text(joint) for joint in draft.joints])}", draft.joints_why),
        *_commented(f"coordinates = {_text(side.coordinates)}", _coordinates_why(side)),
        *_placeholders(side, len(draft.joints)),
        "",
        *_pinned(draft),
        "[channels.mcap]" if draft.topics else "[channels]",
        *([] if draft.topics else _time(draft.clock)),
    ]
    if draft.low_pass is not None:
        why = _marked(f"guessed: {draft.low_pass.why}", "a lower one delays the speed")
        lines += _commented(f"speed_low_pass_hz = {draft.low_pass.corner!r}", why)
    units = draft.units
    for name in draft.channels.found:
        made = _mapped(draft, name, units.get(name), [item for item in reverse if item.channel == name])
        lines += [f"# {text}" if text and name in left_out else text for text in made]
        lines += _wrapped(f"CHECK: left out: it {left_out[name]}") if left_out.get(name) else []
    if not draft.channels.found:
        lines += _wrapped(
            "CHECK: no name or value indicates a torque, speed or position. Write the channels here, with the unit "
            'of the log, e.g. torque = { column = "CH1", unit = "V", scale = 2.0 } with N m or N per V.'
        )
    elif absent := [name for name in ("torque", "speed", "position") if name not in draft.channels.found]:
        lines.append(f"# CHECK: found no {', no '.join(absent)}: cdtool info lists the content of the log")
    lines += _unmapped(draft)
    return "\n".join(lines) + "\n"


def _pinned(draft: Draft) -> list[str]:
    """Return `[csv]` with the settings that were given, and with words that may stand for missing values."""
    if not draft.csv and not draft.words:
        return []
    lines = [f"{key} = {_value(value)}" for key, value in draft.csv.items() if key != "missing" or not draft.words]
    if draft.words:
        told = "; ".join(f"{_value(word.text)} in line {word.line}, column {word.column}" for word in draft.words)
        given = draft.csv.get("missing", [])
        known = [*(given if isinstance(given, list) else [given]), *(word.text for word in draft.words)]
        check = "do they stand for missing values? Where the drive or a sensor failed, the samples are no motion"
        lines += _commented(f"missing = {_value(known)}", _marked(f"guessed: not numbers: {told}", check))
    return ["[csv]", *lines, ""]


def _value(value: object) -> str:
    """Return a text, number, truth value or list of texts as TOML."""
    if isinstance(value, list):
        return _list([_value(item) for item in value])
    return _text(value) if isinstance(value, str) else json.dumps(value)


def _mapped(draft: Draft, name: str, logged: Logged | None, reverse: Sequence[Finding]) -> list[str]:
    """Return one channel's line, and the comment with the reason and what to check."""
    found = draft.channels.found[name]
    why, checks = f"guessed: {found.why}", [found.check]
    if logged is not None:
        why += f"; unit: {logged.why}" if logged.why else ""
        checks.append(logged.check)
    if reverse:
        why += f"; with a positive scale it {reverse[0].words_for('seen')}: inverted"
    if name == "force":
        checks.append("ground truth only: is it the load cell of the test?")
    if name == CONTACT_PRESSURE:
        checks.append("ground truth only: is it the pressure of the contact, not of oil or air?")
    turned = {
        joint for item in reverse for joint in ([item.numbers["joint"]] if item.numbers["joint"] else draft.joints)
    }
    signs = [-1.0 if joint in turned else 1.0 for joint in draft.joints]
    # A force in a guessed unit is not compared with limits.
    guess = ", unit_confirmed = false }" if name in RIG_UNITS and logged and logged.check and not logged.why else " }"
    line = f"{name} = {_channel(draft, name, logged, signs).removesuffix(' }')}{guess}"
    return _commented(line, _marked(why, "; ".join(check for check in checks if check)))


def _unmapped(draft: Draft) -> list[str]:
    """Return the columns or fields that no channel uses as comments, with their ranges and the next best guess."""
    if not draft.unmapped:
        return []
    made = ["", "# Not mapped, with the smallest and the largest value, and the next best guess:"]
    for item in draft.unmapped[:_MOST_LISTED]:
        values = "" if np.isnan(item.low) else f"{item.low:.4g} to {item.high:.4g}; "
        guess = f"perhaps {item.guess}: {item.why}" if item.guess else item.why
        text = _plain(f"{_places(draft, item)}: {values}{guess}")
        made += wrap(text, _WIDEST, initial_indent="#   ", subsequent_indent="#     ", break_on_hyphens=False)
    if len(draft.unmapped) > _MOST_LISTED:
        rest = sum(max(1, len(item.columns)) for item in draft.unmapped[_MOST_LISTED:])
        made.append(f"#   and {rest} more columns: cdtool info lists them")
    return made


def _places(draft: Draft, item: Unmapped) -> str:
    if draft.topics:
        return f"topic = {_text(item.topic)}, field = {_text(item.field)}"
    first = f"column = {_column(item.columns[0])}"
    return first if len(item.columns) == 1 else f"{first} to {_column(item.columns[-1])} ({len(item.columns)} columns)"


def _place(draft: Draft, stream: Stream) -> str:
    if draft.topics:
        return f"topic = {_text(stream.topic)}, field = {_text(stream.field)}"
    return f"column = {_column(stream.columns[0])}"


def _coordinates_why(side: Side) -> str:
    if side.coordinates == "motor":
        return "guessed: the log contains the motor's torque or speed" + ("" if side.gear else ". CHECK: or the load's")
    return 'guessed: the log contains the load\'s own force, speed and position. CHECK: "motor" if there is a gear'


def _placeholders(side: Side, joints: int) -> list[str]:
    """Return placeholders: with inertia 0, detectors with a model refuse to run, so it cannot pass for a real value."""

    def each(value: str) -> str:
        return value if joints == 1 else _list([value] * joints)

    key, unit = ("load_mass", "kg") if side.type == "linear_axis" else ("load_inertia", "kg m2")
    ratio = "m/rad" if side.type == "linear_axis" else "rad/rad"
    refused = "0 is a placeholder that detectors with a model refuse"
    made = _commented(f"{key} = {each('0.0')}", f"CHECK: {unit}, not in the log; {refused}")
    if side.coordinates == "motor":
        made += _commented(f"motor_inertia = {each('0.0')}", "CHECK: kg m2, not in the log; 0 is a placeholder")
        text = f"CHECK: {ratio}, load travel per motor angle; "
        if side.gear is not None:
            why = f"guessed: {side.gear.why}, {side.gear.position} over {side.gear.speed}"
            made += _commented(f"transmission_ratio = {side.gear.ratio:.4g}", f"{why}. {text}correct if both units are")
        else:
            text += "1 is a placeholder: load-side values are wrong with it"
            made += _commented(f"transmission_ratio = {each('1.0')}", text)
    return made


def _time(clock: Clock) -> list[str]:
    if clock.column is None:
        return _commented("time = { rate_hz = 1000.0 }", f"CHECK: a placeholder: {clock.why}")
    column = clock.column if isinstance(clock.column, int) else _text(clock.column)
    scale = f"unit = {_text(clock.unit)}" if clock.rate is None else f"rate_hz = {clock.rate:.5g}"
    scale += f", nanoseconds = {_text(clock.nanoseconds)}" if clock.nanoseconds else ""
    return _commented(f"time = {{ column = {column}, {scale} }}", _marked(f"guessed: {clock.why}", clock.check))


def _channel(draft: Draft, name: str, logged: Logged | None, signs: Sequence[float]) -> str:
    stream = draft.channels.found[name].stream
    if draft.topics:
        parts = [_place(draft, stream)]
    elif len(stream.columns) == 1:
        parts = [f"column = {_column(stream.columns[0])}"]
    else:
        parts = [f"columns = {_list([_column(column) for column in stream.columns])}"]
    if logged is None:
        return f"{{ {', '.join(parts)} }}"
    if logged.unit:
        parts.append(f"unit = {_text(logged.unit)}")
    if logged.scale is not None or min(signs) < 0.0:
        scale = [sign * value for sign, value in zip(signs, logged.scale or (1.0,) * len(signs), strict=False)]
        shown = [f"{value!r}" for value in scale]
        parts.append(f"scale = {shown[0] if len(set(shown)) == 1 else _list(shown)}")
    return f"{{ {', '.join(parts)} }}"


def _column(name: str) -> str:
    """Return the name of a column, or its number in a table without a header."""
    return str(int(name)) if name.isdigit() else _text(name)


def _commented(line: str, why: str) -> list[str]:
    """Return a line with its comment after it, or before it if both are too long for one line."""
    why = _plain(why)
    if not why:
        return [line]
    joined = f"{line}  # {why}"
    if len(joined) <= _WIDEST:
        return [joined]
    return [*_wrapped(why), line]


def _wrapped(text: str) -> list[str]:
    return [f"# {part}" for part in wrap(text, _WIDEST - 4, break_long_words=False, break_on_hyphens=False)]


def _marked(why: str, check: str) -> str:
    return f"{why}. CHECK: {check}" if check else why


def _list(items: Sequence[str]) -> str:
    return f"[{', '.join(items)}]"


def _text(value: str) -> str:
    """Return a TOML string: JSON's escapes are valid in TOML, except for DEL."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _plain(text: str) -> str:
    """Return a text without characters that end a comment or are invalid in one."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
