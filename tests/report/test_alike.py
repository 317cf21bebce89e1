"""Findings of one kind are one line with a count."""

from __future__ import annotations

from cdtool.base.findings import Finding
from cdtool.report.alike import RecordingReason, alike, grouped_findings
from cdtool.results.results import RecordingFinding, Skipped


def gaps(count: int, channel: str) -> Finding:
    first = tuple({"time": 0.1 * i, "length": 0.004} for i in range(1, min(count, 3) + 1))
    return Finding("sample_gaps", channel, {"count": count, "first": first})


def test_findings_of_one_kind_are_merged_whatever_their_numbers_are():
    findings = [gaps(count, name) for name, count in zip("abcd", (1, 2, 5, 1), strict=True)]
    findings += [
        Finding("infinite_values", name, {"count": count, "joint": ""})
        for name, count in zip("ef", (1, 2), strict=True)
    ]
    (name, text), *others = grouped_findings(findings)
    assert name == "a" and text == f"{gaps(1, 'a').sentence}; 3 more like it (b, c, d)"
    assert others == [(item.channel, item.message) for item in findings[4:]]  # two are both shown


def test_findings_of_recordings_are_merged_by_kind_and_channel():
    of = [RecordingFinding.of(f"{i}.csv", gaps(1 + i % 5, "time")) for i in range(6)]
    force = RecordingFinding.of("6.csv", gaps(1, "force"))
    assert alike([*of, force]) == [
        RecordingReason("0.csv", f"{gaps(1, 'time')}; 5 more like it (1.csv, 2.csv, 3.csv, ...)"),
        RecordingReason("6.csv", force.reason),
    ]


def test_reasons_of_errors_are_merged_where_only_their_numbers_differ():
    lines = [Skipped(f"{i}.csv", f"line {i}, column 'a': '?' is not a number") for i in range(5)]
    other = Skipped("5.csv", "line 5 is cut off")
    merged, single = alike([*lines, other])
    assert merged.reason == f"{lines[0].reason}; 4 more like it (1.csv, 2.csv, 3.csv, ...)"
    assert single == RecordingReason(other.recording, other.reason)
