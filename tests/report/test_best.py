"""The sentence of each group names the best detector by an order that cannot be talked away, and what is not known."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cdtool.report.best import best_table
from cdtool.results.evaluated import evaluate
from cdtool.results.results import ExposureResult, FalseAlarmResult, Results
from tests.report.bench import contacts_of

FAST, SLOW = [10.0, 11.0, 12.0, 13.0], [50.0, 51.0, 52.0, 53.0]
MANY = [float(late) for late in range(20, 40)]
FEW = "; too few recordings to show a difference"
SLOW_TAIL = [20.0 + 0.1 * i for i in range(16)] + [400.0 + i for i in range(8)]
HALF_SEEN = [*(31.0 + i for i in range(10)), *["standing still"] * 10]


def results_of(first, second, alarms=0, hours=0.5):
    """Two detectors on the same contacts; the first one raises the false alarms of the hold-out."""
    groups = [("stiff", 4), ("holdout", 20)]
    return Results(
        provenance={},
        detectors=("one", "two"),
        groups=("stiff", "holdout"),
        contacts=(*contacts_of("one", "stiff", first), *contacts_of("two", "stiff", second)),
        false_alarms=tuple(FalseAlarmResult("h.csv", "holdout", "one", "axis", float(i)) for i in range(alarms)),
        exposure=tuple(ExposureResult(group, name, n, n, hours) for group, n in groups for name in ("one", "two")),
        recordings=(),
    )


def told(results):
    return {group.text: words.text for group, words in best_table(evaluate(results)).rows}


@pytest.mark.parametrize(
    ("first", "second", "alarms", "begins", "ends"),
    [
        (FAST, SLOW, 0, "one is best: median 11", f" missed (at most 53 %), no false alarm{FEW}"),
        (FAST, SLOW, 3, "two is best: ", FEW),  # a fast detector that raises false alarms is not the best
        ([*FAST[:3], None], SLOW, 0, "two is best", FEW),
        ([*FAST[:3], "standing still"], SLOW, 0, "two is best", ""),
        ([*FAST[:3], None], [*SLOW[:3], None], 0, "every detector missed contacts; one is best: median 1", FEW),
        (FAST, FAST, 0, "one and two are equally good: median 11", ", no false alarm"),
        ([None] * 4, [None] * 4, 0, "no detector detected a contact: 4 of 4 contacts missed", ""),
        (MANY, [late + 5.0 for late in MANY], 0, "one is best", "no false alarm; shown to be better than two"),
        (
            MANY,
            [late + (-1) ** i * 5.0 + 0.5 for i, late in enumerate(MANY)],
            0,
            "",
            "; not shown to be better than two",
        ),
        (
            [late - 5.0 for late in MANY],
            MANY,
            2,
            "two",
            "; one faster, but with more misses, false alarms or contacts not assessable",
        ),
        # the least median, but a longer mean
        (SLOW_TAIL, [25.0 + 0.1 * i for i in range(24)], 0, "one is best: median 21.2", "; two faster on average"),
        (
            [*[None] * 9, *(30.0 + i for i in range(11))],
            HALF_SEEN,
            0,
            "one is best",
            "; two shown to miss fewer of the contacts that both could assess",
        ),
        (["standing still"] * 4, ["standing still"] * 4, 0, "no detector detected a contact: 4 not assessable", ""),
    ],
)
def test_the_best_misses_least_then_is_quietest_then_fastest_and_how_sure_that_is(first, second, alarms, begins, ends):
    sentence = told(results_of(first, second, alarms))["stiff"]
    assert sentence.startswith(begins) and sentence.endswith(ends)


def test_detectors_that_are_shown_to_differ_are_not_equal_though_their_medians_round_alike():
    shifted = results_of([33.0 + 0.1 * i for i in range(12)], [33.1 + 0.1 * i for i in range(12)])
    results = replace(shifted, contacts=tuple(replace(item, resolution_ms=1.0) for item in shifted.contacts))
    sentence = told(results)["stiff"]
    assert sentence.startswith("one is best: median 34 ms") and sentence.endswith("; shown to be better than two")


def test_a_group_without_contacts_has_its_false_alarms_with_their_bounds():
    quiet, loud = told(results_of(FAST, SLOW)), told(results_of(FAST, SLOW, 2, hours=2.0))
    most = "in 20 operations (at most 0.150 per operation"
    assert quiet["hold-out"] == f"no contacts; no false alarm of any detector {most})"
    assert loud["hold-out"] == (
        f"no contacts; no false alarm of two {most}, 1.50 per hour); "
        "2 false alarms of one in 20 operations (at most 0.315 per operation, 3.15 per hour)"
    )
    blind = replace(results_of(FAST, SLOW), exposure=(ExposureResult("holdout", "one", 4, 4, 0.0, 4),))
    assert told(blind)["hold-out"] == "no contacts; false alarms not assessable"
    made = replace(results_of(FAST, SLOW), provenance={"injected": {"stiff": {}}})
    assert told(made)["stiff"].startswith("injected contacts; one is best")
