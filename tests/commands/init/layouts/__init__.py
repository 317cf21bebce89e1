"""Public layouts of logs as data: a short log of each in `logs`, and the truth about each column in a TOML file.

`public.toml` has the layouts that the guesser's words were completed for; the sealed ones are by somebody who had not
seen it. `source` states what is exact in a layout and what is made up; all values are simulated. A layout more is a log
and an entry in one of these files.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

_FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Truth:
    """What a column is.

    `channel` is a channel of cdtool, "current" (accepted as torque), "time", or "" for one that must not be mapped.
    `joint` is the joint's name or number as text where there are several. `unit` is that of the values, "" if unknown.
    """

    channel: str = ""
    joint: str = ""
    unit: str = ""


@dataclass(frozen=True)
class Layout:
    """A kind of log: who writes such files, a short one, and the truth by column name.

    `machine` is "linear axis", "rotary axis" or "robot". `accept` are further channels that are right for a column, and
    "" if it may also stay unmapped: a set value has the channel "" and accepts `reference_position`. Where the reader
    has other names for the columns (a header of several lines), the truth is that of the columns in order.
    """

    name: str
    source: str
    machine: str
    log: Path
    truth: Mapping[str, Truth]
    accept: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def read_layouts(name: str) -> tuple[Layout, ...]:
    """Return the layouts of a TOML file in this folder: each column is its name, channel, joint and unit."""
    found = tomllib.loads((_FOLDER / f"{name}.toml").read_text(encoding="utf-8"))["layout"]
    return tuple(
        Layout(
            item["name"],
            item["source"],
            item["machine"],
            _FOLDER / "logs" / item["log"],
            {column: Truth(*parts) for column, *parts in item["columns"]},
            {column: tuple(channels) for column, channels in item.get("accept", {}).items()},
        )
        for item in found
    )


LAYOUTS = read_layouts("public")
#: By the author of the guesser after it was done, from public conventions of other makers.
VENDORS = read_layouts("vendors")
SEALED = {name: read_layouts(name) for name in ("sealed_1", "sealed_2", "sealed_3", "sealed_4")}
