"""The Snakefile in docs/examples/fleet: its shares contain each recording once, and fill the store for the whole."""

from __future__ import annotations

import shutil
import tomllib
from glob import glob
from pathlib import Path

import cdtool
from cdtool.execution.store.store import Store

ROOT = Path(__file__).parents[2]
SHARES = 3


def share_of():
    text = (ROOT / "docs" / "examples" / "fleet" / "Snakefile").read_text(encoding="utf-8")
    code = text[text.index("def share_of") : text.index("rule all")]
    names = {"tomllib": tomllib, "glob": glob, "SHARES": SHARES}
    exec(code, names)
    return names["share_of"]


def test_the_shares_fill_the_store_for_the_whole_benchmark(tmp_path, monkeypatch):
    folder = tmp_path / "gate"
    shutil.copytree(ROOT / "sample_logs" / "gate", folder)
    monkeypatch.chdir(folder)
    text = (folder / "benchmark.toml").read_text(encoding="utf-8").partition("[limits]")[0]
    (folder / "benchmark.toml").write_text(text, encoding="utf-8")
    scored: list[str] = []
    for number in range(SHARES):
        file = folder / f"share-{number}.toml"
        file.write_text(share_of()(text, number), encoding="utf-8")
        done = cdtool.benchmark(file, store=Store(folder / "outcomes"))
        scored += [item.recording for item in done.results.recordings]
    whole = cdtool.benchmark("benchmark.toml", store=Store(folder / "outcomes"))
    assert sorted(scored) == sorted(item.recording for item in whole.results.recordings)
    assert whole.stored.computed == 0
