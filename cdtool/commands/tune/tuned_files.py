"""The machine file, benchmark files and signatures that use what was tuned, and the results as JSON values."""

from __future__ import annotations

import csv
import io
from dataclasses import asdict, fields, replace
from glob import escape
from pathlib import Path, PurePosixPath
from typing import Any

from cdtool.base.errors import ConfigurationError
from cdtool.base.files.bounded_loading import read_text
from cdtool.base.files.typed_json import plain
from cdtool.base.plain_text import digits
from cdtool.base.remote.remote_path import is_remote, joined, location, relative_name
from cdtool.base.toml_text import opened_table
from cdtool.base.version import __version__
from cdtool.commands.judging.settings_table import names_in
from cdtool.commands.learning.learning import LearnedSignature, Setting, learned_from_runs
from cdtool.commands.tune.options import TuneTable
from cdtool.commands.tune.search.tuned import TunedDetector
from cdtool.commands.tune.tuned_rows import Tuning
from cdtool.results.limits import ALL
from cdtool.thresholds.base import Threshold
from cdtool.thresholds.stored import rule_to_dict

MARK = "# Tuned by cdtool tune"
MACHINE, BENCHMARK, LABELS, LABELS_MARK = "machine.toml", "benchmark.toml", "labels.csv", "recording"
# Settings of the threshold that are in other tables of a benchmark file.
_ELSEWHERE = ("signature", "safety_factor", "limits")
# Tables with logs, and tables of such tables.
_WITH_LOGS, _OF_TABLES = ("learn", "holdout", "inject"), ("impacts", "campaigns", "points")


def machine_text(tuning: Tuning, folder: Path) -> str:
    """Return the machine file with the tuned gains, each with a comment; everything else is kept."""
    import tomlkit

    source = tuning.setup.machine_file.path
    document: Any = tomlkit.parse(read_text(source, ConfigurationError).removeprefix("\ufeff"))
    if "urdf" in document["machine"]:
        urdf = str(document["machine"]["urdf"])
        document["machine"]["urdf"] = relative_name(joined(source.parent, urdf), folder)
    for tuned in tuning.detectors:
        changed = [(name, value) for name, value in tuned.choice.gains if value != dict(tuned.default.gains).get(name)]
        if not changed:
            continue
        table = _detector_table(document, tuned)
        for name, value in changed:
            item = tomlkit.item(list(value) if isinstance(value, tuple) else value)
            item.comment(f"tuned at {tuning.options.budget}; was {dict(tuned.default.gains)[name]}")
            table[name] = item
    return f"{MARK} from {source.name}.\n{tomlkit.dumps(document)}"


def _detector_table(document: Any, tuned: TunedDetector) -> Any:
    """Return the table of a detector's gains, under the name that the file uses."""
    known = document.get("detectors", {})
    name = next((name for name in (tuned.detector, tuned.short_name) if name in known), tuned.detector)
    return opened_table(document, "detectors", name)


def benchmark_text(tuning: Tuning, tuned: TunedDetector, factor: float, folder: Path) -> str:
    """Return the benchmark file for one tuned detector and its safety factor: its paths are relative to `folder`."""
    import tomlkit

    setup = tuning.setup
    document: Any = tomlkit.parse(read_text(setup.path, ConfigurationError).removeprefix("\ufeff"))
    for key, value in setup.settings.items():  # of --set, in place of the file's
        *above, name = names_in(key)
        if above != ["threshold"]:  # the tuned one is written below
            opened_table(document, *above)[name] = value
    _rebase(document, setup.path.parent, folder)
    document["machine"] = MACHINE
    document["detectors"] = [tuned.detector]
    document.pop("false_alarm_budget", None)
    if "signature" in document:
        document["signature"].pop("safety_factor", None)
        if tuned.choice.rule.name != "signature":
            for name in ("adaptive_level", "speed_range"):  # of the threshold signature only
                document["signature"].pop(name, None)
    document["threshold"] = _threshold(tuned.choice.rule, setup.signature.sides)
    limited = document["threshold"]
    if tuned.choice.rule.name == "signature":
        limited = document.setdefault("signature", tomlkit.table())
    safety = tomlkit.item(factor)
    safety.comment(factor_words(tuning, tuned))
    limited["safety_factor"] = safety
    if tuned.debounce is not None:
        activation = document.setdefault("activation", tomlkit.table())
        item = tomlkit.item(tuned.debounce)
        item.comment("samples")
        activation["debounce"] = item
    _without_other_limits(document, tuned)
    # Keys of the file itself come before its first table.
    tables = [(key, document.pop(key)) for key in list(document) if isinstance(document[key], dict)]
    for key, table in tables:
        document[key] = table
    return "\n".join([*_why(tuning, tuned), tomlkit.dumps(document)])


