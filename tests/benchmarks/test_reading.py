"""The logs that benchmarks/reading.py times have the same numbers for cdtool and for every peer."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from cdtool.formats.mcap import Mcap

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.parametrize(
    ("encoding", "peer", "module"),
    [("cdr", "by_rosbags", "rosbags"), ("protobuf", "by_protobuf", "google"), ("json", "by_orjson", "orjson")],
)
def test_cdtool_and_a_peer_read_the_same_numbers(encoding, peer, module, monkeypatch, tmp_path):
    if find_spec(module) is None:
        pytest.skip(f"{module} is not installed")
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import mcap_logs
    from mcap_logs import FLAT, channel_map, write_log

    write_log(tmp_path / "log.mcap", 0.3, encoding, "zstd")
    columns = Mcap().columns(tmp_path / "log.mcap", channel_map()).columns
    read = getattr(mcap_logs, peer)(tmp_path / "log.mcap", FLAT)
    assert len(read) == 7
    for name, values in read.items():
        assert len(values) == 300 and np.array_equal(columns[name].values, values)
