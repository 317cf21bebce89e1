"""A detector that is defined in a notebook, or has other gains, is used by its instance."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import ClassVar

import pytest

import cdtool
from cdtool.detectors.momentum import Momentum
from cdtool.detectors.pure_torque import PureTorque
from cdtool.execution.store.store import Store
from tests.commands.notebook.values import FREE, GATE, LOG, MACHINE


@dataclass(frozen=True)
class Effort(PureTorque):
    """The drive force under a name of its own."""

    name: ClassVar[str] = "effort"
    short_name: ClassVar[str] = "ef"


def test_a_detector_of_ones_own_is_learned_and_detects():
    learned = cdtool.learn_signature(FREE, MACHINE, Effort())
    found = cdtool.detect(LOG, MACHINE, signature=learned, detector=Effort())
    assert learned.signature.detector == "effort" and found.contacts.detector.tolist() == ["effort"]
    same = cdtool.detect(LOG, MACHINE, signature=cdtool.learn_signature(FREE, MACHINE, "pt"))
    assert found.contacts.alarm_s.tolist() == same.contacts.alarm_s.tolist()


def test_a_detector_that_violates_the_contract_is_refused_in_one_line():
    class Nothing:
        name = "nothing"

    with pytest.raises(cdtool.CdtoolError, match="detector Nothing has no attribute 'short_name'"):
        cdtool.detect(LOG, MACHINE, detector=Nothing(), settings={"threshold.limits": 1.0})
    impostor = type("Impostor", (Effort,), {"name": "momentum"})
    with pytest.raises(cdtool.CdtoolError, match="has the name of a detector of cdtool itself"):
        cdtool.detect(LOG, MACHINE, detector=impostor(), settings={"threshold.limits": 1.0})


def test_a_benchmark_file_takes_the_name_of_a_detector_only():
    with pytest.raises(cdtool.CdtoolError, match="a benchmark file names its detectors"):
        cdtool.detect(LOG, benchmark=GATE / "benchmark.toml", detector=Effort())


def test_a_benchmark_takes_detectors_with_their_gains(tmp_path):
    machine = tmp_path / "machine.toml"
    machine.write_text(f"{MACHINE.read_text()}\n[detectors.momentum]\nbandwidth = 20.0\n")
    text = (GATE / "benchmark.toml").read_text().replace('= "machine.toml"', f'= "{machine}"')
    study = tmp_path / "benchmark.toml"
    study.write_text(re.sub(r'"((?:free|holdout|stiff|soft)/)', rf'"{GATE}/\1', text))
    wanted = cdtool.benchmark(study, detectors=["momentum"]).contacts.latency_ms.tolist()
    store = Store(tmp_path / "store")
    for names in (["momentum"], [Momentum(bandwidth=20.0), "pt"]):
        found = cdtool.benchmark(GATE / "benchmark.toml", detectors=names, store=store, jobs=len(names))
    assert found.results.detectors == ("momentum", "pure_torque")
    assert found.contacts[found.contacts.detector == "momentum"].latency_ms.tolist() == wanted
    assert found.results.provenance["gains"]["momentum"]["bandwidth"] == 20.0


@pytest.mark.parametrize(
    ("detectors", "words"),
    [
        (["gm", Momentum(bandwidth=20.0)], "detectors momentum, momentum contain a repetition"),
        ([Effort()], "unknown detector 'effort'"),
    ],
)
def test_a_benchmark_refuses_detectors_that_it_cannot_tell_by_name(detectors, words):
    with pytest.raises(cdtool.CdtoolError, match=words):
        cdtool.benchmark(GATE / "benchmark.toml", detectors=detectors)