def _threshold(rule: Threshold, sides: str | None) -> Any:
    """Return `threshold` of a benchmark file: the settings that differ from the rule's default ones and `sides`."""
    import tomlkit

    if rule.name == "signature":
        return rule.name
    table = tomlkit.table()
    table["name"] = rule.name
    default = type(rule)()
    for item in fields(rule):
        value = getattr(rule, item.name)
        usual = (None, getattr(default, item.name), sides if item.name == "sides" else None)
        if item.name not in _ELSEWHERE and value not in usual:
            table[item.name] = list(value) if isinstance(value, tuple) else value
    return table


def _rebase(document: Any, base: Path, folder: Path) -> None:
    """Make the paths of a benchmark file relative to another folder."""
    for name in _WITH_LOGS:
        if name in document:
            _rebase_logs(document[name], base, folder)
    of_conditions = document.get("conditions", {}).values()
    impacts = [condition["impacts"] for condition in of_conditions if "impacts" in condition]
    for tables in (*(document.get(name, {}) for name in _OF_TABLES), *impacts):
        for table in tables.values():
            _rebase_logs(table, base, folder)
    for condition in of_conditions:
        _rebase_logs(condition.get("holdout", {}), base, folder)
    if "labels" in document.get("onset", {}):
        document["onset"]["labels"] = LABELS
    for name, key in (("force", "limits"), ("inject", "folder")):
        if key in document.get(name, {}):
            document[name][key] = relative_name(joined(base, str(document[name][key])), folder)
    if "inject" in document and "folder" not in document["inject"]:
        document["inject"]["folder"] = relative_name(joined(base, "injected"), folder)


def _rebase_logs(table: Any, base: Path, folder: Path) -> None:
    def moved(entry: Any) -> Any:
        if isinstance(entry, dict):
            entry["path"] = _moved(str(entry["path"]), base, folder)
            return entry
        return _moved(str(entry), base, folder)

    if "logs" in table:
        logs = table["logs"]
        table["logs"] = [moved(entry) for entry in logs] if isinstance(logs, list) else moved(logs)


def _moved(pattern: str, base: Path, folder: Path) -> str:
    """Return a pattern of files below `base` as one below `folder`; the folders between are no pattern."""
    if is_remote(base) or is_remote(folder) or joined(base, pattern) == Path(pattern):
        return relative_name(joined(base, pattern), folder)
    between = relative_name(base, folder)
    if any(mark in between for mark in "*?[") and not (base / pattern).is_file():
        between = escape(between)
    return PurePosixPath(between, pattern).as_posix()


def labels_text(tuning: Tuning, folder: Path) -> str | None:
    """Return the label file with its recordings named from `folder`; None without a label file."""
    setup = tuning.setup
    if setup.labels is None:
        return None
    base = setup.path.parent
    text = read_text(location(setup.labels.source), ConfigurationError).removeprefix("\ufeff")
    rows = list(csv.reader(io.StringIO(text, newline="")))
    column = [name.strip() for name in rows[0]].index("recording")
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    for number, row in enumerate(rows):
        if number and len(row) > column:
            file, mark, run = row[column].strip().partition("#")
            if "/" in file and joined(base, file).is_file():
                row[column] = f"{relative_name(joined(base, file), folder)}{mark}{run}"
        writer.writerow(row)
    return out.getvalue()


def _without_other_limits(document: Any, tuned: TunedDetector) -> None:
    """Remove limits of other detectors."""
    limits = document.get("limits", {})
    for key in list(limits):
        if key.split(".")[0] not in (ALL, tuned.detector, tuned.short_name):
            del limits[key]


