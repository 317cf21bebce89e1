"""A file of a few kB with a decompressed size of many GB is refused in one line, before memory is allocated."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cdtool.errors import RecordingError
from cdtool.formats.container_checks import check_chunks
from cdtool.formats.parquet_check import check_batches, check_pages
from cdtool.ingest.reading import survey
from tests.formats import bombs
from tests.noted_times import note

SECONDS, MIB = 5.0, 300
# Reads a plain file of each kind, then a bomb; prints the seconds, the MiB above the plain files, and the message.
CHILD = """
import json, resource, sys, time
from pathlib import Path
from cdtool.errors import RecordingError
from cdtool.ingest.reading import survey
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
    import pyarrow.feather as feather
    import pyarrow.parquet as parquet

    table = arrow.table({"t": np.arange(100.0), "a": np.arange(100.0)})
    paths = [folder / f"plain.{suffix}" for suffix in ("parquet", "feather", "h5", "mat")]
    parquet.write_table(table, paths[0])
    feather.write_feather(table, str(paths[1]), compression="zstd")
    for path in paths[2:]:
        with h5py.File(path, "w", userblock_size=512) as file:
            file.create_dataset("a", data=np.arange(100.0).reshape(1, -1), compression="gzip")
    bombs.with_mat_header(paths[3])
    return paths


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (bombs.hdf5_never_written, "a.h5"),
        (bombs.hdf5_never_written, "a.mat"),
        (bombs.hdf5_one_chunk, "a.h5"),
        (bombs.hdf5_packed_twice, "a.h5"),
        (bombs.hdf5_one_chunk, "a.mat"),
        (bombs.hdf5_packed_twice, "a.mat"),
        (bombs.parquet_of_zeros, "a.parquet"),
        (bombs.parquet_with_a_false_page, "a.parquet"),
        (bombs.feather_of_zeros, "a.feather"),
    ],
    ids=lambda item: item if isinstance(item, str) else item.__name__,
)
def test_a_bomb_is_refused_without_allocating_its_memory(make, name, tmp_path):
    for library in ("h5py", "pyarrow"):
        pytest.importorskip(library)
    bomb = make(tmp_path / name)
    paths = [str(bomb), *map(str, plain_files(tmp_path))]
    done = subprocess.run(
        [sys.executable, "-c", CHILD, *paths], capture_output=True, text=True, check=True, cwd=Path(__file__).parents[2]
    )
    seconds, more, message = json.loads(done.stdout)
    assert message.startswith(f"{bomb}: ") and ": refused (" in message and "\n" not in message
    note(seconds, SECONDS)
    assert more < MIB


def test_plain_files_pass_every_check(tmp_path):
    for library in ("h5py", "pyarrow"):
        pytest.importorskip(library)
    for path in plain_files(tmp_path):
        np.testing.assert_array_equal(survey(path).columns["a"].values, np.arange(100.0))


# --- HDF5


def chunked(path: Path, **options) -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("a", data=np.arange(1000.0), **options)
    return path


@pytest.mark.parametrize(
    "options",
    [{}, {"chunks": (100,)}, {"compression": "gzip", "shuffle": True, "fletcher32": True}, {"compression": "lzf"}],
    ids=["contiguous", "chunked", "gzip, shuffled, with a checksum", "lzf"],
)
def test_a_dataset_that_is_compressed_once_passes(tmp_path, options):
    path = chunked(tmp_path / "a.h5", **options)
    with pytest.importorskip("h5py").File(path) as file:
        check_chunks(path, "a", file["a"])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (bombs.hdf5_one_chunk, "unpacks to 4096 MiB"),
        (bombs.hdf5_packed_twice, "dataset 'a' is compressed more than once: refused"),
    ],
    ids=["one chunk", "packed twice"],
)
def test_a_chunk_that_decompresses_to_far_more_than_its_file_is_refused(tmp_path, make, message):
    h5py = pytest.importorskip("h5py")
    path = make(tmp_path / "a.h5")
    with h5py.File(path) as file, pytest.raises(RecordingError, match=message):
        check_chunks(path, "a", file["a"])


# --- Parquet


def check_parquet(path: Path, *keys: str) -> None:
    check_pages(path, pytest.importorskip("pyarrow.parquet").read_metadata(path), keys or ("a",))


