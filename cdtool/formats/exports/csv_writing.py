"""Write one table of a recording as CSV: each float64 with the fewest digits that read back to the same bits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path

from cdtool.formats.column_names import OWN_CLOCK
from cdtool.formats.columns import Column
from cdtool.formats.groups import Group, Part, Parts, WrittenNames, prefix_keys, single_group

# Rows that are in memory as text at once.
_ROWS = 2**14


def write_csv_table(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> WrittenNames:
    """Write a table with its provenance in lines that start with #, and with units in the header: `torque [N m]`."""
    group = single_group(groups)
    header = [_heading(column) for column in chain(*group.flat)]
    if group.own_clock:
        header.insert(0, f"{OWN_CLOCK} [s]")
    with path.open("w", encoding="utf-8", newline="\n") as file:
        for key, value in prefix_keys(provenance).items():
            file.write(f"# {key}: {' '.join(value.split())}\n")
        file.write(",".join(map(_quoted, header)) + "\n")
        for (part,) in parts:
            if part is not None:
                for start in range(0, len(part), _ROWS):
                    file.write(_lines(group, part, slice(start, start + _ROWS)))
    return [[[_heading(part) for part in parts] for parts in group.flat]]


def _lines(group: Group, part: Part, rows: slice) -> str:
    columns = [part.time, *part.flat] if group.own_clock else part.flat
    cells = [map(repr, column[rows].tolist()) for column in columns if column is not None]
    return "".join(f"{','.join(row)}\n" for row in zip(*cells, strict=True))


def _heading(column: Column) -> str:
    return f"{column.name} [{column.unit}]" if column.unit else column.name


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if any(mark in name for mark in ',;"\n\r\t|') else name
