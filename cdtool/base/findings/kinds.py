"""The kinds of findings as `kinds.toml` states them, each read when it is first asked for."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Literal, NamedTuple

Severity = Literal["note", "warning", "loss"]


class FindingKind(NamedTuple):
    """A kind of finding; the words for a number are by its value, or by "given" and "absent"."""

    sentence: str
    severity: Severity
    numbers: tuple[str, ...]
    subject: str
    variant: str
    words: Mapping[str, Mapping[str, str]]


@cache
def kind_of(name: str) -> FindingKind:
    """Return a kind by its name; raises ValueError for an unknown one."""
    if name not in sections():
        raise ValueError(f"'{name}' is not a kind of finding; a finding in words is remark('...')")
    table = tomllib.loads(sections()[name])
    return FindingKind(
        table.pop("sentence"),
        table.pop("severity", "warning"),
        tuple(table.pop("numbers", ())),
        table.pop("subject", ""),
        table.pop("variant", ""),
        table,
    )


@cache
def sections() -> dict[str, str]:
    """Return the text of each kind by its name: to parse all of them takes 20 ms, and a log has a few of them."""
    text = files("cdtool.base.findings").joinpath("kinds.toml").read_text(encoding="utf-8")
    _, *parts = re.split(r"^\[(\w+)\]$", text, flags=re.MULTILINE)
    return dict(zip(parts[::2], parts[1::2], strict=True))
