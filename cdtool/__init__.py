"""cdtool: measure how quickly, how reliably and at which contact force a machine detects a collision.

Every command is available as a function:

    cdtool.read("run.csv", "machine.toml")                              -> Recording
        cdtool.init("run.csv")                                              -> Drafted: a draft of machine.toml
        cdtool.init_study(logs, "study")                                    -> DraftedStudy: also of benchmark.toml
        cdtool.convert("run.csv", "run.parquet", "machine.toml")            -> Converted
        cdtool.recover("damaged.mcap", "clean.mcap")                        -> Recovered
    cdtool.learn_signature(logs, "machine.toml", "feekf")               -> Learned
    cdtool.check_signature("gate.json", logs, "machine.toml")           -> Checked: coverage, drift, advice
    cdtool.forecast_signature("gate.json", logs, "machine.toml", ...)   -> Forecasted: false alarms by temperature, date
    cdtool.update_signature("gate.json", logs, "machine.toml")          -> Updated: the runs added and refused
    cdtool.detect("hit.csv", "machine.toml", signature="gate.json")     -> Detected
        cdtool.detect_runs("cycles.csv", "machine.toml", operations="column:run_id", signature="gate.json")
    cdtool.explain("hit.csv", "machine.toml", signature="gate.json")    -> Explained
        cdtool.explain_runs("cycles.csv", "machine.toml", operations="column:run_id", signature="gate.json")
    cdtool.benchmark("benchmark.toml")                                  -> Benchmark
    cdtool.protocol("protocol.toml")                                    -> Protocol: of a force test, to be signed
    cdtool.score("triggers.csv", "benchmark.toml")                      -> Score
    cdtool.compare("old.json", "new.json")                              -> BuildComparison
    cdtool.plan(missed_at_most="5%")                                    -> Plan
    cdtool.identify(logs, "machine.toml", "machine.toml")               -> IdentifiedMachine: parameters with errors
    cdtool.inject("benchmark.toml", "injected")                         -> Injected: impacts made from impact-free logs
    cdtool.coverage("benchmark.toml")                                   -> Coverage: latency over position and stiffness
    cdtool.tune("benchmark.toml", "1/100op")                            -> Tuning: gains, threshold, debounce
    cdtool.info("run.csv", machine="machine.toml")                      -> Info
    cdtool.study_sensors("machine.toml", ...)                           -> SensorStudy
    cdtool.simulate_gate(folder, {"free": 14, "stiff": 30}, seed=1)     -> number of recordings written
    cdtool.simulate_arm(folder, {"free": 14, "stiff": 30}, seed=1, trial=2)  -> the same
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdtool.simulation.arm_recordings import write_arm_recordings as simulate_arm
    from cdtool.simulation.gate_recordings import write_gate_recordings as simulate_gate
    from cdtool.version import __version__
    from cdtool.workflows.benchmark.benchmark import benchmark
    from cdtool.workflows.comparing import compare
    from cdtool.workflows.convert.converting import convert
    from cdtool.workflows.coverage import coverage
    from cdtool.workflows.detection import detect, detect_runs
    from cdtool.workflows.explaining import explain, explain_runs
    from cdtool.workflows.identification.identifying import identify
    from cdtool.workflows.information import info
    from cdtool.workflows.init.drafting import init, init_study
    from cdtool.workflows.injecting import inject
    from cdtool.workflows.planning import plan
    from cdtool.workflows.protocol.making import protocol
    from cdtool.workflows.recovering import recover
    from cdtool.workflows.runs import read_log as read
    from cdtool.workflows.score_triggers import score
    from cdtool.workflows.signature.forecasting import forecast_signature
    from cdtool.workflows.signature.learning import learn_signature
    from cdtool.workflows.signature.upkeep import check_signature
    from cdtool.workflows.signature.upkeep import update_with_runs as update_signature
    from cdtool.workflows.study.study import study_sensors
    from cdtool.workflows.tuning.tuning import tune

_API = {
    "__version__": "cdtool.version:__version__",
    "read": "cdtool.workflows.runs:read_log",
    "learn_signature": "cdtool.workflows.signature.learning:learn_signature",
    "check_signature": "cdtool.workflows.signature.upkeep:check_signature",
    "forecast_signature": "cdtool.workflows.signature.forecasting:forecast_signature",
    "update_signature": "cdtool.workflows.signature.upkeep:update_with_runs",
    "coverage": "cdtool.workflows.coverage:coverage",
    "detect": "cdtool.workflows.detection:detect",
    "detect_runs": "cdtool.workflows.detection:detect_runs",
    "explain": "cdtool.workflows.explaining:explain",
    "explain_runs": "cdtool.workflows.explaining:explain_runs",
    "benchmark": "cdtool.workflows.benchmark.benchmark:benchmark",
    "score": "cdtool.workflows.score_triggers:score",
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
    "tune": "cdtool.workflows.tuning.tuning:tune",
    "simulate_arm": "cdtool.simulation.arm_recordings:write_arm_recordings",
    "simulate_gate": "cdtool.simulation.gate_recordings:write_gate_recordings",
}

__all__ = [
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
    "forecast_signature",
    "identify",
    "info",
    "init",
    "init_study",
    "inject",
    "learn_signature",
    "plan",
    "protocol",
    "read",
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
        raise AttributeError(f"module 'cdtool' has no attribute '{name}'")
    module, _, attribute = _API[name].partition(":")
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted([*globals(), *_API])
