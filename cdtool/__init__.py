"""cdtool: measure how quickly, how reliably and at which contact force a machine detects a collision.

Every command is available as a function:

    cdtool.read("run.csv", "machine.toml")                              -> Recording
        cdtool.init("run.csv")                                              -> Drafted: a draft of machine.toml
        cdtool.init_study(logs, "study")                                    -> DraftedStudy: also of benchmark.toml
        cdtool.convert("run.csv", "run.parquet", "machine.toml")            -> Converted
        cdtool.recover("damaged.mcap", "clean.mcap")                        -> Recovered
    cdtool.learn_signature(logs, "machine.toml", "feekf")               -> LearnedSignature
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

from lazy_loader import attach_stub

# The names are those of __init__.pyi; each is loaded at its first use.
__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
