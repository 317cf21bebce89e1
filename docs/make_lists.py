"""Write the docs' lists of detectors and formats from the registry and the detectors' pages: python docs/make_lists.py

docs/detectors/index.md is written as a whole; in README.md and docs/containers.md the table between the
two comments is. A detector's page gives its rows in its first lines: the heading is the title, the first paragraph
says what the detector looks at, the second one says "Good at: ... Weak at: ... Use it: ...". A format's row is made of
its class: its suffixes and the first words of its docstring, and of the extra of its name in pyproject.toml.

A table of keys, between `<!-- keys: NAME -->` and `<!-- end -->`, has a row for each field of its model.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, fields
from enum import Enum
from pathlib import Path
from typing import Any

from cdtool.alarms.activation import Activation
from cdtool.base.settings import keys_of, kind_in_words
from cdtool.commands.inject.inject_section import InjectTable, ObstacleTable
from cdtool.commands.judging.named_logs import OnsetTable
from cdtool.commands.judging.settings_table import ForceTable, TriggersTable
from cdtool.commands.simulate.simulation_table import SimulationTable
from cdtool.commands.tune.options import TuneTable
from cdtool.detectors import DETECTORS
from cdtool.execution.workers import Execution
from cdtool.formats import FORMATS
from cdtool.machines.joint_machine import JointTable
from cdtool.machines.linear_axis import LinearAxisTable
from cdtool.machines.planar_arm import PlanarArmTable
from cdtool.machines.rotary_axis import RotaryAxisTable
from cdtool.machines.urdf_robot import UrdfRobotTable
from cdtool.thresholds.signature import Signature
from cdtool.truth.force.limits import ForceProfile, ForceStep, PressureLimit

DOCS = Path(__file__).resolve().parent
_BEGIN, _END = "<!-- made by docs/make_lists.py -->\n", "<!-- end -->\n"
_MODEL = "the machine file must give the inertia"
_INDEX = """# The detectors

Each page gives the equation, the signal and its unit, the gains with their defaults, and when the detector fails.
"Model" means inertia and friction in the [machine file](../machine-file.md), and for an arm or a robot also the
geometry; with coupled joints, a detector that uses a model also needs the position. [How to choose](../choosing.md)
compares them. `cdtool list detectors` also lists those of installed plug-ins.

