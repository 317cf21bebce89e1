"""docs/reproduction.md matches the output of its script."""

from __future__ import annotations

import re

import cdtool
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.results.summary import summarise
from tests.project.pages import DOCS, docs_script


def test_every_table_and_number_of_the_script_is_on_the_page():
    make, page = docs_script("make_reproduction"), (DOCS / "reproduction.md").read_text(encoding="utf-8")
    assert set(re.findall(r"<!-- made: (.*) -->", page)) == {*make.THESIS, "thesis rule"}
    shown = set(re.findall(r"images/(reproduction_\w+\.png)", page))
    assert shown == {path.name for path in make.IMAGES.glob("reproduction_*.png")} and len(shown) == 11


def test_the_tables_of_the_arms_first_trial_match_the_script(tmp_path):
    make, page = docs_script("make_reproduction"), (DOCS / "reproduction.md").read_text(encoding="utf-8")
    simulate_arm(tmp_path / "arm1", make.COUNTS, make.SEED, 1)
    rows = summarise(cdtool.benchmark(tmp_path / "arm1" / "benchmark.toml", jobs=2).results)
    for name in ("6.1, trial 1", "6.2, trial 1"):
        assert f"<!-- made: {name} -->\n\n{make.latencies(name, rows)}\n" in page
