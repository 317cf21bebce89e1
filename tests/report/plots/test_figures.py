"""Figures show outcomes in plain text, with the same bytes each time."""

from __future__ import annotations

import builtins
import json
import re
from dataclasses import replace
from importlib.resources import files
from math import nan

import matplotlib
import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge
from cdtool.base.errors import CdtoolError, OutputError, UsageError
from cdtool.commands.detect import plot as detection_plot
from cdtool.commands.detect.plot import plot_detected
from cdtool.commands.detecting.detection import Detected
from cdtool.detectors.detection import REASONS, Signal, Status, Verdict
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.report.html.plots import plot_data
from cdtool.report.plots import trigger_plot
from cdtool.report.plots.figures import drawing, new_figure, save
from cdtool.report.plots.latency_plot import latency_figure
from cdtool.report.plots.style import HATCHES, look_of
from cdtool.report.plots.trigger_plot import trigger_figure
from cdtool.report.writers.base import Report
from cdtool.results.traces.trace import ContactOutcome, Trace, make_trace
from cdtool.thresholds.limit import Limit
from cdtool.truth.matching import Matching, match
from tests.report.bench import NAMES, Bench
from tests.report.html.html_case import case
from tests.report.plots.svg import assert_within, joined, texts


@pytest.fixture
def six_joints() -> Detected:
    """A log of 6 joints with hand-set limits of which joints 1 and 3 are exceeded; joint 4 is not watched."""
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 10.0, 2e-3)
    torque = rng.normal(0.0, 1.0, (len(time), 6))
    torque[2500:2600, [1, 3]] += 60.0
    names = tuple(f"joint_{i}" for i in range(6))
    channels = {"torque": Series(time, torque, "N m"), "speed": Series(time, np.ones((len(time), 6)), "rad/s")}
    recording = Recording("arm", "arm.csv", names, channels)
    status = np.zeros(torque.shape, dtype=np.uint8)
    status[1000:1200] = Status.GAP
    statistic, band = Limit.given((40, 40, 40, 40, float("inf"), 40)).evaluate(
        recording, Signal(time, torque, status, "N m", joints=names)
    )
    alarms, _ = Activation().alarms(statistic, band)
    assert {alarm.column for alarm in alarms} == {1, 3}
    operation = operations_of(recording)[0]
    return Detected(
        recording,
        (Detection(operation, "pure_torque", statistic, band, Verdict("alarm", alarms)),),
        (),
        (Matching((), alarms),),
        "limit 40 N m set by hand",
    )


def test_a_detection_names_latency_alarm_onset_and_what_was_not_assessable(bench: Bench, simulated, tmp_path):
    found = bench.detected(simulated("stiff", 1), "friction_ekf")
    (alarm, *_), (hit, *_) = found.detections[0].verdict.alarms, found.contacts
    plot_detected(found, tmp_path / "a.svg")
    shown = joined(tmp_path / "a.svg")
    assert f"latency {1e3 * (alarm.time - hit.start):.0f} ms" in shown
    assert f"alarm {alarm.time:.3f} s" in shown
    assert f"onset {hit.start:.3f} s" in shown
    for expected in (
        "stiff1",
        "friction_ekf",
        "not assessable: start-up",
        "load cell [N]",
        "trigger",
        "signal [N s/m]",
    ):
        assert expected in shown
    assert "time from contact onset [ms]" in shown


def test_a_run_without_alarm_has_neither_zoom_nor_latency(bench: Bench, simulated, tmp_path):
    plot_detected(bench.detected(simulated("none", 77), "momentum"), tmp_path / "a.svg")
    shown = joined(tmp_path / "a.svg")
    assert "no alarm" in shown
    assert "time [s]" in shown
    assert "latency" not in shown
    assert "[ms]" not in shown


def with_detection(found: Detected, detection: Detection) -> Detected:
    """Return the log with another detection, matched with its contacts."""
    matching = match(detection.verdict, found.contacts, detection.statistic)
    return replace(found, detections=(detection,), matchings=(matching,))


