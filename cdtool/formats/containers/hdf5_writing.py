"""Write a recording as HDF5: one dataset per column, one group per clock."""

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

from cdtool.formats.column_names import OWN_CLOCK
from cdtool.formats.columns import Column
from cdtool.formats.containers.container_checks import library
from cdtool.formats.groups import Group, Parts, WrittenNames, prefix_keys

_TERMINATION_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


def write_hdf5(path: Path, groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]) -> WrittenNames:
    """Write one dataset per column, with units as attributes; each of several clocks is a group with its own `time`.

    Raises OSError if the disk is full or cannot be written.
    """
    h5py = library("h5py", "hdf5")
    # An exception within the library's calls of `write` would leave it with a file that it cannot close.
    with deferred_signals() as deliver, _CheckedFile(path, "wb+") as disk:

        def check() -> None:
            deliver()
            disk.check()

        with h5py.File(disk, "w", track_order=True) as file:
            names = _write(file, check, groups, parts, provenance)
        check()
    return names


def _write(
    file: Any, check: Callable[[], None], groups: Sequence[Group], parts: Parts, provenance: Mapping[str, str]
) -> WrittenNames:
    names: WrittenNames = []
    datasets: list[list[Any]] = []
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
                    check()
                done[number] = rows.stop
    return names


class _CheckedFile(FileIO):
    """The file that HDF5 writes to: after the first error (`fault`) it discards all data without raising.

    The library cannot close a file after a failed write, and would crash at the end of the process.
    """

    fault: OSError | None = None

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
        """Raise the OSError of the first write that failed."""
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


@contextmanager
def deferred_signals() -> Iterator[Callable[[], None]]:
    """Defer SIGINT, SIGTERM and SIGHUP to the end of the context, or to a call of the function that it yields.

    Use it if a library calls back into Python code that must not raise. Deferred signals are passed to their previous
    handlers, which may raise. Only the main thread receives signals: in other threads this has no effect.
    """
    pending: list[int] = []
    handlers: dict[int, Any] = {}

    def deliver() -> None:
        while pending:
            number = pending.pop(0)
            handler = handlers[number]
            if callable(handler):
                handler(number, None)
            elif handler == signal.SIG_DFL:
                signal.signal(number, signal.SIG_DFL)
                signal.raise_signal(number)

    if threading.current_thread() is not threading.main_thread():
        yield deliver
        return
    for number in _TERMINATION_SIGNALS:
        handlers[number] = signal.signal(number, lambda number, _: pending.append(number))
    try:
        yield deliver
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)
        deliver()
