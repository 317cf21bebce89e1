"""The files that `cdtool identify` writes, by suffix: the machine file, the report and the JSON, all or none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from cdtool.base.errors import UsageError
from cdtool.base.files.foreign import Kind, refuse_inputs, refuse_other_kind
from cdtool.base.files.strict_json import strict_json
from cdtool.base.files.writing import write_texts
from cdtool.base.plain_text import plain
from cdtool.commands.identify.fleet_identification import FleetIdentification
from cdtool.commands.identify.identifying import IdentifiedMachine
from cdtool.report.output_names import check_output_names

MACHINE, PAGE, JSON = ".toml", ".html", ".json"
_KINDS: Mapping[str, Kind] = {
    PAGE: Kind(b"<title>Identification", "HTML report of cdtool identify"),
    JSON: Kind(b'"tool": "cdtool identify"', "results of cdtool identify"),
}


def check_identification_files(
    targets: Sequence[Path], machine: Path, *, force: bool = False, of_fleet: bool = False
) -> None:
    """Raise UsageError for a target that cannot be written: an unknown suffix, a name given twice, an existing file.

    The machine file itself may be updated. A report or JSON of this command may be rewritten; any other existing file
    is replaced only with `force`. The results of a fleet are no machine file.
    """
    check_output_names(targets, (PAGE, JSON) if of_fleet else (MACHINE, PAGE, JSON))
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

    def page() -> str:
        from cdtool.commands.identify.page import identification_html

        return identification_html(done)

    texts: dict[Path, str] = {}
    for target in targets:
        suffix = target.suffix.lower()
        if suffix == MACHINE:
            texts |= dict(done.files_for(target))
        elif suffix == PAGE:
            texts[target] = page()
    written = (*texts, *(target for target in targets if target.suffix.lower() == JSON))
    for target in targets:
        if target.suffix.lower() == JSON:
            texts[target] = strict_json({**done.summary, "outputs": [str(path) for path in written]}) + "\n"
    return _write(texts, inputs)


def write_fleet(fleet: FleetIdentification, targets: Sequence[Path], inputs: Sequence[Path] = ()) -> tuple[Path, ...]:
    """Write the identification of a fleet into each target; see `write_identification`."""

    def page() -> str:
        from cdtool.commands.identify.page import drift_html

        return drift_html(fleet)

    texts = {
        target: page() if target.suffix.lower() == PAGE else strict_json(fleet.summary) + "\n" for target in targets
    }
    return _write(texts, inputs)


def _write(texts: Mapping[Path, str], inputs: Sequence[Path]) -> tuple[Path, ...]:
    refuse_inputs(texts, inputs)
    write_texts(texts)
    return tuple(texts)
