"""Faulty plug-ins: one clear line that names the package, and the others work."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cdtool.detectors import DETECTORS
from tests.command import Outcome, cdtool

GATE = Path(__file__).parents[2] / "sample_logs" / "gate"
LOG = GATE / "stiff" / "03.csv"

DETECTOR = """
from dataclasses import dataclass
from typing import ClassVar
import numpy as np
from cdtool.detectors.detection import Signal
from cdtool.detectors.base import gain
from cdtool.detectors.look import Look

@dataclass(frozen=True)
class Plugin:
    factor: float = gain(1.0, "1", "a factor")
    name: ClassVar[str] = "odd"
    short_name: ClassVar[str] = "od"
    title: ClassVar[str] = "Odd"
    needs: ClassVar[tuple[str, ...]] = ("torque",)
    signed: ClassVar[bool] = True

    def unit(self, machine): return "N"

    def signal(self, recording, machine):
        torque = recording["torque"]
        values, status = torque.values.copy(), np.zeros(torque.values.shape, dtype=np.uint8)
        return Signal(torque.time, values, status, "N")
"""

Install = Callable[..., None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """A package of one module and one entry point, as installed by pip, for the duration of a test."""
    modules = []

    def write(code: str, name: str = "odd", group: str = "detectors", package: str = "odd-things") -> None:
        folder = tmp_path / package
        info, module = folder / f"{package}-1.0.dist-info", f"{package.replace('-', '_')}_module"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n", encoding="utf-8")
        (info / "entry_points.txt").write_text(f"[cdtool.{group}]\n{name} = {module}:Plugin\n", encoding="utf-8")
        (folder / f"{module}.py").write_text(code, encoding="utf-8")
        monkeypatch.syspath_prepend(folder)
        modules.append(module)

    yield write
    for module in modules:
        sys.modules.pop(module, None)


def detect(name: str, *logs: Path) -> Outcome:
    return cdtool("detect", *(logs or (LOG,)), "-m", GATE / "machine.toml", "-d", name, "--set=threshold.limits=4")


def test_the_template_detector_is_valid(install):
    install(DETECTOR)
    assert detect("odd").status == detect("od").status == detect("OD").status == cdtool("list", "detectors").status == 0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (DETECTOR, "import no_such_module", "cannot be loaded: ModuleNotFoundError"),
        (DETECTOR, "def (", "cannot be loaded: SyntaxError"),
        (DETECTOR, "x = 1", "cannot be loaded: AttributeError"),
        ('"odd"', '"even"', "is named 'even' in its class"),
        ("    signed: ClassVar[bool] = True\n", "", "has no attribute 'signed'"),
        ("def signal", "def signals", "has no attribute 'signal'"),
        ('"od"', '"gm"', "has the short name 'gm', which belongs to momentum"),
        ("(frozen=True)", "", "is not a frozen dataclass"),
        ('gain(1.0, "1", "a factor")', "1.0", "has no unit and no meaning for 'factor'"),
        (' = gain(1.0, "1", "a factor")', "", "has no default for 'factor'"),
        (
            "    signed",
            "    look: ClassVar[str] = 'red'\n    signed",
            "has an attribute 'look' that is not of type Look",
        ),
        (
            "    signed",
            "    look = Look('red', 'o')\n    signed",
            'cannot be loaded: ConfigurationError("the colour of a',
        ),
        (
            "    signed",
            "    look = Look('#ff0000', '*')\n    signed",
            'cannot be loaded: ConfigurationError("the marker of',
        ),
    ],
)
def test_a_package_that_cannot_be_used_is_one_line_that_names_it(install, old, new, words):
    assert DETECTOR.count(old) == 1
    install(DETECTOR.replace(old, new))
    done = detect("odd")
    assert done.status == 2 and done.out == "" and done.err.count("\n") == 1, done.err
    assert f"detector plug-in 'odd' of package 'odd-things' {words}" in done.err
    assert done.err.endswith("(repair or uninstall 'odd-things')\n")


def test_the_others_are_listed_despite_an_unusable_package(install):
    install("import no_such_module")
    listed = cdtool("list", "detectors", "--json")
    assert listed.status == 3 and [entry["name"] for entry in json.loads(listed.out)] == DETECTORS.names()
    assert "left out: odd: detector plug-in 'odd' of package 'odd-things' cannot be loaded" in listed.err
    unknown = detect("momentun")
    assert unknown.status == 2 and "unknown detector 'momentun'; " in unknown.err
    assert "(did you mean momentum" in unknown.err
    assert "package 'odd-things' cannot be loaded" in unknown.err


def test_a_name_of_cdtool_itself_is_refused_and_cdtools_own_is_used(install):
    install(DETECTOR.replace('"odd"', '"momentum"'), "momentum")
    listed = cdtool("list", "detectors")
    assert listed.status == 3 and listed.out.count("momentum (gm): Momentum observer") == 1
    assert "'momentum' of package 'odd-things' has the name of a detector of cdtool itself" in listed.err
    assert detect("momentum").status == 0


def test_two_packages_with_one_name_are_both_named(install):
    install(DETECTOR, package="one")
    install(DETECTOR, package="two")
    done = detect("odd")
    assert done.status == 2 and "the packages one and two both provide a detector 'odd'" in done.err


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("torque = recording", "1 / 0; torque = recording", "fails: ZeroDivisionError"),
        ("return Signal(", "return (", "returns tuple, not a Signal"),
        ("torque.time, values", "torque.time, values.tolist()", "are not arrays"),
        ("torque.values.copy()", "torque.values[:, 0].copy()", "samples by joints"),
        ("torque.values.copy()", "np.hstack((torque.values, torque.values))", "samples by joints"),
        ("torque.time, values", "torque.time[1:], values", "samples by joints"),
        ("dtype=np.uint8", "dtype=int", "and a uint8 status are needed"),
        ("torque.time, values", "torque.time[::-1], values", "times that do not strictly increase"),
        ("torque.values.copy()", "np.where(torque.values > 0, np.nan, 0.0)", "valid but not finite"),
        ('status, "N")', 'status, "N", lost=np.zeros(3, dtype=bool))', "marks of lost samples"),
        ('status, "N")', 'status, "N", lost=values)', "marks of lost samples"),
    ],
)
def test_a_signal_that_breaks_the_contract_is_one_line(install, old, new, words):
    assert DETECTOR.count(old) == 1
    install(DETECTOR.replace(old, new))
    done = detect("odd")
    assert done.status == 2 and done.err.count("\n") == 1, done.err
    assert "03.csv: detector odd " in done.err and words in done.err and "docs/own-detector.md" in done.err


def test_a_detector_that_fails_in_some_logs_is_left_out_there_by_name_and_in_all_by_that_of_the_first(install):
    install(DETECTOR.replace("torque = recording", 'assert "03" not in recording.name; torque = recording'))
    done = detect("odd", LOG, GATE / "stiff" / "04.csv")
    assert done.status == 3 and "04.csv" in done.out
    assert "03.csv: detector odd fails: AssertionError() in odd_things_module.py, line 21" in done.err


def benchmark_file(folder: Path) -> Path:
    text = f'machine = "{GATE}/machine.toml"\ndetectors = ["gm"]\nthreshold = "limit"\n'
    text += f'[learn]\nlogs = ["{GATE}/free/03.csv", "{GATE}/free/04.csv"]\n'
    text += f'[impacts.stiff]\nlogs = ["{GATE}/stiff/03.csv"]\n'
    (folder / "benchmark.toml").write_text(text, encoding="utf-8")
    return folder / "benchmark.toml"


@pytest.mark.parametrize("new", ["import no_such_module", DETECTOR.replace("torque = rec", "1 / 0; torque = rec")])
def test_all_detectors_run_except_an_unusable_one_which_is_named(install, tmp_path, new):
    install(new)
    done = cdtool("benchmark", benchmark_file(tmp_path), "--detectors", "all", "--json")
    results = json.loads(done.out)
    assert done.status == 0 and results["detectors"] == list(DETECTORS.names())
    (finding,) = [item for item in results["findings"] if item["recording"] == "odd"]
    assert finding["reason"].startswith("left out: ") and "odd" in done.err


def test_a_detector_that_cannot_learn_does_not_stop_others(install, tmp_path):
    install(DETECTOR.replace("torque = recording", "1 / 0; torque = recording"))
    why = "detector odd fails: ZeroDivisionError"
    done = cdtool("benchmark", benchmark_file(tmp_path), "--detectors", "gm,odd", "--json")
    outcomes = {(item["detector"], item["outcome"]) for item in json.loads(done.out)["contacts"]}
    assert done.status == 3 and outcomes == {("momentum", "detected"), ("odd", "not_assessable")}
    assert done.err.count(why) == 1 and "left out: odd: not assessable: " in done.err
    alone = cdtool("benchmark", benchmark_file(tmp_path), "--detectors", "odd")
    assert alone.status == 2 and alone.err.count("\n") == 1 and why in alone.err and "remove odd from" in alone.err


THRESHOLD = """
from dataclasses import dataclass, replace
from typing import ClassVar
import numpy as np
from cdtool.detectors.detection import Band
from cdtool.thresholds.limit import FittedLimit

