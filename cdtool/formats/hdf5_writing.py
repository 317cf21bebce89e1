"""Writing a recording as HDF5: a dataset a column, a group a clock."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import FileIO
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.columns import Column
from cdtool.formats.column_names import OWN_CLOCK
from cdtool.formats.container_checks import library
from cdtool.formats.groups import Group, Parts, Written, stored

_ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


def write_hdf5(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> Written:
    """Write a dataset a column, units as attributes; several clocks are groups, each with its `time`.

    Raises OSError where the disk is full or cannot be written.
    """
    h5py = library("h5py", "hdf5", path)
    # An exception in what the library calls to write would leave it with a file that it cannot close.
    with held_signals() as deliver, _Disk(path, "wb+") as disk:

        def check() -> None:
            deliver()
            disk.check()

        with h5py.File(disk, "w", track_order=True) as file:
            names = _write(file, check, groups, parts, provenance)
        check()
    return names


def _write(
    file: Any, check: Callable[[], None], groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]
) -> Written:
    names: Written = []
    datasets: list[list[Any]] = []
    for key, value in stored(provenance).items():
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
                    check()
                done[number] = rows.stop
    return names


class _Disk(FileIO):
    """What HDF5 writes to: from the first `fault` on it swallows the rest.

    The library could not close a file that it cannot write to, and would crash at the end of the process.
    """

    fault: OSError | None = None

    def write(self, data: Any) -> int:
        """All of it, or as if."""
        rest = memoryview(data).cast("B")
        size = len(rest)
        try:
            while len(rest) and self.fault is None:
                rest = rest[super().write(rest) :]
        except OSError as fault:
            self.fault = fault
        return size

    def truncate(self, size: int | None = None) -> int:
        """Make the file that long, or as if."""
        try:
            if self.fault is None:
                return super().truncate(size)
        except OSError as fault:
            self.fault = fault
        return self.tell() if size is None else size

    def check(self) -> None:
        """Raise the OSError of what could not be written."""
        if self.fault is not None:
            raise self.fault


def _dataset(folder: Any, column: Column, rows: int) -> Any:
    dataset = folder.create_dataset(_link(column.name), (rows,), np.float64)
    if column.unit:
        dataset.attrs["unit"] = column.unit
    return dataset


def _link(name: str) -> str:
    """A name without the slash that would make a group of it."""
    return name.replace("/", ".")


@contextmanager
def held_signals() -> Iterator[Callable[[], None]]:
    """Hold SIGINT, SIGTERM and SIGHUP until the end, or until the function that this yields is called.

    Where a library calls back into Python, nothing must be raised.
    What they then do, and raise, is what they would have done. Outside the main thread, which alone gets signals,
    nothing is held.
    """
    came: list[int] = []
    before: dict[int, Any] = {}

    def deliver() -> None:
        while came:
            number = came.pop(0)
            handler = before[number]
            if callable(handler):
                handler(number, None)
            elif handler == signal.SIG_DFL:
                signal.signal(number, signal.SIG_DFL)
                signal.raise_signal(number)

    if threading.current_thread() is not threading.main_thread():
        yield deliver
        return
    for number in _ENDING:
        before[number] = signal.signal(number, lambda number, _: came.append(number))
    try:
        yield deliver
    finally:
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)
        deliver()
