"""The text of a draft machine file: TOML in which every guess states its reason and every placeholder is marked."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cdtool.base.findings import Finding
from cdtool.base.toml_text import comment_lines, commented
from cdtool.commands.init.derived_speed import LowPassGuess
from cdtool.commands.init.machine_side import Side
from cdtool.commands.init.names.units import Evidence
from cdtool.commands.init.streams import Channels, column_key
from cdtool.commands.init.unmapped import Unmapped
from cdtool.recordings.recording import CONTACT_PRESSURE, RIG_UNITS, UNITLESS

#: A person reads no longer list of columns.
_MOST_LISTED = 200
_GROUND_TRUTH = {
    "force": "ground truth only: is it the load cell of the test?",
    CONTACT_PRESSURE: "ground truth only: is it the pressure of the contact, not of oil or air?",
}


@dataclass(frozen=True)
class Clock:
    """The keys of `time`, the reason, what to check, and the unit of the streams' times [s]; 0 for a placeholder."""

    keys: Mapping[str, object]
    why: str
    check: str = ""
    in_seconds: float = 0.0


@dataclass(frozen=True)
class UnreadWord:
    """A word in a column of numbers, and where it is first."""

    text: str
    column: str
    line: int


@dataclass(frozen=True)
class Draft:
    """The content to write: kind of machine, joints, clock, and channels with units.

    `csv` are given settings of `[csv]`; `words` are in columns of numbers, perhaps for missing values. `robot` are the
    keys that name a URDF and its joints.
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
    robot: Mapping[str, Any] = field(default_factory=dict)


def draft_text(draft: Draft, left_out: Mapping[str, str], reverse: Sequence[Finding]) -> str:
    """Return the machine file; channels `left_out` become comments with the reason, those to `reverse` change sign."""
    side, clock, low_pass = draft.side, draft.clock, draft.low_pass
    lines = [
        f"# Draft by cdtool init from {_plain(draft.log)}: guessed, not measured.",
        *comment_lines(
            '"guessed" gives the reason; "CHECK" marks what cdtool cannot know: delete the mark after checking.'
        ),
        "",
        "[machine]",
        *_line("type", side.type, side.why, side.check),
        *_line("name", draft.name),
        *_line("joints", draft.joints, draft.joints_why),
        *_line("coordinates", side.coordinates, *_coordinates_why(side)),
        *(_robot(draft) if draft.robot else _placeholders(side, len(draft.joints))),
        "",
        *_pinned(draft),
        "[channels.mcap]" if draft.topics else "[channels]",
        *([] if draft.topics else _line("time", clock.keys, clock.why, clock.check)),
        *(
            _line("speed_low_pass_hz", low_pass.corner, low_pass.why, "a lower one delays the speed")
            if low_pass
            else []
        ),
    ]
    found = draft.channels.found
    for name in found:
        made = _mapped(draft, name, [item for item in reverse if item.channel == name])
        lines += [f"# {text}" for text in made] if name in left_out else made
        lines += comment_lines(f"CHECK: left out: it {left_out[name]}") if left_out.get(name) else []
    if not found:
        lines += comment_lines(
            "CHECK: no name or value indicates a torque, speed or position. Write the channels here, with the unit "
            'of the log, e.g. torque = { column = "CH1", unit = "V", scale = 2.0 } with N m or N per V.'
        )
    elif absent := [name for name in ("torque", "speed", "position") if name not in found]:
        lines += comment_lines(f"CHECK: found no {', no '.join(absent)}: cdtool info lists the content of the log")
    return "\n".join([*lines, *_unmapped(draft)]) + "\n"


def toml(value: object) -> str:
    """Return a text, number, truth value, list or table as TOML on one line."""
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {toml(item)}' for key, item in value.items())} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml, value))}]"
    # JSON's escapes are valid in TOML, except for DEL.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _pinned(draft: Draft) -> list[str]:
    """Return `[csv]` with the settings that were given, and with words that may stand for missing values."""
    if not draft.csv and not draft.words:
        return []
    lines = [f"{key} = {toml(value)}" for key, value in draft.csv.items() if key != "missing" or not draft.words]
    if draft.words:
        told = "; ".join(f"{toml(word.text)} in line {word.line}, column {word.column}" for word in draft.words)
        given = draft.csv.get("missing", [])
        known = [*(given if isinstance(given, list) else [given]), *(word.text for word in draft.words)]
        check = "do they stand for missing values? Where the drive or a sensor failed, the samples are no motion"
        lines += _line("missing", known, f"not numbers: {told}", check)
    return ["[csv]", *lines, ""]


def _mapped(draft: Draft, name: str, reverse: Sequence[Finding]) -> list[str]:
    """Return one channel's line, and the comment with the reason and what to check."""
    found = draft.channels.found[name]
    logged = draft.evidence.logged(name) if name not in UNITLESS else None
    turned = {
        joint for item in reverse for joint in ([item.numbers["joint"]] if item.numbers["joint"] else draft.joints)
    }
    value = _place(draft.topics, found.stream.topic, found.stream.field, found.stream.columns)
    whys, checks = [found.why], [found.check]
    if logged is not None:
        value |= {"unit": logged.unit} if logged.unit else {}
        if logged.scale is not None or turned:
            scale = logged.scale or (1.0,) * len(draft.joints)
            signed = [-part if joint in turned else part for joint, part in zip(draft.joints, scale, strict=False)]
            value["scale"] = signed[0] if len(set(signed)) == 1 else signed
        whys += [f"unit: {logged.why}"] if logged.why else []
        checks.append(logged.check)
        # A force in a guessed unit is not compared with limits.
        value |= {"unit_confirmed": False} if name in RIG_UNITS and logged.check and not logged.why else {}
    whys += [f"with a positive scale it {reverse[0].words_for('seen')}: inverted"] if reverse else []
    checks.append(_GROUND_TRUTH.get(name, ""))
    return _line(name, value, "; ".join(whys), "; ".join(filter(None, checks)))


