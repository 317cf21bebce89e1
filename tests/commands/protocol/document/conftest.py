"""Protocols of a door: one passes, one fails in German, one is incomplete; and of a robot with pressures."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.commands.protocol.assessment.protocol import Protocol
from cdtool.commands.protocol.document.blocks import Document
from cdtool.commands.protocol.document.document import protocol_document
from cdtool.commands.protocol.making import make_protocol
from cdtool.commands.protocol.protocol_file import read_protocol_file
from cdtool.commands.scoring.benchmark import benchmark
from tests.synthetic.force_rig import half_sine, write_log, write_protocol, write_rig
from tests.synthetic.pressure_rig import Run, steady, write_pressure_rig

LONG = "a_recording_with_a_very_long_name_and_no_place_to_break_20260331T101112_run_0001"
DEVIATION = '[[protocol.deviation]]\ntext = "Kraftmessgerät höher befestigt"\nreason = "Podest <verbaut>"'


def _made(folder: Path, path: Path) -> Protocol:
    command = "cdtool benchmark benchmark.toml -p protocol.toml -o protocol.pdf"
    return make_protocol(read_protocol_file(path), benchmark(folder / "benchmark.toml"), command)


@pytest.fixture(scope="session")
def protocols(tmp_path_factory) -> dict[str, Protocol]:
    root = tmp_path_factory.mktemp("protocols")
    peaks = {"pass": (300.0, 320.0, 450.0), "fail": (500.0, 520.0, 450.0), "incomplete": (300.0, 310.0)}
    for name, forces in peaks.items():
        write_rig(root / name, [half_sine(peak) for peak in forces])
    write_log(root / "incomplete" / "edge" / f"{LONG}.csv", half_sine(200.0), seconds=5.0)
    flaws = {
        "pass": {},
        "fail": {"language": "de", "more": DEVIATION},
        "incomplete": {"valid_until": "2026-01-20", "more": "peak_pressures_n_per_cm2 = [12.5, 13, 14.25]"},
    }
    doors = {name: _made(root / name, write_protocol(root / name, **flaws[name])) for name in peaks}
    return doors | {f"pressure_{language}": _of_robot(root / language, language) for language in ("en", "de")}


def _of_robot(folder: Path, language: Literal["en", "de"]) -> Protocol:
    """Return a protocol with a pressure above both limits, at half the speed, and one that stopped the sensor."""

    def pressure(time: FloatArray) -> FloatArray:
        return half_sine(250.0)(time) + np.where((time > 0.3) & (time < 1.5), 130.0, 0.0) + 4.0

    def stopped(time: FloatArray) -> FloatArray:
        return np.minimum(half_sine(300.0)(time), 180.0)

    runs = [Run(half_sine(200.0)), Run(pressure, speed=steady(0.1)), Run(stopped, noise=0.0)]
    entered = "peak_pressures_n_per_cm2 = [160, 250, 185]"
    return _made(folder, write_pressure_rig(folder, runs, language=language, point=entered))


@pytest.fixture(scope="session")
def documents(protocols) -> dict[str, Document]:
    """Return the documents of these protocols."""
    return {name: protocol_document(protocol) for name, protocol in protocols.items()}
