"""cdtool: measure how quickly, how reliably and at which contact force a machine detects a collision.

Every command is available as a function:

    cdtool.read("run.csv", "machine.toml")                              -> Recording
        cdtool.init("run.csv")                                              -> Drafted: a draft of machine.toml
        cdtool.init_study(logs, "study")                                    -> DraftedStudy: also of benchmark.toml
        cdtool.convert("run.csv", "run.parquet", "machine.toml")            -> Converted
        cdtool.recover("damaged.mcap", "clean.mcap")                        -> Recovered
    cdtool.learn_signature(logs, "machine.toml", "feekf")               -> Learned
    cdtool.check_signature("gate.json", logs, "machine.toml")           -> Checked: coverage, drift, advice
    cdtool.update_signature("gate.json", logs, "machine.toml")          -> Updated: the runs added and refused
    cdtool.detect("hit.csv", "machine.toml", signature="gate.json")     -> DetectionResult; of a list DetectionResults
    cdtool.explain("hit.csv", "machine.toml", signature="gate.json")    -> Explained
    cdtool.benchmark("benchmark.toml")                                  -> BenchmarkResult
    cdtool.protocol("protocol.toml")                                    -> Protocol: of a force test, to be signed
    cdtool.score("triggers.csv", "benchmark.toml")                      -> BenchmarkResult
        cdtool.read_results("results.json")                                 -> BenchmarkResult
    cdtool.compare("old.json", "new.json")                              -> BuildComparison
    cdtool.plan(missed_at_most="5%")                                    -> Plan
    cdtool.identify(logs, "machine.toml", "machine.toml")               -> IdentifiedMachine: parameters with errors
    cdtool.inject("benchmark.toml", "injected")                         -> Injected: impacts made from impact-free logs
    cdtool.coverage("benchmark.toml")                                   -> Coverage: latency over position and stiffness
    cdtool.tune("benchmark.toml", "1/100op")                            -> TuningResult: gains, threshold, debounce
    cdtool.info("run.csv", machine="machine.toml")                      -> Info
    cdtool.study_sensors("machine.toml", ...)                           -> SensorStudy
    cdtool.simulate_gate(folder, {"free": 14, "stiff": 30}, seed=1)     -> number of recordings written
    cdtool.simulate_arm(folder, {"free": 14, "stiff": 30}, seed=1, trial=2)  -> the same

The classes of the values that a notebook handles are here too: `Recording`, `Signal`, `Signature`, `CdtoolError` and
others; see docs/python.md.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdtool.alarms.pipeline import Detection
    from cdtool.base.errors import CdtoolError
    from cdtool.base.version import __version__
    from cdtool.commands.compare.comparing import compare
    from cdtool.commands.compare.planning import plan
    from cdtool.commands.convert.converting import convert
    from cdtool.commands.convert.recovering import recover
    from cdtool.commands.detect.result import DetectionResult, DetectionResults, detect
    from cdtool.commands.explain.explaining import explain
    from cdtool.commands.identify.identifying import identify
    from cdtool.commands.init.drafting import init, init_study
    from cdtool.commands.inject.coverage.coverage import coverage
    from cdtool.commands.inject.injecting import inject
    from cdtool.commands.judging.information import info
    from cdtool.commands.judging.reading import read
    from cdtool.commands.learning.learning import learn_signature
    from cdtool.commands.protocol.making import protocol
    from cdtool.commands.report.read_results import read_results
    from cdtool.commands.score.score_triggers import score
    from cdtool.commands.scoring.benchmark import benchmark
    from cdtool.commands.scoring.benchmark_result import BenchmarkResult
    from cdtool.commands.signature.upkeep import check_signature, update_signature
    from cdtool.commands.simulate.arm_recordings import write_arm_recordings as simulate_arm
    from cdtool.commands.simulate.gate_recordings import write_gate_recordings as simulate_gate
    from cdtool.commands.study.study import study_sensors
    from cdtool.commands.tune.result import TuningResult
    from cdtool.commands.tune.tuning import tune
    from cdtool.detectors.detection import Alarm, Band, Signal, Status, Verdict
    from cdtool.formats.machine_file import MachineFile, read_machine_file
    from cdtool.recordings.clock import previous_value
    from cdtool.recordings.recording import Contact, Recording, Series
    from cdtool.thresholds.cusum import Cusum
    from cdtool.thresholds.limit import Limit
    from cdtool.thresholds.signature import Signature

_API = {
    "__version__": "cdtool.base.version:__version__",
    "read": "cdtool.commands.judging.reading:read",
    "learn_signature": "cdtool.commands.learning.learning:learn_signature",
    "check_signature": "cdtool.commands.signature.upkeep:check_signature",
    "update_signature": "cdtool.commands.signature.upkeep:update_signature",
    "coverage": "cdtool.commands.inject.coverage.coverage:coverage",
    "detect": "cdtool.commands.detect.result:detect",
    "explain": "cdtool.commands.explain.explaining:explain",
    "benchmark": "cdtool.commands.scoring.benchmark:benchmark",
    "score": "cdtool.commands.score.score_triggers:score",
    "convert": "cdtool.commands.convert.converting:convert",
    "identify": "cdtool.commands.identify.identifying:identify",
    "inject": "cdtool.commands.inject.injecting:inject",
    "init": "cdtool.commands.init.drafting:init",
    "init_study": "cdtool.commands.init.drafting:init_study",
    "protocol": "cdtool.commands.protocol.making:protocol",
    "recover": "cdtool.commands.convert.recovering:recover",
    "compare": "cdtool.commands.compare.comparing:compare",
    "plan": "cdtool.commands.compare.planning:plan",
    "info": "cdtool.commands.judging.information:info",
    "study_sensors": "cdtool.commands.study.study:study_sensors",
    "tune": "cdtool.commands.tune.tuning:tune",
    "simulate_arm": "cdtool.commands.simulate.arm_recordings:write_arm_recordings",
    "simulate_gate": "cdtool.commands.simulate.gate_recordings:write_gate_recordings",
    "read_results": "cdtool.commands.report.read_results:read_results",
    "read_machine_file": "cdtool.formats.machine_file:read_machine_file",
    "previous_value": "cdtool.recordings.clock:previous_value",
    "BenchmarkResult": "cdtool.commands.scoring.benchmark_result:BenchmarkResult",
    "DetectionResult": "cdtool.commands.detect.result:DetectionResult",
    "DetectionResults": "cdtool.commands.detect.result:DetectionResults",
    "TuningResult": "cdtool.commands.tune.result:TuningResult",
    "Recording": "cdtool.recordings.recording:Recording",
    "Series": "cdtool.recordings.recording:Series",
    "Contact": "cdtool.recordings.recording:Contact",
    "Signal": "cdtool.detectors.detection:Signal",
    "Status": "cdtool.detectors.detection:Status",
    "Band": "cdtool.detectors.detection:Band",
    "Alarm": "cdtool.detectors.detection:Alarm",
    "Verdict": "cdtool.detectors.detection:Verdict",
    "Detection": "cdtool.alarms.pipeline:Detection",
    "MachineFile": "cdtool.formats.machine_file:MachineFile",
    "Signature": "cdtool.thresholds.signature:Signature",
    "Limit": "cdtool.thresholds.limit:Limit",
    "Cusum": "cdtool.thresholds.cusum:Cusum",
    "CdtoolError": "cdtool.base.errors:CdtoolError",
}

__all__ = [
    "Alarm",
    "Band",
    "BenchmarkResult",
    "CdtoolError",
    "Contact",
    "Cusum",
    "Detection",
    "DetectionResult",
    "DetectionResults",
    "Limit",
    "MachineFile",
    "Recording",
    "Series",
    "Signal",
    "Signature",
    "Status",
    "TuningResult",
    "Verdict",
    "__version__",
    "benchmark",
    "check_signature",
    "compare",
    "convert",
    "coverage",
    "detect",
    "explain",
    "identify",
    "info",
    "init",
    "init_study",
    "inject",
    "learn_signature",
    "plan",
    "previous_value",
    "protocol",
    "read",
    "read_machine_file",
    "read_results",
    "recover",
    "score",
    "simulate_arm",
    "simulate_gate",
    "study_sensors",
    "tune",
    "update_signature",
]


def __getattr__(name: str) -> Any:
    if name not in _API:
        from difflib import get_close_matches

        close = [] if name.startswith("_") else get_close_matches(name, __all__, n=2)
        hint = f"; did you mean {' or '.join(close)}?" if close else ""
        raise AttributeError(f"module 'cdtool' has no attribute '{name}'{hint}")
    module, _, attribute = _API[name].partition(":")
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted([*globals(), *_API])
