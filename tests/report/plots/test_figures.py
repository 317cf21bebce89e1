"""Figures show outcomes in plain text, with the same bytes each time."""

from __future__ import annotations

import builtins
from dataclasses import replace

import matplotlib
import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge_alone
from cdtool.base.errors import CdtoolError, OutputError, UsageError
from cdtool.commands.detect import plot as detection_plot
from cdtool.commands.detect.plot import plot_detected
from cdtool.commands.detecting.detection import Detected
from cdtool.detectors.detection import Signal, Status, Verdict
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Recording, Series
from cdtool.report.plots.figures import drawing, new_figure, save
from cdtool.report.plots.latency_plot import latency_figure
from cdtool.report.plots.trigger_plot import trigger_figure
from cdtool.results.traces.trace import ContactOutcome, Trace
from cdtool.thresholds.limit import Limit
from cdtool.truth.matching import match
from tests.report.bench import NAMES, Bench
from tests.report.plots.svg import joined, texts


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


def test_neither_the_users_settings_nor_ours_leak(evaluated, tmp_path):
    save(latency_figure(evaluated), tmp_path / "a.png")
    with matplotlib.rc_context({"text.usetex": True, "savefig.dpi": 30, "lines.linewidth": 9, "savefig.bbox": "tight"}):
        before = dict(matplotlib.rcParams)
        save(latency_figure(evaluated), tmp_path / "b.png")
        assert dict(matplotlib.rcParams) == before
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


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
    detection = judge_alone(operation, "pure_torque", signal, (Limit.given((40.0,)),), Activation())
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
