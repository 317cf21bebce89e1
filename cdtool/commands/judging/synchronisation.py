"""Findings of the sync audit: of one log, and of several logs with the same clocks."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cdtool.base.findings import Finding
from cdtool.statistics.interval import Interval
from cdtool.truth.synchronisation.channel_delay import ChannelDelay, pooled, preferred


def delay_findings(delays: Sequence[ChannelDelay]) -> list[Finding]:
    """Return one finding per channel and reference; a log without a contact says nothing about its load cell."""
    return [_finding(item) for item in preferred(delays) if item.assessable or item.events or item.channel != "force"]


def pooled_delays(logs: Sequence[Sequence[ChannelDelay]], origins: Sequence[float]) -> tuple[ChannelDelay, ...]:
    """Return the delays over several logs, of every pair of channels that more than one log shows.

    Parameters
    ----------
    logs : sequence of sequence of ChannelDelay
        Those of each log.
    origins : sequence of float
        What is added to each log's times to obtain its own clock [s]; 0 if that is not an epoch.

    Returns
    -------
    tuple of ChannelDelay
        With a drift between the clocks only if all logs are on an epoch: otherwise each log may start its clocks again.
    """
    pairs: dict[tuple[str, str, str, str], list[tuple[ChannelDelay, float]]] = {}
    for delays, origin in zip(logs, origins, strict=True):
        for item in delays:
            if item.has_delays:
                key = (item.channel, item.joint, item.reference, item.rests_on)
                pairs.setdefault(key, []).append((item, origin))
    found = []
    for members in pairs.values():
        if len(members) < 2:
            continue
        starts = [start for _, start in members]
        found.append(pooled([item for item, _ in members], starts if all(starts) else [0.0] * len(starts)))
    return tuple(found)


def _finding(item: ChannelDelay) -> Finding:
    about = {"joint": item.joint, "reference": item.reference, "examined": len(item.events)}
    if not item.assessable:
        return Finding("shift_not_assessable", item.channel, {**about, "reason": item.reason})
    return Finding(
        "channel_shift",
        item.channel,
        {
            **about,
            "rests_on": item.rests_on,
            "offset": item.offset.value,
            "low": item.offset.low,
            "high": item.offset.high,
            "at": item.at,
            "event": "section" if item.rests_on == "derivative" else "contact",
            "events": len(item.used),
            "drift": (item.drift.value, item.drift.low, item.drift.high) if item.drift.known else None,
            "stiff": _value(item.stiff),
            "soft": _value(item.soft),
        },
    )


def _value(interval: Interval) -> float | None:
    return None if math.isnan(interval.value) else interval.value
