"""ULog files of PX4: topics with their clocks and instances, dropouts, damage."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import choose_format, read_as_logged, survey
from cdtool.formats.containers.ulog import Ulog
from tests.base.findings.facts import fact_of
from tests.command import cdtool
from tests.synthetic.ulog import CODES, UlogFile

pytest.importorskip("pyulog")


def flight(rows: int = 50) -> UlogFile:
    """An attitude at 250 Hz and two accelerometers at 1 kHz, the second 0.3 ms later."""
    log = UlogFile().info("sys_name", "PX4").parameter("MC_ROLL_P", 6.5)
    log.format("vehicle_attitude", "uint64_t timestamp;float[4] q;uint8_t quat_reset_counter;uint8_t[3] _padding0;")
    log.format("sensor_accel", "uint64_t timestamp;double x;int32_t device_id;")
    log.subscribe(0, "vehicle_attitude").subscribe(1, "sensor_accel").subscribe(2, "sensor_accel", 1)
    log.data(0, "QffffB", ((1_000_000 + 4000 * i, 1.0, 0.5 * i, 0.0, -0.25 * i, i % 256) for i in range(rows)))
    log.data(1, "Qdi", ((1_000_000 + 1000 * i, 0.1 * i, 7) for i in range(4 * rows)))
    return log.data(2, "Qdi", ((1_000_300 + 1000 * i, -0.1 * i, 8) for i in range(4 * rows)))


def kinds(source) -> list[type]:
    return [finding.kind for finding in source.findings]


def test_a_column_is_a_topic_and_a_field_on_the_clock_of_its_topic(tmp_path):
    path = flight().text(1_100_000, "armed").write(tmp_path / "log.ulg")
    source = survey(path)
    assert choose_format(path).name == source.format == "ulog"
    attitude = [f"vehicle_attitude/q[{i}]" for i in range(4)] + ["vehicle_attitude/quat_reset_counter"]
    accel = [f"sensor_accel{i}/{name}" for i in ("", "[1]") for name in ("x", "device_id")]
    assert set(source.columns) == {*attitude, *accel} and source.findings == ()
    q = source.columns["vehicle_attitude/q[1]"]
    assert q.values.tolist() == [0.5 * i for i in range(50)]
    np.testing.assert_allclose(q.time, 1.0 + 0.004 * np.arange(50), rtol=0.0, atol=1e-12)
    second = source.columns["sensor_accel[1]/x"]
    assert second.values[3] == -0.1 * 3 and second.time[0] == pytest.approx(1.0003, abs=1e-12)
    assert source.details == {"sys_name": "PX4", "parameters": "1", "logged texts": "1"}


FIELDS = st.lists(
    st.tuples(st.sampled_from(sorted(CODES.keys() - {"char"})), st.integers(0, 4)), min_size=1, max_size=6
)


@settings(max_examples=40, deadline=None)
@given(fields=FIELDS, rows=st.integers(1, 20), seed=st.integers(0, 2**32 - 1))
def test_numbers_of_any_type_and_array_are_read_as_written(tmp_path_factory, fields, rows, seed):
    text, layout, names = "uint64_t timestamp;", "Q", []
    for i, (kind, size) in enumerate(fields):
        text += f"{kind}{f'[{size}]' if size else ''} f{i};"
        layout += CODES[kind] * max(1, size)
        names += [f"t/f{i}[{k}]" for k in range(size)] or [f"t/f{i}"]
    record = np.dtype(
        [(str(i), "<?" if code == "?" else f"<{np.dtype(code).str[1:]}") for i, code in enumerate(layout)]
    )
    raw = np.random.default_rng(seed).integers(0, 2, (rows, record.itemsize), dtype=np.uint8).tobytes()
    table = np.frombuffer(raw, record)
    log = UlogFile().format("t", text).subscribe(3, "t").data(3, layout, table.tolist())
    source = Ulog().columns(log.write(tmp_path_factory.mktemp("ulog") / "log.ulg"))
    assert list(source.columns) == names
    for i, name in enumerate(names, 1):
        np.testing.assert_array_equal(source.columns[name].values, table[str(i)].astype(np.float64))


def test_messages_inside_of_messages_are_fields_with_a_point(tmp_path):
    log = UlogFile().format("esc_report", "float rpm;float current;")
    log.format("esc_status", "uint64_t timestamp;esc_report[2] esc;uint8_t count;")
    log.subscribe(0, "esc_status").data(0, "QffffB", ((1000 * i, 10.0 * i, 1.0, 20.0 * i, 2.0, 2) for i in range(9)))
    source = survey(log.write(tmp_path / "log.ulg"))
    assert source.names == (
        *(f"esc_status/esc[{i}].{name}" for i in range(2) for name in ("rpm", "current")),
        "esc_status/count",
    )
    assert source.columns["esc_status/esc[1].rpm"].values[4] == 80.0


def test_texts_and_topics_without_time_stamps_are_named(tmp_path):
    log = UlogFile().format("a", "uint64_t timestamp;char[4] words;float v;").format("b", "float v;")
    log.subscribe(0, "a").subscribe(1, "b").data(0, "Q4sf", [(1, b"abcd", 2.0), (2, b"abcd", 3.0)]).data(
        1, "f", [(1.0,)]
    )
    source = survey(log.write(tmp_path / "log.ulg"))
    assert source.names == ("a/v",)
    assert sorted(map(fact_of, source.findings), key=str) == [
        ("column_left_out", {"column": "a/words", "what": "a text"}),
        ("column_left_out", {"column": "b", "what": "a topic without time stamps"}),
    ]


def test_large_integers_are_reported_and_a_clock_since_1970_is_exact(tmp_path):
    start = 1_700_000_000_123_456
    log = UlogFile(start).format("a", "uint64_t timestamp;uint64_t n;").subscribe(0, "a")
    source = survey(log.data(0, "QQ", ((start + 125 * i, 2**63 + i) for i in range(9))).write(tmp_path / "log.ulg"))
    assert source.columns["a/n"].time.tolist() == pytest.approx([125e-6 * i for i in range(9)], abs=1e-15)
    assert source.origin == pytest.approx(start * 1e-6) and kinds(source) == ["rounded_integers"]


def test_dropouts_of_the_logger_are_a_loss(tmp_path):
    source = survey(flight().dropout(20).dropout(300).write(tmp_path / "log.ulg"))
    (finding,) = source.findings
    assert finding.severity == "loss" and fact_of(finding) == (
        "logger_dropouts",
        {"count": 2, "total": 0.32, "longest": 0.3},
    )


def test_a_machine_file_maps_topics_on_their_own_clocks(tmp_path, machine):
    path = flight().write(tmp_path / "log.ulg")
    mapped = machine(
        '[channels]\ntime = { column = "time", unit = "s" }\n'
        'speed = { column = "vehicle_attitude/q[1]", unit = "rad/s" }\n'
        'acceleration = { column = "sensor_accel[1]/x", unit = "m/s2" }\n'
    )
    recording = read_as_logged(path, mapped).recording
    assert len(recording["speed"]) == 50 and len(recording["acceleration"]) == 200


def test_commands_read_a_log(tmp_path):
    path = flight().write(tmp_path / "log.ulg")
    assert "vehicle_attitude/q[3]" in cdtool("info", path).out
    assert cdtool("convert", path, tmp_path / "log.mcap").status == 0
    assert cdtool("init", path, "-o", tmp_path / "machine.toml").status == 0


# --- Damaged and hostile files


def test_a_file_that_ends_within_a_message_is_a_loss_and_one_that_ends_after_it_is_whole(tmp_path):
    whole = flight().content
    last = 3 + 2 + 20  # the last message: header, number, values
    path = tmp_path / "log.ulg"
    for cut in (1, last - 3, last - 1):
        path.write_bytes(whole[:-cut])
        source = survey(path)
        assert [fact_of(finding) for finding in source.findings] == [("cut_within_message", {"size": last - cut})]
        assert len(source.columns["sensor_accel[1]/x"].values) == 199
    path.write_bytes(whole[:-last])
    assert survey(path).findings == ()


def test_a_file_that_is_cut_anywhere_is_one_line_or_reports_its_loss(tmp_path):
    whole, path = flight(5).content, tmp_path / "log.ulg"
    rows = len(survey(flight(5).write(path)).columns["sensor_accel[1]/x"].values)
    for size in range(1, len(whole), 23):
        path.write_bytes(whole[:size])
        try:
            source = Ulog().columns(path)
        except RecordingError as fault:
            assert "\n" not in str(fault)
        else:
            assert all(len(column.values) <= rows for column in source.columns.values())


def test_damaged_bytes_are_reported_or_change_numbers_only(tmp_path, capfd):
    whole, path, random = flight(20).content, tmp_path / "log.ulg", np.random.default_rng(8)
    reported = 0
    for _ in range(80):
        wrong = bytearray(whole)
        for _ in range(2):
            wrong[int(random.integers(16, len(whole)))] = int(random.integers(256))
        path.write_bytes(wrong)
        try:
            source = Ulog().columns(path)
        except RecordingError as fault:
            assert "\n" not in str(fault)
        else:
            reported += "messages_damaged" in kinds(source)
    assert reported
    assert capfd.readouterr().out == ""


def test_messages_after_a_damaged_one_are_read_from_the_next_mark(tmp_path):
    log = flight(10).sync()
    damaged = len(log.content)
    log.data(1, "Qdi", ((2_000_000 + 1000 * i, 5.0, 7) for i in range(4))).sync()
    log.data(1, "Qdi", ((3_000_000 + 1000 * i, 6.0, 7) for i in range(4)))
    wrong = bytearray(log.content)
    wrong[damaged : damaged + 3] = b"\x10\x00\x00"
    path = tmp_path / "log.ulg"
    path.write_bytes(wrong)
    source = survey(path)
    assert "messages_damaged" in kinds(source) and 6.0 in source.columns["sensor_accel/x"].values


def test_a_message_that_is_longer_than_its_file_is_read_once(tmp_path):
    """pyulog goes back by the 150 bytes that the message declares: it left the file, or read its end for ever."""
    path = UlogFile().format("a", "uint64_t timestamp;float v;").write(tmp_path / "log.ulg")
    path.write_bytes(path.read_bytes() + bytes(200) + b"\x96\x00\x00" + bytes(20))
    with pytest.raises(RecordingError, match="has no column of numbers"):
        survey(path)


def test_definitions_that_multiply_without_end_are_refused(tmp_path):
    log = UlogFile().format("a0", "uint64_t timestamp;float v;")
    for i in range(1, 40):
        log.format(f"a{i}", f"a{i - 1} x;a{i - 1} y;")
    with pytest.raises(RecordingError, match="has more than 20000 fields: refused"):
        survey(log.subscribe(0, "a39").write(tmp_path / "log.ulg"))
    itself = UlogFile().format("a", "uint64_t timestamp;b x;").format("b", "a x;").subscribe(0, "a")
    with pytest.raises(RecordingError, match="damaged or not a ULog file: RecursionError"):
        survey(itself.write(tmp_path / "log.ulg"))
    wide = UlogFile().format("a", "uint64_t timestamp;float[65535] x;").subscribe(0, "a")
    with pytest.raises(RecordingError, match="has more than 20000 fields: refused"):
        survey(wide.write(tmp_path / "log.ulg"))


def test_a_log_without_a_message_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="has no column of numbers"):
        survey(UlogFile().format("a", "uint64_t timestamp;float v;").subscribe(0, "a").write(tmp_path / "log.ulg"))
