"""A short run of what tests/fuzz/hostile_input.py tries for long: hostile files and options to every command."""

from __future__ import annotations

import pytest

from tests.fuzz.hostile_commands import attempts, complaint, make_bench, run

COUNT, SEED = 60, 14


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile") / "bench"
    make_bench(folder)
    return folder


def test_no_hostile_file_or_option_makes_a_traceback_or_more_than_a_line(bench):
    complaints = []
    for attempt in attempts(bench, SEED, COUNT):
        if said := complaint(run(attempt, bench)):
            complaints.append(f"{attempt.shown}: {said}")
    assert not complaints, "\n".join(complaints)
