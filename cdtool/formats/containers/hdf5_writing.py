"""Write a recording as HDF5: one dataset per column, one group per clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from io import FileIO
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.formats.column_names import OWN_CLOCK
from cdtool.formats.columns import Column
from cdtool.formats.containers.container_checks import library
from cdtool.formats.groups import Group, Parts, WrittenNames, prefix_keys

# Windows handles signals between two waits only [s].
_WAIT = 0.1


def write_hdf5(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> WrittenNames:
    """Write one dataset per column, with units as attributes; each of several clocks is a group with its own `time`.

    Raises OSError if the disk is full or cannot be written.
    """
    h5py = library("h5py", "hdf5")
    # In a thread, which receives no signals: an exception within the library's calls of `write` would leave it with a
    # file that it cannot close.
    with _CheckedFile(path, "wb+") as disk, ThreadPoolExecutor(1) as thread:
        writing = thread.submit(_write, h5py, disk, groups, parts, provenance)
        try:
            while wait([writing], _WAIT).not_done:
                pass
        except BaseException as interruption:
            disk.fault = interruption
            raise
    return writing.result()


def _write(
    h5py: Any, disk: _CheckedFile, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]
) -> WrittenNames:
    names: WrittenNames = []
    datasets: list[list[Any]] = []
    with h5py.File(disk, "w", track_order=True) as file:
        for key, value in prefix_keys(provenance).items():
            file.attrs[key] = value
        for group in groups:
            folder = file if len(groups) == 1 else file.create_group(group.name, track_order=True)
            before = "" if len(groups) == 1 else f"{group.name}/"
            columns = [Column(OWN_CLOCK, np.empty(0), unit="s")] if group.own_clock else []
            datasets.append([_dataset(folder, column, group.rows) for column in (*columns, *chain(*group.flat))])
            names.append([[before + _link(part.name) for part in parts] for parts in group.flat])
        done = [0] * len(groups)
        for ready in parts:
            for number, part in enumerate(ready):
                if part is not None:
                    rows = slice(done[number], done[number] + len(part))
                    values = [part.time, *part.flat] if groups[number].own_clock else part.flat
                    for dataset, column in zip(datasets[number], values, strict=True):
                        dataset[rows] = column
                        disk.check()
                    done[number] = rows.stop
    disk.check()
    return names


class _CheckedFile(FileIO):
    """The file that HDF5 writes to: after the first error or interruption (`fault`) it discards all data.

    The library cannot close a file after a failed write, and would crash at the end of the process.
    """

    fault: BaseException | None = None

    def write(self, data: Any) -> int:
        """Write all data and return the size; after an error discard the data and return the same size."""
        rest = memoryview(data).cast("B")
        size = len(rest)
        try:
            while len(rest) and self.fault is None:
                rest = rest[super().write(rest) :]
        except OSError as fault:
            self.fault = fault
        return size

    def truncate(self, size: int | None = None) -> int:
        """Set the file's size and return it; after an error return the size without setting it."""
        try:
            if self.fault is None:
                return super().truncate(size)
        except OSError as fault:
            self.fault = fault
        return self.tell() if size is None else size

    def check(self) -> None:
        """Raise the first error or interruption."""
        if self.fault is not None:
            raise self.fault


def _dataset(folder: Any, column: Column, rows: int) -> Any:
    dataset = folder.create_dataset(_link(column.name), (rows,), np.float64)
    if column.unit:
        dataset.attrs["unit"] = column.unit
    return dataset


def _link(name: str) -> str:
    """Return a name without slashes, which would create groups."""
    return name.replace("/", ".")
