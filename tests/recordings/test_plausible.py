"""Values that no sensor can measure are masked, counted and reported as a loss; real contacts are not."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdtool.commands.judging.information import info
from cdtool.formats.channels.channel_assembly import LoggedRecording
from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.machine_file import read_machine_file
from cdtool.formats.signature_store import read_signature
from cdtool.recordings.plausible import PlausibleRanges
from cdtool.recordings.recording import MEASURED, Series
from tests.command import cdtool
from tests.data_folder import UR10E_LOGS

LOGS = Path(__file__).parents[2] / "sample_logs"
FOLDERS = (LOGS / "gate", LOGS / "arm" / "trial_1", LOGS / "arm" / "trial_2")


def logged(folder: Path, *kinds: str) -> list[LoggedRecording]:
    machine = read_machine_file(folder / "machine.toml")
    files = [path for kind in kinds for path in sorted((folder / kind).iterdir())]
    return [read_as_logged(path, machine) for path in files]


def learned_of(logs: list[LoggedRecording]) -> PlausibleRanges:
    return PlausibleRanges.learned([item.recording for item in logs])


def masked(ranges: PlausibleRanges, log: LoggedRecording) -> dict[str, np.ndarray]:
    made = ranges.masked(log.recording, log.factors)
    return {
        name: np.isnan(made[name].values) & ~np.isnan(log.recording[name].values) for name in log.recording.channels
    }


def with_values(log: LoggedRecording, channel: str, rows: slice, value: float, joint: int = 0) -> LoggedRecording:
    series = log.recording[channel]
    values = series.values.copy()
    values[rows, joint] = value
    channels = {**log.recording.channels, channel: Series(series.time, values, series.unit)}
    return replace(log, recording=replace(log.recording, channels=channels))


@pytest.fixture(scope="module", params=FOLDERS, ids=lambda folder: folder.name)
def runs(request) -> tuple[list[LoggedRecording], PlausibleRanges]:
    free = logged(request.param, "free")
    return free, learned_of(free)


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_no_sample_of_an_impact_or_of_another_impact_free_run_is_masked(folder):
    ranges = learned_of(logged(folder, "free"))
    for log in logged(folder, "free", "holdout", "soft", "stiff"):
        assert not any(mask.any() for mask in masked(ranges, log).values()), log.recording.name


@pytest.mark.parametrize("factor", [30.0, 300.0])
def test_a_peak_of_hundreds_of_spreads_is_a_contact_and_not_masked(runs, factor):
    free, ranges = runs
    for channel in ("torque", "speed", "acceleration"):
        series = free[0].recording[channel]
        peak = factor * np.nanstd(series.values)
        log = free[0]
        for k, share in enumerate(
            np.sin(np.linspace(0.1, 3.0, 12)).tolist()
        ):  # it rises and falls within a few samples
            log = with_values(log, channel, slice(100 + k, 101 + k), peak * share)
        assert not masked(ranges, log)[channel].any(), channel


@pytest.mark.parametrize("row", [0, 1, 200, -1])
@pytest.mark.parametrize("raw", [1e306, 1e12, 9.99e37, -1e9, -(2.0**31), 2.0**32 - 1])
@pytest.mark.parametrize("channel", MEASURED)
def test_an_impossible_value_is_masked_only_in_its_own_row(runs, channel, raw, row):
    free, ranges = runs
    at = row % len(free[0].recording[channel])
    wrong = with_values(free[0], channel, slice(at, at + 1), raw * free[0].factors[channel][0])
    found = masked(ranges, wrong)
    assert np.flatnonzero(found[channel][:, 0]).tolist() == [at]
    assert sum(int(mask.sum()) for mask in found.values()) == 1
    finding = ranges.masked(wrong.recording, wrong.factors).findings[-1]
    assert (finding.channel, finding.severity) == (channel, "loss")
    assert finding.numbers["count"] == 1


@pytest.mark.parametrize("raw", [-32768.0, 32767.0, 65535.0])
def test_the_end_of_an_integer_that_fills_a_gap_is_masked(raw):
    """Counts of an int16 that stay within some hundred, like a drive's torque in per mille."""
    rng = np.random.default_rng(1)
    free = logged(FOLDERS[0], "free")[:3]
    counts = [np.rint(300.0 * np.sin(np.arange(500) / 40.0) + rng.normal(0.0, 5.0, 500)) for _ in free]
    scaled = []
    for item, count in zip(free, counts, strict=True):
        series = Series(np.arange(500) * 0.01, 0.001 * count, "N m")
        scaled.append(
            replace(item, recording=replace(item.recording, channels={"torque": series}), factors={"torque": (0.001,)})
        )
    ranges = learned_of(scaled)
    wrong = with_values(scaled[0], "torque", slice(250, 252), raw * 0.001)
    assert np.flatnonzero(masked(ranges, wrong)["torque"][:, 0]).tolist() == [250, 251]
    assert not masked(ranges, with_values(scaled[0], "torque", slice(250, 252), 32.5))["torque"].any()