| detector | short | needs | what it looks at | use it |
|---|---|---|---|---|
"""
_README = "| detector | short | needs | good at | weak at |\n|---|---|---|---|---|\n"
_CONTAINERS = "| format | what it reads | suffixes | `pip install` |\n|---|---|---|---|\n"
_KEYS = "| key | type | default | meaning |\n|---|---|---|---|\n"
_MODELS: Mapping[str, Any] = {
    "activation": Activation,
    "axis": LinearAxisTable,
    "execution": Execution,
    "force": ForceTable,
    "inject": InjectTable,
    "machine": JointTable,
    "obstacle": ObstacleTable,
    "onset": OnsetTable,
    "planar_arm": PlanarArmTable,
    "pressure": PressureLimit,
    "profile": ForceProfile,
    "rotary_axis": RotaryAxisTable,
    "signature": Signature,
    "simulation": SimulationTable,
    "step": ForceStep,
    "tune": TuneTable,
    "triggers": TriggersTable,
    "urdf_robot": UrdfRobotTable,
}
_SHORT = (
    ("one number or a list of numbers", "number(s)"),
    (", without quotes", ""),
    (" in quotes", ""),
    (" of at least", " ≥"),
    (" above", " >"),
    (" and of at most", ", ≤"),
    (" and below", ", <"),
)
_KEY_PAGES = ("benchmark-file", "machine-file", "force-limits", "simulators", "tuning")
# The keys that every machine has stand once, in the table "machine".
_ADDS_TO = dict.fromkeys(("axis", "rotary_axis", "planar_arm", "urdf_robot"), "machine")


@dataclass(frozen=True)
class Row:
    """What the tables say of a detector; `needs_model`: the machine file must give the inertia."""

    page: str
    title: str
    short_name: str
    needs: tuple[str, ...]
    needs_model: bool
    looks_at: str
    good_at: str
    weak_at: str
    use_it: str


def files() -> Mapping[Path, str]:
    """Return the files with their contents as they should be."""
    rows = [_row(name) for name in DETECTORS.names()]
    readme, containers = DOCS.parent / "README.md", DOCS / "containers.md"
    return {
        DOCS / "detectors" / "index.md": _INDEX + "".join(map(_index_line, rows)),
        readme: _with_table(readme, _README, map(_readme_line, rows)),
        containers: _with_table(containers, _CONTAINERS, map(_format_line, FORMATS.names())),
        **{page: _with_keys(page) for page in (DOCS / f"{name}.md" for name in _KEY_PAGES)},
    }


def _with_keys(page: Path) -> str:
    """Return a page with its tables of keys made again."""

    def made(found: re.Match[str]) -> str:
        return f"{found[1]}\n{_KEYS}{''.join(_key_lines(found[2]))}\n{_END}"

    return re.sub(r"(<!-- keys: (\w+) -->\n).*?<!-- end -->\n", made, page.read_text(encoding="utf-8"), flags=re.DOTALL)


def _key_lines(name: str) -> Iterator[str]:
    known = keys_of(_MODELS[_ADDS_TO[name]]) if name in _ADDS_TO else {}
    defaults = {item.name: item for item in fields(_MODELS[name])}
    for key in keys_of(_MODELS[name]).values():
        if key.name not in known:
            unit = f" [{key.extra['unit']}]" if key.extra.get("unit") else ""
            kind = f"{_kind(kind_in_words(key.hint))}{unit}"
            yield _line(f"`{key.name}`", kind, _default(defaults[key.attribute]), key.meaning)


def _kind(words: str) -> str:
    """`a number of at least 0 and below 1` -> `number ≥ 0, < 1`."""
    for long, short in _SHORT:
        words = words.replace(long, short)
    return words.removeprefix("a ")


def _default(item: Field[Any]) -> str:
    """Return the default as it is written in a file; empty if the meaning says it."""
    if item.default is MISSING and item.default_factory is MISSING:
        return "required"
    value = item.default
    if isinstance(value, tuple) and len(value) == 1:
        (value,) = value
    if value in (None, "", (), MISSING, math.inf):
        return ""
    if isinstance(value, Enum):
        return f'`"{value.value}"`'
    if isinstance(value, bool):
        return str(value).lower()
    return f'`"{value}"`' if isinstance(value, str) else f"{value:g}"


def _row(name: str) -> Row:
    detector = DETECTORS.load(name)
    page = f"{name.replace('_', '-')}.md"
    text = (DOCS / "detectors" / page).read_text(encoding="utf-8")
    heading, paragraph, use = (" ".join(part.split()) for part in text.split("\n\n")[:3])
    title = heading.removeprefix("# ").partition(" (")[0]
    said = re.fullmatch(r"Good at: (.+)\. Weak at: (.+)\. Use it: (.+)\.", use)
    if said is None:
        raise ValueError(f"{page}: its third paragraph is not 'Good at: ... Weak at: ... Use it: ...'")
    return Row(
        page, title, detector.short_name, detector.needs, _MODEL in " ".join(text.split()), paragraph, *said.groups()
    )


def _index_line(row: Row) -> str:
    needs = _words((*row.needs, *(["model"] if row.needs_model else [])))
    return _line(f"[{row.title}]({row.page})", f"`{row.short_name}`", needs, row.looks_at, row.use_it)


def _readme_line(row: Row) -> str:
    title = f"[{row.title}](docs/detectors/{row.page})"
    return _line(title, f"`{row.short_name}`", _words(row.needs), row.good_at, row.weak_at)


def _format_line(name: str) -> str:
    found = FORMATS.load(name)
    project = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    install = f"`'cdtool[{name}]'`" if name in project["optional-dependencies"] else "-"
    summary = found.__doc__.strip().partition("\n")[0].partition(": ")[0].rstrip(".")
    return _line(f"`{name}`", summary, f"`{' '.join(found.suffixes)}`", install)


def _words(names: tuple[str, ...]) -> str:
    return ", ".join(name.replace("_", " ") for name in names)


def _line(*cells: str) -> str:
    return f"| {' | '.join(cells)} |\n"


def _with_table(file: Path, head: str, lines: Iterable[str]) -> str:
    before, begin, rest = file.read_text(encoding="utf-8").partition(_BEGIN)
    _, end, after = rest.partition(_END)
    if not (begin and end):
        raise ValueError(f"{file.name}: the comments around its table are missing")
    return f"{before}{begin}\n{head}{''.join(lines)}\n{end}{after}"


if __name__ == "__main__":
    for path, content in files().items():
        path.write_text(content, encoding="utf-8")