def _unmapped(draft: Draft) -> list[str]:
    """Return the columns or fields that no channel uses as comments, with their ranges and the next best guess."""
    if not draft.unmapped:
        return []
    made = ["", "# Not mapped, with the smallest and the largest value, and the next best guess:"]
    for item in draft.unmapped[:_MOST_LISTED]:
        values = "" if np.isnan(item.low) else f"{item.low:.4g} to {item.high:.4g}; "
        guess = f"perhaps {item.guess}: {item.why}" if item.guess else item.why
        where = ", ".join(
            f"{key} = {toml(part)}"
            for key, part in _place(draft.topics, item.topic, item.field, item.columns[:1]).items()
        )
        if len(item.columns) > 1:
            where += f" to {toml(column_key(item.columns[-1]))} ({len(item.columns)} columns)"
        text = _plain(f"{where}: {values}{guess}")
        made += comment_lines(text, "  ", "  ")
    if rest := sum(max(1, len(item.columns)) for item in draft.unmapped[_MOST_LISTED:]):
        made.append(f"#   and {rest} more columns: cdtool info lists them")
    return made


def _place(topics: bool, topic: str, field: str, columns: Sequence[str]) -> dict[str, Any]:
    """Return the keys of a channel that name its columns, or its topic and field."""
    if topics:
        return {"topic": topic, "field": field}
    keys = [column_key(column) for column in columns]
    return {"column": keys[0]} if len(keys) == 1 else {"columns": keys}


def _coordinates_why(side: Side) -> tuple[str, str]:
    if side.coordinates == "motor":
        return "the log contains the motor's torque or speed", "" if side.gear else "or the load's"
    return "the log contains the load's own force, speed and position", '"motor" if there is a gear'


def _placeholders(side: Side, joints: int) -> list[str]:
    """Return placeholders: with inertia 0, detectors with a model refuse to run, so it cannot pass for a real value."""

    def each(value: float) -> float | list[float]:
        return value if joints == 1 else [value] * joints

    key, unit, ratio = "load_inertia", "kg m2", "rad/rad"
    if side.type == "linear_axis":
        key, unit, ratio = "load_mass", "kg", "m/rad"
    made = _line(key, each(0.0), "", f"{unit}, not in the log; 0 is a placeholder that detectors with a model refuse")
    if side.coordinates == "load":
        return made
    made += _line("motor_inertia", each(0.0), "", "kg m2, not in the log; 0 is a placeholder")
    text = f"{ratio}, load travel per motor angle; "
    if side.gear is None:
        text += "1 is a placeholder: load-side values are wrong with it"
        return made + _line("transmission_ratio", each(1.0), "", text)
    why = f"{side.gear.why}, {side.gear.position} over {side.gear.speed}"
    return made + _line("transmission_ratio", float(f"{side.gear.ratio:.4g}"), why, f"{text}correct if both units are")


def _robot(draft: Draft) -> list[str]:
    checks = {
        "joint_map": "the joints of the log in the order of the URDF",
        "locked": "joints that are not in the log, and where they stand [rad or m]",
    }
    made = [line for key, value in draft.robot.items() for line in _line(key, value, "", checks.get(key, ""))]
    inertia = "kg m2 or kg, of rotor and gear, referred to the joint; not in the log; 0 is a placeholder"
    return made + _line("drive_inertia", [0.0] * len(draft.joints), "", inertia)


def _line(key: str, value: object, why: str = "", check: str = "") -> list[str]:
    """Return a key with its comment after it, or before it if both are too long for one line."""
    parts = [f"guessed: {why}" if why else "", f"CHECK: {check}" if check else ""]
    return commented(f"{key} = {toml(value)}", _plain(". ".join(filter(None, parts))))


def _plain(text: str) -> str:
    """Return a text without characters that end a comment or are invalid in one."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
