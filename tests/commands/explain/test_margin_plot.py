"""The figure of an alarm or a missed contact: its texts, and the same bytes each time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import judge
from cdtool.base.errors import UsageError
from cdtool.commands.explain.margin_plot import plot_explanation
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.results.explanation.explanation import explain_operation
from cdtool.thresholds.limit import Limit
from cdtool.truth.matching import match
from tests.report.hostile import HOSTILE

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
        detection = judge(operation, "momentum", signal, [Limit.given((limit,))], Activation(9))
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


def test_a_missed_contact_has_a_mark_where_the_signal_was_nearest_to_its_limit(drawn):
    shown = drawn(50.0)
    assert "missed: no alarm within 1000 ms" in shown and "nearest, " in shown
    assert "outside for" not in shown and "\nalarm\n" not in shown


def test_an_alarm_without_a_contact_counts_from_the_alarm(drawn):
    shown = drawn(1.0, contacts=())
    assert "false alarm at" in shown and "time from alarm [ms]" in shown
    assert "load cell [" not in shown and "contact onset" not in shown


def test_samples_not_assessable_are_hatched_and_have_no_margin(drawn):
    shown = drawn(1.0, blind=True)
    assert "not assessable: missing samples 100 %" in shown
    assert "nearest" not in shown


def test_the_same_event_gives_the_same_bytes_in_every_format(drawn, tmp_path):
    for suffix in (".png", ".svg", ".pdf"):
        for name in ("a", "b"):
            drawn(1.0, path=f"{name}{suffix}")
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes(), suffix
    with pytest.raises(UsageError, match=r"a\.gif"):
        drawn(1.0, path="a.gif")


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_name_is_drawn_plainly_and_shortened(drawn, kind):
    shown = drawn(1.0, name=HOSTILE[kind])
    assert "momentum" in shown
    assert "\x1b" not in shown and "\u202e" not in shown and "n" * 100 not in shown
