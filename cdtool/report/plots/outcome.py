"""One line that says in words what a detection's figure shows."""

from __future__ import annotations

from cdtool.evaluation.truth.matching import Match
from cdtool.plain_text import counted
from cdtool.report.plots.figures import label
from cdtool.workflows.detection import Detected


def outcome_words(found: Detected, alarming: list[int], joints: list[int]) -> str:
    """Return what became of the contacts and alarms, what could not be judged, and which joints are drawn.

    Parameters
    ----------
    found : Detected
        The log with what the detector says of each of its operations.
    alarming, joints : list of int
        The columns of the joints that alarm, and of those that are drawn.

    """
    matches = [item for matching in found.matchings for item in matching.matches]
    words = _words_of_contacts(matches) + _words_of_alarms(found, bool(matches))
    blind = _words_of_unjudged(found)
    if blind:
        words = [word for word in words if word not in ("no alarm", "not assessable")]
    operations = [counted(len(found.detections), "operation")] if len(found.detections) > 1 else []
    return "  ·  ".join([*words, *blind, *operations, *_words_of_joints(found, alarming, joints)])


def _words_of_contacts(matches: list[Match]) -> list[str]:
    late = [1e3 * item.latency for item in matches if item.outcome == "detected"]
    if not matches:
        return []
    if len(matches) == 1:
        return [f"detected after {late[0]:.0f} ms" if late else matches[0].outcome.replace("_", " ")]
    spread = f" after {min(late):.0f} to {max(late):.0f} ms" if late else ""
    return [f"{len(late)} of {counted(len(matches), 'contact')} detected{spread}"]


def _words_of_alarms(found: Detected, has_contacts: bool) -> list[str]:
    """Beside contacts only the alarms that belong to none are worth a word."""
    if has_contacts:
        extra = sum(len(matching.false_alarms) for matching in found.matchings)
        return [counted(extra, "false alarm")] if extra else []
    alarms = sum(len(item.verdict.alarms) for item in found.detections)
    return [counted(alarms, "alarm") if alarms else "no alarm"]


def _words_of_unjudged(found: Detected) -> list[str]:
    unjudged = [item for item in found.detections if item.verdict.outcome == "not_assessable"]
    if not unjudged:
        return []
    operations = len(found.detections)
    share = f" in {len(unjudged)} of {operations} operations" if operations > 1 else ""
    return [f"not assessable{share}: {label(unjudged[0].verdict.reason, 70)}"]


def _words_of_joints(found: Detected, alarming: list[int], joints: list[int]) -> list[str]:
    if len(alarming) > len(joints):
        return [f"{len(joints)} of {len(alarming)} alarming joints shown"]
    if len(found.joints) > len(joints):
        which = "those that alarm" if alarming else "the leading one"
        return [f"{len(joints)} of {len(found.joints)} joints shown: {which}"]
    return []
