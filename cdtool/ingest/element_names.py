"""How the messages of a topic name the elements of their arrays, as a JointState names its joints."""

from __future__ import annotations

from pathlib import Path

from cdtool.ingest.reading import choose_format


def element_names(path: Path, topic: str) -> tuple[str, ...]:
    """The `name` list of a topic's first message; empty where it has none, or the format cannot tell."""
    tell = getattr(choose_format(path), "element_names", None)
    return tuple(tell(path, topic)) if tell is not None else ()
