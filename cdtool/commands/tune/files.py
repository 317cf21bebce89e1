"""The files in the folder that `cdtool tune` writes: machine file, benchmark files, signatures, report and JSON."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from cdtool.base.errors import UsageError
from cdtool.base.files.foreign import Kind, refuse_inputs, refuse_other_kind
from cdtool.base.files.strict_json import strict_json
from cdtool.base.files.writing import write_texts
from cdtool.base.plain_text import plain
from cdtool.base.remote.remote_path import is_remote
from cdtool.commands.console.json_schema import refuse_other_schema, with_schema
from cdtool.commands.tune.tuned_files import (
    LABELS,
    LABELS_MARK,
    MACHINE,
    MARK,
    benchmark_text,
    files_of,
    labels_text,
    machine_text,
    tuned_signature,
    tuning_summary,
)
from cdtool.commands.tune.tuned_rows import Tuning
from cdtool.formats.signature_store import SIGNATURE, write_signature

PAGE, JSON = "tuning.html", "tuning.json"
_KINDS = {
    ".toml": Kind(MARK.encode(), "file of cdtool tune"),
    ".html": Kind(b"<title>Tuning", "report of cdtool tune"),
    ".json": Kind(b'"tool": "cdtool tune"', "results of cdtool tune"),
}


def signature_name(detector: str) -> str:
    """Return the name of a detector's signature file."""
    return f"signature_{detector}.json"


def check_folder(folder: Path, inputs: Iterable[Path], detectors: Iterable[str] = (), *, force: bool = False) -> None:
    """Check that the files of a tuning may be written into a folder.

    Raises UsageError for a folder at a URL, a file of that name, an input in it that would be replaced, or a file that
    `cdtool tune` did not write, unless `force`.
    """
    if is_remote(folder):
        raise UsageError(f"--output is '{plain(folder)}'", "give a folder of this machine")
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{plain(folder)}: exists and is not a folder", "choose another name")
    kinds = {folder / name: _KINDS[Path(name).suffix] for name in (MACHINE, "benchmark.toml", PAGE, JSON)}
    kinds[folder / LABELS] = Kind(LABELS_MARK.encode(), "file of cdtool tune")
    for name in detectors:
        kinds[folder / f"benchmark_{name}.toml"] = _KINDS[".toml"]
        kinds[folder / signature_name(name)] = SIGNATURE
    refuse_inputs(kinds, inputs)
    for schema in ("machine", "benchmark"):
        refuse_other_schema(schema, folder / MACHINE, force=force)
    for target, kind in kinds.items():
        refuse_other_kind(target, kind, force=force)


def open_folder(folder: Path, inputs: Iterable[Path], detectors: Iterable[str] = (), *, force: bool = False) -> None:
    """Create the output folder before the search; raises UsageError (see `check_folder`)."""
    check_folder(folder, inputs, detectors, force=force)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        raise UsageError(f"{plain(folder)}: cannot be created: {fault.strerror}", "choose another name") from fault


def write_tuning(tuning: Tuning, folder: Path) -> tuple[Path, ...]:
    """Write what was tuned into a folder, all texts or none; return the files. Raises OutputError, SignatureError."""
    from cdtool.commands.tune.page import tuning_html

    learned = {tuned.detector: tuned_signature(tuning, tuned).signature for tuned in tuning.detectors}
    texts = with_schema("machine", folder / MACHINE, machine_text(tuning, folder))
    for name, tuned in files_of(tuning):
        factor = learned[tuned.detector].current[0].safety_factor
        texts |= with_schema("benchmark", folder / name, benchmark_text(tuning, tuned, factor, folder))
    texts[folder / PAGE] = tuning_html(tuning)
    texts[folder / JSON] = strict_json(tuning_summary(tuning)) + "\n"
    if (labels := labels_text(tuning, folder)) is not None:
        texts[folder / LABELS] = labels
    signatures = {folder / signature_name(name): signature for name, signature in learned.items()}
    write_texts(texts)
    for path, signature in signatures.items():
        write_signature(path, signature)
    return (*texts, *signatures)
