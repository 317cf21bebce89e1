"""Which sensor sees an impact first, before a machine is built: what `cdtool study` does."""

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
    """The ranking for one joint of a machine, and in words what was assumed because neither file nor option gave it.

    `waves` says whether the load counts as rigid in this impact (thesis 3.1.4); None where its first natural frequency
    is not given.
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
    """Rank the sensors of a machine by how early they see an impact (thesis figure 4.10).

    `study` is a TOML file with the tables [impact], [drive], [controller], [sensors.NAME]; `options` by their keys,
    such as {"impact.speed": 0.2}, win over it. `factor` is the k of k sigma. Of an arm or a robot one joint is studied
    while the others stand. Raises ConfigurationError, UsageError: where the machine has no inertias of load and motor,
    or a value has no meaning.
    """
    file = read_machine_file(machine)
    found = read_study(file, study, joint, options)
    ranking = rank_sensors(found.case, found.sensors, factor)
    frequency = found.first_frequency
    waves = None if frequency is None else check_waves(ranking.swing_duration, frequency)
    return SensorStudy(file.machine.name, found.joint, ranking, waves, found.assumptions)
