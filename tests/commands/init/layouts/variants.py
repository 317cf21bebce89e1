"""Variants of a layout that make guesses harder: without one of its channels, or without its names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.random import Generator

from tests.commands.init.layouts.layout import Layout


def without_each_channel(layout: Layout) -> list[Layout]:
    """Return the layout without the columns of one channel, for each of its channels."""
    names = list(layout.truth)
    found = []
    for channel in sorted({truth.channel for truth in layout.truth.values() if truth.channel}):
        kept = {name: name for name in names if layout.truth[name].channel != channel}
        if len(kept) > 1:
            found.append(_rewritten(layout, f"{layout.name} without {channel}", kept))
    return found


def without_names(layout: Layout) -> Layout:
    """Return the layout with names that say nothing, apart from that of the clock."""
    kept = {
        name: name if truth.channel == "time" else f"sig_{_letters(i)}"
        for i, (name, truth) in enumerate(layout.truth.items())
    }
    return _rewritten(layout, f"{layout.name} without names", kept)


def is_table(layout: Layout) -> bool:
    """Whether the layout is a text table whose first line has the names, and each other line a cell for each."""
    if layout.suffix != ".csv" or all(name.isdigit() for name in layout.truth):
        return False
    content = _written(layout, np.random.default_rng(7))
    lines = content.splitlines()
    separator = _separator(lines[0], list(layout.truth))
    return bool(separator) and {line.count(separator) for line in lines} == {len(layout.truth) - 1}


def _letters(number: int) -> str:
    alphabet = "bcdefghjk"
    return "z" + "".join(alphabet[(number // 9**k) % 9] for k in range(3))


def _rewritten(layout: Layout, name: str, kept: Mapping[str, str]) -> Layout:
    """Return a layout with these columns of another one, under new names."""
    columns = list(layout.truth)

    def write(path: Path, generator: Generator) -> None:
        lines = _written(layout, generator).splitlines()
        separator = _separator(lines[0], columns)
        rows = [_taken(line.split(separator), columns, kept) for line in lines[1:]]
        text = "\n".join([separator.join(kept.values()), *(separator.join(row) for row in rows)])
        path.write_text(text + "\n", encoding="utf-8")

    truth = {new: layout.truth[old] for old, new in kept.items()}
    return replace(layout, name=name, write=write, truth=truth)


def _taken(cells: Sequence[str], columns: Sequence[str], kept: Mapping[str, str]) -> list[str]:
    return [cell for cell, column in zip(cells, columns, strict=True) if column in kept]


def _separator(header: str, columns: Sequence[str]) -> str:
    return next((mark for mark in "\t;, " if header.split(mark) == list(columns)), "")


_KEPT: dict[tuple[str, str], bytes] = {}
"""What a layout writes, by its name and the state of the generator: all its variants need it."""


def _written(layout: Layout, generator: Generator) -> str:
    key = layout.name, str(generator.bit_generator.state)
    if key not in _KEPT:
        with TemporaryDirectory() as folder:
            whole = Path(folder) / "whole.csv"
            layout.write(whole, generator)
            _KEPT[key] = whole.read_bytes()
    content = _KEPT[key]
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252")


def written(layout: Layout, folder: Path) -> Path:
    """Write a log of the layout into a folder and return its path."""
    path = folder / f"log{layout.suffix}"
    layout.write(path, np.random.default_rng(7))
    return path
