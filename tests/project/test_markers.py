"""The list of slow tests names tests that exist."""

from __future__ import annotations

import ast

from tests.markers import ROOT, slow_tests


def test_every_test_that_is_listed_as_slow_exists():
    listed = slow_tests()
    assert listed == sorted(set(listed))
    files = {name.partition("::")[0] for name in listed}
    functions = {
        f"{file}::{node.name}"
        for file in files
        for node in ast.parse((ROOT / file).read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef)
    }
    assert set(listed) <= functions, "tests/slow_tests.txt: correct the names of tests that were renamed"
