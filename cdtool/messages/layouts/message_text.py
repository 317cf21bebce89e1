"""The text format of ROS message definitions that ros1msg and ros2msg share.

The definition of the message itself comes first. The definitions of nested messages follow, each after a line of `=`
and `MSG: package/Type`. A line is `type name`, `type name default` or `type NAME=constant`; `#` begins a comment.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

from cdtool.messages.layouts.layout import Array, Layout, Member, Message, Number, Schema, SchemaError, Text

_RULE = re.compile(r"^={3,}\s*$", re.MULTILINE)
_HEADING = re.compile(r"^MSG:[ \t]+(\S+)\s*$")
_LINE = re.compile(r"(?P<type>\S+)\s+(?P<name>[A-Za-z]\w*)(?P<constant>\s*=)?(?P<rest>.*)")
_TYPE = re.compile(
    r"(?P<base>[A-Za-z]\w*(?:/[A-Za-z]\w*){0,2})(?:<=(?P<text_bound>[1-9]\d*))?(?P<array>\[(?:<=)?(?P<length>[1-9]\d*)?\])?"
)

Kind = Number | Text | Message

# The schemas of so many definitions are kept, if they are not longer than this [bytes]: all logs of a robot have the
# same ones.
_KEPT, _LONGEST_KEPT = 64, 1 << 16


@dataclass(frozen=True, eq=False)
class Dialect:
    """The differences between ROS 1 and ROS 2: the primitive types and the layouts that need no definition."""

    primitives: dict[str, Kind]
    known: tuple[Layout, ...]


def parse_definitions(name: str, data: bytes, dialect: Dialect) -> Schema:
    """Return the layouts of a definition text; raises SchemaError."""
    return (_parse_and_keep if len(data) <= _LONGEST_KEPT else _parse)(name, data, dialect)


def _parse(name: str, data: bytes, dialect: Dialect) -> Schema:
    try:
        text = data.decode()
    except UnicodeDecodeError as fault:
        raise SchemaError(f"the definition is not UTF-8: {fault}") from fault
    sections = dict(_section(part, name if i == 0 else "") for i, part in enumerate(_sections(text)))
    known = {layout.name: layout for layout in dialect.known if layout.name not in sections}
    names = {*sections, *known}
    layouts = known | {title: _layout(title, body, names, dialect) for title, body in sections.items()}
    _check_nesting(short_name(name), layouts)
    return Schema(layouts[short_name(name)], layouts)


_parse_and_keep = lru_cache(_KEPT)(_parse)


def short_name(name: str) -> str:
    """Return a type's name without its middle part: `package/msg/Type` becomes `package/Type`."""
    parts = name.split("/")
    return f"{parts[0]}/{parts[-1]}" if len(parts) > 1 else name


def _sections(text: str) -> list[str]:
    parts = _RULE.split(text)
    bodies: dict[str, str] = {}
    kept = parts[:1]
    for part in parts[1:]:
        if not part.strip():
            continue
        title, body = _section(part, "")
        if bodies.setdefault(title, body) != body:
            raise SchemaError(f"'{title}' has two different definitions")
        kept.append(part)
    return kept


def _section(part: str, name: str) -> tuple[str, str]:
    lines = part.strip().splitlines()
    heading = _HEADING.match(lines[0]) if lines else None
    if heading is not None:
        return short_name(heading[1]), "\n".join(lines[1:])
    if not name:
        first = lines[0].strip()[:60] if lines else ""
        raise SchemaError(f"a nested definition begins with '{first}' instead of MSG: and its name")
    return short_name(name), "\n".join(lines)


def _layout(title: str, body: str, names: set[str], dialect: Dialect) -> Layout:
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
        members[match["name"]] = _member(match["type"], match["name"], title, names, dialect)
    return Layout(title, tuple(members.values()))


def _member(text: str, name: str, title: str, names: set[str], dialect: Dialect) -> Member:
    match = _TYPE.fullmatch(text)
    if match is None:
        raise SchemaError(f"type '{text[:60]}' of {title}.{name} cannot be parsed")
    kind = dialect.primitives.get(match["base"]) or _message(match["base"], title, names)
    if kind is None:
        raise SchemaError(f"type '{match['base']}' of {title}.{name} is not defined")
    if match["text_bound"] and not isinstance(kind, Text):
        raise SchemaError(f"type '{text[:60]}' of {title}.{name}: only strings can have a length limit")
    if not match["array"]:
        return Member(name, kind)
    bounded = "<=" in match["array"]
    if bounded and not match["length"]:
        raise SchemaError(f"type '{text[:60]}' of {title}.{name} cannot be parsed")
    return Member(name, kind, Array(int(match["length"]) if match["length"] and not bounded else None))


def _message(base: str, title: str, names: set[str]) -> Message | None:
    package = title.split("/", maxsplit=1)[0]
    tries = (short_name(base),) if "/" in base else (f"{package}/{base}", base, f"std_msgs/{base}")
    return next((Message(name) for name in tries if name in names), None)


def _check_nesting(root: str, layouts: dict[str, Layout]) -> None:
    """Raise SchemaError if a message contains itself."""
    done: set[str] = set()

    def visit(name: str, above: tuple[str, ...]) -> None:
        if name in above:
            raise SchemaError(f"'{name}' contains itself")
        if name in done:
            return
        if len(above) > 100:
            raise SchemaError("more than 100 levels of nested messages")
        for member in layouts[name].members:
            if isinstance(member.kind, Message):
                visit(member.kind.name, (*above, name))
        done.add(name)

    visit(root, ())
