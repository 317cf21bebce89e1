"""The docstrings of public names have numpydoc sections, and their examples run.

Public is what a user of the Python API or the author of a plug-in calls:

* every function of `cdtool.__all__`; its classes need a summary, the results also an example;
* every class in the tables of the detectors and the thresholds, and the methods of their contracts;
* every public function of `cdtool.detectors.base`, `cdtool.detectors.filters` and `cdtool.thresholds.base`, which are
  the tools of a plug-in, and of `cdtool.statistics`;
* every function of the detectors, the thresholds, and of truth, statistics and results together that another folder of
  cdtool imports.

A public function needs Parameters with a description of each, Returns, Raises if it raises an error itself, and
Examples; a class needs Parameters, Notes and Examples. Examples run as doctests, or name where there is one.
Properties, internal functions and the fields of results have a line each.
"""

from __future__ import annotations

import ast
import dataclasses
import doctest
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

import cdtool
from cdtool.base.settings import keys_of
from cdtool.detectors import DETECTORS
from cdtool.detectors.base import Detector
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.base import FittedThreshold, Threshold

ROOT = Path(__file__).parents[2]
ROOMS = ("detectors", "thresholds", "results")
OF_RESULTS = ("truth", "statistics")  # with the results one room
WHOLE_MODULES = ("cdtool.detectors.base", "cdtool.detectors.filters", "cdtool.thresholds.base")
STATISTICS = "cdtool.statistics"
# The classes of the API that have an example.
RESULTS = ("BenchmarkResult", "DetectionResult", "DetectionResults")
CONTRACTS = (Detector.signal, Threshold.fit, FittedThreshold.evaluate)

_IMPORT = re.compile(
    rf"^ *from (cdtool\.(?:{'|'.join((*ROOMS, *OF_RESULTS))})[\w.]*) import (\([^)]*\)|.*)", re.MULTILINE
)
_FUNCTION = re.compile(r"^def ([a-z]\w*)", re.MULTILINE)
_HEADING = re.compile(r"^([A-Z][a-z]+)\n-{3,}\n", re.MULTILINE)
_FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


