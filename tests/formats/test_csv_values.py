from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from cdtool.base.errors import UsageError
from cdtool.formats.csv import Csv, write_csv
from tests.base.findings.facts import fact_of
from tests.data_folder import UR10E_LOGS, data, needs_data
from tests.time_bounds import bounded


def read(path):
    return Csv().columns(path)


def test_written_columns_keep_their_format_and_read_back(tmp_path):
    path = tmp_path / "out.csv"
    columns = {"t": np.array([0.0, 1.0]), "a": np.array([0.123456, math.nan])}
    write_csv(path, columns, {"t": "%.0f", "a": "%.3f"})
    assert path.read_text() == "t,a\n0,0.123\n1,nan\n"
    assert read(path).columns["a"].values[0] == 0.123
    with pytest.raises(UsageError, match="lengths"):
        write_csv(path, {"a": np.zeros(2), "b": np.zeros(3)}, {})


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.lists(st.floats(allow_infinity=False), min_size=1, max_size=30))
@example([5e-324, 1.7976931348623157e308, -0.0, 0.1, 2.2250738585072014e-308])
def test_any_written_number_is_read_back_exactly(tmp_path, numbers):
    path = tmp_path / "bits.csv"
    column = np.array(numbers)
    write_csv(path, {"a": column, "b": column}, {})
    assert np.array_equal(read(path).columns["a"].values, column, equal_nan=True)
    path.write_text("a;b\n" + "".join(f"{x!r};0.5\n".replace(".", ",") for x in numbers))
    assert np.array_equal(read(path).columns["a"].values, column, equal_nan=True)


def test_seven_seconds_at_1_khz_are_written_and_read_back(tmp_path):
    columns = {name: np.random.default_rng(1).normal(size=7000) for name in "abcdefgh"}
    path = tmp_path / "big.csv"
    write_csv(path, columns, dict.fromkeys(columns, "%.6f"))
    read(path)  # imports pandas
    with bounded(0.5):
        write_csv(path, columns, dict.fromkeys(columns, "%.6f"))
        source = read(path)
    for name, values in columns.items():
        np.testing.assert_allclose(source.columns[name].values, values, rtol=0.0, atol=0.5e-6)


@pytest.mark.parametrize(
    ("name", "rows", "width"), [("link4", 1896, 25), ("ur-static", 4259, 31), ("no_torque", 531, 31)]
)
def test_the_ur10e_files_without_header_are_read_completely(name, rows, width):
    path = UR10E_LOGS / f"{name}.csv.gz"
    source = read(path)
    assert len(source.columns) == width
    table = np.column_stack([column.values for column in source.columns.values()])
    assert np.array_equal(table, np.loadtxt(path, delimiter=","))
    assert len(table) == rows


@needs_data("ur3e")
@pytest.mark.parametrize("name", ["L0L1", "L1L2"])
def test_the_ur3e_files_are_read_with_any_line_ends(name):
    source = read(data("ur3e") / f"{name}.csv")
    assert len(source.names) == 175
    assert len(source.columns["target_q_0"].values) > 20
    fact = fact_of(source.findings[0])
    assert fact.kind == "not_numeric" and fact.numbers["column"] == "_id"
