"""Read machine.toml: the machine, the channel maps for columns and topics, and gains.

Every error names the file, the key, the value and what is allowed. See docs/machine-file.md.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from cdtool.base.derived import StoresDerived
from cdtool.base.errors import ConfigurationError, nearest
from cdtool.base.files.bounded_loading import read_toml
from cdtool.base.remote.remote_path import location
from cdtool.base.settings import Place, keys_of, read, setting
from cdtool.base.value_words import value_in_words
from cdtool.detectors import DETECTORS
from cdtool.formats.channels.channel_map import (
    AcceptedUnits,
    ChannelMap,
    ChannelSource,
    TablePins,
    channel_maps,
)
from cdtool.machines import MACHINES
from cdtool.machines.dynamics import Gain, Machine
from cdtool.machines.joint_machine import JointTable, per_joint


@dataclass(frozen=True, repr=False)
class MachineFile(StoresDerived):
    """A validated machine file: the machine, its channels, and gains that differ from the defaults.

    `model`: the table [model] as `machines.axis_model.model_table.ModelTable`, None if the file does not have one.
    `simulated`: it says that its logs are.
    """

    path: Path
    machine: Machine
    columns: ChannelMap
    topics: ChannelMap
    gains: Mapping[str, Mapping[str, Gain]]
    digest: str
    model: Any = None
    simulated: bool = False

    def __repr__(self) -> str:
        return f"MachineFile({str(self.path)!r}: {self.machine.name}, joints {', '.join(self.machine.joints)})"

    @property
    def _sources(self) -> tuple[ChannelSource, ...]:
        return tuple(item for each in (self.columns, self.topics) for item in (*each.sources, *each.beside))

    @property
    def force_reduction(self) -> str:
        """Return how the axes of a force become one number, in words; empty if no force has several axes."""
        return " or ".join(dict.fromkeys(item.reduction for item in self._sources if item.reduction))

    def maps(self, channel: str) -> bool:
        """Return whether a log has a column, a topic or a file beside it for a channel."""
        return any(item.channel == channel for item in self._sources)

    @property
    def label_kinds(self) -> tuple[str, ...]:
        """Return the kinds of contacts that a label channel distinguishes."""
        return tuple(dict.fromkeys(kind for item in self._sources for _, kind in item.kinds))

    def files_beside(self, log: Path) -> tuple[Path, ...]:
        """Return the files that belong to a log, whether they exist or not."""
        return tuple(dict.fromkeys(item.own_file.path_for(log) for item in self._sources if item.own_file))

    def with_map(self, channels: ChannelMap) -> MachineFile:
        """Return the file with another map, for columns or topics."""
        return replace(self, columns=channels, topics=channels)

    def detector(self, name: str | Any) -> Any:
        """Return the detector of that (full or short) name with this file's gains; an instance as it is, checked."""
        if not isinstance(name, str):
            return DETECTORS.checked(name)
        full = DETECTORS.canonical(name)
        return DETECTORS.load(full)(**self.gains.get(full, {}))

    def with_gains_of(self, detectors: Sequence[str | Any]) -> MachineFile:
        """Return the file with the gains of those detectors that are objects; raises UsageError for unknown classes."""
        made = [self.detector(item) for item in detectors if not isinstance(item, str)]
        return replace(self, gains={**self.gains, **{DETECTORS.canonical(item.name): asdict(item) for item in made}})


@dataclass(frozen=True, kw_only=True)
class MachineTable:
    """A machine file as it is written, without [machine]: its keys depend on the type."""

    simulated: Annotated[bool, setting("the logs are simulated, not recorded: reports say so")] = False
    channels: Annotated[Any, setting("where the channels are in a log")] = None
    csv: Annotated[dict[str, Any] | None, setting("the dialect of text tables, where it is not found")] = None
    detectors: Annotated[dict[str, dict[str, Any]], setting("gains that differ from the defaults")] = field(
        default_factory=dict
    )
    model: Annotated[dict[str, Any] | None, setting("what the model of each axis has beside [machine]")] = None


