from __future__ import annotations

import gc

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import survey
from cdtool.formats.containers.mdf import Mdf
from tests.base.findings.facts import fact_of

asammdf = pytest.importorskip("asammdf")


@pytest.fixture
def saved(tmp_path):
    def save(*groups, version="4.10"):
        path = tmp_path / "log.mf4"
        with asammdf.MDF(version=version) as log:
            for signals in groups:
                log.append(signals, common_timebase=True)
            return log.save(path if version >= "4" else path.with_suffix(".mdf"), overwrite=True)

    return save


def signal(name, samples, step, **options):
    samples = np.asarray(samples)
    return asammdf.Signal(samples, np.arange(len(samples)) * step, name=name, **options)


@pytest.mark.parametrize("version", ["3.30", "4.10"])
def test_each_group_has_its_masters_clock_with_units_and_conversions_applied(saved, version):
    path = saved(
        [signal("i", np.sin(np.arange(100.0)), 0.01, unit="A")],
        [signal("n", np.arange(30, dtype=np.uint16), 0.003, unit="rpm", conversion={"a": 0.5, "b": -3.0})],
        version=version,
    )
    source = survey(path)
    assert source.columns["i"].values.tobytes() == np.sin(np.arange(100.0)).tobytes()
    assert (source.columns["i"].unit, source.columns["n"].unit) == ("A", "rpm")
    assert source.columns["n"].values.tolist() == [0.5 * k - 3.0 for k in range(30)]
    np.testing.assert_array_equal(source.columns["n"].time, np.arange(30) * 0.003)
    assert not source.findings


def test_texts_and_enumerations_are_named_and_left_out(saved):
    words = signal("word", np.array([b"a", b"b"]), 1.0, encoding="utf-8")
    states = {"val_0": 0, "text_0": "off", "val_1": 1, "text_1": "on", "default": b"?"}
    path = saved(
        [words, signal("state", np.arange(2, dtype=np.uint8), 1.0, conversion=states), signal("v", [1.0, 2.0], 1.0)]
    )
    source = survey(path)
    assert list(source.columns) == ["v"]
    assert [finding.numbers["what"] for finding in source.findings].count("of texts") == 2


def test_only_plain_arithmetic_is_evaluated_in_a_formula(saved):
    good = signal("good", np.arange(4, dtype=np.uint8), 1.0, conversion={"formula": "(X1*3+1)/2"})
    path = saved([good, signal("evil", np.arange(4, dtype=np.uint8), 1.0, conversion={"formula": "where(X1, X1, X1)"})])
    source = survey(path)
    assert list(source.columns) == ["good"]
    what = "defined by the formula 'where(X1, X1, X1)', which is not evaluated"
    assert fact_of(source.findings[0]) == ("column_left_out", {"column": "evil", "what": what})


def test_equal_names_in_two_groups_are_distinguished(saved):
    path = saved([signal("v", [1.0, 2.0], 0.1)], [signal("v", [3.0, 4.0, 5.0], 0.1)])
    columns = survey(path).columns
    assert columns["0/v"].values.tolist() == [1, 2] and columns["1/v"].values.tolist() == [3, 4, 5]


def test_damaged_files_are_one_line_without_output_from_the_library(saved, capfd):
    path = saved([signal("v", np.random.default_rng(1).normal(size=500), 0.001, unit="A")])
    whole = path.read_bytes()
    random = np.random.default_rng(3)
    cases = [whole[:cut] for cut in (9, 70, 200, len(whole) // 2, len(whole) - 1)]
    for _ in range(40):
        wrong = bytearray(whole)
        wrong[int(random.integers(8, len(whole)))] ^= 1 << int(random.integers(8))
        cases.append(bytes(wrong))
    for content in cases:
        path.write_bytes(content)
        try:
            Mdf().columns(path)
        except RecordingError as fault:
            assert "\n" not in str(fault)
    assert capfd.readouterr().err == ""


def test_a_log_that_is_interrupted_while_it_is_opened_prints_nothing(saved, monkeypatch):
    """SIGTERM in the constructor: the destructor of a log without its attributes."""
    path = saved([signal("v", np.arange(9.0), 0.001)])
    seen = []
    monkeypatch.setattr("sys.unraisablehook", seen.append)

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("asammdf.blocks.mdf_v4.MDF4.__init__", interrupted)
    with pytest.raises(KeyboardInterrupt):
        Mdf().columns(path)
    gc.collect()
    assert seen == []