def test_a_position_whose_counter_wraps_is_masked_until_it_is_back():
    time = np.arange(2000) * 0.01
    stroke = 20000.0 * (1.0 - np.cos(2.0 * np.pi * time / 20.0)) / 2.0
    free = logged(FOLDERS[0], "free")[0]

    def log(counts: np.ndarray) -> LoggedRecording:
        channels = {"position": Series(time, 1e-3 * counts, "rad")}
        return replace(free, recording=replace(free.recording, channels=channels), factors={"position": (1e-3,)})

    ranges = learned_of([log(stroke)] * 3)
    wrapped = np.mod(stroke + 20000.0 + 2.0**15, 2.0**16) - 2.0**15  # like an int16 that starts at 20,000
    assert (np.abs(np.diff(wrapped)) > 60000.0).sum() == 2
    found = masked(ranges, log(wrapped))["position"][:, 0]
    assert np.array_equal(found, wrapped < 0.0)


@pytest.mark.parametrize(("channel", "times"), [("torque", 8.0), ("torque", 300.0), ("speed", 8.0), ("speed", 40.0)])
@pytest.mark.parametrize("samples", [1, 3])
def test_a_spike_is_masked_in_a_run_to_learn_from_but_not_in_a_log_to_assess(runs, channel, times, samples):
    free, _ = runs
    highest = max(float(np.nanmax(np.abs(item.recording[channel].values))) for item in free)
    spiked = with_values(free[3], channel, slice(300, 300 + samples), times * highest)
    ranges = learned_of([*free[:3], spiked, *free[4:]])
    made = ranges.masked(spiked.recording, spiked.factors, to_learn=(-np.inf, np.inf))
    assert np.flatnonzero(np.isnan(made[channel].values[:, 0])).tolist() == list(range(300, 300 + samples))
    assert made.findings[-1].severity == "loss" and made.findings[-1].channel == channel
    if times < 10.0:
        assert not masked(ranges, spiked)[channel].any()


def strokes(*starts: float, stuck: slice | None = None) -> Series:
    """Consecutive strokes of 20 rad, each from its own start, with rests; constant at 0 on request."""
    shape = np.concatenate((np.zeros(50), np.linspace(0.0, 20.0, 400), np.full(50, 20.0)))
    values = np.concatenate([start + shape for start in starts])
    if stuck:
        values[stuck] = 0.0
    return Series(0.01 * np.arange(len(values)), values[:, np.newaxis], "rad")


def masked_position(free: LoggedRecording, series: Series) -> tuple[np.ndarray, str]:
    def log(item: Series) -> LoggedRecording:
        return replace(
            free, recording=replace(free.recording, channels={"position": item}), factors={"position": (1.0,)}
        )

    ranges = learned_of([log(strokes(0.0))] * 3)
    made = ranges.masked(log(series).recording, {"position": (1.0,)})
    words = "; ".join(str(item) for item in made.findings if item not in free.recording.findings)
    return np.isnan(made["position"].values[:, 0]), words


def test_a_reset_encoder_is_read_from_its_new_zero_once_it_moves():
    free = logged(FOLDERS[0], "free")[0]
    found, words = masked_position(free, strokes(0.0, 0.0, 0.0))
    rows = np.flatnonzero(found)
    # After each leap: the rest, and until it has moved by a fiftieth of the runs' travel.
    for leap in (500, 1000):
        own = rows[(rows >= leap) & (rows < leap + 500)]
        assert own[0] == leap and 55 <= len(own) <= 65 and np.array_equal(own, np.arange(leap, leap + len(own)))
    assert rows[0] == 500
    assert "2 leaps" in words and "from 20 to 0 rad at 5.000 s" in words and "new zero from 5.5" in words


