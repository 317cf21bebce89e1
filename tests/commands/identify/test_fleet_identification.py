"""One identification per machine or day: how logs are divided, and which changes are found and which are not."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cdtool.base.errors import UsageError
from cdtool.commands.identify.estimate import IdentificationError
from cdtool.commands.identify.fleet_identification import (
    Division,
    DriftKind,
    FleetIdentification,
    drift_of,
    identify_fleet,
)
from tests.command import cdtool as command
from tests.synthetic.ageing import write_ageing_gate

ROOT = Path(__file__).parents[3]
GATE = ROOT / "sample_logs" / "gate"


def test_a_trend_beyond_three_standard_errors_is_found_and_a_smaller_one_is_not() -> None:
    errors = np.full(5, 2.0)
    rising = drift_of(200.0 + np.arange(5) * 3.0, errors)
    assert rising.kind is DriftKind.TREND
    assert rising.change == pytest.approx(12.0)
    # The slope's standard error is 2 / sqrt(10): 3 per period are 4.74 of them.
    assert rising.standard_errors == pytest.approx(3.0 * np.sqrt(10.0) / 2.0)
    assert rising.line == pytest.approx((200.0, 212.0))
    flat = drift_of(200.0 + np.arange(5) * 1.5, errors)
    assert flat.kind is DriftKind.NONE
    assert not flat.is_changed


def test_one_period_that_differs_is_found_though_there_is_no_trend() -> None:
    values = np.array([200.0, 200.0, 215.0, 200.0, 200.0])
    drift = drift_of(values, np.full(5, 2.0))
    assert drift.kind is DriftKind.PERIOD
    assert drift.change == pytest.approx(15.0)


def test_one_period_is_not_assessable() -> None:
    assert drift_of(np.array([1.0]), np.array([0.1])).kind is DriftKind.ONE_PERIOD


def test_an_error_that_is_far_too_small_by_chance_is_not_believed() -> None:
    values, errors = np.array([200.0, 201.0, 200.5]), np.array([2.0, 1e-9, 2.0])
    assert drift_of(values, errors).kind is DriftKind.NONE
    exact = np.array([4300.0, 4300.1, 4300.2])
    assert drift_of(exact, np.full(3, 1e-12)).kind is DriftKind.NONE


def test_values_without_a_change_are_rarely_found_to_have_one() -> None:
    rng = np.random.default_rng(1)
    errors = np.full(4, 1.0)
    false = sum(drift_of(rng.standard_normal(4) + 50.0, errors).is_changed for _ in range(4000))
    # Two tests, each beyond 3 standard errors: 0.27 % each.
    assert 4 < false < 40


@pytest.fixture(scope="module")
def fleet_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return two gates of six logs each: one with friction that grows by 50 %, one as it was; and one without torque.

    The machine file has no motor inertia: the drive is left out, which takes most of the time.
    """
    folder = tmp_path_factory.mktemp("fleet")
    write_ageing_gate(folder / "gate2", 6, 1, friction=1.5)
    write_ageing_gate(folder / "gate10", 6, 2)
    (folder / "gate3" / "free").mkdir(parents=True)
    for number in (3, 4):
        (folder / "gate3" / "free" / f"0{number}.csv").write_text("t,phi\n0,0\n1,0\n", encoding="utf-8")
    text = (GATE / "machine.toml").read_text(encoding="utf-8")
    kept = [line for line in text.splitlines() if not line.startswith("motor_inertia")]
    (folder / "machine.toml").write_text("\n".join(kept), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def fleet(fleet_folder: Path) -> FleetIdentification:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("cdtool.commands.identify.fleet_identification._LOGS_PER_PERIOD", 3)
        logs = [str(fleet_folder / "*" / "free" / "*.csv")]
        return identify_fleet(logs, fleet_folder / "machine.toml")


def test_the_growing_friction_is_found_and_the_other_gate_has_not_changed(fleet: FleetIdentification) -> None:
    assert [item.machine for item in fleet.machines] == ["gate2", "gate10"]
    grown, same = fleet.machines
    assert grown.logs == same.logs == 6
    assert "friction forward" in {item.name for item in grown.changed}
    (friction,) = [item for item in grown.series if item.name == "friction forward"]
    assert friction.periods == ("01 to 03", "04 to 06")
    # Half of the growth is between the middles of the two halves.
    assert friction.drift.change == pytest.approx(200.0 * 0.5 * 3.0 / 5.0, rel=0.3)
    assert same.changed == ()
    assert {item.name for item in same.parameters} >= {
        "friction forward",
        "machine.load_mass",
        "model.controller.speed_gain",
    }


def test_a_machine_whose_logs_cannot_be_used_is_left_out_with_the_reason(fleet: FleetIdentification) -> None:
    reasons = {item.recording: item.reason for item in fleet.skipped}
    assert "no impact-free log is left" in reasons["gate3"]
    assert len(fleet.skipped) == 1


def test_the_command_shows_what_changed_and_exits_with_3_if_a_machine_was_left_out(
    fleet: FleetIdentification, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, fleet_folder: Path
) -> None:
    monkeypatch.setattr("cdtool.commands.identify.fleet_identification.identify_fleet", lambda *_, **__: fleet)
    outputs = ["-o", tmp_path / "drift.html", "-o", tmp_path / "drift.json"]
    logs = fleet_folder / "*" / "free" / "*.csv"
    done = command("identify", logs, "-m", fleet_folder / "machine.toml", "--by", "machine", *outputs)
    assert done.status == 3
    assert "friction forward" in done.out
    assert "2 machines identified, 2 assessable over time, 1 changed" in done.out
    assert "gate3" in done.err
    page = (tmp_path / "drift.html").read_text(encoding="utf-8")
    assert "1 of 2 machines changed" in page
    assert page.count("data:image/png;base64,") == 2
    values = json.loads((tmp_path / "drift.json").read_text(encoding="utf-8"))
    changed = {
        item["machine"]: [series["name"] for series in item["series"] if series["drift"]["is_changed"]]
        for item in values["machines"]
    }
    assert "friction forward" in changed["gate2"]
    assert changed["gate10"] == []


@pytest.mark.parametrize(
    ("options", "message"),
    [(["--by", "week"], "--by is 'week'"), (["--by", "machine", "-o", "drift.toml"], "drift.toml")],
)
def test_a_wrong_division_or_output_is_one_line(options: list[str], message: str) -> None:
    done = command("identify", GATE / "free" / "*.csv", "-m", GATE / "machine.toml", *options)
    assert done.status == 2
    assert len(done.err.strip().splitlines()) == 1
    assert message in done.err


def test_no_usable_machine_is_an_error(fleet_folder: Path) -> None:
    with pytest.raises(IdentificationError, match="no machine can be identified"):
        identify_fleet([str(fleet_folder / "gate3" / "free" / "*")], fleet_folder / "machine.toml")


def rest_log(path: Path, begins: float = 0.0) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = "\n".join(f"{begins + 1e-3 * number:.3f},0.1,0.0" for number in range(200))
    path.write_text(f"t,i,n\n{rows}\n", encoding="utf-8")
    return path


MACHINE = """[machine]
type = "linear_axis"
coordinates = "load"
load_mass = 10.0
[channels]
time = { column = "t", unit = "s" }
torque = { column = "i", unit = "N" }
speed = { column = "n", unit = "m/s" }
"""


@pytest.fixture
def groups(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str, list[str]]]:
    """Return what each identification is given, without doing it."""
    seen: list[tuple[str, str, list[str]]] = []

    def given(items: list[object], *_: object, **__: object) -> list[object]:
        seen.extend((item.machine, item.period, [log.name for log in item.logs]) for item in items)  # type: ignore[attr-defined]
        return []

    monkeypatch.setattr(
        "cdtool.commands.identify.fleet_identification.in_order", lambda _, items, *__, **___: given(items)
    )
    return seen


