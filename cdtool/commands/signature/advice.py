"""What to do with a signature, from the coverage of its runs and the drift of a season."""

from __future__ import annotations

from cdtool.commands.signature.audit import DriftAudit
from cdtool.commands.signature.coverage import Coverage
from cdtool.commands.signature.words import place_of
from cdtool.statistics.trends import LEAST_RUNS


def advice(coverage: Coverage | None, drift: DriftAudit | None) -> str:
    """Return what to do with a signature, the most urgent step first.

    Parameters
    ----------
    coverage : Coverage or None
        What the runs show that it was learned from.
    drift : DriftAudit or None
        What the runs since then show.

    Returns
    -------
    str
        One line.

    Notes
    -----
    Resistance that grows at one location comes before everything: relearned, an obstruction would be normal. Then a
    drift of the whole stroke; too few runs are reported only if neither is shown, because a relearned signature is
    checked again. Alarms without a drift are left to `cdtool explain`. A season that is too short to show a drift is
    not a reason to keep a signature.

    Examples
    --------
    >>> advice(None, None)
    'nothing was assessable'
    """
    if coverage is None and drift is None:
        return "nothing was assessable"
    steps = []
    if drift is not None:
        steps += _inspect(drift)
        if any(item.overall and (item.overall.outward or not item.two_sided) for item in drift.joints):
            steps.append("relearn from the latest runs" if not steps else "then relearn")
        elif drift.alarms and not steps:
            steps.append("analyse the alarms with cdtool explain: no drift is shown")
    if coverage is not None and not coverage.enough and (drift is None or not drift.drifts):
        steps.append(_more(coverage))
    if not steps and coverage is None and drift is not None and not any(item.course.trend for item in drift.joints):
        return f"too few runs for advice: give at least {LEAST_RUNS} new ones, or those learned from"
    return "; ".join(steps) if steps else "keep the signature"


def _inspect(drift: DriftAudit) -> list[str]:
    places = dict.fromkeys(
        place_of(item.local.place, drift.axis, drift.unit)
        for item in drift.joints
        if item.local is not None and item.local.place is not None
    )
    return [f"inspect the machine {' and '.join(places)} before anything is learned"] if places else []


def _more(coverage: Coverage) -> str:
    if coverage.more_runs is None:
        return "raise the safety factor, or add runs and check again"
    return f"add at least {coverage.more_runs} runs, or raise the safety factor"
