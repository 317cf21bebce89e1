"""Which logs a pattern of a benchmark file names."""

from __future__ import annotations

import pytest

from cdtool.base.errors import UsageError
from cdtool.commands.judging.runs import find_logs


@pytest.mark.parametrize("pattern", ["", ".", "/", "#", "#1"])
def test_a_pattern_that_is_a_folder_or_the_root_matches_nothing(pattern, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for base in (tmp_path, tmp_path.relative_to(tmp_path)):
        with pytest.raises(UsageError, match="no file matches"):
            find_logs([pattern], base, runs=True)


def test_an_empty_list_of_logs_is_an_error(tmp_path):
    with pytest.raises(UsageError, match="is empty"):
        find_logs([], tmp_path)