def _why(tuning: Tuning, tuned: TunedDetector) -> list[str]:
    """Return the comment at the head of a benchmark file: what was chosen, and why."""
    lines = [f"{MARK} from {tuning.setup.path.name} for {tuned.detector} at {tuning.options.budget}."]
    for words, figures in (("default", tuned.default_nested or tuned.default_apparent), ("tuned", tuned.honest)):
        if figures is not None:
            means = ", ".join(f"{name} {item.mean_ms:.1f} ms" for name, item in figures.groups.items())
            lines.append(f"# {words}: mean latency {means}; {figures.alarming} of {figures.free} free runs alarm.")
    lines.append(
        "# These results are from recordings not used for the choice."
        if tuned.nested
        else "# These results are apparent: on the recordings used for the choice. Check them on others."
    )
    return lines


def factor_words(tuning: Tuning, tuned: TunedDetector) -> str:
    """Return how the safety factor was set, in words."""
    words = f"for {tuning.options.budget}, set on {len(tuning.runs.operations)} runs"
    if tuned.correction > 1.0:
        words += f", times {digits(float(f'{tuned.correction:.3g}'))} because they also chose"
    return words


def tuned_signature(tuning: Tuning, tuned: TunedDetector) -> LearnedSignature:
    """Return the signature file of a tuned detector, learned from all runs; raises SignatureError, UsageError."""
    setup, activation = tuning.setup, tuning.setup.activation
    if tuned.debounce is not None:
        activation = replace(activation, debounce=tuned.debounce)
    detector = tuned.choice.detector(setup.machine_file.detector(tuned.detector))
    setting = Setting(setup.watched, setup.operations, activation, tuning.options.budget, setup.split)
    learned = learned_from_runs(tuning.runs, setup.machine_file, detector, tuned.choice.rule, setting)
    thresholds = tuple(
        item.with_safety_factor(tuned.correction * item.safety_factor) for item in learned.signature.current
    )
    return replace(learned, signature=replace(learned.signature, current=thresholds, first=thresholds))


def tuning_summary(tuning: Tuning) -> dict[str, Any]:
    """Return the results as JSON values."""
    options = tuning.options
    return {
        "tool": "cdtool tune",
        "tool_version": __version__,
        "machine": tuning.setup.machine_file.machine.name,
        "benchmark": tuning.setup.path.name,
        "benchmark_sha256": tuning.setup.digest,
        "false_alarm_budget": str(options.budget),
        "tune": plain({item.name: getattr(options, item.name) for item in fields(TuneTable)}),
        "injected_groups": [name for name, group in tuning.setup.impacts.items() if group.injected is not None],
        "split": tuning.setup.split.value,
        "contacts": dict(tuning.groups),
        "verdict": tuning.verdict[1],
        "checked_on_others": tuning.is_nested,
        "detectors": [_tuned_values(item) for item in tuning.detectors],
        "unusable": dict(tuning.unusable),
        "skipped": [asdict(item) for item in tuning.left_out],
    }


def _tuned_values(tuned: TunedDetector) -> dict[str, Any]:
    """Return a tuned detector by its names in Python, the rule of a threshold as a signature file has it."""
    candidates = {
        name: {"gains": dict(item.gains), "threshold": rule_to_dict(item.rule)}
        for name, item in (("default", tuned.default), ("choice", tuned.choice))
    }
    return {**plain(tuned), **candidates}


def files_of(tuning: Tuning) -> list[tuple[str, TunedDetector]]:
    """Return the name of each tuned detector's benchmark file: that of the best one is benchmark.toml."""
    first, *others = tuning.detectors
    return [(BENCHMARK, first), *((f"benchmark_{item.detector}.toml", item) for item in others)]


def described_choice(tuned: TunedDetector) -> str:
    """Return the searched settings of the threshold, and the gains that are not the default ones, in words."""
    rule, default = tuned.choice.rule, dict(tuned.default.gains)
    parts = [f"{name} {_short(getattr(rule, name))}" for name in getattr(rule, "searched", {})]
    parts += [f"{name} {_short(value)}" for name, value in tuned.choice.gains if value != default[name]]
    return ", ".join(parts)


def _short(value: Any) -> str:
    if isinstance(value, tuple):
        return "/".join(_short(item) for item in value)
    return digits(value) if isinstance(value, float | int) else str(value)