def test_a_missed_and_a_not_assessable_contact_have_different_words(bench: Bench, simulated, tmp_path):
    found = bench.detected(simulated("stiff", 1), "momentum")
    detection = found.detections[0]
    silent = replace(detection, verdict=Verdict("no alarm"))
    plot_detected(with_detection(found, silent), tmp_path / "missed.svg")
    assert "missed" in joined(tmp_path / "missed.svg")
    assert "not assessable: missing samples" not in joined(tmp_path / "missed.svg")
    status = np.full_like(detection.statistic.status, Status.GAP)
    blind = replace(
        detection,
        statistic=replace(detection.statistic, status=status),
        verdict=Verdict("not_assessable", reason="missing samples 100 %"),
    )
    plot_detected(with_detection(found, blind), tmp_path / "blind.svg")
    shown = joined(tmp_path / "blind.svg")
    assert "not assessable: missing samples 100 %" in shown
    assert "missed" not in shown


def test_only_the_joints_that_alarm_are_drawn_and_the_others_are_counted(six_joints, tmp_path):
    plot_detected(six_joints, tmp_path / "a.svg")
    shown = joined(tmp_path / "a.svg")
    assert "joint_1" in shown
    assert "joint_3" in shown
    assert "joint_0" not in shown
    assert "2 of 6 joints shown: those that alarm" in shown
    assert "not assessable: missing samples" in shown
    assert "load cell" not in shown


def missed_by(trace: Trace, name: str) -> Trace:
    """The same with nothing noticed by one detector."""
    panels = tuple(
        replace(panel, seen=(ContactOutcome("missed"),), alarms=(), verdict="no alarm")
        if panel.detector == name
        else panel
        for panel in trace.panels
    )
    return replace(trace, panels=panels)


def test_triggers_are_ordered_by_latency_with_missed_and_not_assessable_last(bench: Bench, simulated, tmp_path):
    trace = missed_by(bench.trace(simulated("stiff", 2), "stiff"), "pure_inertia")
    save(trigger_figure(trace), tmp_path / "a.svg")
    shown = texts(tmp_path / "a.svg")
    order = [next(i for i, text in enumerate(shown) if text.startswith(name)) for name in NAMES]
    by_name = dict(zip(NAMES, order, strict=True))
    assert sorted(NAMES, key=by_name.__getitem__) == ["friction_ekf", "momentum", "pure_torque", "pure_inertia"]
    late = {panel.detector: panel.seen[0].late for panel in trace.panels}
    for name in ("friction_ekf", "momentum", "pure_torque"):
        assert f"{1e3 * late[name]:.0f} ms" in shown
    assert "missed" in shown


def test_the_row_of_a_detector_that_could_not_assess_the_contact_states_this(bench: Bench, simulated, tmp_path):
    trace = bench.trace(simulated("stiff", 2), "stiff", ("momentum",))
    blind = replace(trace.panels[0], seen=(ContactOutcome("not_assessable", nan, nan, "the axis stands still"),))
    save(trigger_figure(replace(trace, panels=(blind,))), tmp_path / "a.svg")
    shown = texts(tmp_path / "a.svg")
    assert "not assessable" in shown and "the axis stands still" in shown
    assert not any(text.endswith(" ms") for text in shown)


def test_a_trace_without_a_load_cell_has_only_rows_of_detectors(bench: Bench, simulated):
    trace = bench.trace(simulated("stiff", 2), "stiff")
    with drawing():
        assert len(trigger_plot.trigger_figure(trace).axes) == len(NAMES) + 1
        figure = trigger_plot.trigger_figure(replace(trace, force_time=np.empty(0), force=np.empty(0)))
    assert len(figure.axes) == len(NAMES)


