"""HDF5's clocks and packed numbers: attributes are applied, or the dataset is left out."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import cdtool
from cdtool.formats.channels.reading import read_recording, survey
from cdtool.formats.containers.hdf5 import Hdf5, Packing, times_since
from cdtool.formats.epoch_clock import EpochClock, common_origin
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


@pytest.mark.parametrize(
    ("unit", "first", "step"),
    [
        ("seconds since 2024-01-01", 86_400, 1),
        ("milliseconds since 2024-01-01 12:30", 41_400_000, 250),
        ("us since 2024-01-01T12:30:15.5Z", 41_384_500_000, 1),
        ("nanoseconds since 1970-01-01 00:00:00 UTC", 1_704_153_600_000_000_000, 7),
        ("days since 1899-12-30", 45_293.0, 2.0**-20),
        ("hours since 2024-01-01 02:00:00 +02:00", 24.0, 2.0**-12),
        ("minutes since 2024-01-01 22:00:00 -0200", 0.0, 0.5),
        ("secs since 2023-12-31  6:59:59,75 -5:00", 129_600.25, 1),
    ],
)
def test_a_time_since_a_date_is_a_clock_since_1970(saved, tmp_path, unit, first, step):
    factor = {"s": 1, "m": 1e-3, "u": 1e-6, "n": 1e-9, "d": 86_400, "h": 3600}[unit[0]] if unit[:3] != "min" else 60
    counts = first + step * np.arange(50)
    path = saved(time=(counts, {"units": unit}), q=(np.arange(50.0), {"units": "rad"}))
    source = survey(path)
    assert source.origin == datetime(2024, 1, 2, tzinfo=UTC).timestamp()
    assert np.allclose(source.columns["q"].time, factor * step * np.arange(50), rtol=4e-16, atol=0.0)
    (tmp_path / "machine.toml").write_text(MACHINE)
    assert len(read_recording(path, read_machine_file(tmp_path / "machine.toml"))["position"]) == 50


@given(
    st.datetimes(datetime(1980, 1, 1), datetime(2090, 1, 1)),
    st.integers(-14 * 60, 14 * 60),
    st.sampled_from(["T", " "]),
)
def test_any_date_is_converted_like_in_the_calendar(date, minutes, gap):
    zone = timezone(timedelta(minutes=minutes))
    text = date.replace(tzinfo=zone).isoformat(gap)
    _, base = times_since(f"seconds since {text}", "gregorian")
    microseconds = (date.replace(tzinfo=zone) - datetime(1970, 1, 1, tzinfo=UTC)) // timedelta(microseconds=1)
    assert base == Fraction(microseconds, 10**6)


@pytest.mark.parametrize(
    ("attributes", "why"),
    [
        ({"units": "seconds since the start"}, "the date of 'seconds since the start' cannot be read"),
        ({"units": "hours since 2024-01-01 25:00"}, "the date of 'hours since 2024-01-01 25:00' cannot be read"),
        ({"units": "seconds since 2024-01-01", "calendar": "360_day"}, "its calendar '360_day'"),
    ],
    ids=["date", "hour", "calendar"],
)
def test_a_time_since_an_unreadable_date_is_reported_and_not_used_as_a_clock(saved, attributes, why):
    source = survey(saved(time=(np.arange(9.0), attributes), q=(np.arange(9.0), {})))
    (reason,) = [finding.numbers["reason"] for finding in source.findings if finding.kind == "unusable_clock"]
    assert source.columns["q"].time is None and why in reason


@pytest.mark.parametrize("unit", ["N m", "seconds", "since 2024-01-01", "rad since 2024-01-01", "s"])
def test_other_units_are_not_a_time_since_a_date(unit):
    assert times_since(unit, "") is None


def test_packed_numbers_are_unpacked_and_fill_values_are_missing(saved):
    raw = np.array([100, 200, -32768, -99, 0], dtype=np.int16)
    attributes = {"scale_factor": 0.01, "add_offset": np.float32(5.0), "_FillValue": np.int16(-32768)}
    attributes |= {"missing_value": np.array([-99], dtype=np.int16), "units": "N m"}
    source = survey(saved(tau=(raw, attributes), x=(np.array([1.0, -9999.0, 3.0, 4.0, 5.0]), {"_FillValue": -9999.0})))
    assert np.allclose(source.columns["tau"].values, [6.0, 7.0, np.nan, np.nan, 5.0], rtol=1e-15, equal_nan=True)
    assert source.columns["tau"].unit == "N m" and ("tau", ("packed_values", {"scale": 0.01, "offset": 5.0})) in facts(
        source
    )
    assert np.array_equal(source.columns["x"].values, [1.0, np.nan, 3.0, 4.0, 5.0], equal_nan=True)


@given(
    st.lists(st.integers(-(2**15), 2**15 - 1), min_size=1, max_size=20),
    st.floats(1e-6, 1e3),
    st.floats(-1e3, 1e3),
    st.integers(-(2**15), 2**15 - 1),
)
def test_a_packed_number_is_raw_times_scale_plus_offset(raw, scale, offset, missing):
    numbers = Packing(scale, offset, (missing,)).unpacked(np.array(raw, dtype=np.int16))
    truth = [np.nan if x == missing else x * scale + offset for x in raw]
    assert np.array_equal(numbers, truth, equal_nan=True)


def test_unpacking_leaves_the_raw_numbers_of_64_bits_as_they_are():
    raw = np.arange(4.0, dtype=np.dtype("f8", metadata={"h5py": 1}))  # converted to float64 without a copy
    assert np.array_equal(Packing(2.0, 1.0, (1.0, 3.0)).unpacked(raw), [1.0, np.nan, 5.0, np.nan], equal_nan=True)
    assert raw.tolist() == [0.0, 1.0, 2.0, 3.0]


def test_a_fill_value_of_32_bits_is_compared_in_32_bits(saved):
    values = np.array([0.5, 0.1, 2.0], dtype=np.float32)
    source = survey(saved(x=(values, {"_FillValue": np.float32(0.1)})))
    assert np.isnan(source.columns["x"].values).tolist() == [False, True, False]


@pytest.mark.parametrize(
    "attributes",
    [{"scale_factor": "0.01"}, {"add_offset": np.nan}, {"_FillValue": "none"}],
    ids=["text", "nan", "fill"],
)
def test_a_dataset_with_an_unknown_packing_is_left_out(saved, attributes):
    source = survey(saved(x=(np.arange(5), attributes), y=(np.arange(5.0), {})))
    assert list(source.columns) == ["y"]
    why = f"packed, but its attribute {next(iter(attributes))} is not a number"
    assert facts(source) == [("", ("column_left_out", {"column": "x", "what": why}))]


def test_a_packed_clock_may_have_missing_stamps(saved):
    counts = np.array([10, 20, -1, 40], dtype=np.int32)
    attributes = {"units": "s", "scale_factor": 0.001, "add_offset": 2.0, "_FillValue": np.int32(-1)}
    times = survey(saved(time=(counts, attributes), q=(np.arange(4.0), {}))).columns["q"].time
    assert np.allclose(times, [2.01, 2.02, np.nan, 2.04], rtol=1e-15, equal_nan=True)


def test_the_epoch_is_subtracted_before_a_clock_is_scaled(saved):
    """If ticks of 100 ns since 1970 were scaled first, float64 would have a resolution of 240 ns."""
    ticks = 17_000_000_001_234_567 + np.cumsum(np.random.default_rng(7).integers(9_001, 11_000, 200))
    source = survey(saved(time=(ticks, {"units": "s", "scale_factor": 1e-7}), q=(np.arange(200.0), {})))
    assert np.allclose(source.columns["q"].time, (ticks - ticks[0]) / 1e7, rtol=4e-16, atol=0.0)
    assert source.origin == ticks[0] / 1e7


def test_info_shows_every_column_on_the_clock_of_its_group(saved):
    path = saved(
        drive__t=(np.arange(10.0) * 10.0, {"unit": "ms"}),
        drive__q=(np.arange(10.0), {}),
        cell__time=(np.arange(40.0) / 1000.0, {"units": "s"}),
        cell__force=(np.arange(40.0), {}),
    )
    info = cdtool.info(path)
    rates = {channel.name: round(channel.rate_hz) for channel in info.channels}
    assert rates == {"drive/t": 100, "drive/q": 100, "cell/time": 1000, "cell/force": 1000}
    assert not [finding for finding in info.findings if finding.kind == "assumed_clock"]


def test_clocks_of_groups_without_a_unit_are_a_warning(saved):
    clocks = {"drive__t": (np.arange(9.0), {}), "cell__time": (np.arange(9.0), {})}
    assert ("", ("clocks_without_unit", {"datasets": ("cell/time", "drive/t")})) in facts(survey(saved(**clocks)))
    alone = facts(survey(saved(t=clocks["drive__t"], q=clocks["drive__t"])))
    assert not [fact for _, fact in alone if fact.kind == "clocks_without_unit"]


def test_the_epoch_that_is_subtracted_is_the_earliest():
    clocks = [
        EpochClock(lambda a, b, x=x: np.array([x, x + 1])[a:b], 1e-3) for x in (1_700_000_000_250, 1_700_000_000_000)
    ]
    findings = []
    origin = common_origin({"a": clocks[0], "b": clocks[1]}, findings)
    assert origin == 1_700_000_000 and not findings
    assert [clock.times(0, 2, origin).tolist() for clock in clocks] == [[0.25, 0.251], [0.0, 0.001]]


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


def test_missing_first_stamps_hide_no_epoch(saved):
    stamps = 1_700_000_000_000 + np.arange(9)
    stamps[0] = -1
    source = survey(saved(time=(stamps, {"unit": "ms", "_FillValue": np.int64(-1)}), q=(np.arange(9.0), {})))
    assert source.origin == 1_700_000_000.001 and source.columns["q"].time[1:3].tolist() == [0.0, 0.001]


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