def test_days_come_from_the_path_or_the_clock(tmp_path: Path, groups: list[tuple[str, str, list[str]]]) -> None:
    rest_log(tmp_path / "a" / "2026-03-02" / "run.csv")
    rest_log(tmp_path / "a" / "run_20260301.csv")
    rest_log(tmp_path / "a" / "plain.csv", begins=1.772409600e9)  # 2026-03-02 00:00 UTC
    rest_log(tmp_path / "b" / "unknown.csv")
    (tmp_path / "m.toml").write_text(MACHINE, encoding="utf-8")
    with pytest.raises(IdentificationError):
        identify_fleet([str(tmp_path / "*" / "**" / "*.csv")], tmp_path / "m.toml", Division.DAY)
    assert ("a", "2026-03-01", ["run_20260301.csv"]) in groups
    assert [sorted(logs) for name, day, logs in groups if (name, day) == ("a", "2026-03-02")] == [
        ["plain.csv", "run.csv"]
    ]
    assert not any(period for name, period, _ in groups if name == "b")


def test_logs_without_any_day_are_refused(tmp_path: Path) -> None:
    rest_log(tmp_path / "run.csv")
    (tmp_path / "m.toml").write_text(MACHINE, encoding="utf-8")
    with pytest.raises(UsageError, match="neither the paths nor the clocks"):
        identify_fleet([tmp_path / "run.csv"], tmp_path / "m.toml", Division.DAY)


def test_folders_of_dates_are_no_machines_and_run_9_comes_before_run_10(
    tmp_path: Path, groups: list[tuple[str, str, list[str]]]
) -> None:
    for number in range(1, 12):
        rest_log(tmp_path / f"2026-01-{1 + number // 6:02d}" / f"run{number}.csv")
    (tmp_path / "m.toml").write_text(MACHINE.replace("[machine]", '[machine]\nname = "door"'), encoding="utf-8")
    with pytest.raises(IdentificationError):
        identify_fleet([str(tmp_path / "*" / "*.csv")], tmp_path / "m.toml")
    whole, first, second = groups
    assert (whole[0], whole[1], len(whole[2])) == ("door", "", 11)
    assert first[2] + second[2] == [f"run{number}.csv" for number in range(1, 12)]
    assert first[1] == "run1 to run6"
