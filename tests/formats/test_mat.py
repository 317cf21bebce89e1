from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import read_recording, survey
from cdtool.formats.mat import Mat
from tests.data_folder import data, needs_data


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
