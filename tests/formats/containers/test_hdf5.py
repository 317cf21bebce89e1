from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import read_recording, survey
from cdtool.formats.containers.hdf5 import Hdf5
from cdtool.formats.machine_file import read_machine_file
from cdtool.formats.pieces import join_pieces
from tests.base.findings.facts import fact_of

h5py = pytest.importorskip("h5py")

MACHINE = """[machine]
type = "rotary_axis"
coordinates = "load"
joints = ["a", "b"]

[channels]
time = { column = "time", unit = "s" }
position = { columns = ["drive/q[0]", "drive/q[1]"], unit = "rad" }
force = { column = "cell/force", unit = "N" }
"""


@pytest.fixture
def two_groups(tmp_path):
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        drive, cell = file.create_group("drive"), file.create_group("cell")
        drive.create_dataset("t", data=np.arange(10.0) * 10.0).attrs["unit"] = "ms"
        drive.create_dataset("q", data=np.arange(20.0).reshape(10, 2)).attrs["unit"] = "rad"
        cell.create_dataset("time", data=np.arange(40.0) / 1000.0).attrs["units"] = np.bytes_("s")
        cell.create_dataset("force", data=np.arange(40, dtype=np.int16))
    return path


def test_datasets_are_columns_by_path_each_with_the_clock_of_its_group(two_groups):
    source = survey(two_groups)
    assert set(source.columns) == {"drive/t", "drive/q[0]", "drive/q[1]", "cell/time", "cell/force"}
    assert source.columns["drive/q[1]"].values.tolist() == list(range(1, 20, 2))
    assert source.columns["drive/q[1]"].unit == "rad"
    np.testing.assert_array_equal(source.columns["drive/q[0]"].time, np.arange(10.0) * 10.0 * 1e-3)
    np.testing.assert_array_equal(source.columns["cell/force"].time, np.arange(40.0) / 1000.0)


def test_channels_of_different_clocks_make_one_recording(two_groups, tmp_path):
    (tmp_path / "machine.toml").write_text(MACHINE)
    recording = read_recording(two_groups, read_machine_file(tmp_path / "machine.toml"))
    assert len(recording["position"]) == 10 and len(recording["force"]) == 40
    assert recording["position"].values.shape == (10, 2)


