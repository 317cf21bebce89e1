"""Structs, arrays of structs and cells of MATLAB files, the same for version 7 and for version 7.3."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.io.matlab
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import loadmat

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import survey
from cdtool.formats.mat import Mat
from cdtool.formats.mat.version_5 import read_variables
from tests.base.findings.facts import fact_of
from tests.formats import bombs
from tests.formats.mat_files import save_v7, save_v73

T = np.arange(40) * 0.01
SAVE = [pytest.param(save_v7, id="7"), pytest.param(save_v73, id="7.3")]


@pytest.fixture(params=SAVE)
def source_of(request, tmp_path):
    """Write variables in one of the versions; return what is read."""
    if request.param is save_v73:
        pytest.importorskip("h5py")
    return lambda variables, **options: Mat().columns(request.param(tmp_path / "log.mat", variables, **options))


def trials(rows=(30, 40, 50)):
    random = np.random.default_rng(3)
    return [{"t": 0.01 * np.arange(n), "q": random.random((n, 2)), "load": 1.0 * n, "tool": f"tool {n}"} for n in rows]


def facts(source, kind):
    return [fact_of(finding) for finding in source.findings if finding.kind == kind]


def test_a_field_has_the_name_that_a_matlab_user_writes(source_of):
    source = source_of({"log": {"t": T, "joint": [{"tau": T, "q": 2 * T}, {"tau": 3 * T, "q": T}], "in": {"v": -T}}})
    expected = {"log.t", "log.joint(1).tau", "log.joint(1).q", "log.joint(2).tau", "log.joint(2).q", "log.in.v"}
    assert set(source.columns) == expected and source.findings == ()
    assert source.columns["log.joint(2).tau"].values.tolist() == (3 * T).tolist()
    assert all(column.time is None for column in source.columns.values())  # one clock: a table


def test_a_matrix_in_a_cell_in_a_struct_has_columns_and_cells_of_texts_are_named(source_of):
    source = source_of({"log": {"t": T, "c": (np.column_stack((T, -T)), "text", {"v": T}), "names": ("a", "b")}})
    assert set(source.columns) == {"log.t", "log.c{1}[0]", "log.c{1}[1]", "log.c{3}.v"}
    assert source.details == {"log.c{2}": "text"}
    assert [str(item) for item in source.findings if item.kind == "variable_left_out"] == [
        "variable 'log.names' is a cell of texts: left out"
    ]


def test_groups_of_one_struct_have_the_clock_that_is_as_long_and_the_rest_is_named(source_of):
    log = {"t": T, "tau": T, "time_cell_ms": np.arange(90.0), "force": np.ones(90), "gains": np.arange(7.0)}
    source = source_of({"log": log})
    assert set(source.columns) == {"log.t", "log.tau", "log.time_cell_ms", "log.force"}
    np.testing.assert_allclose(source.columns["log.force"].time, 0.001 * np.arange(90), rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(source.columns["log.tau"].time, T)
    assert {(fact.numbers["unit"], fact.numbers["evidence"]) for fact in facts(source, "assumed_clock")} == {
        ("s", "steps"),
        ("ms", "name"),
    }
    assert facts(source, "without_clock") == [("without_clock", {"variable": "log.gains", "rows": 7})]
    assert "log.gains" in source.names  # a machine file may name it


@pytest.mark.parametrize(("unit", "since"), [("s", 1.7e9), ("ms", 1.7e12)])
def test_clocks_that_count_from_1970_start_together(source_of, unit, since):
    step = {"s": 0.01, "ms": 10.0}[unit]
    one, two = since + step * np.arange(20), since + 5 * step + step * np.arange(30)
    source = source_of({"a": {"t": one, "x": one - since}, "b": {"t": two, "y": two - since}})
    assert source.origin == 1.7e9
    assert source.columns["a.x"].time[0] == 0.0
    assert source.columns["b.y"].time[0] == pytest.approx(0.05, abs=1e-6)
    assert {fact.numbers["evidence"] for fact in facts(source, "assumed_clock")} == {"epoch"}


def test_a_clock_in_an_unknown_unit_is_a_warning(source_of):
    source = source_of({"a": {"t": 1.0 * np.arange(20), "x": T[:20]}, "b": {"t": T, "y": T}})
    (doubt,) = [finding for finding in source.findings if finding.severity == "warning"]
    assert (doubt.channel, doubt.numbers["unit"]) == ("a.t", "ms")


def test_the_elements_of_an_array_of_structs_have_their_own_clocks(source_of):
    source = source_of({"trial": trials()})
    fields = ("t", "q[0]", "q[1]")
    assert set(source.columns) == {f"trial({number}).{name}" for number in (1, 2, 3) for name in fields}
    for number, run in enumerate(trials(), 1):
        column = source.columns[f"trial({number}).q[1]"]
        np.testing.assert_array_equal(column.values, run["q"][:, 1])
        np.testing.assert_array_equal(column.time, run["t"])
    assert source.details["trial(2).tool"] == "tool 40" and source.details["trial(2).load"] == "40"


def test_an_array_of_structs_of_single_numbers_is_named_with_what_makes_it_readable(source_of):
    """table2struct(T) makes one struct per row."""
    source = source_of({"v": T, "T": [{"t": 0.1 * i, "tau": 2.0 * i, "note": "x"} for i in range(6)]})
    (found,) = facts(source, "variable_left_out")
    assert found.numbers["what"] == "an array of structs without vectors"
    assert "struct('t', [T.t])" in found.numbers["advice"]


NOON = 739_385.5  # 2024-05-13 12:00


def test_days_of_datenum_are_seconds_since_the_first(source_of):
    source = source_of({"log": {"t": NOON + T / 86400, "v": T}})
    assert source.columns["log.t"].unit == "s" and source.origin == 1_715_601_600.0
    np.testing.assert_allclose(source.columns["log.t"].values, T, rtol=0.0, atol=1.1e-5)
    assert [fact.numbers["start"] for fact in facts(source, "days_of_matlab")] == ["2024-05-13T12:00:00.000"]


def test_an_object_of_version_7_is_named_by_its_class(tmp_path):
    """An opaque array: flags, name, type system, class, then what only MATLAB can read."""
    path = save_v7(tmp_path / "log.mat", {"t": T})

    def part(kind: int, content: bytes) -> bytes:
        return np.array([kind, len(content)], "<u4").tobytes() + content + bytes(-len(content) % 8)

    content = part(6, np.array([17, 0], "<u4").tobytes()) + part(1, b"T") + part(1, b"MCOS") + part(1, b"table")
    path.write_bytes(path.read_bytes() + part(14, content + part(14, b"")))
    (finding,) = Mat().columns(path).findings
    assert (finding.numbers["variable"], finding.numbers["what"]) == ("T", "a table")
    assert "table2struct(T, 'ToScalar', true)" in finding.sentence


# --- Files that MATLAB wrote

WRITTEN = Path(scipy.io.matlab.__file__).parent / "tests" / "data"


@pytest.mark.parametrize("version", ["6.1_SOL2", "6.5.1_GLNX86", "7.1_GLNX86", "7.4_GLNX86"])
def test_files_that_matlab_wrote_are_read_as_scipy_reads_them(version):
    if not WRITTEN.exists():
        pytest.skip("this SciPy came without its test data")
    variables = read_variables(WRITTEN / f"teststructarr_{version}.mat")
    one, two = variables["teststructarr"]
    assert one["one"].read().item() == 1 and two["two"] == "number 2"
    nested = read_variables(WRITTEN / f"teststructnest_{version}.mat")["teststructnest"][0]
    assert nested["two"][0]["three"] == "number 3"
    cells = read_variables(WRITTEN / f"testcell_{version}.mat")["testcell"]
    assert [cell.read().size for cell in cells[1:]] == [1, 2, 3]
    numbers = read_variables(WRITTEN / f"testcomplex_{version}.mat")["testcomplex"]
    assert numbers.is_complex and numbers.shape == (1, 9)
    cube = read_variables(WRITTEN / f"test3dmatrix_{version}.mat")["test3dmatrix"].read()
    np.testing.assert_array_equal(cube, loadmat(WRITTEN / f"test3dmatrix_{version}.mat")["test3dmatrix"])


def test_every_file_of_scipys_tests_is_read_or_refused_in_one_line():
    if not WRITTEN.exists():
        pytest.skip("this SciPy came without its test data")
    paths = sorted(WRITTEN.glob("*.mat"))
    assert len(paths) > 80
    for path in paths:
        try:
            survey(path)
        except RecordingError as fault:
            assert "\n" not in str(fault)


# --- Both versions, and damage

FIELDS = st.dictionaries(
    st.sampled_from("abcd"), st.sampled_from(["vector", "matrix", "scalar", "text", "empty"]), min_size=1
)


def _value(kind: str, random: np.random.Generator):
    return {
        "vector": random.random(9),
        "matrix": random.random((9, 3)),
        "scalar": float(random.random()),
        "text": "word",
        "empty": np.empty((0, 0)),
    }[kind]


@settings(max_examples=25, deadline=None)
@given(fields=FIELDS, elements=st.integers(1, 3), clock=st.booleans(), packed=st.booleans(), seed=st.integers(0, 9999))
def test_any_struct_has_the_same_columns_in_both_versions(tmp_path_factory, fields, elements, clock, packed, seed):
    pytest.importorskip("h5py")
    folder, random = tmp_path_factory.mktemp("mat"), np.random.default_rng(seed)
    array = [
        {key: _value(kind, random) for key, kind in sorted(fields.items())}
        | ({"t": np.sort(random.random(9))} if clock else {})
        for _ in range(elements)
    ]
    variables = {"n": np.arange(5.0), "s": array if elements > 1 else array[0]}
    old = Mat().columns(save_v7(folder / "old.mat", variables, do_compression=packed))
    new = Mat().columns(save_v73(folder / "new.mat", variables, **({"compression": "gzip"} if packed else {})))
    assert new.names == old.names and new.findings == old.findings and new.details == old.details
    for name, column in old.columns.items():
        assert new.columns[name].values.tobytes() == column.values.tobytes()


def test_structs_nested_without_end_are_refused(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = save_v73(tmp_path / "a.mat", {"t": T})
    with h5py.File(path, "a") as file:
        cell = file.create_dataset("c", (2, 1), dtype=h5py.ref_dtype)
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
        cell[:] = cell.ref
    with pytest.raises(RecordingError, match="32 levels of structs and cells: refused"):
        Mat().columns(path)
    nested: object = T
    for _ in range(40):
        nested = {"a": nested}
    with pytest.raises(RecordingError, match="32 levels of structs and cells: refused"):
        Mat().columns(save_v7(tmp_path / "b.mat", {"s": nested}))


@pytest.mark.parametrize(
    ("make", "message"),
    [(bombs.hdf5_one_chunk, "unpacks to 4096 MiB"), (bombs.hdf5_packed_twice, "compressed more than once: refused")],
)
def test_a_bomb_inside_of_a_struct_is_refused(tmp_path, make, message):
    h5py = pytest.importorskip("h5py")
    path = make(tmp_path / "a.mat")
    with h5py.File(path, "a") as file:
        file.create_group("s").attrs["MATLAB_class"] = np.bytes_("struct")
        file.move("a", "s/a")
    with pytest.raises(RecordingError, match=message):
        Mat().columns(path)
