"""The figure of an alarm or a missed contact: its texts, and the same bytes each time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import judge_alone
from cdtool.commands.explain.margin_plot import plot_explanation
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.results.explanation.explanation import explain_operation
from cdtool.thresholds.limit import Limit
from cdtool.truth.matching import match

TIME = np.arange(4000) * 1e-3
CONTACT = Contact(2.0, 2.4, 0.001)
Drawn = Callable[..., str]


@pytest.fixture
def drawn(tmp_path: Path) -> Drawn:
    """drawn(limit, ...): every text of the figure of the first event, line by line."""

    def draw(
        limit: float,
        name: str = "log",
        contacts: tuple[Contact, ...] = (CONTACT,),
        blind: bool = False,
        path: str = "why.svg",
    ) -> str:
        rng = np.random.default_rng(2)
        noise = rng.normal(size=(3, len(TIME)))
        hit = np.clip(TIME - 2.0, 0.0, 0.3)
        channels = {
            "torque": Series(TIME, 5.0 + 0.1 * noise[0] + 30.0 * np.clip(TIME - 2.1, 0.0, 0.2), "N m"),
            "speed": Series(TIME, 0.2 + 1e-3 * noise[1] - 2.0 * np.clip(TIME - 2.02, 0.0, 0.1), "rad/s"),
            "reference_speed": Series(TIME, np.full(len(TIME), 0.2), "rad/s"),
            "force": Series(TIME, 1000.0 * hit, "N"),
        }
        recording = Recording(name, name, ("hip",), channels)
        status = np.zeros((len(TIME), 1), dtype=np.uint8)
        status[1990:] = Status.GAP if blind else Status.VALID
        signal = Signal(TIME, (0.1 * noise[2] + 10.0 * hit).reshape(-1, 1), status, "N m", joints=("hip",))
        operation = Operation(recording, MotionClass(1, 0.2))
        detection = judge_alone(operation, "momentum", signal, [Limit.given((limit,))], Activation(9))
        matching = match(detection.verdict, contacts, detection.statistic)
        (event, *_) = explain_operation(detection, matching, Activation(9), ("torque", "speed"))
        plot_explanation(detection, event, tmp_path / path)
        if not path.endswith(".svg"):
            return ""
        texts = ElementTree.parse(tmp_path / path).iter("{http://www.w3.org/2000/svg}text")
        return "\n".join("".join(item.itertext()) for item in texts)

    return draw


def test_an_alarm_shows_channels_in_order_signal_margin_onset_and_debounce(drawn):
    shown = drawn(1.0)
    assert "after the contact (onset at 2.000 s, load cell)" in shown
    order = [shown.index(name) for name in ("load cell", "speed", "torque", "margin to limit")]
    assert order == sorted(order)
    for expected in ("+20 ms", "outside for 9 samples", "contact onset", "alarm", "normal band", "read by momentum"):
        assert expected in shown, expected
    assert "time from contact onset [ms]" in shown
    assert "reference_speed" not in shown  # it neither moved nor does the detector read it
