from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import read_recording, survey
from cdtool.formats.containers.hdf5 import Hdf5
from cdtool.formats.machine_file import read_machine_file

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


def test_damaged_files_are_one_line(two_groups):
    data = two_groups.read_bytes()
    random = np.random.default_rng(2)
    for cut in (9, 100, len(data) // 2, len(data) - 1):
        two_groups.write_bytes(data[:cut])
        with pytest.raises(RecordingError) as caught:
            Hdf5().columns(two_groups)
        assert "\n" not in str(caught.value)
    for at in (len(data) // 2, len(data)):
        two_groups.write_bytes(data[:at] + b"inserted" + data[at:])
        with pytest.raises(RecordingError, match="damaged: 8 bytes longer than it states"):
            Hdf5().columns(two_groups)
    for at in random.integers(8, len(data), 150).tolist():
        wrong = bytearray(data)
        wrong[at] ^= 1 << int(random.integers(8))
        two_groups.write_bytes(wrong)
        try:
            Hdf5().columns(two_groups)
        except RecordingError as fault:
            assert "\n" not in str(fault)
