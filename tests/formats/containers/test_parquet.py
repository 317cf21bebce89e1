from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.reading import survey
from tests.base.findings.facts import fact_of

pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")


@pytest.fixture
def saved(tmp_path):
    def save(columns, **options):
        path = tmp_path / "log.parquet"
        table = columns if isinstance(columns, pa.Table) else pa.table(columns)
        parquet.write_table(table, path, **options)
        return path

    return save


def test_numbers_of_every_kind_become_float64_and_others_are_named(saved):
    path = saved(
        {
            "t": pa.array([0.0, 0.1, 0.2]),
            "n": pa.array([1, None, 3], pa.int32()),
            "half": pa.array([0.5, 1.5, 2.5], pa.float32()),
            "on": pa.array([True, None, False]),
            "word": pa.array(["a", "b", "c"]),
            "list": pa.array([[1.0], [2.0], [3.0]]),
        }
    )
    source = survey(path)
    assert list(source.columns) == ["t", "n", "half", "on"]
    assert all(column.values.dtype == np.float64 for column in source.columns.values())
    np.testing.assert_array_equal(source.columns["n"].values, [1.0, np.nan, 3.0])
    assert source.columns["on"].values.tolist()[::2] == [1.0, 0.0]
    word, other = (fact_of(finding) for finding in source.findings)
    assert word == ("column_left_out", {"column": "word", "what": "string"})
    assert (other.numbers["column"], other.numbers["what"][:5]) == ("list", "list<")


def test_a_fields_unit_is_read_and_time_stamps_are_seconds_after_the_first(saved):
    stamps = pa.array(np.datetime64("2025-03-04T05:06:07", "ns") + np.arange(3) * np.timedelta64(1_000_001, "ns"))
    fields = [pa.field("when", stamps.type), pa.field("i", pa.float64(), metadata={"unit": "A"})]
    source = survey(saved(pa.Table.from_arrays([stamps, pa.array([1.0, 2.0, 3.0])], schema=pa.schema(fields))))
    assert source.columns["i"].unit == "A" and source.columns["when"].unit == "s"
    assert source.columns["when"].values.tolist() == [0.0, 0.001000001, 0.002000002]
    assert source.findings[0].numbers["start"].startswith("2025-03-04T05:06:07")


def test_integers_that_float64_cannot_represent_are_reported(saved):
    rounded = [None, 2**53, -(2**63), 2**63 - 1, 7]
    (finding,) = survey(saved({"v": pa.array(rounded, pa.int64())})).findings
    assert finding == Finding("rounded_integers", "v", {"count": 2})
    one = survey(saved({"t": [1, 2], "big": [2**53 + 1, 5]}))
    assert one.findings[0] == Finding("rounded_integers", "big", {"count": 1})


def test_a_small_file_that_decompresses_to_far_more_is_refused(tmp_path):
    path = tmp_path / "bomb.parquet"
    parquet.write_table(pa.table({"v": np.zeros(40_000_000)}), path, compression="zstd")
    assert path.stat().st_size < 1_000_000
    with pytest.raises(RecordingError, match="times its size: refused"):
        survey(path)


def test_without_the_library_the_error_names_the_extra(saved, monkeypatch):
    path = saved({"v": [1.0, 2.0]})
    monkeypatch.setattr("cdtool.formats.containers.container_checks.import_module", _absent)
    with pytest.raises(RecordingError, match=r"pyarrow is not installed.*pip install '\.\[parquet\]'"):
        survey(path)


def _absent(name: str) -> None:
    raise ImportError(name)
