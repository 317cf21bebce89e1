"""The contact pressure of a test: from the log or by hand, against the limits of the body area, never a silent pass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import ConfigurationError
from cdtool.commands.protocol.assessment.protocol import Protocol
from cdtool.commands.protocol.checking import check_protocol
from cdtool.commands.protocol.document.document import protocol_document
from cdtool.commands.protocol.document.html import to_html
from cdtool.commands.protocol.document.words import words_of
from tests.synthetic.force_rig import half_sine
from tests.synthetic.pressure_rig import Run, write_pressure_rig

# The chest: sternum 120 N/cm2 quasi-static, 240 N/cm2 transient.


def made(folder: Path, *runs: Run, **changes: object) -> Protocol:
    return cdtool.protocol(write_pressure_rig(folder, runs, **changes))


def result(protocol: Protocol) -> tuple[str, list[str]]:
    return protocol.verdict.outcome, [reason.kind for reason in protocol.verdict.reasons]


def page_of(protocol: Protocol) -> str:
    return to_html(protocol_document(protocol)).replace("<wbr>", "")


def held(first: float, later: float):
    """Return a pressure: a peak in the first 0.3 s, then another for a second."""
    return lambda time: half_sine(first)(time) + np.where((time > 0.3) & (time < 1.5), later, 0.0)


@pytest.mark.parametrize(
    ("unit", "scale"), [("N/cm2", 1.0), ("N/cm²", 1.0), ("MPa", 0.01), ("kPa", 10.0), ("bar", 0.1), ("Pa", 1e4)]
)
def test_a_pressure_in_every_unit_is_the_same_peak(tmp_path, unit, scale):
    protocol = made(tmp_path, Run(scale=scale), unit=unit)
    assert result(protocol) == ("pass", [])
    (item,) = protocol.points[0].pressures
    assert item.peak == pytest.approx(100.0, abs=0.5) and item.late_peak == pytest.approx(0.0, abs=0.5)


def test_an_area_of_the_plan_has_its_own_limit_and_an_unknown_one_is_refused(tmp_path):
    area = 'body_area = "pectoral muscle"'
    assert result(made(tmp_path / "a", Run(half_sine(260.0)), point=area)) == ("pass", [])
    with pytest.raises(ConfigurationError, match="no pressure for the body area 'pectoral'") as fault:
        made(tmp_path / "b", Run(), point='body_area = "pectoral"')
    assert "pectoral muscle" in fault.value.hint and "protocol.toml" in fault.value.message
    with pytest.raises(ConfigurationError, match="remove body_area"):
        check_protocol(write_pressure_rig(tmp_path / "c", [Run()], profile="en_12453_wide_gap", point=area))


def test_a_limited_pressure_that_was_not_measured_is_never_a_pass(tmp_path):
    protocol = made(tmp_path, Run(None), Run(None))
    assert result(protocol) == ("incomplete", ["pressure_not_measured"])
    assert protocol.verdict.reasons[0].values["missing"] == 2
    assert "pressure not measured in 2 of 2 repetitions" in words_of("en").reasons(protocol.verdict, "incomplete")[0]
    assert result(made(tmp_path / "one", Run(), Run(None)))[1] == ["pressure_not_measured"]


def test_both_peaks_are_compared_and_a_difference_is_a_deviation(tmp_path):
    def point(peak: float) -> str:
        return f"peak_pressures_n_per_cm2 = [{peak}]"

    same = made(tmp_path / "same", Run(half_sine(200.0)), point=point(210.0))
    assert result(same) == ("pass", [])  # the record shows that it was early
    assert "N/cm² entered" not in page_of(same)
    other = made(tmp_path / "other", Run(half_sine(100.0)), point=point(118.0))
    assert result(other) == ("pass", [])
    assert "peak pressure 118 N/cm² entered, 100" in page_of(other)
    assert result(made(tmp_path / "late", Run(half_sine(100.0)), point=point(200.0)))[1] == ["pressure_time_unknown"]
    assert result(made(tmp_path / "high", Run(half_sine(100.0)), point=point(300.0)))[0] == "fail"


def test_the_reading_at_rest_is_subtracted_and_shown_and_never_decides(tmp_path):
    def offset(by: float, peak: float):
        return lambda time: half_sine(peak)(time) + by

    protocol = made(tmp_path / "low", Run(offset(5.0, 200.0)))
    assert result(protocol) == ("pass", [])
    record = protocol.points[0].pressures[0].record
    assert record is not None and (record.rest, record.peak) == pytest.approx((5.0, 200.0), abs=0.3)
    assert result(made(tmp_path / "high", Run(offset(5.0, 238.0)))) == ("incomplete", ["pressure_rest_decides"])
    # A sensor that holds the peak of an earlier contact reads it at rest.
    assert result(made(tmp_path / "held", Run(offset(200.0, 50.0))))[1] == ["pressure_rest_decides"] * 2
    assert result(made(tmp_path / "negative", Run(offset(-5.0, 245.0))))[0] == "fail"


def test_what_the_film_did_not_see_is_not_a_pass(tmp_path):
    def without(begin: float, end: float, peak: float = 100.0):
        return lambda time: np.where((time > begin) & (time < end), np.nan, half_sine(peak)(time))

    def only(before: float):
        return lambda time: np.where(time < before, half_sine(100.0)(time), np.nan)

    cases = {
        "dead": (lambda time: 0.0 * time, ["pressure_does_not_rise"]),
        "too early": (lambda time: half_sine(200.0)(time + 0.4) + half_sine(20.0)(time), ["pressure_does_not_rise"]),
        "gap": (without(0.1, 0.2), ["pressure_not_assessable"]),
        "gap at the onset": (without(-0.01, 0.05), ["pressure_not_assessable"]),
        "ends early": (only(0.4), ["pressure_not_assessable"] * 2),
        "never at rest": (without(-3.0, -0.001), ["pressure_not_measured"]),
    }
    for name, (pressure, wanted) in cases.items():
        outcome, kinds = result(made(tmp_path / name, Run(pressure)))
        assert (outcome, kinds) == ("incomplete", wanted), name


def test_a_saturated_sensor_and_one_beyond_its_range_are_not_a_pass(tmp_path):
    stop = Run(lambda time: np.minimum(half_sine(300.0)(time), 180.0), noise=0.0)
    channel = '{ column = "p", unit = "N/cm2", saturation = [-500, 150] }'
    masked = made(tmp_path / "masked", Run(half_sine(200.0)), channel=channel)
    assert result(masked)[0] == "incomplete" and "pressure_not_assessable" in result(masked)[1]
    small = made(tmp_path / "range", Run(half_sine(200.0)), most=150.0)
    assert result(small) == ("incomplete", ["pressure_beyond_range"])
    entered = made(tmp_path / "film", Run(None), most=100.0, point="peak_pressures_n_per_cm2 = [110]")
    assert result(entered) == ("incomplete", ["pressure_beyond_range"])
    stopped = made(tmp_path / "stop", stop)
    assert result(stopped) == ("incomplete", ["pressure_not_assessable"])
    sentence = words_of("en").reasons(stopped.verdict, "incomplete")[0]
    assert sentence.endswith("transient: the sensor was at its stop, 180 N/cm², below the limit of 240 N/cm²")


def test_the_pressure_instrument_is_required_and_its_calibration_is_checked(tmp_path):
    assert result(made(tmp_path / "none", Run(), instrument=False)) == ("incomplete", ["no_pressure_instrument"])
    old = made(tmp_path / "old", Run(), valid_until="2026-03-30")
    assert result(old) == ("incomplete", ["calibration_expired"])
    empty = made(tmp_path / "empty", Run(), most=0.0)
    assert result(empty)[1] == ["no_value"] and "range_n_per_cm2" in str(empty.verdict.reasons[0].values["key"])


def test_a_film_reader_may_have_a_file_and_a_clock_of_its_own(tmp_path):
    clock = 'time = { column = "ms", unit = "ms" }, time_offset = 2.5'
    channel = f'{{ file = "../films/{{stem}}.csv", column = "p", unit = "MPa", {clock} }}'
    path = write_pressure_rig(tmp_path, [Run(None)], channel=channel)
    time = np.arange(0.0, 4500.0, 3.0) + np.random.default_rng(1).uniform(0.0, 0.9, 1500)
    pressure = 0.01 * half_sine(180.0)(1e-3 * time - 0.5)
    rows = "\n".join(f"{t:.3f},{p:.5f}" for t, p in zip(time, pressure, strict=True))
    (tmp_path / "films").mkdir()
    (tmp_path / "films" / "01.csv").write_text(f"ms,p\n{rows}\n", encoding="utf-8")
    protocol = cdtool.protocol(path)
    assert result(protocol) == ("pass", [])
    record = protocol.points[0].pressures[0].record
    assert record is not None and record.peak == pytest.approx(180.0, rel=1e-3)
    assert [item.role for item in protocol.files].count("measured") == 2
    (tmp_path / "films" / "01.csv").unlink()
    assert result(cdtool.protocol(path)) == ("incomplete", ["pressure_not_measured"])