@pytest.mark.parametrize("version", ["1.0", "2.0"])
@pytest.mark.parametrize("compression", ["none", "snappy", "gzip", "zstd"])
@pytest.mark.parametrize("dictionary", [True, False], ids=["dictionary", "plain"])
def test_the_pages_of_a_plain_table_decompress_to_the_size_in_its_footer(tmp_path, version, compression, dictionary):
    parquet = pytest.importorskip("pyarrow.parquet")
    arrow = pytest.importorskip("pyarrow")
    random = np.random.default_rng(5)
    columns = {
        "a": random.normal(size=20_000),
        "b": random.integers(0, 9, 20_000),
        "s": [f"word {i}" for i in random.integers(0, 99, 20_000)],
        "m": [None if i % 3 else float(i) for i in range(20_000)],
        "l": [[1.0, 2.0]] * 20_000,
    }
    path = tmp_path / "a.parquet"
    options = {"data_page_size": 4096, "row_group_size": 6000, "use_dictionary": dictionary}
    parquet.write_table(arrow.table(columns), path, compression=compression, data_page_version=version, **options)
    metadata = parquet.read_metadata(path)
    check_pages(path, metadata, list(columns))
    column_chunks = [metadata.row_group(i).column(j) for i in range(metadata.num_row_groups) for j in range(5)]
    # The size in the footer includes the pages' headers, of at most about 100 bytes each.
    from cdtool.formats.parquet_check import _unpacked

    content = path.read_bytes()
    for chunk in column_chunks:
        size = _unpacked(path, content, chunk)
        assert 0 < size <= chunk.total_uncompressed_size <= size * 1.2 + 400


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (bombs.parquet_with_a_false_page, "unpacks to 2048 MiB"),
        (bombs.parquet_with_false_rows, r"unpacks to \d+ MiB, \d+ times its size: refused"),
    ],
    ids=["a false page", "false rows"],
)
def test_a_parquet_file_whose_footer_hides_its_decompressed_size_is_refused(tmp_path, make, message):
    pytest.importorskip("pyarrow")
    path = make(tmp_path / "a.parquet")
    with pytest.raises(RecordingError, match=message):
        check_parquet(path)


def test_a_column_that_is_not_requested_may_have_any_size(tmp_path):
    arrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    path = bombs.parquet_of_zeros(tmp_path / "a.parquet")
    with pytest.raises(RecordingError, match="refused"):
        check_parquet(path, "a")
    check_parquet(path, "b")
    assert parquet.read_schema(path).equals(arrow.schema([("a", arrow.bool_())]))


def test_a_page_with_a_damaged_header_is_reported(tmp_path):
    path = bombs.parquet_with_a_false_page(tmp_path / "a.parquet", claimed=98_304)
    check_parquet(path)
    content = bytearray(path.read_bytes())
    for header, message in ((b"\x15\x00\x15\x01", "a page without its size"), (b"\xff" * 80, "a page without")):
        content[4 : 4 + len(header)] = header
        path.write_bytes(content)
        with pytest.raises(RecordingError, match=rf"a\.parquet: damaged: column 'a' has {message}"):
            check_parquet(path)


# --- Feather


def feather(path: Path, compression: str, count: int = 100) -> Path:
    arrow, ipc = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.ipc")
    table = arrow.table({"a": np.arange(float(count)), "s": arrow.array(["x", "y"] * (count // 2)).dictionary_encode()})
    options = ipc.IpcWriteOptions(compression=compression)
    with arrow.OSFile(str(path), "wb") as file, ipc.new_file(file, table.schema, options=options) as writer:
        writer.write_table(table, max_chunksize=count // 4)
    return path


@pytest.mark.parametrize("compression", [None, "lz4", "zstd"])
def test_a_plain_feather_file_passes_whole_or_cut_anywhere(tmp_path, compression):
    path = feather(tmp_path / "a.feather", compression)
    check_batches(path)
    whole = path.read_bytes()
    for cut in range(8, len(whole), 37):
        path.write_bytes(whole[:cut])
        check_batches(path)


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_feather_file_whose_batches_decompress_to_far_more_is_refused(tmp_path, compression):
    pytest.importorskip("pyarrow")
    path = bombs.feather_of_zeros(tmp_path / "a.feather", compression, batches=20 if compression == "zstd" else 45)
    if compression == "lz4":  # its ratio for zeros is 250
        assert 45 * 80e6 / path.stat().st_size > 200
    with pytest.raises(RecordingError, match=r"unpacks to \d+ MiB, \d+ times its size: refused"):
        check_batches(path)


def test_a_buffer_that_declares_a_tebibyte_is_refused(tmp_path):
    path = feather(tmp_path / "a.feather", "zstd", 4000)
    content = path.read_bytes()
    declared = struct.pack("<q", 8 * 1000)  # the decompressed size of the first batch's numbers
    assert content.count(declared) >= 4
    path.write_bytes(content.replace(declared, struct.pack("<q", 2**40), 1))
    with pytest.raises(RecordingError, match="unpacks to 1048576 MiB"):
        check_batches(path)


def test_batches_that_only_the_footer_names_are_counted(tmp_path):
    pytest.importorskip("pyarrow")
    path = bombs.feather_of_zeros(tmp_path / "a.feather")
    content = bytearray(path.read_bytes())
    schema = 8 + 8 + struct.unpack("<I", content[12:16])[0]
    content[schema : schema + 8] = b"\xff\xff\xff\xff\0\0\0\0"  # the end of the messages in sequence
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="refused"):
        check_batches(path)


def test_bytes_other_than_messages_are_passed_to_the_library(tmp_path):
    path = tmp_path / "a.feather"
    random = np.random.default_rng(2)
    for size in (1, 7, 8, 30, 400):
        path.write_bytes((b"ARROW1\0\0" + random.bytes(size))[: max(8, size)])
        check_batches(path)
    whole = feather(path, "lz4").read_bytes()
    for _ in range(200):
        wrong = bytearray(whole)
        for _ in range(4):
            wrong[int(random.integers(8, len(whole)))] = int(random.integers(256))
        path.write_bytes(wrong)
        try:
            check_batches(path)
        except RecordingError as fault:
            assert "refused" in str(fault)
