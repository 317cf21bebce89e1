"""The kinds of files that `convert` writes, and the converted table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

LIBRARIES = {
    ".parquet": "pyarrow", ".feather": "pyarrow", ".h5": "h5py", ".hdf5": "h5py", ".mf4": "asammdf", ".tdms": "nptdms"
}  # fmt: skip
KINDS = [".csv", ".mcap", ".parquet", ".feather", ".h5", ".mf4", ".tdms"]
SEVERAL_CLOCKS = KINDS[1:]


def needs(*suffixes: str) -> None:
    """Skip, by name, where a container's library is absent."""
    for suffix in suffixes:
        if suffix in LIBRARIES:
            pytest.importorskip(LIBRARIES[suffix])


def table(path: Path, rows: int = 400) -> Path:
    """A CSV table in ms with values of all magnitudes, and a missing one."""
    random = np.random.default_rng(7)
    torque = random.normal(size=rows) * 10.0 ** random.integers(-200, 200, rows)
    lines = [f"{k * 0.7},{float(torque[k])!r},{float(k) / 3.0!r}" for k in range(rows)]
    lines[5] = "3.5,,0.1"
    path.write_text("time [ms],torque [N m],speed [rad/s]\n" + "\n".join(lines) + "\n")
    return path
