"""MATLAB files of version 7, and of version 7.3, which are HDF5 files, with the same columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.io.matlab
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import read_recording, survey
from cdtool.formats.machine_file import read_machine_file
from cdtool.formats.mat import Mat
from tests.data_folder import data, needs_data
from tests.formats.mat_files import CLASSES, save_v73


@pytest.fixture
def saved(tmp_path):
    def save(variables, name="log.mat", **options):
        savemat(tmp_path / name, variables, **options)
        return tmp_path / name

    return save


def test_each_column_of_a_matrix_is_a_column(saved):
    table = np.arange(12.0).reshape(4, 3)
    source = Mat().columns(saved({"q": table}))
    assert list(source.columns) == ["q[0]", "q[1]", "q[2]"]
    assert source.columns["q[2]"].values.tolist() == table[:, 2].tolist()


def test_a_matrix_with_more_columns_than_rows_is_transposed_with_a_note(saved):
    source = Mat().columns(saved({"q": np.arange(12.0).reshape(3, 4)}))
    assert source.columns["q[0]"].values.tolist() == [0, 1, 2, 3]
    assert source.findings[0].kind == "rows_as_columns"


def test_a_damaged_number_type_is_an_error_and_does_not_crash_the_process(saved):
    path = of_an_unknown_kind(saved({"q": np.arange(50.0)}))
    with pytest.raises(RecordingError, match=r"damaged at byte 128: .*unknown kind \(111\)"):
        Mat().columns(path)


def of_an_unknown_kind(path: Path) -> Path:
    """Make the numbers of a variable of 50 float64 those of an unknown kind."""
    whole = path.read_bytes()
    at = whole.index(b"\x09\0\0\0\x90\x01\0\0")  # miDOUBLE, 400 bytes
    path.write_bytes(whole[:at] + b"\x6f" + whole[at + 1 :])
    return path


def test_a_missing_variable_is_named_with_its_channel(saved, machine):
    channels = '[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = "v", unit = "rad/s" }\n'
    with pytest.raises(RecordingError, match=r"no column 'v' \(channel 'speed'\).*known: t, w"):
        Mat().columns(saved({"t": np.arange(3.0), "w": np.arange(3.0)}), machine(channels).columns)


@needs_data("emps")
def test_the_emps_axis_is_a_recording_in_load_coordinates(machine):
    found = machine(
        """
        [channels]
        time = { column = "t", unit = "s" }
        torque = { column = "vir", unit = "V", scale = 35.15 }
        position = { column = "qm", unit = "m" }
        reference_position = { column = "qg", unit = "m" }
        """,
        '[machine]\ntype = "linear_axis"\nname = "emps"\ncoordinates = "load"\nload_mass = 95.1\n',
    )
    recording = read_recording(data("emps") / "DATA_EMPS.mat", found)
    assert recording["torque"].unit == "N"
    assert len(recording["position"]) == 24841
    assert recording.duration == pytest.approx(24.84)
    assert "speed" in recording
    assert set(survey(data("emps") / "DATA_EMPS.mat").details) == {"gtau", "kp", "kv"}


h5py = pytest.importorskip("h5py")


def same(found, expected) -> None:
    assert found.names == expected.names and list(found.columns) == list(expected.columns)
    for name, column in expected.columns.items():
        assert found.columns[name].values.dtype == np.float64
        assert found.columns[name].values.tobytes() == column.values.tobytes()
    assert found.details == expected.details
    assert found.findings == expected.findings


@settings(max_examples=40, deadline=None)
@given(
    shapes=st.lists(st.tuples(st.integers(1, 6), st.integers(1, 6)), min_size=1, max_size=4),
    kinds=st.lists(st.sampled_from(sorted(CLASSES)), min_size=4, max_size=4),
    packed=st.booleans(),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_matrix_has_the_same_columns_as_in_version_7(tmp_path_factory, shapes, kinds, packed, seed):
    folder = tmp_path_factory.mktemp("mat")
    random = np.random.default_rng(seed)
    variables = {"time": np.arange(9.0)}
    for i, (shape, kind) in enumerate(zip(shapes, kinds, strict=False)):
        variables[f"v{i}"] = (50.0 * random.random(shape)).astype(kind)
    ordered = dict(sorted(variables.items()))  # as HDF5 lists them
    savemat(folder / "old.mat", ordered)
    new = save_v73(folder / "new.mat", ordered, **({"compression": "gzip"} if packed else {}))
    same(Mat().columns(new), Mat().columns(folder / "old.mat"))


def test_variables_other_than_vectors_and_matrices_of_numbers_are_named_and_left_out(tmp_path):
    path = save_v73(
        tmp_path / "a.mat",
        {
            "t": np.arange(3.0),
            "s": {"a": 1.0},
            "c": ("a", "b"),
            "w": "words",
            "z": np.ones(3) * 1j,
            "e": np.empty((0, 3)),
        }
        | {"cube": np.zeros((2, 3, 4))},
    )
    with h5py.File(path, "a") as file:
        file.create_group("p").attrs["MATLAB_sparse"] = np.uint64(3)
        file["l"] = h5py.SoftLink("/t")
        file["x"] = h5py.ExternalLink("other.h5", "/t")
        file.create_dataset("o", data=np.zeros((1, 6), np.uint32)).attrs.update(
            {"MATLAB_class": np.bytes_("datetime"), "MATLAB_object_decode": np.int32(3)}
        )
        file["f"] = np.zeros((1, 3))
        file["f"].attrs["MATLAB_class"] = np.bytes_("function_handle")
    source = Mat().columns(path)
    assert list(source.columns) == ["t"]
    assert source.details == {"s.a": "1", "w": "words"}
    left_out = {finding.numbers["variable"]: finding.numbers["what"] for finding in source.findings}
    assert left_out == {
        "c": "a cell of texts",
        "cube": "a 2 x 3 x 4 array",
        "e": "a 0 x 3 array",
        "f": "a function handle",
        "l": "a link",
        "o": "a datetime",
        "p": "a sparse matrix",
        "x": "a link",
        "z": "complex",
    }


def test_a_requested_complex_column_is_an_error(tmp_path):
    path = save_v73(tmp_path / "a.mat", {"t": np.arange(3.0), "z": np.ones(3) * 1j})
    (tmp_path / "machine.toml").write_text(
        '[machine]\ntype = "linear_axis"\ncoordinates = "load"\n[channels]\n'
        'time = { column = "t", unit = "s" }\nspeed = { column = "z", unit = "m/s" }\n'
    )
    with pytest.raises(RecordingError, match="column 'z' is complex"):
        read_recording(path, read_machine_file(tmp_path / "machine.toml"))


def test_a_file_that_matlab_wrote_is_read():
    path = Path(scipy.io.matlab.__file__).parent / "tests" / "data" / "testhdf5_7.4_GLNX86.mat"
    if not path.exists():
        pytest.skip("this SciPy came without its test data")
    source = survey(path)
    assert source.format == "mat"
    np.testing.assert_allclose(source.columns["testdouble"].values, np.arange(9) * np.pi / 4, rtol=0.0, atol=1e-12)


def test_without_h5py_the_error_states_what_to_install_or_how_to_save(tmp_path, monkeypatch):
    def absent(module: str) -> None:
        raise ImportError(module)

    path = save_v73(tmp_path / "a.mat", {"t": np.arange(3.0)})
    monkeypatch.setattr("cdtool.formats.containers.container_checks.import_module", absent)
    with pytest.raises(RecordingError) as fault:
        Mat().columns(path)
    assert fault.value.message == f"{path}: is a MATLAB 7.3 (HDF5) file, and h5py is not installed"
    assert fault.value.hint == "pip install '.[hdf5]'; or save it in MATLAB with save(name, ..., '-v7')"


def test_a_dataset_in_other_files_is_not_followed(tmp_path):
    path = save_v73(tmp_path / "a.mat", {"t": np.arange(3.0)})
    (tmp_path / "raw").write_bytes(np.arange(3.0).tobytes())
    with h5py.File(path, "a") as file:
        file.create_dataset("r", (1, 3), "f8", external=[("raw", 0, 24)])
        layout = h5py.VirtualLayout((1, 3), "f8")
        layout[:] = h5py.VirtualSource(".", "t", (1, 3))
        file.create_virtual_dataset("v", layout)
    source = Mat().columns(path)
    assert list(source.columns) == ["t"]
    assert [finding.numbers["what"] for finding in source.findings] == ["an array stored in other files"] * 2
