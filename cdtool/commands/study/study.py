"""Rank the sensors by when they detect an impact, before a machine is built: the work of `cdtool study`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdtool.commands.study.study_file import read_study
from cdtool.formats.machine_file import read_machine_file
from cdtool.impact.sensor_ranking import Ranking, rank_sensors
from cdtool.impact.waves import WaveCheck, check_waves


@dataclass(frozen=True, repr=False)
class SensorStudy:
    """The ranking for one joint of a machine, and the assumptions made for values that were not given.

    `waves` states whether the load counts as rigid in this impact (thesis 3.1.4); None without its first natural
    frequency.
    """

    machine: str
    joint: str
    ranking: Ranking
    waves: WaveCheck | None
    assumptions: tuple[str, ...]

    def __repr__(self) -> str:
        return f"SensorStudy({self.machine}, joint {self.joint})"


def study_sensors(
    machine: str | Path,
    study: str | Path | None = None,
    *,
    settings: Mapping[str, Any] | None = None,
) -> SensorStudy:
    """Rank the sensors of a machine by how early they respond to an impact.

    Parameters
    ----------
    machine : str or Path
        The machine file.
    study : str or Path, optional
        A TOML file with joint, k and the tables [impact], [drive], [controller] and [sensors.NAME].
    settings : mapping, optional
        Values in place of keys of the file, as {"impact.speed": 0.2}.

    Returns
    -------
    SensorStudy
        The ranking, whether the load counts as rigid, and the assumptions.

    Raises
    ------
    ConfigurationError
        The machine file or the study file is wrong.
    UsageError
        The machine file does not give the inertias of load and motor, or a value is outside its range.

    Notes
    -----
    Thesis figure 4.10, computed by simulating the impact: 4.20, or 4.21 and 4.23 corrected (docs/errata.md).

    Examples
    --------
    >>> import cdtool
    >>> study = cdtool.study_sensors("sample_logs/gate/machine.toml", "docs/examples/gate_study.toml")
    >>> [response.sensor.name for response in study.ranking.responses]
    ['load_cell', 'accelerometer', 'torque_sensor', 'motor_position', 'motor_speed', 'motor_torque']
    """
    file = read_machine_file(machine)
    found = read_study(file, study, settings)
    ranking = rank_sensors(found.case, found.sensors, found.factor)
    frequency = found.first_frequency
    waves = None if frequency is None else check_waves(ranking.swing_duration, frequency)
    return SensorStudy(file.machine.name, found.joint, ranking, waves, found.assumptions)
