"""The files that `cdtool identify` writes, by suffix: the machine file, the report and the JSON, all or none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from cdtool.base.errors import UsageError
from cdtool.base.files.foreign import Kind, refuse_inputs, refuse_other_kind
from cdtool.base.files.strict_json import strict_json
from cdtool.base.files.writing import write_texts
from cdtool.base.plain_text import plain
from cdtool.commands.identify.identifying import IdentifiedMachine
from cdtool.report.outputs import check_output_names

MACHINE, PAGE, JSON = ".toml", ".html", ".json"
_KINDS: Mapping[str, Kind] = {
    PAGE: Kind(b"<title>Identification", "HTML report of cdtool identify"),
    JSON: Kind(b'"tool": "cdtool identify"', "results of cdtool identify"),
}


def check_identification_files(targets: Sequence[Path], machine: Path, *, force: bool = False) -> None:
    """Raise UsageError for a target that cannot be written: an unknown suffix, a name given twice, an existing file.

    The machine file itself may be updated. A report or JSON of this command may be rewritten; any other existing file
    is replaced only with `force`.
    """
    check_output_names(targets, (MACHINE, PAGE, JSON))
    for target in targets:
        suffix = target.suffix.lower()
        if suffix in _KINDS:
            refuse_inputs([target], [machine])
            refuse_other_kind(target, _KINDS[suffix], force=force)
        elif target.exists() and not force and target.resolve() != machine.resolve():
            raise UsageError(f"{plain(target)}: already exists", "choose another name, or overwrite it with --force")


def write_identification(
    done: IdentifiedMachine, targets: Sequence[Path], inputs: Sequence[Path] = ()
) -> tuple[Path, ...]:
    """Write what was identified of one machine; return the files, which are replaced together, or none.

    With the machine file of a robot belongs its URDF, if its inertias are new; a machine file without any change is not
    written. `inputs`: the logs, which are never overwritten. Raises UsageError, OutputError.
    """
    from cdtool.commands.identify.page import identification_html

    texts: dict[Path, str] = {}
    for target in targets:
        suffix = target.suffix.lower()
        if suffix == MACHINE:
            texts |= dict(done.files_for(target))
        elif suffix == PAGE:
            texts[target] = identification_html(done)
    written = (*texts, *(target for target in targets if target.suffix.lower() == JSON))
    for target in targets:
        if target.suffix.lower() == JSON:
            texts[target] = strict_json({**done.summary, "outputs": [str(path) for path in written]}) + "\n"
    refuse_inputs(texts, inputs)
    write_texts({**_schemas(texts), **texts})
    return tuple(texts)


def _schemas(texts: Mapping[Path, str]) -> dict[Path, str]:
    """Return the schema that a machine file names beside itself, if it is not there: the file is in a new folder."""
    made: dict[Path, str] = {}
    for file, text in texts.items():
        if file.suffix.lower() == MACHINE and text.startswith("#:schema ./"):
            from cdtool.commands.console.json_schema import with_schema

            made |= {path: own for path, own in with_schema("machine", file, text).items() if not path.exists()}
    return made
