"""Decompression bombs: small files with a large declared size, written without allocating that size."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

MIB = 2**20
# MATLAB's header of a file of version 7.3, before the HDF5 part.
MAT_HEADER = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Jan  6 09:00:00 2025 HDF5 schema 1.00 ."


def deflated_zeros(mib: int) -> bytes:
    """Return a zlib stream of `mib` MiB of zeros, as repeated blocks of 1 MiB."""
    packer = zlib.compressobj(9)
    first = packer.compress(bytes(MIB)) + packer.flush(zlib.Z_FULL_FLUSH)
    block = packer.compress(bytes(MIB)) + packer.flush(zlib.Z_FULL_FLUSH)
    checksum = struct.pack(">HH", mib * MIB % 65521, 1)  # Adler-32 of zeros
    return first + block * (mib - 1) + b"\x03\x00" + checksum


def rows_in_gzip(path: Path, size: int = 10_000_000) -> Path:
    """Write a table of short rows, a thousandth of whose size is in the file."""
    packer = zlib.compressobj(9, wbits=-15)
    piece = packer.compress(b"0,0,0\n" * 170_000) + packer.flush(zlib.Z_FULL_FLUSH)
    path.write_bytes(b"\x1f\x8b\x08\0\0\0\0\0\0\x03" + piece * (size // len(piece)))
    return path


def with_mat_header(path: Path) -> Path:
    """Write MATLAB's header into the user block of an HDF5 file."""
    with path.open("r+b") as file:
        file.write(MAT_HEADER.ljust(116) + bytes(8) + b"\x00\x02IM")
    return path


def mat_of_small_integers(path: Path, mib: int = 250) -> Path:
    """Write a variable of version 7 with 250 Mi zeros of one byte each, which are 2000 MiB as float64."""
    rows = mib * MIB
    head = struct.pack("<4I", 6, 8, 9, 0) + struct.pack("<2I2i", 5, 8, rows, 1) + struct.pack("<2I8s", 1, 1, b"x")
    packer = zlib.compressobj(9)
    packed = packer.compress(struct.pack("<2I", 14, len(head) + 8 + rows) + head + struct.pack("<2I", 2, rows))
    packed += b"".join(packer.compress(bytes(MIB)) for _ in range(mib)) + packer.flush()
    header = b"MATLAB 5.0 MAT-file".ljust(116) + bytes(8) + b"\x00\x01IM"
    path.write_bytes(header + struct.pack("<2I", 15, len(packed)) + packed)
    return path


def hdf5_never_written(path: Path) -> Path:
    """Write a dataset of 75 GiB without data."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("a", shape=(1, 10**10), chunks=(1, 1000), dtype="f8").attrs["MATLAB_class"] = b"double"
    return with_mat_header(path) if path.suffix == ".mat" else path


def hdf5_one_chunk(path: Path, mib: int = 4096) -> Path:
    """Write 1000 values in one chunk of 4 GiB."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        chunk = (1, mib * MIB // 8)
        dataset = file.create_dataset("a", (1, 1000), "f8", maxshape=(1, None), chunks=chunk, compression="gzip")
        dataset.attrs["MATLAB_class"] = b"double"
        dataset.id.write_direct_chunk((0, 0), deflated_zeros(mib))
    return with_mat_header(path) if path.suffix == ".mat" else path


def hdf5_packed_twice(path: Path, mib: int = 4096) -> Path:
    """Write 1000 values in a chunk of 8 kB that is compressed twice and decompresses to 4 GiB."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        packing = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        packing.set_chunk((1, 1000))
        packing.set_deflate(9)
        packing.set_deflate(9)
        space = h5py.h5s.create_simple((1, 1000))
        h5py.h5d.create(file.id, b"a", h5py.h5t.IEEE_F64LE, space, packing).write_direct_chunk(
            (0, 0), zlib.compress(deflated_zeros(mib), 9)
        )
        file["a"].attrs["MATLAB_class"] = b"double"
    return with_mat_header(path) if path.suffix == ".mat" else path


def parquet_of_zeros(path: Path, rows: int = 10**8) -> Path:
    """Write false 100 million times, which is 763 MiB as numbers, as runs of which only the lengths are stored."""
    import pyarrow as arrow
    import pyarrow.parquet as parquet

    table = arrow.table({"a": np.zeros(10**7, dtype=bool)})
    with parquet.ParquetWriter(path, table.schema, compression="zstd") as writer:
        for _ in range(rows // 10**7):
            writer.write_table(table, row_group_size=10**7)
    return path


def parquet_with_false_rows(path: Path, rows: int = 10**8) -> Path:
    """Write the same file with 10 as the total number of rows in its footer."""
    content = bytearray(parquet_of_zeros(path, rows).read_bytes())
    footer = len(content) - 8 - struct.unpack("<I", content[-8:-4])[0]
    stated = b"\x16" + varint(2 * rows)  # the field after the schema: a long with the next field number
    at = content.index(stated, footer)
    padded = bytes([20 | 128]) + b"\x80" * (len(stated) - 3) + b"\0"  # 10, in as many bytes
    content[at + 1 : at + len(stated)] = padded
    path.write_bytes(content)
    return path


def parquet_with_a_false_page(path: Path, claimed: int = 2**31 - 8) -> Path:
    """Write 12,288 values in a page with a declared size of 2 GiB."""
    import pyarrow as arrow
    import pyarrow.parquet as parquet

    rows = 12_288
    schema = arrow.schema([arrow.field("a", arrow.float64(), nullable=False)])
    table = arrow.table({"a": np.random.default_rng(0).random(rows)}, schema=schema)
    parquet.write_table(table, path, compression="zstd", use_dictionary=False, write_statistics=False)
    chunk = parquet.read_metadata(path).row_group(0).column(0)
    total, start = chunk.total_compressed_size, chunk.data_page_offset
    header = next(
        head for size in range(total - 60, total) if len(head := _page_header(claimed, size, rows)) + size == total
    )
    content = bytearray(path.read_bytes())
    content[start : start + len(header)] = header
    path.write_bytes(content)
    return path


def varint(value: int) -> bytes:
    """Return an unsigned integer in the varint encoding of Thrift and protobuf."""
    encoded = bytearray()
    while value > 127:
        encoded.append(value & 127 | 128)
        value >>= 7
    return bytes([*encoded, value])


def _page_header(unpacked: int, packed: int, values: int) -> bytes:
    """Return a data page's header in Thrift's compact protocol: fields 1, 2, 3 and 5, a struct of four fields."""
    sizes = b"".join(b"\x15" + varint(2 * number) for number in (0, unpacked, packed))
    inner = b"".join(b"\x15" + varint(2 * number) for number in (values, 0, 3, 3))
    return sizes + b"\x2c" + inner + b"\0\0"
