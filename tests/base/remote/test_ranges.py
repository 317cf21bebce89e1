"""A file at a URL that is read by ranges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdtool.base.remote import session
from cdtool.base.remote.ranges import RangedFile
from cdtool.base.remote.storage import StorageError

CONTENT = np.random.default_rng(1).bytes(300_000)
places = st.integers(0, len(CONTENT) + 100)


@pytest.fixture
def url(memory):
    memory.pipe_file("/logs/a.mcap", CONTENT)
    return "memory://logs/a.mcap"


def _read(file, at, length):
    file.seek(at)
    return file.read(length)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(st.tuples(places, st.integers(0, 40_000)), max_size=30),
    st.lists(st.tuples(places, st.integers(0, 20_000)), max_size=5),
)
def test_reads_are_those_of_the_file(url, reads, expected):
    file = RangedFile(url)
    file.expect((at, at + length) for at, length in expected)
    for at, length in reads:
        assert _read(file, at, length) == CONTENT[at : at + length]


def test_expected_ranges_are_read_once(url):
    file = RangedFile(url)
    before = session.amount_read()
    file.expect([(200_000, 200_100), (0, 50), (250_000, 260_000), (200_090, 200_200)])
    for at, length in ((0, 50), (200_000, 200), (250_500, 9000)):
        assert _read(file, at, length) == CONTENT[at : at + length]
    assert tuple(np.subtract(session.amount_read(), before)) == (50 + 200 + 10_000, 3)


def test_scattered_small_reads_transfer_little_and_consecutive_ones_few_requests(url):
    file = RangedFile(url)
    before = session.amount_read()
    for at in range(0, 300_000, 100_000):
        _read(file, at, 100)
    assert session.amount_read()[0] - before[0] <= 3 * (8192 + 100)
    file, before = RangedFile(url), session.amount_read()
    for at in range(0, len(CONTENT), 1000):
        assert _read(file, at, 1000) == CONTENT[at : at + 1000]
    assert session.amount_read()[1] - before[1] <= 12


def test_a_replaced_file_is_noticed(url, memory):
    file = RangedFile(url)
    file.check_unchanged()
    memory.pipe_file("/logs/a.mcap", CONTENT[:-1] + b"x")
    with pytest.raises(StorageError, match="changed while it was read"):
        file.check_unchanged()
