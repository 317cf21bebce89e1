"""The likely cause of an alarm in a sentence."""

from __future__ import annotations

import math

from cdtool.evaluation.explanation.cause import Cause, CauseKind, Shift
from cdtool.evaluation.explanation.explanation import AlarmExplanation
from cdtool.evaluation.explanation.transient import Transient

_SENSOR = {
    CauseKind.SPEED_GLITCH: ("a glitch of the speed sensor", "the position shows no such motion"),
    CauseKind.TORQUE_SPIKE: ("a spike of the torque or motor current", "the speed did not answer"),
    CauseKind.KNOCK: ("a knock on the accelerometer", "neither speed nor torque departed"),
}


def cause_words(item: AlarmExplanation) -> list[str]:
    """The likely cause with its evidence in numbers."""
    return [f"Likely cause: {_told(item.cause, item)}."]


def _told(cause: Cause, item: AlarmExplanation) -> str:
    if cause.transient is not None:
        what, why = _SENSOR[cause.kind]
        return f"{what}: {_transient(cause.transient, item)}, and {why}"
    if cause.loss is not None:
        loss = cause.loss
        count = "1 sample" if loss.samples == 1 else f"{loss.samples} samples"
        return (
            f"lost samples: about {count} of {loss.channel} missing from {loss.start:.3f} to {loss.end:.3f} s, "
            f"{_before(item.alarm.time - loss.end)}, and nothing else explains it"
        )
    shifts = "; ".join(_shift(shift, item.absent is None) for shift in cause.shifts)
    if cause.kind is CauseKind.CONTACT:
        return f"a contact: {shifts}; both stayed off"
    if cause.kind is CauseKind.FRICTION:
        return f"a change of friction: {shifts}; the torque stayed off, the speed did not"
    if cause.kind is CauseKind.COMMAND:
        return f"a changed command: {shifts}"
    return "not clear"


def _shift(shift: Shift, learned: bool) -> str:
    """Only what was learned is called normal."""
    unit = f" {shift.unit}" if shift.unit not in ("", "1") else ""
    before = f"where {shift.normal:.4g} is normal" if learned else f"after {shift.normal:.4g} before it"
    return f"{shift.channel} of {shift.joint} {shift.value:.4g}{unit} {before}"


def _transient(found: Transient, item: AlarmExplanation) -> str:
    unit = f" {found.unit}" if found.unit not in ("", "1") else ""
    lasted = max(1e3 * (found.end - found.start), 0.0)
    rings = " to either side" if found.rings else ""
    when = _before(item.alarm.time - found.start)
    return f"{found.channel} of {found.joint} off by {found.height:+.3g}{unit}{rings} for {lasted:.0f} ms, {when}"


def _before(seconds: float) -> str:
    late = round(1e3 * seconds) if math.isfinite(seconds) else 0
    return f"{late} ms before the alarm" if late > 0 else "at the alarm"
