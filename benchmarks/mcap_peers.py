"""The packages that MCAP reading is compared with: each decodes message by message and reads the same numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap_logs import Array, Content, protobuf_message

Columns = dict[str, Array]


def gathered(content: Content, messages: Iterator[tuple[str, Any]], member: Callable[[Any, str], Any]) -> Columns:
    """Columns of the wanted fields of (topic, decoded message); `member` gets a field of one."""
    fields: dict[str, list[tuple[list[str], list[Any]]]] = {topic: [] for topic in content.topics}
    for topic, field in content.wanted:
        fields[topic].append((field.removesuffix("[:]").split("."), []))
    for topic, message in messages:
        for steps, values in fields[topic]:
            value = message
            for step in steps:
                value = member(value, step)
            values.append(value)
    found = {topic: iter(columns) for topic, columns in fields.items()}
    return {f"{topic} {field}": np.array(next(found[topic])[1], dtype=np.float64) for topic, field in content.wanted}


def by_rosbags(path: Path, content: Content) -> Columns:
    from rosbags.highlevel import AnyReader

    with AnyReader([path]) as reader:
        rows = reader.messages()
        return gathered(
            content, ((each.topic, reader.deserialize(raw, each.msgtype)) for each, _, raw in rows), getattr
        )


def by_orjson(path: Path, content: Content) -> Columns:
    import orjson

    with path.open("rb") as file:
        rows = make_reader(file).iter_messages(log_time_order=False)
        return gathered(
            content, ((channel.topic, orjson.loads(row.data)) for _, channel, row in rows), dict.__getitem__
        )


def by_protobuf(path: Path, content: Content) -> Columns:
    made = {topic: protobuf_message(kind)[1] for topic, (kind, _) in content.topics.items()}
    with path.open("rb") as file:
        rows = make_reader(file).iter_messages(log_time_order=False)
        return gathered(
            content,
            ((channel.topic, made[channel.topic].FromString(row.data)) for _, channel, row in rows),
            getattr,
        )
