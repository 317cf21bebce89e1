"""Variants of a layout that make guesses harder: without one of its channels, or without its names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from tests.commands.init.layouts import Layout


def without_each_channel(layout: Layout, folder: Path) -> Iterator[Layout]:
    """Yield the layout without the columns of one channel, for each of its channels."""
    for channel in sorted({truth.channel for truth in layout.truth.values() if truth.channel}):
        kept = {name: name for name, truth in layout.truth.items() if truth.channel != channel}
        if len(kept) > 1:
            yield _rewritten(layout, f"{layout.name} without {channel}", kept, folder)


def without_names(layout: Layout, folder: Path) -> Layout:
    """Return the layout with names that say nothing, apart from that of the clock."""
    kept = {
        name: name if truth.channel == "time" else f"sig_{_letters(i)}"
        for i, (name, truth) in enumerate(layout.truth.items())
    }
    return _rewritten(layout, f"{layout.name} without names", kept, folder)


def is_table(layout: Layout) -> bool:
    """Whether the layout is a text table whose first line has the names, and each other line a cell for each."""
    if layout.log.suffix != ".csv" or all(name.isdigit() for name in layout.truth):
        return False
    lines = _lines(layout)
    separator = _separator(lines[0], layout)
    return bool(separator) and {line.count(separator) for line in lines} == {len(layout.truth) - 1}


def _letters(number: int) -> str:
    alphabet = "bcdefghjk"
    return "z" + "".join(alphabet[(number // 9**k) % 9] for k in range(3))


def _lines(layout: Layout) -> list[str]:
    content = layout.log.read_bytes()
    try:
        return content.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return content.decode("latin-1").splitlines()


def _separator(header: str, layout: Layout) -> str:
    return next((mark for mark in "\t;, " if header.split(mark) == list(layout.truth)), "")


def _rewritten(layout: Layout, name: str, kept: Mapping[str, str], folder: Path) -> Layout:
    """Return a layout with these columns of another one, under new names."""
    header, *lines = _lines(layout)
    separator = _separator(header, layout)
    cells = [zip(line.split(separator), layout.truth, strict=True) for line in lines]
    rows = [[cell for cell, old in row if old in kept] for row in cells]
    log = folder / f"{name.replace('/', '_')}.csv"
    log.write_text("\n".join(map(separator.join, [kept.values(), *rows])) + "\n", encoding="utf-8")
    return replace(layout, name=name, log=log, truth={new: layout.truth[old] for old, new in kept.items()})
