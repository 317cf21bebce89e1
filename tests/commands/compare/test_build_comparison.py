"""Comparison of two builds: shown changes, pairing and refusals."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdtool import benchmark, simulate_gate
from cdtool.alarms.activation import Activation
from cdtool.base.errors import ConfigurationError
from cdtool.commands.compare.comparison import compare
from cdtool.commands.compare.comparison_json import to_json
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from cdtool.results.results import Results
from cdtool.statistics.paired import fisher_p, mcnemar_p
from cdtool.statistics.rates import poisson_difference_p
from cdtool.statistics.sample_size import detectable_difference, impacts_for_unpaired
from tests.commands.compare.questions import KEY, asked, latencies, row_of, single
from tests.synthetic.builds import MISSED, NOT_ASSESSABLE, ONSET, UNCERTAINTY, Outcome, build_results


def test_a_shift_of_every_latency_is_shown_with_its_size_in_both_directions():
    old = latencies()
    slower = [x + 5.0 for x in old]
    worse, better = compare(single(old), single(slower)), compare(single(slower), single(old))
    assert (worse.verdict, better.verdict) == ("worse", "better")
    assert row_of(worse).words.startswith("slower by 5.0 ms (5.0 to 5.0); more force at the alarm by 50.0 N")
    assert row_of(better).words.startswith("faster by 5.0 ms (5.0 to 5.0); less force at the alarm by 50.0 N")
    assert row_of(worse).paired and row_of(worse).pairs == 30


def test_no_change_shown_states_the_detectable_change():
    old = latencies()
    noise = latencies(mean=0.0, std=3.0, seed=4)
    found = compare(single(old, force=None), single([a + b for a, b in zip(old, noise, strict=True)], force=None))
    assert found.verdict == "no change shown" and found.asked == 1
    least = detectable_difference(30, float(np.std(noise, ddof=1)), 0.8, 0.95)
    assert asked(found, "latency_ms").detectable == pytest.approx(least, rel=1e-3)
    assert row_of(found).words.startswith("on the same 30 contacts: ") and not found.later
    assert row_of(found).words.endswith(f"; no change shown (a change of {least:.1f} ms would have been shown)")


def test_a_change_of_the_size_said_to_be_shown_is_shown_in_some_80_of_100():
    rng = np.random.default_rng(5)
    least = detectable_difference(12, 3.0)
    old, shown = latencies(12), 0
    for _ in range(60):
        new = [a + b for a, b in zip(old, rng.normal(least, 3.0, 12), strict=True)]
        shown += compare(single(old, force=None), single(new, force=None)).verdict == "worse"
    assert 0.65 * 60 <= shown <= 0.95 * 60


@pytest.mark.parametrize("n", [10, 25])
def test_the_detectable_unpaired_change_agrees_with_the_planned_sample_size(n):
    drawn = np.random.default_rng(6).normal(size=n)
    standard = 40.0 + 3.0 * (drawn - drawn.mean()) / drawn.std(ddof=1)
    old, new = (single(x.tolist(), force=None, bytes_of=b, names=b) for x, b in ((standard, "a"), (standard, "b")))
    found = compare(old, new)
    least = asked(found, "latency_ms").detectable
    assert not row_of(found).paired
    assert impacts_for_unpaired(1.0001 * least, 3.0) == n < impacts_for_unpaired(0.9999 * least, 3.0)


def test_misses_of_the_same_contacts_are_compared_by_mcnemar_on_others_by_fisher():
    old = latencies(40)
    new = [MISSED] * 9 + old[9:]
    paired = compare(single(old), single(new))
    question = asked(paired, "missed")
    assert question.p == pytest.approx(mcnemar_p(0, 9)) and question.outcome == "worse"
    assert "misses more: 9 of 40, before 0 of 40" in row_of(paired).words
    other = compare(single(old), single(new, bytes_of="other", names="x"))
    assert asked(other, "missed").p == pytest.approx(fisher_p(0, 40, 9, 40))
    assert "misses fewer: 0 of 40, before 9 of 40" in row_of(compare(single(new), single(old))).words


def test_a_pair_not_assessable_in_one_build_is_counted_separately():
    old = [*latencies(30), NOT_ASSESSABLE, MISSED]
    new = [NOT_ASSESSABLE, *latencies(30)[1:], NOT_ASSESSABLE, MISSED]
    found = compare(single(old), single(new))
    row = row_of(found)
    assert row.one_not_assessable == 1 and row.pairs == 32
    assert asked(found, "latency_ms").old_of == 29 and asked(found, "missed").old_of == 30
    assert (asked(found, "not_assessable").old, asked(found, "not_assessable").new) == (1, 2)
    assert row.words.endswith("; 1 of 32 contacts not assessable in one of the builds")


def test_false_alarms_are_compared_by_hours():
    old = single(latencies(), false_alarms={KEY: 2}, hours=2.0)
    new = single(latencies(), false_alarms={KEY: 15}, hours=1.0)
    found = compare(old, new)
    question = asked(found, "false_alarms")
    assert question.p == pytest.approx(poisson_difference_p(15, 1.0, 2, 2.0)) and found.verdict == "worse"
    assert row_of(found).words == "more false alarms: 15 in 1 h, before 2 in 2 h"
    assert row_of(compare(new, old)).words == "fewer false alarms: 2 in 2 h, before 15 in 1 h"


def test_an_impact_free_group_says_how_many_false_alarms_would_have_been_shown():
    old = build_results({}, holdout=["momentum"])
    found = compare(old, build_results({}, holdout=["momentum"], benchmark_sha256="another"))
    least = int(asked(found, "false_alarms").detectable)
    assert row_of(found).words == f"no change shown ({least} false alarms instead of 0 would have been shown)"
    shown = {
        count: compare(
            old, build_results({}, holdout=["momentum"], false_alarms={("momentum", "holdout"): count})
        ).verdict
        for count in (least - 1, least)
    }
    assert shown == {least - 1: "inconclusive", least: "worse"}


def test_all_questions_are_corrected_together():
    drawn = np.random.default_rng(8).normal(size=12)
    change = 2.2 + 3.0 * (drawn - drawn.mean()) / drawn.std(ddof=1)
    old = latencies(12)
    new = [a + b for a, b in zip(old, change.tolist(), strict=True)]
    alone = compare(single(old, force=None), single(new, force=None))
    assert alone.verdict == "worse" and 0.01 < asked(alone, "latency_ms").p < 0.05
    noise = {("pure_torque", f"group {i}"): latencies(12, seed=20 + i) for i in range(6)}
    moved = {
        key: [x + y for x, y in zip(v, latencies(12, 0.0, 3.0, 40 + i), strict=True)]
        for i, (key, v) in enumerate(noise.items())
    }
    together = compare(build_results({KEY: old, **noise}, force=None), build_results({KEY: new, **moved}, force=None))
    assert together.asked == 7
    (row,) = [row for row in together.rows if row.detector == "momentum" and row.group == "stiff"]
    question = row.question("latency_ms")
    assert question is not None and question.p == asked(alone, "latency_ms").p
    assert question.corrected_p > 0.05 and question.outcome == "no change shown"
    assert question.detectable > asked(alone, "latency_ms").detectable


def test_recordings_of_one_campaign_count_as_one():
    old = latencies(12)
    new = [x + 5.0 for x in old]
    assert compare(single(old), single(new)).verdict == "worse"
    campaigns = [f"day {i % 3}" for i in range(12)]
    for named in ({}, {"campaigns": campaigns}):
        found = compare(single(old, campaigns=campaigns), single(new, **named))
        assert found.verdict == "inconclusive", named
        assert asked(found, "latency_ms").p == pytest.approx(2 / 2**3)
    assert compare(single(old), single(new, campaigns=campaigns)).verdict == "inconclusive"


def test_copies_under_other_names_are_paired_each_with_its_own():
    old, new = single(latencies()), single([x + 5.0 for x in latencies()], names="renamed-")
    old, new = (replace(b, recordings=tuple(replace(r, sha256="same") for r in b.recordings)) for b in (old, new))
    assert row_of(compare(old, new)).words.startswith("slower by 5.0 ms (5.0 to 5.0)")


def test_a_recording_is_the_partner_of_one_only():
    old, new = single(latencies()), single(latencies())
    first, second, *others = new.recordings
    swapped = (replace(first, sha256=second.sha256), replace(second, recording="stiff/new.csv", sha256="new"), *others)
    found = compare(old, replace(new, recordings=swapped))
    assert row_of(found).pairs == 29
    assert found.notes[0].startswith("stiff: 29 recordings are paired; 1 only in old and 1 only in new")


@pytest.mark.parametrize(("moved", "paired"), [(0.9, True), (1.1, False)])
def test_other_bytes_are_paired_by_name_where_the_onset_is_within_its_uncertainty(moved, paired):
    new = single([x + 5.0 for x in latencies()], bytes_of="converted", begins=ONSET + moved * UNCERTAINTY)
    found = compare(single(latencies()), new)
    assert row_of(found).paired is paired
    assert found.notes == (() if paired else ("stiff: unpaired, the recordings differ (30 and 30)",))


def test_other_contacts_in_the_same_bytes_are_refused():
    old = single(latencies())
    with pytest.raises(ConfigurationError, match=r"contact 1 begins at 5.000000 s in old and 5.004000 s in new"):
        compare(old, single(latencies(), begins=ONSET + 0.004))
    two = replace(old, recordings=tuple(replace(item, contacts=2) for item in old.recordings))
    with pytest.raises(
        ConfigurationError, match=r"stiff/00\.csv: the same bytes, but its contacts are 1 in old and 2 in new"
    ):
        compare(old, two)


def test_what_is_under_test_may_differ_and_is_listed():
    new = single(
        latencies(),
        tool_version="2.0",
        gains={"momentum": {"bandwidth": 12.0}, "unknown": {"x": 1}},
        debounce_samples=None,
        learned_sha256={f"free/{i}.csv": f"free{i}" for i in range(8)} | {"more.csv": "more"},
        machine_sha256="ab" * 32,
    )
    listed = {(item.key, item.old, item.new) for item in compare(single(latencies()), new).changed}
    assert listed == {
        ("tool_version", "1.0", "2.0"),
        ("gains.momentum.bandwidth", "10.0", "12.0"),
        ("debounce_samples", "9", "default (9 ms)"),
        ("learned_runs", "10 runs", "9 runs, 8 of them the same"),
        ("machine_sha256", "none", "abababababab"),
    }


def test_nothing_depends_on_the_order_of_the_recordings():
    old, new = single(latencies()), single(latencies(seed=3), bytes_of="x", names="x")
    for other in (new, single(latencies(seed=3))):
        turned = replace(other, contacts=other.contacts[::-1], recordings=other.recordings[::-1])
        assert to_json(compare(old, other)) == to_json(compare(old, turned))


OLD = [40.0 + number for number in range(16)]
ON_THE_SAME = {
    "all later": ([x + 21.0 + 70.0 * i / 15 for i, x in enumerate(OLD)], "16 later by 21.0 to 91.0 ms", True),
    "mixed": (
        [x + (8.0 if i < 9 else -2.0) for i, x in enumerate(OLD)],
        "9 later by 8.0 ms, 7 earlier by 2.0 ms",
        False,
    ),
    "missed": ([MISSED, *OLD[1:]], "1 newly missed", True),
    "found": ([OLD[0] - 1.0, *OLD[1:]], "1 earlier by 1.0 ms", False),
}


@pytest.mark.parametrize("name", ON_THE_SAME)
def test_what_happened_on_the_same_contacts_is_said_beside_the_inference(name):
    new, words, later = ON_THE_SAME[name]
    day = ["monday"] * 8 + ["tuesday"] * 8
    found = compare(single(OLD, campaigns=day), single(new, campaigns=day))
    assert found.verdict == "inconclusive" and found.later == later
    assert row_of(found).words.startswith(f"on the same 16 contacts: {words}; inconclusive: ")
    start = f"{'missing more of' if name == 'missed' else 'later on'} the same contacts in 1 of 1 row; about other "
    assert found.words.startswith(f"{start}recordings inconclusive: " if later else "inconclusive: ")


def test_some_onsets_that_agree_by_chance_do_not_choose_the_contacts():
    old, new = single(latencies()), single([x + 5.0 for x in latencies()], bytes_of="fresh", begins=ONSET + 0.5)
    near = tuple(replace(item, onset_s=ONSET) if i < 5 else item for i, item in enumerate(new.contacts))
    found = compare(old, replace(new, contacts=near))
    assert not row_of(found).paired and asked(found, "latency_ms").old_of == 30


KEYS = [(name, group) for name in ("momentum", "pure_torque") for group in ("stiff", "soft")]


@pytest.fixture(scope="module")
def builds(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Results]:
    """FEEKF and GM on the same 12 stiff and 12 soft impacts with a debounce of 9 and of 14 samples."""
    folder: Path = tmp_path_factory.mktemp("builds") / "gate"
    simulate_gate(folder, {"free": 10, "stiff": 12, "soft": 12}, seed=77)
    setup = read_benchmark_file(folder / "benchmark.toml")
    made = {count: replace(setup, activation=Activation(count)) for count in (9, 14)}
    return {count: benchmark(item, detectors=["feekf", "gm"]).results for count, item in made.items()}


def test_five_more_samples_of_debounce_are_found_as_five_milliseconds(builds):
    found = compare(builds[9], builds[14])
    assert found.verdict == "worse" and len(found.rows) == 4
    for row in found.rows:
        latency = row.question("latency_ms")
        assert latency is not None and row.pairs == 12
        assert (latency.outcome, latency.change.value) == ("worse", pytest.approx(5.0, abs=0.2))
        assert row.words.startswith("slower by 5.0 ms (5.0 to 5.0)")
    assert {(item.key, item.old, item.new) for item in found.changed} == {("debounce_samples", "9", "14")}


@pytest.mark.parametrize("paired", [True, False])
def test_equal_builds_are_called_neither_worse_nor_better_in_at_least_nine_of_ten_comparisons(paired):
    """With a spread of a quarter, 30 contacts rule out a change of a half; a smaller one is inconclusive."""
    rng = np.random.default_rng(78)

    def drawn() -> list[Outcome]:
        """Skewed latencies, one in twenty missed."""
        latencies = 40.0 * rng.lognormal(0.0, 0.25, 30)
        return [float(x) if found else MISSED for x, found in zip(latencies, rng.random(30) > 0.05, strict=True)]

    other = {} if paired else {"bytes_of": "other", "names": "other-"}
    quiet, tried = Counter[str](), 30
    for _ in range(tried):
        false_alarms = [{key: int(rng.poisson(3.0)) for key in KEYS} for _ in range(2)]
        old = build_results({key: drawn() for key in KEYS}, false_alarms=false_alarms[0], force=None)
        new = build_results({key: drawn() for key in KEYS}, false_alarms=false_alarms[1], force=None, **other)
        found = compare(old, new, relevant_change=0.5)
        assert {row.paired for row in found.rows} == {paired}
        quiet[found.verdict] += 1
        if quiet.total() <= 3:
            assert compare(old, new).verdict in (found.verdict, "inconclusive")
    assert quiet["no change shown"] >= 0.9 * tried
