"""Logs named in a benchmark file or a label file must be scored, and only once."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file
from tests.command import cdtool

PROFILE = '[force]\nprofile = "en_12453_reducing_gap"\n'
STIFF = '[impacts.stiff]\nlogs = ["stiff/*.csv"]\n'
LEARN = '[learn]\nlogs = ["free/*.csv"]\n'
HOLDOUT = '[holdout]\nlogs = ["holdout/*.csv"]\n'
ONSET = '[onset]\nlabels = "labels.csv"\n'


@pytest.fixture
def read(gate_folder: Path, tmp_path: Path):
    """read(*tables): the benchmark file with these tables for the logs of the gate."""
    for name in ("free", "stiff", "soft", "holdout", "machine.toml"):
        (tmp_path / name).symlink_to(gate_folder / name)

    def run(*parts: str, labels: str = "") -> BenchmarkFile:
        (tmp_path / "labels.csv").write_text(f"recording,start_s,end_s\n{labels}", encoding="utf-8")
        file = tmp_path / "b.toml"
        file.write_text("".join(('machine = "machine.toml"\ndetectors = ["gm"]\n', *parts)), encoding="utf-8")
        return read_benchmark_file(file)

    run.folder = tmp_path
    return run


@pytest.mark.parametrize("row", ["stiff/1.csv,5.0,5.2\n", "free/99.csv,,\n"])
def test_a_label_that_fits_no_scored_recording_is_a_note_with_its_line(read, row):
    """A file without any label of a scored recording is refused."""
    name = row.split(",")[0]
    (note,) = read(LEARN, STIFF, ONSET, labels=f"02.csv,5.0,5.2\n{row}").labels.findings
    assert note.severity == "note" and f"not used: {name} (line 3)" in str(note)
    with pytest.raises(ConfigurationError, match=rf"labels\.csv: no row is about a scored recording: {name}"):
        read(LEARN, STIFF, ONSET, labels=row)


def test_a_label_may_be_about_a_log_that_is_learned_from_by_its_whole_path(read):
    labels = read(LEARN, STIFF, ONSET, labels="02.csv,5.0,5.2\nfree/01.csv,,\n").labels
    assert labels is not None and labels.name_of("free/01.csv") == "free/01.csv"


def test_a_label_outside_the_recording_is_left_out_with_its_line(read):
    read(LEARN, STIFF, ONSET, labels="stiff/01.csv,1.0,1.2\nstiff/02.csv,999.0,999.5\n")
    (read.folder / "triggers.csv").write_text("recording,time_s\nstiff/01.csv,1.1\n", encoding="utf-8")
    done = cdtool("score", read.folder / "triggers.csv", "-b", read.folder / "b.toml")
    assert done.status == 3 and "labels.csv line 3: the contact begins at 999 s" in done.err
    assert "onset:" in done.out and "label file labels.csv" in done.out


@pytest.mark.parametrize("table", ["points", "campaigns"])
def test_different_spellings_of_a_path_are_the_same_log(read, table):
    folder = read.folder.name
    setup = read(PROFILE, LEARN, STIFF, f'[{table}.a]\nlogs = ["../{folder}/stiff/*.csv"]\n')
    assert set(getattr(setup, table)) == set(setup.impacts["stiff"].logs)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            '[points.a]\nlogs = ["soft/*.csv"]\n',
            r"points\.a: names .*soft/01\.csv, which is not in a group of \[impacts\]",
        ),
        (
            '[campaigns.a]\nlogs = ["soft/*.csv"]\n',
            r"campaigns\.a: names .*soft/01\.csv, which is not in a group of \[impacts\]",
        ),
        ('[points.""]\nlogs = ["stiff/*.csv"]\n', r"points\.: has no name"),
        ('[campaigns." "]\nlogs = ["stiff/*.csv"]\n', r"campaigns\. : has no name"),
        ('[impacts.""]\nlogs = ["soft/*.csv"]\n', r"impacts\.: is not a valid group name"),
        ('[impacts." "]\nlogs = ["soft/*.csv"]\n', r"impacts\. : is not a valid group name"),
        ('[impacts."*"]\nlogs = ["soft/*.csv"]\n', r"impacts\.\*: is not a valid group name"),
        ('[impacts.again]\nlogs = ["soft/*.csv", "stiff/01.csv"]\n', r"stiff/01\.csv is scored in stiff and in again"),
        ('[impacts.again]\nlogs = ["soft/*.csv", "free/../soft/01.csv"]\n', r"soft/01\.csv is scored twice in again"),
        ('[holdout]\nlogs = ["stiff/*.csv"]\n', r"stiff/01\.csv is scored in stiff and in holdout"),
    ],
)
def test_an_unscored_log_an_empty_name_and_a_repeated_log_are_refused(read, text, said):
    with pytest.raises(ConfigurationError, match=said):
        read(PROFILE, LEARN, STIFF, text)


def test_a_campaign_may_name_logs_of_the_hold_out_and_a_point_may_not(read):
    setup = read(PROFILE, LEARN, STIFF, HOLDOUT, '[campaigns.a]\nlogs = ["holdout/*.csv"]\n')
    assert len(setup.campaigns) == 2
    with pytest.raises(
        ConfigurationError, match=r"points\.a: names .*holdout/01\.csv, which is not in a group of \[impacts\]"
    ):
        read(PROFILE, LEARN, STIFF, HOLDOUT, '[points.a]\nlogs = ["holdout/*.csv"]\n')


def test_points_and_a_limits_file_without_a_force_profile_are_refused(read):
    with pytest.raises(ConfigurationError, match=r"points: .*no force profile.*\[force\] profile"):
        read(LEARN, STIFF, '[points.a]\nlogs = ["stiff/*.csv"]\n')
    limits = '[gap]\ntitle = "t"\nsource = "s"\nsteps = [{ from_s = 0.0, at_most_n = 400.0, name = "dynamic" }]\n'
    (read.folder / "limits.toml").write_text(limits, encoding="utf-8")
    with pytest.raises(ConfigurationError, match=r"force\.limits: .*no profile.*gap"):
        read(LEARN, STIFF, '[force]\nlimits = "limits.toml"\n')
    assert read(LEARN, STIFF, 'force_profile = "gap"\n[force]\nlimits = "limits.toml"\n').impacts["stiff"].force
