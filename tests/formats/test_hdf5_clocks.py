"""HDF5's clocks, and packed numbers, which are left out."""

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
    (tmp_path / "machine.toml").write_text(MACHINE)
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


def test_a_packed_clock_is_left_out(saved):
    attributes = {"units": "s", "scale_factor": 0.001}
    source = survey(saved(time=(np.arange(9), attributes), q=(np.arange(9.0), {})))
    assert list(source.columns) == ["q"] and source.columns["q"].time is None


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