def test_an_epoch_clock_of_the_machine_file_beside_the_files_own_is_subtracted_once(tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for name in ("clock", "time"):
            file[name] = 1.7e9 + np.arange(5.0)
            file[name].attrs["unit"] = "s"
        file["q"] = np.arange(5.0)
    text = MACHINE.split("joints")[0] + '[channels]\ntime = { column = "clock", unit = "s" }\n'
    (tmp_path / "machine.toml").write_text(text + 'position = { column = "q", unit = "rad" }\n')
    recording = read_recording(tmp_path / "log.h5", read_machine_file(tmp_path / "machine.toml"))
    assert recording.origin == 1.7e9 and recording["position"].time.tolist() == [0, 1, 2, 3, 4]


def test_texts_compounds_scalars_and_matlabs_texts_are_named_and_left_out(tmp_path):
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["v"] = np.arange(5.0)
        file["word"] = ["a", "b"]
        file["pair"] = np.zeros(3, dtype=[("x", "f8"), ("y", "f8")])
        file["one"] = 3.0
        file["char"] = np.arange(5, dtype=np.uint16)
        file["char"].attrs["MATLAB_class"] = np.bytes_("char")
        file["z"] = np.ones(3) * 1j
    source = survey(path)
    assert list(source.columns) == ["v"]
    left_out = {(finding.numbers["column"], finding.numbers["what"]) for finding in source.findings}
    assert left_out == {
        ("word", "of texts or references"),
        ("pair", "a compound"),
        ("char", "a MATLAB char"),
        ("z", "complex"),
        ("one", "of shape ()"),
    }


def test_the_rows_of_a_matrix_in_matlabs_order_are_columns(tmp_path):
    path = tmp_path / "matlab73.h5"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["q"] = np.arange(20.0).reshape(2, 10)
        file["t"] = np.arange(10.0).reshape(1, 10)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file")
    source = survey(path)
    assert source.columns["q[1]"].values.tolist() == list(range(10, 20)) and len(source.columns["t"].values) == 10


def test_external_and_cyclic_links_are_not_followed(tmp_path):
    secret = tmp_path / "secret.bin"
    secret.write_bytes(bytes(range(64)))
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["v"] = np.arange(5.0)
        file["circle"] = h5py.SoftLink("/")
        file["out"] = h5py.ExternalLink("other.h5", "/v")
        file.create_dataset("stolen", shape=(64,), dtype="u1", external=[(str(secret), 0, 64)])
        layout = h5py.VirtualLayout(shape=(5,), dtype="f8")
        layout[:] = h5py.VirtualSource("other.h5", "v", shape=(5,))
        file.create_virtual_dataset("virtual", layout)
    source = survey(path)
    assert list(source.columns) == ["v"]
    assert [finding.numbers["what"] for finding in source.findings] == ["stored in other files"] * 2


@pytest.mark.parametrize(("chunks", "lost"), [((10,), "1 of 3"), (None, "1 of 1")])
def test_rows_that_were_never_written_are_refused_instead_of_read_as_zeros(tmp_path, chunks, lost):
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        dataset = file.create_dataset("v", shape=(25,), dtype="f8", chunks=chunks)
        if chunks:
            dataset[:20] = 1.0
    with pytest.raises(RecordingError, match=f"dataset 'v': {lost} chunks are not in the file"):
        survey(path)


ONE_JOINT = """[machine]
type = "rotary_axis"
coordinates = "load"

[channels]
time = { column = "time", unit = "s" }
position = { column = "q", unit = "rad" }
"""


@pytest.fixture
def saved(tmp_path):
    """Return a function that writes datasets with their attributes and returns the path."""

    def save(**datasets):
        path = tmp_path / "log.h5"
        with h5py.File(path, "w") as file:
            for name, (values, attributes) in datasets.items():
                file[name.replace("__", "/")] = values
                file[name.replace("__", "/")].attrs.update(attributes)
        return path

    return save


def facts(source) -> list[tuple[str, tuple]]:
    return [(finding.channel, fact_of(finding)) for finding in source.findings]


@pytest.mark.parametrize("kind", [np.int64, np.uint64])
@pytest.mark.parametrize("origin", [1_700_000_000_123_456_789, 4_000_000_000_000_000_001])
def test_nanoseconds_since_1970_are_exact(saved, kind, origin):
    steps = np.cumsum(np.random.default_rng(2).integers(900_001, 1_100_000, 300))
    stamps = (origin + steps).astype(kind)
    source = survey(saved(time=(stamps, {"unit": "ns"}), q=(np.arange(300.0), {})))
    assert np.allclose(source.columns["q"].time, (steps - steps[0]) / 1e9, rtol=4e-16, atol=0.0)
    assert source.origin == int(stamps[0]) / 1e9
    assert facts(source) == [("time", ("rounded_integers", {"count": 300}))]


def test_stamps_before_the_first_one_keep_their_sign(saved):
    stamps = np.array([10**18 + 5, 10**18, 10**18 + 9], dtype=np.uint64)
    times = survey(saved(time=(stamps, {"unit": "ns"}), q=(np.arange(3.0), {}))).columns["q"].time
    assert times.tolist() == [0.0, -5e-9, 4e-9]


@pytest.mark.parametrize("unit", ["seconds since 2024-01-01", "milliseconds since 2024-01-01", "days since 1899-12-30"])
def test_a_time_since_a_date_is_left_out_and_never_read_in_another_unit(saved, tmp_path, unit):
    path = saved(time=(np.arange(9.0), {"units": unit}), q=(np.arange(9.0), {}))
    source = survey(path)
    assert list(source.columns) == ["q"] and source.columns["q"].time is None
    why = f"in '{unit}' of the CF conventions, which are not applied"
    assert facts(source) == [("", ("column_left_out", {"column": "time", "what": why}))]
    (tmp_path / "machine.toml").write_text(ONE_JOINT)
    with pytest.raises(RecordingError, match="'time'"):
        read_recording(path, read_machine_file(tmp_path / "machine.toml"))


@pytest.mark.parametrize(
    "attributes",
    [
        {"scale_factor": 0.01},
        {"add_offset": np.float32(5.0)},
        {"_FillValue": np.int16(-32768)},
        {"missing_value": np.array([-99, -98], dtype=np.int16)},
        {"scale_factor": "0.01"},
        {"_FillValue": b"none"},
        {"add_offset": np.empty(0)},
    ],
    ids=["scale", "offset", "fill", "missing", "text", "bytes", "empty"],
)
def test_a_packed_dataset_is_left_out(saved, attributes):
    source = survey(saved(x=(np.arange(5), attributes), y=(np.arange(5.0), {})))
    assert list(source.columns) == ["y"]
    why = "packed by the CF conventions, which are not applied"
    assert facts(source) == [("", ("column_left_out", {"column": "x", "what": why}))]


def test_clocks_of_groups_without_a_unit_are_a_warning(saved):
    clocks = {"drive__t": (np.arange(9.0), {}), "cell__time": (np.arange(9.0), {})}
    assert ("", ("clocks_without_unit", {"datasets": ("cell/time", "drive/t")})) in facts(survey(saved(**clocks)))
    alone = facts(survey(saved(t=clocks["drive__t"], q=clocks["drive__t"])))
    assert not [fact for _, fact in alone if fact.kind == "clocks_without_unit"]


def test_a_clock_without_an_epoch_keeps_its_times_and_is_reported(saved):
    path = saved(
        drive__time=(1_700_000_000_000 + np.arange(9), {"unit": "ms"}),
        drive__q=(np.arange(9.0), {}),
        cell__t=(0.5 + np.arange(9.0), {"unit": "s"}),
        cell__f=(np.arange(9.0), {}),
    )
    source = survey(path)
    assert source.origin == 1.7e9 and source.columns["drive/q"].time[0] == 0.0
    assert source.columns["cell/f"].time.tolist() == (0.5 + np.arange(9.0)).tolist()
    assert ("", ("no_start_time", {"channels": ("cell/f", "cell/t")})) in facts(source)


def test_some_columns_are_read_in_pieces_at_the_times_that_they_have_among_all(saved):
    path = saved(
        a__time=(1_700_000_000_000 + np.arange(9), {"unit": "ms"}),
        a__q=(np.arange(9.0), {}),
        b__time=(1_700_000_002_000 + np.arange(9), {"unit": "ms"}),
        b__f=(np.arange(9.0), {}),
    )
    source = join_pieces(Hdf5().pieces(path, {"b/f"}), sort=False)
    assert list(source.columns) == ["b/f"] and source.origin == 1.7e9
    assert source.columns["b/f"].time[0] == 2.0
