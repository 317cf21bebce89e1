"""One line that says in words what a detection's figure shows."""

from __future__ import annotations

from cdtool.plain_text import counted
from cdtool.report.plots.figures import label
from cdtool.workflows.detection import Detected


def outcome_words(found: Detected, alarming: list[int], joints: list[int]) -> str:
    """What became of the contacts, which alarms belong to none, what could not be judged, which joints are drawn."""
    matches = [item for matching in found.matchings for item in matching.matches]
    late = [1e3 * item.latency for item in matches if item.outcome == "detected"]
    words = []
    if len(matches) == 1:
        words.append(f"detected after {late[0]:.0f} ms" if late else matches[0].outcome.replace("_", " "))
    elif matches:
        spread = f" after {min(late):.0f} to {max(late):.0f} ms" if late else ""
        words.append(f"{len(late)} of {counted(len(matches), 'contact')} detected{spread}")
    extra = sum(len(matching.false_alarms) for matching in found.matchings)
    alarms = sum(len(item.verdict.alarms) for item in found.detections)
    if matches and extra:
        words.append(f"{counted(extra, 'false alarm')}")
    elif not matches:
        words.append("no alarm" if not alarms else f"{counted(alarms, 'alarm')}")
    blind = [item for item in found.detections if item.verdict.outcome == "not_assessable"]
    if blind:
        share = f" in {len(blind)} of {len(found.detections)} operations" if len(found.detections) > 1 else ""
        words = [word for word in words if word not in ("no alarm", "not assessable")]
        words.append(f"not assessable{share}: {label(blind[0].verdict.reason, 70)}")
    if len(found.detections) > 1:
        words.append(counted(len(found.detections), "operation"))
    if len(alarming) > len(joints):
        words.append(f"{len(joints)} of {len(alarming)} alarming joints shown")
    elif len(found.joints) > len(joints):
        which = "those that alarm" if alarming else "the leading one"
        words.append(f"{len(joints)} of {len(found.joints)} joints shown: {which}")
    return "  ·  ".join(words)
