from __future__ import annotations

import pytest

from cdtool.formats.mcap.uniform import UniformChunkReader


@pytest.fixture(scope="module")
def fast_path_chunks():
    """Yield the numbers of chunks that the fast path has read (True) and has not read (False)."""
    counts = {True: 0, False: 0}
    read_chunk = UniformChunkReader.read

    def counting(self, content, rows, is_known):
        result = read_chunk(self, content, rows, is_known)
        counts[result is not None] += 1
        return result

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(UniformChunkReader, "read", counting)
        yield counts
