"""The definitions of ROS messages: concatenated .msg texts (MCAP, appendix "Well-known schema encodings").

A definition begins with the message itself; each nested message follows after a line of `=` and `MSG: package/Type`. A
line is `type name`, `type name default` or `type NAME=constant`; `#` begins a comment. A string or sequence may have a
length limit (`string<=5`, `float64[<=3]`), which does not change its encoding. The library `rosbags` parses them as
well, but neither rules of other lengths nor two fields or definitions of one name are noticed.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Literal

from cdtool.formats.messages.layout import TEXT, Layout, Member, SchemaError

_RULE = re.compile(r"^={3,}\s*$", re.MULTILINE)
_HEADING = re.compile(r"^MSG:[ \t]+(\S+)\s*$")
_LINE = re.compile(r"(?P<type>\S+)\s+(?P<name>[A-Za-z]\w*)(?P<constant>\s*=)?(?P<rest>.*)")
_TYPE = re.compile(
    r"(?P<base>[A-Za-z]\w*(?:/[A-Za-z]\w*){0,2})(?:<=(?P<text_bound>[1-9]\d*))?(?P<array>\[(?:<=)?(?P<length>[1-9]\d*)?\])?"
)
Kind = str | Layout
_SAME: dict[str, Kind] = {
    "bool": "?",
    **{f"int{8 * size}": f"i{size}" for size in (1, 2, 4, 8)},
    **{f"uint{8 * size}": f"u{size}" for size in (1, 2, 4, 8)},
    "float32": "f4",
    "float64": "f8",
    "char": "u1",
    "string": TEXT,
}


def _two(name: str, seconds: str, code: str, nanoseconds: str, nano_code: str) -> Layout:
    return Layout(name, [Member(seconds, code), Member(nanoseconds, nano_code)])


# http://wiki.ros.org/msg: `time` and `duration` are two numbers.
_ROS1: dict[str, Kind] = {
    "byte": "i1",
    "time": _two("time", "secs", "u4", "nsecs", "u4"),
    "duration": _two("duration", "secs", "i4", "nsecs", "i4"),
}
# https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html: `byte` is an octet.
_ROS2: dict[str, Kind] = {"byte": "u1"}
# The messages of ROS 2 that need no definition.
_KNOWN = {
    f"builtin_interfaces/{name}": _two(f"builtin_interfaces/{name}", "sec", "i4", "nanosec", "u4")
    for name in ("Time", "Duration")
}


@lru_cache(64)  # all logs of a robot have the same definitions
def parse_definitions(name: str, data: bytes, ros: Literal[1, 2]) -> Layout:
    """Return the layout of the message `name`; raises SchemaError."""
    try:
        text = data.decode()
    except UnicodeDecodeError as fault:
        raise SchemaError(f"the definition is not UTF-8: {fault}") from fault
    sections = _sections(text, name)
    definitions = _Definitions(sections, ros)
    return {title: definitions.layout(title, ()) for title in sections}[_short_name(name)]


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


class _Definitions:
    """The texts of the messages by name, and the layouts of those that were parsed."""

    def __init__(self, bodies: dict[str, str], ros: Literal[1, 2]) -> None:
        self._bodies = bodies
        self._layouts = {name: layout for name, layout in _KNOWN.items() if ros == 2 and name not in bodies}
        self._primitives = _SAME | (_ROS1 if ros == 1 else _ROS2)
        self._aliases = {"time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration"}

    def layout(self, name: str, above: tuple[str, ...]) -> Layout:
        """Return the layout of a message that those `above` contain; raises SchemaError."""
        if name in above:
            raise SchemaError(f"'{name}' contains itself")
        if len(above) > 100:
            raise SchemaError("more than 100 levels of nested messages")
        if name not in self._layouts:
            members: dict[str, Member] = {}
            for line in self._bodies[name].splitlines():
                member = self._member(line.partition("#")[0].strip(), (*above, name))
                if member is not None and members.setdefault(member.name, member) is not member:
                    raise SchemaError(f"{name} has two fields '{member.name}'")
            self._layouts[name] = Layout(name, [*members.values()])
        return self._layouts[name]

    def _member(self, content: str, above: tuple[str, ...]) -> Member | None:
        """Return the field of a line; None if it has none."""
        if not content:
            return None
        title = above[-1]
        if set(content) == {"-"}:
            raise SchemaError(f"{title} is the definition of a service or action, not of a message")
        match = _LINE.fullmatch(content)
        rest = match["rest"] if match else ""
        if match is None or (not match["constant"] and rest and not rest[0].isspace()):
            raise SchemaError(f"'{content[:60]}' in {title} is not a field")
        if match["constant"]:
            return None
        text, name = match["type"], match["name"]
        match = _TYPE.fullmatch(text)
        if match is None or match["array"] == "[<=]":
            raise SchemaError(f"type '{text[:60]}' of {title}.{name} cannot be parsed")
        kind = self._kind(match["base"], above)
        if kind is None:
            why = "has characters whose width depends on the writer" if match["base"] == "wstring" else "is not defined"
            raise SchemaError(f"type '{match['base']}' of {title}.{name} {why}")
        if match["text_bound"] and kind != TEXT:
            raise SchemaError(f"type '{text[:60]}' of {title}.{name}: only strings can have a length limit")
        is_fixed = match["length"] and "<=" not in match["array"]
        return Member(name, kind, bool(match["array"]), int(match["length"]) if is_fixed else None)

    def _kind(self, base: str, above: tuple[str, ...]) -> Kind | None:
        if base in self._primitives:
            return self._primitives[base]
        package = above[-1].split("/", maxsplit=1)[0]
        tries = (_short_name(base),) if "/" in base else (f"{package}/{base}", base, f"std_msgs/{base}")
        known = self._bodies.keys() | self._layouts.keys()
        found = self._aliases.get(base) or next((name for name in tries if name in known), None)
        return None if found is None else self.layout(found, above)
