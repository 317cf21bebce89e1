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
        cdtool.detect_runs("cycles.csv", "machine.toml", operations="column:run_id", signature="gate.json")
    cdtool.explain("hit.csv", "machine.toml", signature="gate.json")    -> Explained
        cdtool.explain_runs("cycles.csv", "machine.toml", operations="column:run_id", signature="gate.json")
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
    from cdtool.clock import previous_value
    from cdtool.detection import Alarm, Band, Signal, Status, Verdict
    from cdtool.errors import CdtoolError
    from cdtool.machine_file import MachineFile, read_machine_file
    from cdtool.notebook.benchmark import benchmark
    from cdtool.notebook.benchmark_result import BenchmarkResult
    from cdtool.notebook.detection_result import DetectionResult, DetectionResults, detect, detect_runs
    from cdtool.notebook.read_results import read_results
    from cdtool.notebook.reading import read
    from cdtool.notebook.score import score
    from cdtool.notebook.tuning_result import TuningResult, tune
    from cdtool.pipeline import Detection
    from cdtool.recording import Contact, Recording, Series
    from cdtool.simulation.arm_recordings import write_arm_recordings as simulate_arm
    from cdtool.simulation.gate_recordings import write_gate_recordings as simulate_gate
    from cdtool.thresholds.cusum import Cusum
    from cdtool.thresholds.limit import Limit
    from cdtool.thresholds.signature import Signature
    from cdtool.version import __version__
    from cdtool.workflows.comparing import compare
    from cdtool.workflows.convert.converting import convert
    from cdtool.workflows.coverage import coverage
    from cdtool.workflows.explaining import explain, explain_runs
    from cdtool.workflows.identification.identifying import identify
    from cdtool.workflows.information import info
    from cdtool.workflows.init.drafting import init, init_study
    from cdtool.workflows.injecting import inject
    from cdtool.workflows.planning import plan
    from cdtool.workflows.protocol.making import protocol
    from cdtool.workflows.recovering import recover
    from cdtool.workflows.signature.learning import learn_signature
    from cdtool.workflows.signature.upkeep import check_signature
    from cdtool.workflows.signature.upkeep import update_with_runs as update_signature
    from cdtool.workflows.study.study import study_sensors

_API = {
    "__version__": "cdtool.version:__version__",
    "read": "cdtool.notebook.reading:read",
    "learn_signature": "cdtool.workflows.signature.learning:learn_signature",
    "check_signature": "cdtool.workflows.signature.upkeep:check_signature",
    "update_signature": "cdtool.workflows.signature.upkeep:update_with_runs",
    "coverage": "cdtool.workflows.coverage:coverage",
    "detect": "cdtool.notebook.detection_result:detect",
    "detect_runs": "cdtool.notebook.detection_result:detect_runs",
    "explain": "cdtool.workflows.explaining:explain",
    "explain_runs": "cdtool.workflows.explaining:explain_runs",
    "benchmark": "cdtool.notebook.benchmark:benchmark",
    "score": "cdtool.notebook.score:score",
    "convert": "cdtool.workflows.convert.converting:convert",
    "identify": "cdtool.workflows.identification.identifying:identify",
    "inject": "cdtool.workflows.injecting:inject",
    "init": "cdtool.workflows.init.drafting:init",
    "init_study": "cdtool.workflows.init.drafting:init_study",
    "protocol": "cdtool.workflows.protocol.making:protocol",
    "recover": "cdtool.workflows.recovering:recover",
    "compare": "cdtool.workflows.comparing:compare",
    "plan": "cdtool.workflows.planning:plan",
    "info": "cdtool.workflows.information:info",
    "study_sensors": "cdtool.workflows.study.study:study_sensors",
    "tune": "cdtool.notebook.tuning_result:tune",
    "simulate_arm": "cdtool.simulation.arm_recordings:write_arm_recordings",
    "simulate_gate": "cdtool.simulation.gate_recordings:write_gate_recordings",
    "read_results": "cdtool.notebook.read_results:read_results",
    "read_machine_file": "cdtool.machine_file:read_machine_file",
    "previous_value": "cdtool.clock:previous_value",
    "BenchmarkResult": "cdtool.notebook.benchmark_result:BenchmarkResult",
    "DetectionResult": "cdtool.notebook.detection_result:DetectionResult",
    "DetectionResults": "cdtool.notebook.detection_result:DetectionResults",
    "TuningResult": "cdtool.notebook.tuning_result:TuningResult",
    "Recording": "cdtool.recording:Recording",
    "Series": "cdtool.recording:Series",
    "Contact": "cdtool.recording:Contact",
    "Signal": "cdtool.detection:Signal",
    "Status": "cdtool.detection:Status",
    "Band": "cdtool.detection:Band",
    "Alarm": "cdtool.detection:Alarm",
    "Verdict": "cdtool.detection:Verdict",
    "Detection": "cdtool.pipeline:Detection",
    "MachineFile": "cdtool.machine_file:MachineFile",
    "Signature": "cdtool.thresholds.signature:Signature",
    "Limit": "cdtool.thresholds.limit:Limit",
    "Cusum": "cdtool.thresholds.cusum:Cusum",
    "CdtoolError": "cdtool.errors:CdtoolError",
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
    "detect_runs",
    "explain",
    "explain_runs",
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