def test_triggers_of_a_run_without_contact_state_this(bench: Bench, simulated, tmp_path):
    save(trigger_figure(bench.trace(simulated("none", 77), "holdout")), tmp_path / "a.svg")
    shown = texts(tmp_path / "a.svg")
    assert shown.count("no alarm") == len(NAMES)
    assert any("no contact" in text for text in shown)


def test_neither_the_users_settings_nor_ours_leak(evaluated, tmp_path):
    save(latency_figure(evaluated), tmp_path / "a.png")
    with matplotlib.rc_context({"text.usetex": True, "savefig.dpi": 30, "lines.linewidth": 9, "savefig.bbox": "tight"}):
        before = dict(matplotlib.rcParams)
        save(latency_figure(evaluated), tmp_path / "b.png")
        assert dict(matplotlib.rcParams) == before
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_nothing_is_clipped_where_panels_of_several_joints_are_drawn(six_joints):
    with drawing():
        recording = replace(six_joints.recording, name="n" * 300)
        assert_within(detection_plot._figure(replace(six_joints, recording=recording)))


def test_a_figure_that_cannot_be_written_is_an_error_with_a_hint(evaluated, tmp_path):
    with pytest.raises(CdtoolError, match="no folder") as fault:
        save(latency_figure(evaluated), tmp_path / "no" / "a.png")
    assert "create the folder first" in fault.value.hint
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(CdtoolError) as fault:
        save(latency_figure(evaluated), tmp_path / "folder.png")
    assert "is a folder" in fault.value.message
    with pytest.raises(UsageError, match=r"a\.gif") as fault:
        save(latency_figure(evaluated), tmp_path / "a.gif")
    assert ".svg" in fault.value.hint
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]


def test_a_failed_write_leaves_the_old_file_and_no_temporary_file(tmp_path, monkeypatch):
    target = tmp_path / "a.png"
    target.write_bytes(b"old")

    def fail(*args: object, **kwargs: object) -> None:
        raise OSError(28, "No space left on device")

    with drawing():
        figure = new_figure(2.0, 2.0)
        monkeypatch.setattr("cdtool.base.files.writing.os.fsync", fail)
        with pytest.raises(CdtoolError, match="No space left"):
            save(figure, target)
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_detector_looks_the_same_everywhere_and_known_ones_differ():
    assert len({look_of(name).colour for name in (*NAMES, "inertial_momentum")}) == 5
    assert len({look_of(name).marker for name in (*NAMES, "inertial_momentum")}) == 5
    assert look_of("someone's plug-in") == look_of("someone's plug-in")


@pytest.fixture
def five_alarms() -> Detected:
    """A log of one axis whose signal leaves its limit five times, a second apart."""
    time = np.arange(0.0, 10.0, 2e-3)
    torque = np.zeros((len(time), 1))
    for start in (1.0, 2.0, 3.0, 4.0, 5.0):
        torque[(time >= start) & (time < start + 0.1)] = 60.0
    channels = {"torque": Series(time, torque, "N m"), "speed": Series(time, np.ones((len(time), 1)), "rad/s")}
    recording = Recording("axis", "axis.csv", ("axis",), channels)
    (operation,) = operations_of(recording)
    signal = Signal(time, torque, np.zeros(torque.shape, dtype=np.uint8), "N m", joints=("axis",))
    detection = judge(operation, "pure_torque", signal, (Limit.given((40.0,)),), Activation())
    return Detected(recording, (detection,), (), (match(detection.verdict, (), detection.statistic),), "limit 40 N m")


def test_the_trigger_panel_rises_and_falls_with_each_of_five_alarms(five_alarms):
    verdict = five_alarms.detections[0].verdict
    assert len(verdict.alarms) == 5
    with drawing():
        figure = detection_plot._figure(five_alarms)
    (panel,) = {axes for axes in figure.axes if axes.get_ylabel() == "trigger"}
    step, raised, again = panel.lines[:3]
    at, level = (np.asarray(values) for values in step.get_data())
    assert np.count_nonzero(np.diff(level) > 0) == np.count_nonzero(np.diff(level) < 0) == 5
    assert at[1:][np.diff(level) > 0] == pytest.approx([alarm.time for alarm in verdict.alarms])
    assert at[1:][np.diff(level) < 0] == pytest.approx(verdict.rearmed)
    assert len(raised.get_xdata()) == len(again.get_xdata()) == 5


