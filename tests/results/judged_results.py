"""Results with outcomes set by the test."""

from __future__ import annotations

from dataclasses import asdict, replace

from cdtool.results.results import ForceResult, ForceStepResult, Results
from cdtool.truth.force.limits import read_force_limits
from tests.synthetic.builds import build_results

GATE = "en_12453_reducing_gap"
PROFILE = asdict(read_force_limits()[GATE])
KEY = ("momentum", "stiff")


def results(outcomes, verdicts=(), point=None, points=(), **more) -> Results:
    """Contacts of one detector, and one force verdict per contact in the given order."""
    made = build_results({KEY: outcomes}, force_profiles={"stiff": PROFILE} if verdicts or points else {}, **more)
    return replace(
        made, forces=tuple(force(made, i, verdict, point) for i, verdict in enumerate(verdicts)), points=tuple(points)
    )


def force(made: Results, number: int, verdict: str, point: str | None = None) -> ForceResult:
    reason = {"fail": "dynamic: 3600 N where 400 N are allowed", "not_assessable": "residual: the record ends"}
    step = ForceStepResult("dynamic", 0.0, 400.0, 3600.0, 3.1, verdict, reason.get(verdict))
    name = made.contacts[number].recording
    return ForceResult(name, "stiff", 1, GATE, verdict, 3600.0, (step,), point, 3.1, reason.get(verdict))
