"""Why a repetition was not run as planned: its speed before the contact differs, or is missing in a logged channel."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from cdtool.commands.protocol.assessment.plan import MeasuringPoint
from cdtool.commands.protocol.assessment.reasons import Reason, ReasonKind, Value


def speed_reasons(point: MeasuringPoint, speeds: Sequence[tuple[str, float | None]]) -> Iterator[Reason]:
    """Yield the repetitions whose speed is not the planned one.

    Parameters
    ----------
    point : MeasuringPoint
        The point of the plan, with its speed [m/s] and tolerance; without a planned speed nothing is compared.
    speeds : sequence of (str, float or None)
        The recording of each repetition and the speed just before the contact [m/s]; NaN: its samples are missing,
        None: it was not measured, which the plan does not require.

    Yields
    ------
    Reason
        With the point, the repetition, and both speeds.

    Examples
    --------
    >>> point = MeasuringPoint(name="edge", speed_m_per_s=0.2)
    >>> speeds = [("1.csv", 0.21), ("2.csv", 0.1), ("3.csv", None)]
    >>> [reason.values["measured"] for reason in speed_reasons(point, speeds)]
    [0.1]
    """
    planned = point.speed_m_per_s
    if not planned:
        return
    for number, (recording, speed) in enumerate(speeds, 1):
        if speed is None:
            continue
        about: dict[str, Value] = {
            "point": point.name,
            "repetition": number,
            "recording": recording,
            "planned": planned,
        }
        if math.isnan(speed):
            yield Reason(ReasonKind.SPEED_MISSING, about, due="test_day")
        elif abs(speed - planned) > point.speed_tolerance * planned * (1.0 + 1e-9):
            values: dict[str, Value] = {**about, "measured": speed, "tolerance": 100.0 * point.speed_tolerance}
            yield Reason(ReasonKind.SPEED_DIFFERS, values, due="test_day")