def test_alarms_of_several_joints_are_one_trigger_with_a_mark_for_each(six_joints):
    with drawing():
        figure = detection_plot._figure(six_joints)
    panel = next(axes for axes in figure.axes if axes.get_ylabel() == "trigger")
    level = np.asarray(panel.lines[0].get_ydata())
    assert np.count_nonzero(np.diff(level) > 0) == 1
    assert len(panel.lines[1].get_xdata()) == len(six_joints.detections[0].verdict.alarms) == 2


def test_the_triggers_of_all_detectors_are_shaded_from_each_alarm_until_it_is_re_armed(five_alarms, tmp_path):
    (detection,), (matching,) = five_alarms.detections, five_alarms.matchings
    trace = make_trace("free", detection.operation, (), (detection,), (matching,))
    assert trace.panels[0].rearmed == detection.verdict.rearmed
    with drawing():
        axes = trigger_plot.trigger_figure(trace).axes[0]
    shaded = [patch.get_extents().transformed(axes.transData.inverted()) for patch in axes.patches]
    held = sorted((box.x0, box.x1) for box in shaded if 0.0 < box.width < 2.0)
    assert [start for start, _ in held] == pytest.approx([alarm.time for alarm in detection.verdict.alarms])
    assert [end for _, end in held] == pytest.approx(detection.verdict.rearmed)


def test_every_reason_for_not_assessable_has_a_hatch_and_a_name_in_the_page():
    assert set(HATCHES) == set(REASONS)
    assert len(set(HATCHES.values())) == len(HATCHES)
    named = json.loads(json.dumps(plot_data(Report(*case()))["reasons"]))
    assert named == {str(int(code)): text for code, text in REASONS.items()}
    script = (files("cdtool.report.html") / "page_files" / "trace.js").read_text(encoding="utf-8")
    drawn = dict(re.findall(r'(\d): "(M[^"]+)"', script.split("const HATCHES = {")[1].split("}")[0]))
    assert set(drawn) == set(named) and len(set(drawn.values())) == len(drawn)


def test_a_contact_that_is_detected_during_an_earlier_alarm_begins_its_own_interval(five_alarms):
    (detection,), (matching,) = five_alarms.detections, five_alarms.matchings
    trace = make_trace("stiff", detection.operation, (), (detection,), (matching,))
    first, again = detection.verdict.alarms[0].time, detection.verdict.rearmed[0]
    hit = Contact(first + 0.2, first + 0.3, 100.0)
    panel = replace(trace.panels[0], seen=(ContactOutcome("detected", 0.1, first + 0.3),))
    trace = replace(trace, contacts=(hit,), contact=0, panels=(panel,), view=(first - 0.1, first + 2.0))
    spans = trigger_plot._triggers(trace, panel, trace.view)
    assert np.ravel(sorted(spans)[:2]) == pytest.approx([first, first + 0.3, first + 0.3, again])


def test_without_any_writable_folder_for_matplotlib_one_line_names_the_setting(monkeypatch):
    """As in a container with a read-only file system: matplotlib raises while it is imported."""
    imported = builtins.__import__

    def read_only(name, *rest):
        if name == "matplotlib":
            raise OSError("Matplotlib requires access to a writable cache directory")
        return imported(name, *rest)

    monkeypatch.setattr(builtins, "__import__", read_only)
    with pytest.raises(OutputError, match="no writable folder") as fault, drawing():
        pass
    assert "MPLCONFIGDIR" in fault.value.hint
