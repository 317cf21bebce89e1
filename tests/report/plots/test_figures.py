"""Figures show outcomes in plain text, with the same bytes each time."""

from __future__ import annotations

import builtins

import matplotlib
import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import judge_alone
from cdtool.base.errors import CdtoolError, OutputError, UsageError
from cdtool.commands.detect import plot as detection_plot
from cdtool.commands.detecting.detection import Detected
from cdtool.detectors.detection import Signal
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Recording, Series
from cdtool.report.plots.figures import drawing, save
from cdtool.report.plots.latency_plot import latency_figure
from cdtool.thresholds.limit import Limit
from cdtool.truth.matching import match


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
