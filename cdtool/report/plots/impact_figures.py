"""The figures of the thesis's two chapters on impacts, redrawn into a folder."""

from __future__ import annotations

from pathlib import Path

from cdtool.errors import UsageError
from cdtool.file_locks import is_temporary
from cdtool.files import replaced_folder
from cdtool.foreign_files import FIGURES
from cdtool.impact.examples import chapter_4 as example
from cdtool.impact.sensor_ranking import rank_sensors
from cdtool.plain_text import plain
from cdtool.report.plots.impact_plots import write_impact_plots
from cdtool.report.plots.sensor_plot import plot_ranking
from cdtool.report.plots.transmission_plots import plot_elastic_bode, plot_impact, plot_rigid_bode

DEPTHS = (0.1e-6, 1e-6, 10e-6, 50e-6, 91e-6)
"""Penetrations about which figure 4.4 is drawn [m]."""

SPEED = 0.25
"""Speed of the load at them [m/s]; the thesis does not say at which it was drawn."""

SHARES = (0.01, 0.1, 1.0, 10.0)
"""Stiffnesses of the contact in figure 4.7 as shares of the limit 4.36."""


def draw_impact_figures(target: Path, *, force: bool = False) -> list[Path]:
    """Draw figures 3.2, 3.4, 3.5 (see `write_impact_plots`), 4.3, 4.4, 4.7 and 4.10 into a folder; their files.

    A folder that holds figures of cdtool only is replaced as a whole, another one with `force` only: then what has
    other names stays. Raises CdtoolError where it cannot write.
    """
    with replaced_folder(target, lambda old: _only_figures(old, force=force)) as folder:
        written = _draw(folder)
    return [target / path.name for path in written]


def _only_figures(folder: Path, *, force: bool) -> bool:
    for path in sorted(folder.iterdir()):
        if is_temporary(path.name) or (path.suffix in FIGURES and FIGURES[path.suffix].is_kind_of(path)):
            continue
        if force:
            return False
        raise UsageError(
            f"{plain(path)}: is not a cdtool figure, and the folder would be replaced as a whole",
            "choose another folder, or keep what else is in it with --force",
        )
    return True


def _draw(folder: Path) -> list[Path]:
    course, rigid, elastic = (folder / f"transmission_{name}.png" for name in ("course", "rigid", "elastic"))
    plot_impact(example.impact(), course)
    states = [(depth, SPEED) for depth in DEPTHS]
    plot_rigid_bode(example.TRANSMISSION, example.CONTACT, states, rigid)
    plot_elastic_bode(example.ELASTIC, SHARES, elastic)
    ranking = folder / "sensor_ranking.png"
    plot_ranking(rank_sensors(example.RANKED, example.SENSORS), ranking)
    return [*write_impact_plots(folder), course, rigid, elastic, ranking]