class Fitted(FittedLimit):
    def evaluate(self, recording, signal):
        statistic, band = super().evaluate(recording, signal)
        return statistic, band

@dataclass(frozen=True)
class Plugin:
    safety_factor: float = 5.5
    name: ClassVar[str] = "odd"
    needs: ClassVar[tuple[str, ...]] = ()
    fitted: ClassVar[tuple[type, ...]] = (Fitted,)

    def fit(self, pairs):
        return Fitted((-100.0,), (100.0,), (1.0,), (1.0,), self.safety_factor)
"""


def benchmark_with_threshold(folder: Path) -> Outcome:
    path = benchmark_file(folder)
    path.write_text(path.read_text(encoding="utf-8").replace('"limit"', '"odd"'), encoding="utf-8")
    return cdtool("benchmark", path)


def test_the_template_threshold_is_valid(install, tmp_path):
    install(THRESHOLD, group="thresholds")
    assert benchmark_with_threshold(tmp_path).status == 0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("return Fitted(", "return 1 / 0, (", "threshold odd fails: ZeroDivisionError"),
        ("return Fitted(", "return FittedLimit(", "threshold odd returns FittedLimit, its `fitted` names Fitted"),
        ("return statistic, band", "return 1 / 0", "threshold Fitted fails: ZeroDivisionError"),
        ("return statistic, band", "return statistic, Band(band.lower[1:], band.upper)", "another shape"),
        ("return statistic, band", "return statistic, Band(band.lower, band.upper + np.nan)", "returns NaN where its"),
    ],
)
def test_a_threshold_that_breaks_the_contract_is_one_line(install, tmp_path, old, new, words):
    assert THRESHOLD.count(old) == 1
    install(THRESHOLD.replace(old, new), group="thresholds")
    done = benchmark_with_threshold(tmp_path)
    # The middle of a long line is cut: its end names the error.
    assert done.status == 2 and words[-25:] in done.err and "docs/own-detector.md" in done.err
    assert "Traceback" not in done.err


@pytest.mark.parametrize("method", ["with_safety_factor", "to_dict"])
def test_a_threshold_whose_other_methods_fail_is_one_line_too(install, tmp_path, method):
    broken = f"class Fitted(FittedLimit):\n    def {method}(self, *given): return 1 / 0\n"
    install(THRESHOLD.replace("class Fitted(FittedLimit):\n", broken), group="thresholds")
    learn = ("learn-signature", GATE / "free/03.csv", GATE / "free/04.csv", "-m", GATE / "machine.toml")
    done = cdtool(*learn, "-d", "gm", "--set=threshold=odd", "-o", tmp_path / "s.json")
    if method == "with_safety_factor":
        assert done.status == 0, done.err
        for command in (("detect", LOG, "--set=activation.hysteresis=0.2"), ("explain", LOG)):
            done = cdtool(*command, "-m", GATE / "machine.toml", "-s", tmp_path / "s.json")
            assert done.status == 2 and "threshold Fitted fails: ZeroDivisionError" in done.err, done.err
    else:
        assert done.status == 2 and "threshold odd cannot be stored: ZeroDivisionError" in done.err, done.err
    assert "Traceback" not in done.err


def test_a_program_error_never_has_the_status_of_a_violated_limit(monkeypatch, tmp_path):
    def fault(*_: object, **__: object) -> None:
        raise ZeroDivisionError("deep inside")

    monkeypatch.setattr("cdtool.commands.scoring.benchmark.read_benchmark_file", fault)
    done = cdtool("benchmark", benchmark_file(tmp_path))
    assert done.status == 2 and "ZeroDivisionError" in done.err


WRITER = """
from cdtool.base.files.writing import write_text
from cdtool.base.files.foreign import Kind
from cdtool.report.writers.base import Writer