def test_a_failed_position_is_masked_until_it_is_back():
    free = logged(FOLDERS[0], "free")[0]
    found, words = masked_position(free, strokes(0.0, stuck=slice(460, 480)))
    assert np.flatnonzero(found).tolist() == list(range(460, 480))
    assert "20 values" in words and "1 leap " in words and "new zero" not in words


def test_masking_does_not_depend_on_later_samples(runs):
    free, ranges = runs
    rng = np.random.default_rng(3)
    log = free[0]
    for channel in ("torque", "position"):
        for row in rng.integers(10, len(log.recording[channel]), 5).tolist():
            log = with_values(log, channel, slice(row, row + 2), float(rng.choice([1e306, -3e5, 1e12])))
    whole = masked(ranges, log)
    for cut in rng.integers(20, len(log.recording["torque"]), 20).tolist():
        end = float(log.recording["torque"].time[cut])
        part = replace(log, recording=log.recording.between(-np.inf, end))
        for name, mask in masked(ranges, part).items():
            assert np.array_equal(mask, whole[name][: len(mask)]), name


def test_ranges_survive_json_and_refuse_invalid_values(runs):
    _, ranges = runs
    assert PlausibleRanges.from_dict(json.loads(json.dumps(ranges.to_dict()))) == ranges
    values = ranges.to_dict()
    values["torque"]["reach"] = -1.0
    with pytest.raises(ValueError, match="plausible range of torque"):
        PlausibleRanges.from_dict(values)


def test_no_sample_of_real_contacts_of_a_robot_is_masked():
    try:
        machine = read_machine_file(UR10E_LOGS / "machine.toml")
    except Exception as fault:
        pytest.skip(str(fault))
    ranges = learned_of([read_as_logged(UR10E_LOGS / "no_torque.csv.gz", machine)])
    for name in ("no_torque", "link4", "ur-static"):
        log = read_as_logged(UR10E_LOGS / f"{name}.csv.gz", machine)
        assert not any(mask.any() for mask in masked(ranges, log).values()), name


@pytest.fixture
def gate(tmp_path) -> Path:
    shutil.copytree(LOGS / "gate", tmp_path / "gate")
    return tmp_path / "gate"


def spoil(path: Path, column: int, rows: list[int], text: str) -> None:
    lines = path.read_text().splitlines()
    for row in rows:
        cells = lines[row].split(",")
        cells[column] = text
        lines[row] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n")


def learn(gate: Path, out: Path):
    logs = sorted((gate / "free").iterdir())
    return cdtool("learn-signature", *logs, "-m", gate / "machine.toml", "-d", "feekf", "-o", out)


def test_wild_values_are_a_loss_in_a_log_to_assess_and_in_one_to_learn_from_whose_limits_stay(gate, tmp_path):
    before, after, log = tmp_path / "before.json", tmp_path / "after.json", gate / "holdout" / "03.csv"
    assert learn(gate, before).status == 0
    assessed = ("detect", log, "-m", gate / "machine.toml", "-s", before)
    assert cdtool(*assessed).status == 0
    spoil(log, 1, [900], "-3e7")
    done = cdtool(*assessed)
    assert done.status == 3 and "1 value is implausible" in done.err
    spoil(gate / "free" / "03.csv", 1, [900, 1500], "9.99e37")
    done = learn(gate, after)
    assert done.status == 3
    assert "loss: " in done.err and "free/03.csv" in done.err and "2 values" in done.err
    largest = [np.abs(read_signature(path).current[0].by_travel.mean).max() for path in (before, after)]
    assert largest[1] == pytest.approx(largest[0], rel=0.2)


def test_min_and_max_of_the_machine_file_mask_and_are_a_loss(gate):
    machine = gate / "machine.toml"
    plain, limited = 'unit = "A", scale = 0.56 }  #', 'unit = "A", scale = 0.56, min = -40, max = 40 }  #'
    machine.write_text(machine.read_text().replace(plain, limited))
    spoil(gate / "free" / "03.csv", 1, [900, 1500], "41")
    losses = [item for item in info(gate / "free" / "03.csv", machine=machine).findings if item.severity == "loss"]
    assert [str(item) for item in losses] == ["torque: 2 values are outside the possible range, masked"]


def test_a_fifth_of_the_runs_may_be_wrong_without_moving_the_range(runs):
    free, ranges = runs
    broken = [with_values(item, "torque", slice(None), 1e7) if i < 2 else item for i, item in enumerate(free)]
    moved = learned_of(broken).channels["torque"]
    assert moved.reach < 2.0 * ranges.channels["torque"].reach
