"""Damaged bytes of every format: read or refused in one line, nothing made up, and what is lost is said.

MCAP has its own suite (mcap_damage), and plain text tables, whose damage is known cell by cell (damaged_tables.py).
"""

from __future__ import annotations

import datetime
import gzip
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import nptdms
import numpy as np
import openpyxl
import pyarrow
import pytest
from pyarrow import parquet
from rosbags.rosbag1 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

from cdtool.base.errors import RecordingError
from cdtool.formats import FORMATS
from cdtool.formats.channels.reading import survey
from tests.formats import lvm_files, scope_exports
from tests.formats.bags.test_rosbag2 import FOXY, write_bag
from tests.formats.mat_files import save_v7, save_v73

ROWS = 60
T = np.arange(ROWS) * 0.01
VALUES = np.random.default_rng(6).normal(size=ROWS).round(6)
DAMAGES = ("cut", "inserted", "flipped", "changed", "removed", "repeated")
COUNT = 120


def table(path: Path) -> None:
    rows = "".join(f"{t:.2f},{value}\n" for t, value in zip(T, VALUES, strict=True))
    path.write_bytes(gzip.compress(("t,v\n" + rows).encode(), mtime=0))


def lvm(path: Path) -> None:
    channels = [lvm_files.Channel(name, VALUES.tolist(), unit="N") for name in ("a", "b")]
    path.write_text(lvm_files.measurement(lvm_files.Style(headings="Yes"), channels), newline="")


def scope(path: Path) -> None:
    channels = [scope_exports.Channel("a", "1", VALUES.tolist()), scope_exports.Channel("b", "5", [1.5] * 12)]
    scope_exports.write_export(path, channels, scope_exports.Options(shared=False))


def hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        for name, values in (("a/time", T), ("a/v", VALUES), ("q", VALUES.reshape(-1, 2))):
            file[name] = values
        file["a/time"].attrs["unit"] = "s"


def tdms(path: Path) -> None:
    with nptdms.TdmsWriter(str(path)) as writer:
        for part in np.split(VALUES, 6):
            writer.write_segment([nptdms.ChannelObject("m", "v", part, properties={"unit_string": "A"})])


def xlsx(path: Path) -> None:
    workbook = openpyxl.Workbook()
    for row in (["t", "v"], *zip(T.tolist(), VALUES.tolist(), strict=True)):
        workbook.active.append(row)
    workbook.properties.modified = datetime.datetime(2025, 1, 1)
    workbook.save(path)


def rosbag(path: Path) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    number = store.types["std_msgs/msg/Float64"]
    with BagWriter(path) as writer:
        connection = writer.add_connection("/v", number.__msgtype__, typestore=store)
        for k, value in enumerate(VALUES.tolist()):
            writer.write(connection, 10**18 + k * 10**7, store.serialize_ros1(number(value), number.__msgtype__))


def without_index(path: Path) -> None:
    write_bag(path, schema=FOXY.partition("CREATE INDEX")[0])


STRUCT = {"log": {"t": T, "c": (T, "x"), "j": [{"q": VALUES, "n": 1.0}, {"q": T, "n": 2.0}]}}


@dataclass(frozen=True)
class Made:
    """How a file is made, and which damages are always refused.

    `counted`: lost rows are said; `checked`: a checksum covers all values; `filled`: no column is left without a value.
    """

    name: str
    make: Callable[[Path], object]
    refused: tuple[str, ...] = ()
    counted: bool = False
    checked: bool = False
    filled: bool = True


MADE = {
    "csv": [Made("a.csv.gz", table, ("cut", "inserted"), checked=True), Made("a.lvm", lvm)],
    "twincat_scope": [Made("a.csv", scope)],
    "mat": [
        Made("7.mat", lambda path: save_v7(path, STRUCT), ("cut",)),
        Made("packed.mat", lambda path: save_v7(path, STRUCT, do_compression=True), ("cut",)),
        Made("73.mat", lambda path: save_v73(path, STRUCT, compression="gzip"), ("cut", "inserted")),
    ],
    "hdf5": [Made("a.h5", hdf5, ("cut", "inserted"))],
    "parquet": [
        Made("a.parquet", lambda path: parquet.write_table(pyarrow.table({"t": T, "v": VALUES}), path), filled=False)
    ],
    "tdms": [Made("a.tdms", tdms)],
    "xlsx": [Made("a.xlsx", xlsx, checked=True)],
    "rosbag": [Made("a.bag", rosbag, counted=True)],
    "rosbag2": [Made("a.db3", write_bag, counted=True), Made("unindexed.db3", without_index)],
}


def damaged(whole: bytes, kind: str, seed: int) -> Iterator[bytes]:
    """Yield files with damage of a kind at random places."""
    rng = np.random.default_rng(seed)
    for _ in range(COUNT // len(DAMAGES)):
        at = int(rng.integers(4, len(whole) - 1))
        if kind == "cut":
            yield whole[:at]
        elif kind == "inserted":
            yield whole[:at] + bytes(37) + whole[at:]
        elif kind == "flipped":
            yield whole[:at] + bytes([whole[at] ^ 1 << int(rng.integers(8))]) + whole[at + 1 :]
        elif kind == "changed":
            wrong = bytearray(whole)
            for place in rng.integers(4, len(whole), int(rng.integers(1, 8))).tolist():
                wrong[place] = int(rng.integers(256))
            yield bytes(wrong)
        elif kind == "removed":
            yield whole[:at] + whole[at + int(rng.integers(1, 200)) :]
        else:
            yield whole[:at] + whole[at : at + 100] + whole[at:]


def columns_of(source) -> dict[str, list[float]]:
    return {name: column.values.tolist() for name, column in source.columns.items()}


def test_every_format_has_damaged_files():
    assert {*MADE, "mcap"} == set(FORMATS.names())


@pytest.mark.parametrize("kind", DAMAGES)
@pytest.mark.parametrize("made", [made for each in MADE.values() for made in each], ids=lambda made: made.name)
def test_a_damaged_file_is_read_or_refused_in_one_line_and_no_row_is_lost_in_silence(tmp_path, made, kind):
    path = tmp_path / made.name
    made.make(path)
    whole, truth = path.read_bytes(), survey(path)
    assert truth.columns and not [finding for finding in truth.findings if finding.severity == "loss"]
    for content in damaged(whole, kind, seed=len(whole)):
        path.write_bytes(content)
        try:
            source = survey(path)
        except RecordingError as fault:
            assert str(path) in str(fault) and "\n" not in str(fault) and len(str(fault)) < 600
            continue
        assert kind not in made.refused
        assert not made.filled or all(len(column.values) for column in source.columns.values())
        assert all(c.time is None or len(c.time) == len(c.values) for c in source.columns.values())
        said = any(finding.severity in ("loss", "warning") for finding in source.findings)
        assert (
            not made.counted
            or said
            or [len(c.values) for c in truth.columns.values()] == [len(c.values) for c in source.columns.values()]
        )
        assert not made.checked or columns_of(source) == columns_of(truth)
