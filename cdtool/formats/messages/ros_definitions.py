"""The definitions of ROS messages: concatenated .msg texts (MCAP, appendix "Well-known schema encodings").

A definition begins with the message itself; each nested message follows after a line of `=` and `MSG: package/Type`. A
line is `type name`, `type name default` or `type NAME=constant`; `#` begins a comment. A string or sequence may have a
length limit (`string<=5`, `float64[<=3]`), which does not change its encoding. The library `rosbags` parses them as
well, in a hundred times the time of reading a short log.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Literal

from cdtool.formats.messages.layout import Array, Layout, Member, Message, Number, Schema, SchemaError, TextType

_RULE = re.compile(r"^={3,}\s*$", re.MULTILINE)
_HEADING = re.compile(r"^MSG:[ \t]+(\S+)\s*$")
_LINE = re.compile(r"(?P<type>\S+)\s+(?P<name>[A-Za-z]\w*)(?P<constant>\s*=)?(?P<rest>.*)")
_TYPE = re.compile(
    r"(?P<base>[A-Za-z]\w*(?:/[A-Za-z]\w*){0,2})(?:<=(?P<text_bound>[1-9]\d*))?(?P<array>\[(?:<=)?(?P<length>[1-9]\d*)?\])?"
)
Kind = Number | TextType | Message
_SAME: dict[str, Kind] = {
    "bool": Number("?"),
    **{f"int{8 * size}": Number(f"i{size}") for size in (1, 2, 4, 8)},
    **{f"uint{8 * size}": Number(f"u{size}") for size in (1, 2, 4, 8)},
    "float32": Number("f4"),
    "float64": Number("f8"),
    "char": Number("u1"),
    "string": TextType(),
}
# http://wiki.ros.org/msg: `time` and `duration` are two numbers.
_ROS1: dict[str, Kind] = {"byte": Number("i1"), "time": Message("time"), "duration": Message("duration")}
# https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html: `byte` is an octet.
_ROS2: dict[str, Kind] = {
    "byte": Number("u1"),
    "time": Message("builtin_interfaces/Time"),
    "duration": Message("builtin_interfaces/Duration"),
}


def _two(name: str, seconds: str, code: str, nanoseconds: str, nano_code: str) -> Layout:
    return Layout(name, (Member(seconds, Number(code)), Member(nanoseconds, Number(nano_code))))


# The layouts that need no definition.
_KNOWN = {
    1: (_two("time", "secs", "u4", "nsecs", "u4"), _two("duration", "secs", "i4", "nsecs", "i4")),
    2: tuple(_two(f"builtin_interfaces/{name}", "sec", "i4", "nanosec", "u4") for name in ("Time", "Duration")),
}


@lru_cache(64)  # all logs of a robot have the same definitions
def parse_definitions(name: str, data: bytes, ros: Literal[1, 2]) -> Schema:
    """Return the layouts of the message `name` and of its nested messages; raises SchemaError."""
    try:
        text = data.decode()
    except UnicodeDecodeError as fault:
        raise SchemaError(f"the definition is not UTF-8: {fault}") from fault
    sections = _sections(text, name)
    known = {layout.name: layout for layout in _KNOWN[ros] if layout.name not in sections}
    names, primitives = {*sections, *known}, _SAME | (_ROS1 if ros == 1 else _ROS2)
    layouts = known | {title: _layout(title, body, names, primitives) for title, body in sections.items()}
    _check_nesting(_short_name(name), layouts, ())
    return Schema(layouts[_short_name(name)], layouts)


def _short_name(name: str) -> str:
    """Return a type's name without its middle part: `package/msg/Type` becomes `package/Type`."""
    parts = name.split("/")
    return f"{parts[0]}/{parts[-1]}" if len(parts) > 1 else name


def _sections(text: str, name: str) -> dict[str, str]:
    """Return the text of each message by its name; the first one may have no heading."""
    first, *others = _RULE.split(text)
    sections: dict[str, str] = {}
    for part, title in ((first, name), *((part, "") for part in others if part.strip())):
        lines = part.strip().splitlines()
        heading = _HEADING.match(lines[0]) if lines else None
        if heading is not None:
            title, lines = heading[1], lines[1:]
        elif not title:
            raise SchemaError(f"a nested definition begins with '{lines[0].strip()[:60]}' instead of MSG: and its name")
        body = "\n".join(lines)
        if part is not first and sections.setdefault(_short_name(title), body) != body:
            raise SchemaError(f"'{_short_name(title)}' has two different definitions")
        sections[_short_name(title)] = body
    return sections


def _layout(title: str, body: str, names: set[str], primitives: dict[str, Kind]) -> Layout:
    members: dict[str, Member] = {}
    for line in body.splitlines():
        content = line.partition("#")[0].strip()
        if not content:
            continue
        if set(content) == {"-"}:
            raise SchemaError(f"{title} is the definition of a service or action, not of a message")
        match = _LINE.fullmatch(content)
        rest = match["rest"] if match else ""
        if match is None or (not match["constant"] and rest and not rest[0].isspace()):
            raise SchemaError(f"'{content[:60]}' in {title} is not a field")
        if match["constant"]:
            continue
        if match["name"] in members:
            raise SchemaError(f"{title} has two fields '{match['name']}'")
        members[match["name"]] = _member(match["type"], match["name"], title, names, primitives)
    return Layout(title, tuple(members.values()))


def _member(text: str, name: str, title: str, names: set[str], primitives: dict[str, Kind]) -> Member:
    match = _TYPE.fullmatch(text)
    if match is None or (match["array"] == "[<=]"):
        raise SchemaError(f"type '{text[:60]}' of {title}.{name} cannot be parsed")
    kind = primitives.get(match["base"]) or _message(match["base"], title, names)
    if kind is None:
        why = "has characters whose width depends on the writer" if match["base"] == "wstring" else "is not defined"
        raise SchemaError(f"type '{match['base']}' of {title}.{name} {why}")
    if match["text_bound"] and not isinstance(kind, TextType):
        raise SchemaError(f"type '{text[:60]}' of {title}.{name}: only strings can have a length limit")
    if not match["array"]:
        return Member(name, kind)
    is_fixed = match["length"] and "<=" not in match["array"]
    return Member(name, kind, Array(int(match["length"]) if is_fixed else None))


def _message(base: str, title: str, names: set[str]) -> Message | None:
    package = title.split("/", maxsplit=1)[0]
    tries = (_short_name(base),) if "/" in base else (f"{package}/{base}", base, f"std_msgs/{base}")
    return next((Message(name) for name in tries if name in names), None)


def _check_nesting(name: str, layouts: dict[str, Layout], above: tuple[str, ...], done: set[str] | None = None) -> None:
    """Raise SchemaError if a message contains itself."""
    done = set() if done is None else done
    if name in above:
        raise SchemaError(f"'{name}' contains itself")
    if len(above) > 100:
        raise SchemaError("more than 100 levels of nested messages")
    for member in layouts[name].members if name not in done else ():
        if isinstance(member.kind, Message):
            _check_nesting(member.kind.name, layouts, (*above, name), done)
    done.add(name)
