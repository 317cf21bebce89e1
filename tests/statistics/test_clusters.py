"""Clusters that are put together keep every value, and what their intervals and tests say."""

from __future__ import annotations

import numpy as np

from cdtool.statistics import clusters
from cdtool.statistics.clusters import clusters_of
from cdtool.statistics.paired import paired_difference, unpaired_difference


def test_clusters_put_together_hold_the_same_values_each_cluster_as_a_whole():
    labels = np.repeat(np.arange(300), np.arange(300) % 4 + 1)
    groups = clusters_of(np.arange(len(labels), dtype=float), labels.tolist())
    merged = groups.merged(50, 7)
    assert len(merged) == 50 and merged.counts.sum() == len(labels) and merged.counts.min() > 0
    assert np.array_equal(np.sort(merged.values), np.sort(groups.values))
    assert np.array_equal(merged.number, np.repeat(np.arange(50), merged.counts))
    place = dict(zip(merged.values.tolist(), merged.number.tolist(), strict=True))
    of_cluster = [{place[float(i)] for i in np.flatnonzero(labels == number)} for number in range(300)]
    assert {len(places) for places in of_cluster} == {1}


def test_a_difference_of_many_recordings_is_shown_and_none_is_not(monkeypatch):
    monkeypatch.setattr("cdtool.statistics.paired.MOST_CLUSTERS", 100)
    monkeypatch.setattr(clusters, "MOST_CLUSTERS", 100)
    rng = np.random.default_rng(2)
    noise = rng.normal(size=1000)
    assert paired_difference(noise + 0.5, range(1000)).p < 0.001
    assert paired_difference(noise - noise.mean(), range(1000)).p > 0.5
    other = rng.normal(size=800)
    assert unpaired_difference(noise + 0.5, other, range(1000), range(800)).p < 0.001
    assert unpaired_difference(noise - noise.mean(), other - other.mean(), range(1000), range(800)).p > 0.5
