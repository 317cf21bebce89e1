"""Files that are read piece by piece have the same numbers as read at once, in time order and bounded memory."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.formats import slices
from cdtool.formats.channels.log_statistics import LogStatistics
from cdtool.formats.channels.reading import choose_format
from cdtool.formats.columns import Column, Piece
from cdtool.formats.csv import text
from cdtool.formats.pieces import PieceRun, Pieces, join_pieces, read_pieces
from cdtool.formats.source import Source
from cdtool.formats.time_order import Lateness, by_time
from tests.commands.convert.kinds import needs


def pieces_of(path: Path) -> list[Piece]:
    return list(PieceRun(read_pieces(choose_format(path), path)))


def same(one: Source, other: Source) -> bool:
    """Return whether two sources are equal, including the bits of their numbers."""
    columns = [(one.columns[name], other.columns[name]) for name in one.columns]
    details = [
        [s.findings, dict(s.details), dict(s.topics), s.names, s.origin, s.first_row, list(s.columns)]
        for s in (one, other)
    ]
    return details[0] == details[1] and all(
        a.values.tobytes() == b.values.tobytes()
        and (a.time is None) == (b.time is None)
        and (a.time is None or b.time is None or a.time.tobytes() == b.time.tobytes())
        and a.unit == b.unit
        for a, b in columns
    )


def write_hdf5(path: Path, clocks: Mapping[str, Mapping[str, FloatArray]]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        for name, columns in clocks.items():
            for key, values in columns.items():
                file[f"{name}/{key}"] = values
            file[f"{name}/time"].attrs["unit"] = "s"


def write_tdms(path: Path, clocks: Mapping[str, Mapping[str, FloatArray]]) -> None:
    import nptdms

    with nptdms.TdmsWriter(str(path)) as writer:
        for name, columns in clocks.items():
            units = {"time": {"unit_string": "s"}}
            writer.write_segment([nptdms.ChannelObject(name, key, *[v, units.get(key)]) for key, v in columns.items()])


@pytest.mark.parametrize("write", [write_hdf5, write_tdms])
def test_a_container_read_in_many_pieces_has_the_same_columns(write, tmp_path, monkeypatch):
    suffix = ".h5" if write is write_hdf5 else ".tdms"
    needs(suffix)
    path = tmp_path / f"run{suffix}"
    drive, imu = np.arange(300) / 1000.0, 0.0101 + np.arange(700) / 3000.0
    write(path, {"drive": {"time": drive, "effort": np.sin(drive)}, "imu": {"time": imu, "x": np.cos(imu), "y": imu}})
    found = choose_format(path)
    at_once = found.columns(path)
    assert len({piece.clock for piece in pieces_of(path)}) == len(pieces_of(path))
    monkeypatch.setattr(slices, "VALUES_PER_PIECE", 100)
    pieces = pieces_of(path)
    assert len(pieces) > 20
    # Clocks that run in parallel are yielded in parallel.
    starts = np.array([float(piece.time[0]) for piece in pieces if piece.time is not None and piece.rows])
    assert np.max(np.maximum.accumulate(starts) - starts) < 0.06  # the accelerometer ends 0.06 s before the drive
    assert same(at_once, join_pieces(read_pieces(found, path), sort=False))


@pytest.mark.parametrize("end", ["\n", "", "\n# the end\n"])
def test_a_table_read_in_many_blocks_has_the_same_columns(end, tmp_path, monkeypatch):
    lines = [f"2025-03-01,23:59:{k // 100:02d}.{k % 100:02d},{k},{k / 7!r}" for k in range(5000)]
    lines[1200] = "# a comment"
    lines[2300] = ""
    lines[3400] = lines[3400].replace(",", " , ")
    lines[4500] = "day,clock,a,b"
    path = tmp_path / "a.csv"
    path.write_text("day,clock,a,b\n" + "\n".join(lines[:6000]) + end)
    found = choose_format(path)
    at_once = found.columns(path)
    monkeypatch.setattr(text, "BLOCK_BYTES", 1 << 11)
    assert len(pieces_of(path)) > 20
    assert same(at_once, join_pieces(read_pieces(found, path), sort=False))


@pytest.mark.parametrize(("row", "fault"), [(4000, None), (100, "line 102 has 1 cell")])
def test_words_are_a_footer_only_if_no_row_follows_in_any_block(row, fault, tmp_path, monkeypatch):
    monkeypatch.setattr(text, "BLOCK_BYTES", 1 << 12)
    lines = [f"{k},{k}" for k in range(4000)]
    lines.insert(row, "end of the measurement")
    path = tmp_path / "a.csv"
    path.write_text("t,v\n" + "\n".join(lines) + "\n")
    if fault is None:
        assert sum(piece.rows for piece in pieces_of(path)) == 4000
    else:
        with pytest.raises(RecordingError, match=fault):
            pieces_of(path)


@given(st.lists(st.integers(0, 50), min_size=1, max_size=60), st.integers(1, 7), st.integers(0, 2**32))
def test_rows_are_in_the_order_of_their_times_however_late_the_file_stores_them(times, length, seed):
    late = np.sort(times) / 8.0
    order = np.argsort(np.arange(len(late)) + np.random.default_rng(seed).uniform(0, 9, len(late)))
    pieces = [
        Piece(clock, time, {clock: time + shift}, len(time))
        for start in range(0, len(late), length)
        for clock, shift in (("a", 0.5), ("b", 0.25))
        for time in [np.sort(late[order[start : start + length]])]
    ]
    lateness = Lateness()
    for piece in pieces:
        lateness.add(piece.time)
    columns = {name: [Column(name, np.empty(0))] for name in "ab"}
    ready = list(by_time(pieces, columns, lateness.late, sort=True, most=8))
    for name, shift in (("a", 0.5), ("b", 0.25)):
        found = np.concatenate([part[name].values[name] for part in ready if name in part])
        assert np.array_equal(found, late + shift)
    # Both clocks have the same times and are yielded together.
    assert all(set(part) == {"a", "b"} for part in ready)
    ends = [part["a"].time for part in ready]
    assert all(one[-1] < other[0] for one, other in pairwise(ends))


def test_the_memory_for_the_statistics_of_a_log_does_not_grow_with_its_length():
    def read(count: int) -> Pieces:
        def pieces() -> Iterator[Piece]:
            for k in range(count):
                time = (np.arange(20_000) + 20_000 * k) * 1e-3
                yield Piece("/a", time, {"/a data": np.sin(time)}, len(time))

        yield from pieces()
        return Source(Path("a"), "mcap", {"/a data": Column("/a data", np.empty(0), np.empty(0))})

    peaks = {}
    for count in (20, 200):
        tracemalloc.start()
        figures = LogStatistics(lambda _, n=count: read(n), in_order=True)
        peaks[count] = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert figures.rows("/a data") == 20_000 * count
        assert figures.clocks["/a"].rate == pytest.approx(1000.0)
    assert peaks[200] < 1.2 * peaks[20]
