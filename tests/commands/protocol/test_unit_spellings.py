"""Force-time curves around a limit, with their unit spelled in 20 ways: none passes whose true force is too high."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.commands.init.drafting import init
from cdtool.commands.protocol.assessment.assessment import PointAssessment
from tests.command import cdtool as command
from tests.synthetic.force_rig import half_sine, write_protocol, write_rig

LIMIT, RATE, SECONDS = 400.0, 500.0, 2.5
GRAVITY, POUND = 9.80665, 4.4482216152605
# The true peaks [N]; within this distance of the limit [N] noise may decide.
PEAKS, NOISE = [LIMIT * (0.9 + 0.2 * number / 59) for number in range(60)], 2.0


@dataclass(frozen=True)
class Spelling:
    """A header of a force in newtons per `factor`, a row of units below it, and its outcome.

    `drafted`: the protocol is as true as the curves with the machine file of `cdtool init`; `clear`: also with
    `unit = "N"`.
    """

    header: str
    factor: float
    units: str = ""
    drafted: bool = True
    clear: bool = False


SPELLINGS = [
    Spelling("Kraft [N]", 1.0, clear=True),
    Spelling("Kraft", 1.0, units="Newton", clear=True),
    Spelling("Kraft [kN]", 1e3),
    Spelling("Kraft [KN]", 1e3),
    Spelling("Kraft [daN]", 10.0),
    Spelling("Schließkraft (hN)", 100.0),
    Spelling("Kraft [MN]", 1e6),
    Spelling("Kraft [kp]", GRAVITY),
    Spelling("Force [lbf]", POUND),
    Spelling("force (lbs)", POUND),
    Spelling("Kraft [kg]", GRAVITY),
    Spelling("Kraft in daN", 10.0),
    Spelling("Kraft Kilonewton", 1e3),
    Spelling("force_lbf", POUND),
    Spelling("Force [pound-force]", POUND),
    Spelling("Kraft", 10.0, units="[daN]"),
    Spelling("Messkraft", 1e3, units="Kilonewton"),
    Spelling("Kraft [kN] gefiltert", 1e3),
    Spelling("Kraft [N*10]", 10.0, drafted=False),
    Spelling("Kraft (gefiltert)", 10.0, drafted=False),
]
LIMITS = f"""
[rig]
title = "a limit of {LIMIT:g} N"
source = "the test"
sample_rate_at_least_hz = 200.0
steps = [{{ from_s = 0.0, at_most_n = {LIMIT}, name = "dynamic" }}]
"""
BENCHMARK = """
machine = "machine.toml"
[force]
limits = "limits.toml"
profile = "rig"
[impacts.edge]
logs = ["*.csv"]
"""
POINT = """
[[protocol.point]]
name = "{name}"
repetitions = 1
logs = ["{name}.csv"]
"""


def write_curve(path: Path, spelling: Spelling, peak: float, head: str = "") -> None:
    """Write a log of the force alone in the spelling's unit: decimal commas, a skewed pulse, a jittering clock.

    `head`: the lines above the rows, in place of the spelling's.
    """
    rng = np.random.default_rng(round(1e3 * peak))
    time = (np.arange(round(SECONDS * RATE)) + rng.uniform(-0.2, 0.2, round(SECONDS * RATE))) / RATE
    since = np.clip((time - 0.8) / 0.25, 0.0, 1.0) ** 0.7
    force = peak * np.sin(np.pi * since) ** 2 + 3.0 + rng.normal(0.0, 0.3, len(time))
    rows = [f"{t:.5f};{f / spelling.factor:.9g}".replace(".", ",") for t, f in zip(time, force, strict=True)]
    units = [f"s;{spelling.units}"] if spelling.units else []
    path.write_text("\n".join([head or f"Zeit [s];{spelling.header}", *units, *rows]) + "\n", encoding="utf-8")


def measured(
    folder: Path, spelling: Spelling, peaks: list[float], by_init: bool, head: str = ""
) -> list[PointAssessment]:
    """Return a point of a protocol for each peak, with a machine file by `cdtool init`, or one that states N."""
    for number, peak in enumerate(peaks):
        write_curve(folder / f"c{number:02d}.csv", spelling, peak, head)
    text = init(folder / "c00.csv", folder / "machine.toml").text
    before, mark, after = text.partition("\nforce = {")
    assert mark, text
    if not by_init:
        line, _, rest = after.partition("\n")
        after = f'{line.split(", unit")[0]}, unit = "N" }}\n{rest}'
        (folder / "machine.toml").write_text(before + mark + after, encoding="utf-8")
    (folder / "limits.toml").write_text(LIMITS, encoding="utf-8")
    (folder / "benchmark.toml").write_text(BENCHMARK, encoding="utf-8")
    points = "".join(POINT.format(name=f"c{number:02d}") for number in range(len(peaks)))
    (folder / "protocol.toml").write_text(f'[protocol]\nbenchmark = "benchmark.toml"\n{points}', encoding="utf-8")
    return list(cdtool.protocol(folder / "protocol.toml").points)


def check(folder: Path, spelling: Spelling, peaks: list[float], by_init: bool) -> None:
    """Check that no curve above the limit passes, and that every one is judged right where the unit is clear."""
    points = measured(folder, spelling, peaks, by_init)
    is_clear = spelling.drafted if by_init else spelling.clear
    for peak, point in zip(peaks, points, strict=True):
        if not is_clear:
            (reason,) = [item for item in point.reasons if item.kind in ("no_force", "unreadable")]
            header = f"'{spelling.header}"
            assert point.outcome == "incomplete" and all(
                part in str(reason.values["message"]) for part in (header, "machine file N", "unit_confirmed = true")
            )
        elif abs(peak - LIMIT) > NOISE:
            assert point.outcome == ("pass" if peak < LIMIT else "fail"), (peak, point.reasons)
        assert peak <= LIMIT or point.outcome != "pass"


def name_of(value: object) -> str:
    if isinstance(value, Spelling):
        return " ".join(filter(None, (value.header, value.units)))
    return "by init" if value else "states N"


MATRIX = [(spelling, by_init) for spelling in SPELLINGS for by_init in (True, False)]


@pytest.mark.parametrize(("spelling", "by_init"), MATRIX, ids=name_of)
def test_no_spelling_of_a_unit_passes_a_force_above_the_limit(tmp_path, spelling, by_init):
    """60 curves in newtons; another spelling differs in its factor and in how its unit is read only."""
    check(tmp_path, spelling, PEAKS if spelling == SPELLINGS[0] else [368.0, 421.0], by_init)


@pytest.mark.parametrize("by_init", [True, False])
@pytest.mark.parametrize(
    ("head", "factor"),
    [
        ("Zeit [s];kN_Kraft", 1e3),
        ("Zeit [s];KraftkN", 1e3),
        ("Zeit [s];forceKg", GRAVITY),
        ("Zeit [s];Kraft kNewton", 1e3),
        ("Zeit [s];Kraft in Tonnen", 1e3 * GRAVITY),
        ("Zeit [s];Force kips", 1e3 * POUND),
        ("Zeit [s];Kraft {kN}", 1e3),
        ("Zeit [s];Kraft［ｋＮ］", 1e3),
        ("Zeit [s];Kraft [kN] [N]", 1e3),
        ("Zeit [s];Kraft [N]*1000", 1e3),
        ("Zeit [s];Kraft x10 [N]", 10.0),
        ("Zeit [s];Kraft 10N", 10.0),
        ("Zeit [s];Kraft [mV]", 10.0),
        ("Zeit [s];Kraft_mV", 10.0),
        ("Zeit [s];Kraft [N]\ns;kN", 1e3),
        ("s;kN\nZeit;Kraft", 1e3),
        ("Messung 7\nEinheit: kN\nZeit;Kraft", 1e3),
        ("# Einheit der Kraft: kN\nZeit;Kraft", 1e3),
        ("Zeit;s\nKraft;kN\nZeit;Kraft", 1e3),
    ],
)
def test_a_unit_anywhere_in_the_head_passes_no_force_above_the_limit(tmp_path, head, factor, by_init):
    (point,) = measured(tmp_path, Spelling(head.removeprefix("Zeit [s];"), factor), [421.0], by_init, head)
    assert point.outcome != "pass"


RIG_BENCHMARK = """
[force]
profile = "en_12453_reducing_gap"
[limits]
"*.edge.force_failed" = { max = 0 }
"""


@pytest.mark.parametrize(
    ("header", "confirmed", "outcome", "status"),
    [
        ("load_cell [N]", "", "met", 0),
        ("load_cell [kN]", "", "not_assessable", 4),
        ("load_cell [filtered]", "", "not_assessable", 4),
        ("load_cell [A]", "", "not_assessable", 4),
        ("load_cell", ", unit_confirmed = false", "not_assessable", 4),
        ("load_cell [kN]", ", unit_confirmed = true", "met", 0),
        ("load_cell [filtered]", ", unit_confirmed = true", "met", 0),
    ],
)
def test_a_force_in_a_doubtful_unit_meets_no_limit(tmp_path, header, confirmed, outcome, status):
    write_rig(tmp_path, [half_sine(300.0), half_sine(320.0), half_sine(340.0)])
    write_protocol(tmp_path)
    for path, old, new in [
        ("machine.toml", '"load_cell", unit = "N"', f'"load_cell", unit = "N"{confirmed}'),
        ("benchmark.toml", "[onset]", f"{RIG_BENCHMARK}[onset]"),
        *((f"edge/0{number}.csv", "load_cell", header) for number in (1, 2, 3)),
    ]:
        text = (tmp_path / path).read_text(encoding="utf-8")
        (tmp_path / path).write_text(text.replace(old, new, 1), encoding="utf-8")
    done = cdtool.benchmark(tmp_path / "benchmark.toml")
    assert [item.outcome for item in done.results.limits] == [outcome]
    assert command("protocol", "write", tmp_path / "protocol.toml", "-o", tmp_path / "protocol.html").status == status


def test_a_run_whose_torque_is_in_a_doubtful_unit_is_not_learned_from(tmp_path):
    write_rig(tmp_path, [half_sine(300.0)])
    log = tmp_path / "edge" / "01.csv"
    log.write_text(log.read_text(encoding="utf-8").replace("force_drive", "force_drive [kN]"), encoding="utf-8")
    done = command(
        "learn-signature", log, "-d", "gm", "-m", tmp_path / "machine.toml", "-o", tmp_path / "signature.json"
    )
    assert done.status == 2 and "torque: the header says 'force_drive [kN]', the machine file N" in done.err