@cache
def texts() -> dict[str, str]:
    """The text of every module of cdtool."""
    files = sorted((ROOT / "cdtool").rglob("*.py"))
    names = (".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for file in files)
    return {name: file.read_text(encoding="utf-8") for name, file in zip(names, files, strict=True)}


def room_of(module: str) -> str:
    """The folder of cdtool that a module is in."""
    room = f"{module}..".split(".")[1]
    return "results" if room in OF_RESULTS else room


def imported_elsewhere() -> Iterator[tuple[str, str]]:
    """Yield (module, name) of what a file imports from a folder of ROOMS that it is not in."""
    for user, text in texts().items():
        for module, names in _IMPORT.findall(text):
            if room_of(user) != room_of(module):
                yield from ((module, name) for name in re.findall(r"(\w+)(?: as \w+)?\s*(?:,|\)|$)", names))


def functions_of(module: str) -> set[tuple[str, str]]:
    return {(module, name) for name in _FUNCTION.findall(texts()[module])}


@cache
def names_of_functions() -> dict[str, Callable[..., Any]]:
    """Every public function of ROOMS by its full name."""
    wanted = {item for item in imported_elsewhere() if item in functions_of(item[0])}
    for module in texts():
        if module in WHOLE_MODULES or module.startswith(f"{STATISTICS}."):
            wanted |= functions_of(module)
    found = {f"{module}.{name}": getattr(import_module(module), name) for module, name in sorted(wanted)}
    return found | {f"{item.__module__}.{item.__qualname__}": item for item in CONTRACTS}


@cache
def api() -> dict[str, Callable[..., Any]]:
    return {f"cdtool.{name}": item for name, item in public().items() if not inspect.isclass(item)}


@cache
def public() -> dict[str, Any]:
    """Every name of `cdtool.__all__` but the version: functions, and the classes of the values that a user handles."""
    return {name: getattr(cdtool, name) for name in cdtool.__all__ if name != "__version__"}


@cache
def rules() -> dict[str, type]:
    """The classes in the tables of the detectors and the thresholds."""
    loaded = [registry.load(name) for registry in (DETECTORS, THRESHOLDS) for name in registry.table]
    return {f"{item.__module__}.{item.__qualname__}": item for item in loaded}


def sections(text: str) -> dict[str, str]:
    """The sections of a docstring by heading, and what is before them as ""."""
    parts = _HEADING.split(text)
    return {"": parts[0], **dict(zip(parts[1::2], parts[2::2], strict=True))}


def described(section: str) -> dict[str, str]:
    """The entries of a section Parameters: the description of each name."""
    entries = {}
    for part in re.split(r"^(?=\S)", section, flags=re.MULTILINE):
        names, separator, rest = part.partition(" : ")
        if separator:
            entries |= {name.strip().lstrip("*"): rest.partition("\n")[2].strip() for name in names.split(",")}
    return entries


def raises_itself(function: Callable[..., Any]) -> bool:
    """Whether the function has a raise statement, in itself and not in a function inside it."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(function))))
    waiting = list(tree.body[0].body) if isinstance(tree.body[0], ast.FunctionDef) else []
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Raise) and node.exc is not None:
            return True
        if not isinstance(node, ast.FunctionDef | ast.Lambda | ast.ClassDef):
            waiting += ast.iter_child_nodes(node)
    return False


def faults_of_function(function: Callable[..., Any], contract: bool = False) -> list[str]:
    found = sections(inspect.getdoc(function) or "")
    signature = inspect.signature(function)
    entries = described(found.get("Parameters", ""))
    needed = [name for name in signature.parameters if name != "self"]
    faults = [f"does not describe the parameter {name}" for name in needed if not entries.get(name)]
    faults += [f"describes {name}, which is not a parameter" for name in entries if name not in needed]
    if signature.return_annotation not in (None, "None") and not found.get("Returns", "").strip():
        faults.append("has no section Returns")
    if raises_itself(function) and not found.get("Raises", "").strip():
        faults.append("has no section Raises")
    return faults + ([] if contract else faults_of_text(found))


def faults_of_class(rule: type) -> list[str]:
    found = sections(inspect.getdoc(rule) or "")
    fields = {item.name: item for item in dataclasses.fields(rule)}
    entries = described(found.get("Parameters", ""))
    # A field of settings is described by its annotation.
    keys = {key.attribute: key.meaning for key in keys_of(rule).values()}
    entries |= {name: keys.get(name) or "filled in" for name in fields if name not in entries and found and keys}
    faults = [f"does not describe {name}" for name in fields if not entries.get(name)]
    faults += [f"describes {name}, which is not a field" for name in entries if name not in fields]
    units = {name: item.metadata.get("unit", "1") for name, item in fields.items()}
    faults += [
        f"does not state the unit [{unit}] of {name}"
        for name, unit in units.items()
        if unit != "1" and f"[{unit}]" not in entries.get(name, "")
    ]
    if "__post_init__" in vars(rule) and "Raises" not in found:
        faults.append("has no section Raises")
    if not re.search(r"Fails\b", found.get("Notes", "")):
        faults.append("does not state in Notes when it fails")
    return faults + faults_of_text(found)


def faults_of_text(found: dict[str, str]) -> list[str]:
    """What is wrong with the summary and the examples of a docstring."""
    summary, examples = found[""].strip().split("\n\n")[0], found.get("Examples", "")
    faults = [] if summary.endswith((".", "?")) and "\n" not in summary else ["has no summary of one line"]
    if ">>>" not in examples and not any(name in known_names() for name in re.findall(r"`([\w.]+)`", examples)):
        faults.append("has no example, and does not name a documented function that has one")
    return faults


@cache
def known_names() -> set[str]:
    """The names of functions with an example of their own, as a docstring writes them."""
    functions = {**api(), **names_of_functions()}
    with_example = [name for name, item in functions.items() if ">>>" in (inspect.getdoc(item) or "")]
    return {
        *with_example,
        *(name.rpartition(".")[2] for name in with_example if not name.startswith("cdtool.commands")),
    }


@pytest.mark.parametrize("name", sorted(api()))
def test_a_function_of_the_api_describes_every_keyword_what_it_returns_and_raises(name):
    faults = faults_of_function(api()[name])
    if "Raises" not in sections(inspect.getdoc(api()[name]) or ""):
        faults.append("has no section Raises")
    assert not faults, f"{name}: {'; '.join(faults)}"


def test_the_public_functions_of_the_method_have_their_sections():
    faults = {
        name: faults_of_function(function, contract=function in CONTRACTS)
        for name, function in names_of_functions().items()
    }
    assert not {name: found for name, found in faults.items() if found}


def test_a_class_of_the_api_has_a_summary_of_one_line_and_its_methods_are_described():
    faults = set()
    for name, kind in public().items():
        if inspect.isclass(kind):
            texts_of = {name: inspect.getdoc(kind)}
            own = {key: item for key, item in vars(kind).items() if not key.startswith("_")}
            described_ones = {key: item for key, item in own.items() if callable(item) or isinstance(item, property)}
            texts_of |= {f"{name}.{key}": inspect.getdoc(item) for key, item in described_ones.items()}
            firsts = {key: (text or "").split("\n\n")[0] for key, text in texts_of.items()}
            faults |= {key for key, first in firsts.items() if not first or first[-1] not in ".:?"}
    assert not faults


@pytest.mark.parametrize("name", sorted(rules()))
def test_a_detector_or_threshold_describes_its_settings_with_units_its_equation_and_when_it_fails(name):
    assert not faults_of_class(rules()[name])


def run(tests: list[doctest.DocTest]) -> str:
    """Run examples; return what is wrong, empty if all are right."""
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=_FLAGS, verbose=False)
    for test in tests:
        runner.run(test, out=said.append)
    return "".join(said)


@pytest.mark.usefixtures("checkout")
@pytest.mark.parametrize("name", sorted({*api(), *rules(), *RESULTS}))
def test_an_example_runs(name):
    item = (public() | api() | rules())[name]
    known = dict(vars(import_module(item.__module__))) if name in rules() else {}
    test = doctest.DocTestParser().get_doctest(inspect.getdoc(item) or "", known, name, name, 0)
    assert test.examples
    assert not run([test])


@pytest.mark.usefixtures("checkout")
@pytest.mark.parametrize("room", ROOMS)
def test_the_other_examples_of_the_method_run(room):
    modules = [name for name, text in texts().items() if room_of(name) == room and ">>>" in text]
    tests = [test for name in modules for test in doctest.DocTestFinder().find(import_module(name), name)]
    tests = [test for test in tests if test.name not in rules()]
    assert sum(bool(test.examples) for test in tests) > 10
    assert not run(tests)
