"""Read `[protocol]`: of a benchmark file, or of a file of its own. Paths are relative to the file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.base.files.bounded_loading import read_bytes, read_toml
from cdtool.base.remote.remote_path import joined, location
from cdtool.base.settings import Place, read, setting
from cdtool.base.value_words import value_in_words
from cdtool.commands.judging.named_logs import named_file
from cdtool.commands.protocol.assessment.plan import MeasuringPoint, TestPlan
from cdtool.truth.force.limits import ForceProfile, profile_of, read_force_limits

TABLE = "protocol"


@dataclass(frozen=True)
class ProtocolTable(TestPlan):
    """[protocol] as it is written: the plan, and the files that it refers to."""

    benchmark: Annotated[str, setting("the benchmark file with the recordings, relative to the file")] = ""
    limits: Annotated[str, setting("your own file of force limits; default: the shipped one")] = ""


@dataclass(frozen=True)
class ProtocolFile:
    """A read `[protocol]`: the plan, its benchmark file (None: not named), and the force profiles by name.

    `limits` is the file of the profiles; None: those that ship with cdtool.
    """

    path: Path
    plan: TestPlan
    benchmark: Path | None
    profiles: Mapping[str, ForceProfile]
    limits: Path | None = None

    def profile_of(self, point: MeasuringPoint, of_group: ForceProfile | None = None) -> ForceProfile | None:
        """Return the force profile of a point: its own, else that of its recordings' group; None without both.

        Raises ConfigurationError if the profile has no pressure for the point's area of the body.
        """
        profile = self.profiles[point.profile] if point.profile else of_group
        if profile is not None and point.body_area:
            try:
                profile.pressure_limit(point.body_area)
            except UsageError as fault:
                where = f"{self.path}: protocol.point '{point.name}': body_area"
                raise ConfigurationError(f"{where}: {fault.message}", fault.hint) from fault
        return profile


def has_protocol(path: Path) -> bool:
    """Return whether a benchmark file has a table [protocol]; raises ConfigurationError if it cannot be read."""
    return TABLE in read_toml(path, "a benchmark file")


def read_protocol_file(path: str | Path) -> ProtocolFile:
    """Read and check `[protocol]`; values that are not known yet may be missing or empty.

    Parameters
    ----------
    path : str or Path
        The file with the table: a protocol file, or a benchmark file.

    Returns
    -------
    ProtocolFile
        The plan with its force profiles. Of a benchmark file, it is itself the benchmark of the protocol.

    Raises
    ------
    ConfigurationError
        A key is unknown, a value has the wrong type, or a profile does not exist; the message names file and key.

    Examples
    --------
    >>> file = read_protocol_file("sample_logs/gate/protocol.toml")
    >>> [(point.name, point.repetitions) for point in file.plan.points]
    [('closing edge', 4), ('closing edge with bumper', 4)]
    """
    file = location(path)
    place = Place(str(file))
    values = read_toml(file, "a protocol file", place)
    if TABLE in values and not isinstance(values[TABLE], dict):
        raise place.fault(TABLE, f"is {value_in_words(values[TABLE])}", f"add a table [{TABLE}]")
    if TABLE not in values:
        raise ConfigurationError(f"{file}: has no table [protocol]", "draft one: cdtool protocol init BENCHMARK")
    is_benchmark = "machine" in values and not isinstance(values["machine"], dict)
    for name in values:
        if name != TABLE and not is_benchmark:
            place.note(name, "unknown key", f"known: {TABLE}")
    below = place.below(TABLE)
    table = read(ProtocolTable, _filled(values[TABLE]), below)
    if table is None:
        place.finish()
    assert table is not None
    limits = joined(file.parent, table.limits) if table.limits else None
    profiles: dict[str, ForceProfile] = place.tried(
        {}, lambda: read_force_limits(limits and named_file(below, "limits", limits))
    )
    if is_benchmark and table.benchmark:
        below.note("benchmark", "is only for a file of its own", "remove the key")
    for number, point in enumerate(table.points, 1):
        if point.profile and profiles:
            at = below.below(f"point[{number}]")
            with place.noting(), at.at("profile"):
                profile = profile_of(profiles, point.profile)
                with at.at("body_area"):
                    profile.pressure_limit(point.body_area)
    place.finish()
    base = file if is_benchmark else joined(file.parent, table.benchmark) if table.benchmark else None
    return ProtocolFile(file, table, base, profiles, limits)


def _filled(value: Any) -> Any:
    """Return the values of a table without those that are empty: they are not known yet."""
    if isinstance(value, dict):
        return {name: _filled(item) for name, item in value.items() if item != ""}
    return [_filled(item) for item in value] if isinstance(value, list) else value


def digest_of_file(path: Path) -> str:
    """Return the SHA-256 of a small file; raises ConfigurationError if it cannot be read."""
    import hashlib

    return hashlib.sha256(read_bytes(path, ConfigurationError)).hexdigest()