def read_machine_file(path: str | Path) -> MachineFile:
    """Read and check a machine file.

    Parameters
    ----------
    path : str or Path
        The machine file.

    Returns
    -------
    MachineFile
        The model of the machine, the map of its channels, and the gains of its detectors. Every function that takes
        the name of a machine file takes this as well.

    Raises
    ------
    ConfigurationError
        The file cannot be read, or a key or a value is wrong; the message names it.

    Examples
    --------
    >>> import cdtool
    >>> gate = cdtool.read_machine_file("sample_logs/gate/machine.toml")
    >>> gate.machine.name, gate.machine.joints, gate.machine.force_unit
    ('gate', ('gate',), 'N')
    """
    file = location(path)
    place = Place(str(file))
    values = read_toml(file, "a machine file", place)
    if isinstance(values.get("machine"), str):
        raise ConfigurationError(f"{file}: is a benchmark file, not a machine file", f"give {values['machine']}")
    machine = place.tried(None, _machine, values, place)
    written = {name: value for name, value in values.items() if name not in ("machine", "operations")}
    table = read(MachineTable, written, place)
    assert table is not None
    joints, units = (machine.joints, machine.accepted_units) if machine else _of_any_axis(values.get("machine"))
    columns, topics = channel_maps(written.get("channels", {}), place.below("channels"), joints, units)
    gains = _read_gains(table.detectors, len(joints), place.below("detectors"))
    model = _read_model(table.model, len(joints), place.below("model"))
    columns = replace(columns, pins=_read_pins(table.csv, place.below("csv")))
    place.finish()
    assert machine is not None
    topics = replace(topics, named=len(joints) > 1 or "joints" in values["machine"])
    digest = hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()
    return MachineFile(file, machine, columns, topics, gains, digest, model, table.simulated)


def _machine(values: Mapping[str, Any], place: Place) -> Machine | None:
    """Return the machine of [machine], with the mistakes in `place`; None if it cannot be made."""
    table = values.get("machine")
    if table is None and not place.is_whole:
        return None
    if not isinstance(table, dict):
        problem = "is missing" if table is None else f"is {value_in_words(table)}"
        raise place.fault("machine", problem, "add a table [machine]")
    for part, at in ((values, place), (table, place.below("machine"))):
        if "operations" in part:
            hint = "set it there, or give detect --set operations=motion"
            raise at.fault("operations", "is a key of the benchmark file", hint)
    below, kind = place.below("machine"), table.get("type")
    known = MACHINES.names_for(kind)
    if kind in known:
        machine: Machine | None = MACHINES.load(kind).read(table, below)
        return machine
    if kind is not None or place.is_whole:
        problem = "is missing" if kind is None else f"is {value_in_words(kind)}"
        below.note("type", problem, nearest(str(kind), known))
    closest = max(map(MACHINES.load, known), key=lambda item: len(table.keys() & keys_of(item.table)))
    closest.read(table, below)  # for the mistakes of its keys
    return None


def _of_any_axis(table: Any) -> tuple[tuple[str, ...], AcceptedUnits]:
    """Return joints and units to check the channels with if the machine is wrong: as named, and of every machine.

    The joints are empty if they are not named.
    """
    named = read(JointTable, table if isinstance(table, dict) else {}, Place(""))
    axes = [MACHINES.load(kind).of({"transmission_ratio": 1.0}) for kind in ("linear_axis", "rotary_axis")]
    return named.joints if named else (), lambda channel: (
        *dict.fromkeys(name for axis in axes for name in axis.accepted_units(channel)),
        "SI",
    )


def fingerprint(machine: Machine) -> str:
    """Return a hash of a machine's parameters, to which a signature belongs."""
    return hashlib.sha256(_parameters_text(machine).encode()).hexdigest()


def machine_parameters(machine: Machine) -> dict[str, Any]:
    """Return type and parameters of a machine as JSON values, under the keys of the machine file."""
    values: dict[str, Any] = json.loads(_parameters_text(machine), parse_constant=str)
    keys = {"load_inertia": getattr(machine, "inertia_key", "load_inertia")}
    return {keys.get(name, name): value for name, value in values.items()}


def _parameters_text(machine: Machine) -> str:
    return json.dumps({"type": type(machine).__name__, **asdict(machine)}, sort_keys=True)


def _read_gains(table: Mapping[str, Any], joints: int, place: Place) -> dict[str, dict[str, Gain]]:
    """Return the gains of [detectors] by the detectors' full names, with the mistakes in `place`."""
    gains: dict[str, dict[str, Gain]] = {}
    for name, values in table.items():
        with place.noting(), place.at(name):
            full = DETECTORS.canonical(name)
            if full in gains:
                place.note(name, f"repeats {full}", "give a detector's gains once, under one of its names")
            detector = read(DETECTORS.load(full), values, place.below(name))
            keys = [key for key in values if hasattr(detector, key)]
            for key in keys:
                if joints and isinstance(getattr(detector, key), tuple):
                    per_joint(detector, key, joints, place.below(name))
            gains[full] = {key: getattr(detector, key) for key in keys}
    return gains


def _read_model(table: Mapping[str, Any] | None, joints: int, place: Place) -> Any:
    if table is None:
        return None
    from cdtool.machines.axis_model.model_table import ModelTable  # only few commands use it

    return ModelTable.read(table, joints, place)


def _read_pins(table: Mapping[str, Any] | None, place: Place) -> TablePins:
    if table is None:
        return TablePins()
    from cdtool.formats.csv_dialect.pins import read_pins

    return read_pins(table, place)
