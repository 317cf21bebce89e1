"""Rank the sensors by when they detect an impact, before a machine is built: the work of `cdtool study`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cdtool.impact.sensor_ranking import Ranking, rank_sensors
from cdtool.impact.waves import WaveCheck, check_waves
from cdtool.machine_file import read_machine_file
from cdtool.workflows.study.study_file import read_study


@dataclass(frozen=True)
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


def study_sensors(
    machine: str | Path,
    study: str | Path | None = None,
    *,
    joint: str = "",
    factor: float = 5.0,
    options: Mapping[str, float] | None = None,
) -> SensorStudy:
    """Rank the sensors of a machine by how early they detect an impact (thesis figure 4.10).

    `study` is a TOML file with the tables [impact], [drive], [controller], [sensors.NAME]; `options` by their keys,
    such as {"impact.speed": 0.2}, override it. `factor` is the k of k sigma. For an arm or a robot, one joint is
    studied while the others are at rest. Raises ConfigurationError or UsageError for missing inertias of load and
    motor, and for meaningless values.
    """
    file = read_machine_file(machine)
    found = read_study(file, study, joint, options)
    ranking = rank_sensors(found.case, found.sensors, factor)
    frequency = found.first_frequency
    waves = None if frequency is None else check_waves(ranking.swing_duration, frequency)
    return SensorStudy(file.machine.name, found.joint, ranking, waves, found.assumptions)
