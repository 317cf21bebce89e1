"""Read machine.toml: the machine, the channel maps for columns and topics, and gains.

Every error names the file, the key, the value and what is allowed. See docs/machine-file.md.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from cdtool.base.derived import StoresDerived
from cdtool.base.errors import ConfigurationError, UsageError, nearest
from cdtool.base.remote.remote_path import location
from cdtool.base.tables import Table, read_toml
from cdtool.detectors import DETECTORS
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, read_channel_map
from cdtool.machines import MACHINES
from cdtool.machines.dynamics import Gain, Machine


@dataclass(frozen=True, repr=False)
class MachineFile(StoresDerived):
    """A validated machine file: the machine, its channels, and gains that differ from the defaults.

    `model`: the table [model] as `machines.axis_model.model_table.ModelTable`, None if the file does not have one.
    """

    path: Path
    machine: Machine
    columns: ChannelMap
    topics: ChannelMap
    gains: Mapping[str, Mapping[str, Gain]]
    digest: str
    model: Any = None

    def __repr__(self) -> str:
        return f"MachineFile({str(self.path)!r}: {self.machine.name}, joints {', '.join(self.machine.joints)})"

    @property
    def _sources(self) -> tuple[ChannelSource, ...]:
        maps = (self.columns, self.topics)
        return tuple(item for each in maps for item in (*each.sources, *each.beside))

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
    values = read_toml(file, "a machine file")
    root = Table(values, str(file))
    if isinstance(values.get("machine"), str):
        raise ConfigurationError(f"{file}: is a benchmark file, not a machine file", f"give {values['machine']}")
    table = root.table("machine", required=True)
    for part in (root, table):
        if "operations" in part.values:
            raise part.fault(
                "operations", "is a key of the benchmark file", "set it there, or give detect --operations motion"
            )
    kind = table.choice("type", MACHINES.names_for(table.values.get("type")))
    machine = MACHINES.load(kind).from_table(table)
    table.finish()
    channels = root.table("channels")
    columns = read_channel_map(channels, machine.joints, machine.accepted_units, topics=False)
    if "csv" in root:
        from cdtool.formats.csv_dialect.pins import read_pins

        columns = replace(columns, pins=read_pins(root.table("csv")))
    topics = read_channel_map(channels.table("mcap"), machine.joints, machine.accepted_units, topics=True)
    if len(machine.joints) == 1 and "joints" not in table:
        topics = replace(topics, named=False)
    gains = _read_gains(root.table("detectors"), len(machine.joints))
    model = None
    if "model" in root:  # only few commands use it
        from cdtool.machines.axis_model.model_table import ModelTable

        model = ModelTable.read(root.table("model"), len(machine.joints))
    root.finish()
    digest = hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()
    return MachineFile(file, machine, columns, topics, gains, digest, model)


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


def _read_gains(table: Table, joints: int) -> dict[str, dict[str, Gain]]:
    gains: dict[str, dict[str, Gain]] = {}
    for name in table.values:
        try:
            full = DETECTORS.canonical(name)
        except UsageError as fault:
            raise table.fault(name, fault.message, fault.hint) from fault
        part, detector = table.table(name), DETECTORS.load(full)
        allowed = [item.name for item in fields(detector)]
        for key in part.values:
            if key not in allowed:
                raise part.fault(key, "unknown gain", nearest(key, allowed))
        given = {
            key: part.numbers(key, joints) if isinstance(value, list) else part.number(key)
            for key, value in part.values.items()
        }
        try:
            detector(**given)
        except ConfigurationError as fault:
            raise ConfigurationError(f"{table.key(name)}: {fault.message}", fault.hint) from fault
        if full in gains:
            raise table.fault(name, f"repeats {full}", "give a detector's gains once, under one of its names")
        gains[full] = given
    return gains
