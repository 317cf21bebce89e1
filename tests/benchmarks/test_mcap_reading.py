"""The logs that benchmarks/mcap_reading.py times have the same numbers for cdtool and for every peer."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from cdtool.formats.mcap import Mcap

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def test_cdtool_and_the_peers_read_the_same_numbers(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import mcap_reading
    from mcap_logs import channel_map

    paths = mcap_reading.write_logs(tmp_path, 0.3)
    read = set()
    for log, _, module, by_peer, _ in mcap_reading.PEERS:
        if find_spec(module.partition(".")[0]) is None or log.endswith("10 s"):
            continue
        content = mcap_reading.LOGS[log].content
        columns = Mcap().columns(paths[log], channel_map(content)).columns
        for name, values in by_peer(paths[log], content).items():
            assert len(values) == 300
            assert np.array_equal(columns[name].values, values)
        read.add(log)
    assert {"cdr, zstd", "nested cdr, zstd"} <= read


def test_cpu_time_and_wall_clock_are_both_measured(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import mcap_reading

    calls = []
    cpu, wall = mcap_reading.cpu_and_wall({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, 3)
    assert calls == ["b", "a", "a", "b", "b", "a", "a", "b"]
    assert (
        {name: len(each) for name, each in cpu.items()}
        == {name: len(each) for name, each in wall.items()}
        == {"a": 3, "b": 3}
    )
