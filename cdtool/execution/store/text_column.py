"""A Parquet column of texts without pandas, which `pyarrow.array` imports: that takes longer than a small store."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


def text_column(values: Sequence[str]) -> Any:
    """Return an Arrow array of texts."""
    import pyarrow as pa

    pieces = [value.encode() for value in values]
    ends = np.zeros(len(pieces) + 1, dtype=np.int64)
    np.cumsum([len(piece) for piece in pieces], out=ends[1:])
    return pa.LargeStringArray.from_buffers(len(pieces), pa.py_buffer(ends), pa.py_buffer(b"".join(pieces)))