class Plugin(Writer):
    name = "odd"
    suffixes = (".txt",)
    kinds = {".txt": Kind(b"cdtool: ", "list of cdtool")}

    def write(self, report, target):
        write_text(target, "cdtool: " + ", ".join(report.evaluated.results.detectors) + chr(10))
"""


def test_a_report_is_written_by_the_writer_of_another_package(install, tmp_path):
    install(WRITER, group="writers")
    done = cdtool("benchmark", benchmark_file(tmp_path), "-o", tmp_path / "list.txt", "-o", tmp_path / "results.json")
    assert done.status == 0 and (tmp_path / "list.txt").read_text(encoding="utf-8") == "cdtool: momentum\n"
    assert cdtool("report", tmp_path / "results.json", "-o", tmp_path / "list.txt").status == 0
    (tmp_path / "list.txt").write_text("my own", encoding="utf-8")
    refused = cdtool("report", tmp_path / "results.json", "-o", tmp_path / "list.txt")
    assert refused.status == 2 and "contains no list of cdtool" in refused.err
    listed = json.loads(cdtool("list", "writers", "--json").out)
    assert listed[-1]["name"] == "odd" and listed[-1]["suffixes"] == [".txt"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('(".txt",)', '("txt",)', "cannot be loaded: ConfigurationError"),
        ('{".txt"', '{".text"', "cannot be loaded: ConfigurationError"),
        ("(Writer)", "", "has no attribute 'in_folder'"),
        ('name = "odd"', 'name = "odd"; subject = "comparisons"', "cannot be loaded: ConfigurationError"),
    ],
)
def test_a_writer_that_cannot_be_used_is_listed_as_left_out(install, old, new, words):
    assert WRITER.count(old) == 1
    install(WRITER.replace(old, new), group="writers")
    listed = cdtool("list", "writers")
    assert listed.status == 3 and f"writer plug-in 'odd' of package 'odd-things' {words}" in listed.err


def test_a_writer_that_fails_is_one_line_and_leaves_the_file(install, tmp_path):
    assert WRITER.count('"cdtool: " + ') == 1
    install(WRITER.replace('"cdtool: " + ', '"cdtool: " + 1 / 0 + '), group="writers")
    (tmp_path / "list.txt").write_text("cdtool: earlier\n", encoding="utf-8")
    done = cdtool("benchmark", benchmark_file(tmp_path), "-o", tmp_path / "list.txt")
    assert done.status == 2 and "list.txt: writer odd fails: ZeroDivisionError" in done.err, done.err
    assert "Traceback" not in done.err and "odd_things_module.py, line " in done.err
    assert (tmp_path / "list.txt").read_text(encoding="utf-8") == "cdtool: earlier\n"
