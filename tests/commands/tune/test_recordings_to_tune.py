"""Folds of recordings: what depends on one another is in one fold."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cdtool.commands.judging.log_groups import Split
from cdtool.commands.tune.recordings_to_tune import in_folds
from cdtool.results.curves.false_alarm_budget import Budget
from tests.commands.tune.search.recordings import operation, tuning_recordings

BUDGET = Budget(0.2, "operation")


@pytest.mark.parametrize("split", [Split.RECORDING, Split.DAY])
def test_injected_contacts_are_in_the_fold_of_the_log_that_they_were_put_into(split):
    free = [operation(f"2026-11-{1 + number // 2:02}/{number}.csv") for number in range(20)]
    (example, *_) = tuning_recordings().struck
    struck = [
        replace(example, operations=(operation(f"made/{kind}/{number}.csv"),), group=kind, made_from=free[number].name)
        for kind in ("hard", "soft")
        for number in range(20)
    ]
    made = in_folds(free, struck, split, 3, BUDGET, is_nested=True)
    fold_of = {run.operation.name: run.fold for run in made.free}
    assert len(set(fold_of.values())) == 5
    assert [log.fold for log in made.struck] == [fold_of[log.made_from] for log in made.struck]


def test_contacts_put_into_one_log_stay_together_where_it_is_not_learned_from():
    free = [operation(f"{number}.csv") for number in range(20)]
    (example, *_) = tuning_recordings().struck
    struck = [
        replace(example, operations=(operation(f"made/{number}.csv"),), made_from=f"other/{number // 4}.csv")
        for number in range(20)
    ]
    made = in_folds(free, struck, Split.RECORDING, 3, BUDGET, is_nested=True)
    folds = {}
    for log in made.struck:
        folds.setdefault(log.made_from, set()).add(log.fold)
    assert all(len(numbers) == 1 for numbers in folds.values())
    assert len(set.union(*folds.values())) >= 3
