"""The signature file on disk: versioned JSON, written atomically, updated under a lock."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cdtool.alarms.activation import Activation
from cdtool.base.errors import OutputError, SignatureError, UsageError
from cdtool.base.files.bounded_loading import MOST_JSON, ContentError, parse_json, read_bytes
from cdtool.base.files.foreign import Kind
from cdtool.base.files.kinds import kind_of
from cdtool.base.files.writing import locked, write_text
from cdtool.base.remote.remote_path import location
from cdtool.base.value_words import fault_in_words, value_in_words
from cdtool.formats.signature_file import FactorOrigin, LearnedRun, SignatureFile
from cdtool.machines.dynamics import Gain
from cdtool.recordings.operations import HOW_TO_CUT, RunCut
from cdtool.recordings.plausible import PlausibleRanges
from cdtool.thresholds.base import FittedThreshold
from cdtool.thresholds.fitted_signature import known
from cdtool.thresholds.normal_motion import NormalMotion
from cdtool.thresholds.stored import fitted_from_dict, fitted_to_dict, rule_from_dict, rule_to_dict

# Of the layout of a file: a change of it counts on.
SCHEMA_VERSION = 5
# Version 3 has no plausible ranges and speed courses, and before 5 there were other normal motions, or none.
_READABLE = (3, 4, SCHEMA_VERSION)
_KIND = "cdtool signature"
# Beginning of every signature file: `_to_json` writes its kind first.
SIGNATURE = Kind(f'"kind": "{_KIND}"'.encode(), "signature")


def write_signature(path: str | Path, signature: SignatureFile) -> None:
    """Write a .json file, completely or not at all (see `cdtool.base.files.writing`). Raises SignatureError."""
    file = location(path)
    check_name(file)
    text = json.dumps(_to_json(signature), allow_nan=False)
    with _faults():
        write_text(file, text)


def check_name(file: Path) -> None:
    """Raise SignatureError for a name not allowed for a signature, which protects recordings."""
    if file.suffix.lower() != ".json":
        raise SignatureError(f"{file}: must end in .json", "choose another name")


def read_signature(path: str | Path) -> SignatureFile:
    """Read and check a signature file; raises SignatureError."""
    file = location(path)
    content = read_bytes(file, SignatureError, most=MOST_JSON, hint="create one with cdtool learn-signature")
    try:
        values = parse_json(content)
    except ContentError as fault:
        raise _no_signature(file, content, f": {fault}") from fault
    if not isinstance(values, dict) or values.get("kind") != _KIND:
        raise _no_signature(file, content)
    if values.get("schema_version") not in _READABLE:
        raise SignatureError(
            f"{file}: schema_version is {value_in_words(values.get('schema_version'))}; this version of cdtool "
            f"reads {' and '.join(map(str, _READABLE))}",
            "relearn it with this version",
        )
    try:
        return _from_json(values, str(file))
    except UsageError as fault:
        raise SignatureError(f"{file}: {fault.message}", fault.hint) from fault
    except Exception as fault:  # any exception from wrong values, including plug-in thresholds
        raise SignatureError(f"{file}: damaged signature file: {fault_in_words(fault)}", "relearn it") from fault


def _no_signature(file: Path, content: bytes, why: str = "") -> SignatureError:
    kind = kind_of(content)
    # A signature file is JSON itself, so a more specific message is used.
    own = not kind or kind in ("a signature file", "JSON")
    what = f"not a signature file{why}" if own else f"is {kind}, not a signature file"
    return SignatureError(f"{file}: {what}", "create one with cdtool learn-signature")


def rewrite_signature(path: str | Path, change: Callable[[SignatureFile], SignatureFile]) -> SignatureFile:
    """Read, change and write a file under a lock, so that no concurrent update is lost. Raises SignatureError."""
    with _faults(), locked(location(path)):
        stored = read_signature(path)
        changed = change(stored)
        if changed is not stored:
            write_signature(path, changed)
        return changed


@contextmanager
def _faults() -> Iterator[None]:
    """Convert errors while writing to SignatureError."""
    try:
        yield
    except (OutputError, UsageError) as fault:
        raise SignatureError(fault.message, fault.hint) from fault


def _to_json(signature: SignatureFile) -> dict[str, Any]:
    from cdtool.base.version import __version__  # looking it up takes as long as all of --help

    return {
        "kind": _KIND,
        "schema_version": SCHEMA_VERSION,
        "tool_version": __version__,
        "machine": {
            "name": signature.machine,
            "fingerprint": signature.machine_fingerprint,
            "parameters": signature.machine_parameters,
        },
        "detector": {"name": signature.detector, "gains": dict(signature.gains)},
        "unit": signature.unit,
        "joints": list(signature.joints),
        "threshold": rule_to_dict(signature.rule),
        "safety_factor_set": asdict(signature.origin),
        "activation": asdict(signature.activation),
        "operations": signature.operations,
        "plausible": signature.plausible.to_dict() if signature.plausible is not None else None,
        "runs": [asdict(run) for run in signature.runs],
        "current": [fitted_to_dict(signature.rule, item) for item in signature.current],
        "first": [fitted_to_dict(signature.rule, item) for item in signature.first],
        "normal_motion": None if signature.normal is None else [item.to_dict() for item in signature.normal],
    }


def _from_json(values: Mapping[str, Any], source: str) -> SignatureFile:
    rule = rule_from_dict(values["threshold"])
    current, first = (tuple(fitted_from_dict(rule, item) for item in values[name]) for name in ("current", "first"))
    joints = tuple(values["joints"])
    if not all(isinstance(name, str) for name in joints):
        raise ValueError("joints must be a list of names")
    _check_fitted(current, first, joints)
    normal = values.get("normal_motion") if values["schema_version"] == SCHEMA_VERSION else None
    return SignatureFile(
        machine=str(values["machine"]["name"]),
        machine_fingerprint=str(values["machine"]["fingerprint"]),
        detector=str(values["detector"]["name"]),
        gains={str(name): _gain(value) for name, value in values["detector"]["gains"].items()},
        unit=str(values["unit"]),
        joints=joints,
        rule=rule,
        origin=_origin(values["safety_factor_set"]),
        activation=_activation(values["activation"]),
        current=current,
        first=first,
        runs=tuple(LearnedRun(str(run["name"]), str(run["sha256"]), int(run["operation"])) for run in values["runs"]),
        operations=_operations(values["operations"]),
        source=source,
        plausible=PlausibleRanges.from_dict(values["plausible"]) if values.get("plausible") else None,
        normal=None if normal is None else tuple(NormalMotion.from_dict(item) for item in normal),
        machine_parameters=_parameters(values["machine"].get("parameters")),
    )


def _operations(value: object) -> str:
    try:
        if isinstance(value, str) and RunCut.of(value) is not None:
            return value
    except UsageError:
        pass
    return known("operations", value, HOW_TO_CUT)


def _check_fitted(current: Sequence[FittedThreshold], first: Sequence[FittedThreshold], joints: Sequence[str]) -> None:
    if not current or len(current) != len(first):
        raise ValueError(f"{len(current)} current thresholds, but {len(first)} first ones")
    for item in (*current, *first):
        if not 0.0 < item.safety_factor < math.inf:
            raise ValueError(f"safety factor {item.safety_factor}")
        motion = getattr(item, "motion", None)
        if motion is not None and not (motion.direction in (-1, 1) and 0.0 < motion.nominal_speed < math.inf):
            raise ValueError(f"a class of motion with direction {motion.direction:g}, speed {motion.nominal_speed:g}")
        if getattr(item, "joints", tuple(joints)) != tuple(joints):
            raise ValueError(f"joints {', '.join(joints) or 'none'}, but limits for other joints")


def _origin(values: Mapping[str, Any]) -> FactorOrigin:
    known("safety_factor_set", values["by"], ("default", "hand", "budget"))
    return FactorOrigin(**values)


def _activation(values: Mapping[str, Any]) -> Activation:
    debounce, latch = values["debounce"], values["latch"]
    if isinstance(debounce, bool) or not isinstance(debounce, int | None) or not isinstance(latch, bool):
        raise ValueError("activation: debounce must be a number of samples, latch true or false")
    return Activation(debounce, float(values["rearm"]), float(values["hysteresis"]), latch)


def _parameters(values: Any) -> Mapping[str, Any] | None:
    if values is not None and not isinstance(values, dict):
        raise ValueError("the machine's parameters must be a table")
    return values


def _gain(value: Any) -> Gain:
    return tuple(map(float, value)) if isinstance(value, list) else float(value)
