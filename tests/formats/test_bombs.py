"""A small file with a decompressed size of many GB is refused in one line, before memory is allocated."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cdtool.formats.channels.reading import survey
from tests.formats import bombs
from tests.time_bounds import check

SECONDS, MIB = 5.0, 300
# Reads a plain file of each kind, then a bomb; prints the seconds, the MiB above the plain files, and the message.
CHILD = """
import json, resource, sys, time
from pathlib import Path
from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import survey
for plain in sys.argv[2:]:
    survey(Path(plain))
before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.perf_counter()
try:
    message = f"was read: {list(survey(Path(sys.argv[1])).columns)}"
except RecordingError as fault:
    message = str(fault)
more = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
print(json.dumps([time.perf_counter() - start, more, message]))
"""


def plain_files(folder: Path) -> list[Path]:
    import h5py
    import pyarrow as arrow
    import pyarrow.parquet as parquet

    table = arrow.table({"t": np.arange(100.0), "a": np.arange(100.0)})
    paths = [folder / f"plain.{suffix}" for suffix in ("parquet", "h5", "mat")]
    parquet.write_table(table, paths[0])
    for path in paths[1:]:
        with h5py.File(path, "w", userblock_size=512) as file:
            file.create_dataset("a", data=np.arange(100.0).reshape(1, -1), compression="gzip")
    bombs.with_mat_header(paths[2])
    return paths


def measured(bomb: Path, *plain: Path) -> tuple[float, float, str]:
    """Read the plain files, then the bomb, in a process: its seconds, MiB above those of the plain files, message."""
    command = [sys.executable, "-c", CHILD, str(bomb), *map(str, plain)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=Path(__file__).parents[2])
    seconds, more, message = json.loads(done.stdout)
    return seconds, more, message


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (bombs.rows_in_gzip, "a.csv.gz"),
        (bombs.mat_of_small_integers, "a.mat"),
        (bombs.hdf5_never_written, "a.h5"),
        (bombs.hdf5_never_written, "a.mat"),
        (bombs.hdf5_one_chunk, "a.h5"),
        (bombs.hdf5_packed_twice, "a.h5"),
        (bombs.hdf5_one_chunk, "a.mat"),
        (bombs.hdf5_packed_twice, "a.mat"),
        (bombs.parquet_of_zeros, "a.parquet"),
        (bombs.parquet_with_false_rows, "a.parquet"),
        (bombs.parquet_with_a_false_page, "a.parquet"),
    ],
    ids=lambda item: item if isinstance(item, str) else item.__name__,
)
def test_a_bomb_is_refused_without_allocating_its_memory(make, name, tmp_path):
    for library in ("h5py", "pyarrow"):
        pytest.importorskip(library)
    bomb = make(tmp_path / name)
    seconds, more, message = measured(bomb, *plain_files(tmp_path))
    assert message.startswith(f"{bomb}: ") and "\n" not in message
    # pyarrow finds that a size is false without writing to the memory.
    assert ("damaged or not a Parquet file: " if "with_a_false" in make.__name__ else ": refused (") in message
    check(seconds, SECONDS)
    assert more < MIB


def test_plain_files_pass_every_check(tmp_path):
    for library in ("h5py", "pyarrow"):
        pytest.importorskip(library)
    for path in plain_files(tmp_path):
        np.testing.assert_array_equal(survey(path).columns["a"].values, np.arange(100.0))


# --- HDF5
