"""Numbers of a file as float64."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from cdtool.formats.columns import as_float64
from cdtool.formats.containers.hdf5 import Hdf5
from cdtool.formats.mat import Mat

# The second one, infinity with its last bit changed, is a NaN that signals an invalid operation as it is converted.
SIGNALS = np.array([0x3F800000, 0x7F800001, 0x7F800000], np.uint32).view(np.float32)


@pytest.fixture
def no_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.mark.usefixtures("no_warnings")
def test_every_nan_is_converted_without_a_warning_and_float64_without_a_copy():
    np.testing.assert_array_equal(as_float64(SIGNALS), [1.0, np.nan, np.inf])
    values = np.arange(3.0)
    assert as_float64(values) is values and as_float64(values[::2]).flags.c_contiguous
    assert as_float64([True, 2]).tolist() == [1.0, 2.0]


@pytest.mark.usefixtures("no_warnings")
def test_a_log_with_such_a_number_is_read_without_a_warning(tmp_path):
    savemat = pytest.importorskip("scipy.io").savemat
    savemat(tmp_path / "log.mat", {"speed": np.tile(SIGNALS, 4)})
    np.testing.assert_array_equal(
        Mat().columns(tmp_path / "log.mat").columns["speed"].values[:3], [1.0, np.nan, np.inf]
    )
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["speed"] = np.tile(SIGNALS, 4)
    np.testing.assert_array_equal(
        Hdf5().columns(tmp_path / "log.h5").columns["speed"].values[:3], [1.0, np.nan, np.inf]
    )
