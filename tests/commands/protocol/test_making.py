"""A test from a rig's recordings to its protocol: file, assignment, verdict."""

from __future__ import annotations

import hashlib
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.commands.protocol.assessment.protocol import Protocol
from cdtool.commands.protocol.assessment.reasons import ProtocolVerdict
from cdtool.commands.protocol.checking import check_protocol
from cdtool.commands.protocol.document.words import words_of
from cdtool.commands.protocol.drafting import draft_protocol
from cdtool.commands.protocol.making import make_protocol
from cdtool.commands.protocol.protocol_file import read_protocol_file
from tests.synthetic.force_rig import half_sine, write_log, write_protocol, write_rig

FORCES = (half_sine(300.0), half_sine(320.0), half_sine(340.0))


@pytest.fixture(scope="module")
def rig(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("rig")
    write_rig(folder, FORCES)
    write_protocol(folder)
    return folder


@pytest.fixture(scope="module")
def made(rig) -> Protocol:
    return make_protocol(read_protocol_file(rig / "protocol.toml"), cdtool.benchmark(rig / "benchmark.toml"))


def kinds_of(verdict: ProtocolVerdict) -> list[str]:
    return [reason.kind for reason in verdict.reasons]


def kinds(protocol: Protocol) -> list[str]:
    return kinds_of(protocol.verdict)


def test_three_good_repetitions_pass_with_their_quantities_and_latencies(made):
    assert (made.verdict.outcome, kinds(made)) == ("pass", [])
    (point,) = made.points
    assert [round(item.curve.peak) for item in point.repetitions] == pytest.approx([300, 320, 340], abs=2)
    for item, peak in zip(point.repetitions, (300.0, 320.0, 340.0), strict=True):
        share = 150.0 / peak
        assert item.dynamic_time == pytest.approx(0.3 - 0.6 / math.pi * math.asin(share), abs=2e-3)
        assert item.sample_rate == pytest.approx(1000.0)
        assert set(item.latencies_ms) == {"momentum"}


def test_the_verdicts_are_those_of_the_benchmark_with_the_same_profile(rig, made):
    text = (rig / "benchmark.toml").read_text(encoding="utf-8")
    other = rig / "with_force.toml"
    other.write_text(text + '[force]\nprofile = "en_12453_reducing_gap"\n', encoding="utf-8")
    rows = cdtool.benchmark(other).results.forces
    found = made.points[0].repetitions
    assert [row.recording for row in rows] == [item.recording for item in found]
    assert [row.peak_n for row in rows] == [item.curve.peak for item in found]
    assert [row.verdict for row in rows] == [item.verdict.outcome for item in found]


def test_every_file_is_named_with_its_hash_and_one_hash_stands_for_all(rig, made):
    for item in made.files:
        assert hashlib.sha256((rig / item.name).read_bytes()).hexdigest() == item.sha256
    assert [item.role for item in made.files] == ["protocol", "benchmark", "machine", *["measured"] * 3]
    lines = "".join(f"{item.sha256}  {item.name}\n" for item in made.files)
    assert hashlib.sha256(lines.encode()).hexdigest() == made.data_sha256
    changed = replace(made, files=made.files[:-1])
    assert changed.data_sha256 != made.data_sha256


def test_every_file_that_a_figure_depends_on_has_its_hash(tmp_path):
    write_rig(tmp_path, FORCES)
    (tmp_path / "yard.toml").write_bytes(Path("cdtool/truth/force/limits.toml").read_bytes())
    (tmp_path / "own.toml").write_bytes(Path("cdtool/truth/force/limits.toml").read_bytes() + b"\n")
    with (tmp_path / "benchmark.toml").open("a", encoding="utf-8") as opened:
        opened.write('[force]\nlimits = "yard.toml"\nprofile = "en_12453_reducing_gap"\n')
    path = write_protocol(tmp_path)
    text = path.read_text(encoding="utf-8").replace('profile = "en_', '# "')
    path.write_text(text, encoding="utf-8")
    first = cdtool.protocol(path)
    assert first.verdict.outcome == "pass"
    assert [item.name for item in first.files if item.role == "limits"] == ["yard.toml"]
    path.write_text(text.replace('number = "P-17"', 'limits = "own.toml"'), encoding="utf-8")
    assert [item.name for item in cdtool.protocol(path).files if item.role == "limits"] == ["own.toml", "yard.toml"]
    # The report must not overwrite it, either.
    assert tmp_path / "yard.toml" in cdtool.benchmark(tmp_path / "benchmark.toml").inputs


def test_a_file_of_labels_and_a_load_cell_in_its_own_file_have_their_hash(tmp_path):
    write_rig(tmp_path, FORCES)
    machine = (tmp_path / "machine.toml").read_text(encoding="utf-8")
    time = 'time = { column = "t", unit = "s" }, time_offset = 0.0'
    own = f'force = {{ file = "{{stem}}_force.csv", column = "load_cell", unit = "N", {time} }}'
    (tmp_path / "machine.toml").write_text(
        machine.replace('force = { column = "load_cell", unit = "N" }', own), encoding="utf-8"
    )
    for log in sorted((tmp_path / "edge").glob("*.csv")):
        log.with_stem(f"{log.stem}_force").write_bytes(log.read_bytes())
    benchmark = (tmp_path / "benchmark.toml").read_text(encoding="utf-8")
    (tmp_path / "benchmark.toml").write_text(
        benchmark.replace("[onset]", '[onset]\nlabels = "labels.csv"'), encoding="utf-8"
    )
    (tmp_path / "labels.csv").write_text("recording,start_s,end_s\n01.csv,3.0,3.3\n", encoding="utf-8")
    files = {item.name: item.role for item in cdtool.protocol(write_protocol(tmp_path)).files}
    names = set(files)
    assert files["labels.csv"] == "labels"
    assert {f"edge/0{number}{end}.csv" for number in (1, 2, 3) for end in ("", "_force")} <= names


def test_an_excluded_recording_is_named_and_not_counted(tmp_path):
    write_rig(tmp_path, (*FORCES, half_sine(900.0)))
    more = '[[protocol.exclusion]]\nlogs = ["edge/04.csv"]\nreason = "the rig slipped"'
    protocol = cdtool.protocol(write_protocol(tmp_path, more=more))
    assert protocol.verdict.outcome == "pass" and len(protocol.points[0].repetitions) == 3
    assert [(item.recording, item.reason) for item in protocol.excluded] == [("edge/04.csv", "the rig slipped")]
    assert "excluded" in [item.role for item in protocol.files]


def test_a_contact_without_a_force_or_that_cannot_be_read_is_a_reason(tmp_path):
    write_rig(tmp_path, FORCES[:2])
    write_log(tmp_path / "edge" / "03.csv", half_sine(5.0))
    protocol = cdtool.protocol(write_protocol(tmp_path))
    assert protocol.verdict.outcome == "incomplete"
    assert kinds(protocol) == ["too_few_repetitions", "unreadable"]


@pytest.mark.parametrize(("slope", "reading"), [(150.0, 156.0), (400.0, 165.0)])
def test_a_slow_contact_that_begins_with_the_record_does_not_pass_by_a_wrong_rest(slope, reading, tmp_path):
    def ramp(time):
        return np.where(time < 1.5, np.minimum(slope * (time + 3.0), reading), 0.0)

    write_rig(tmp_path, (ramp, ramp, ramp))
    protocol = cdtool.protocol(write_protocol(tmp_path))
    assert protocol.points[0].repetitions[0].verdict.steps[1].peak < 150.0 < reading
    assert kinds(protocol) == ["rest_decides"] * 3


@pytest.mark.parametrize(
    ("slope", "level", "early"),
    [(2.0, 18.0, 3.0), (5.0, 17.0, 3.0), (1.0, 18.0, 3.0), (20.0, 40.0, 0.5), (15.0, 30.0, 0.55)],
)
def test_a_record_that_begins_in_the_middle_of_a_slow_rise_does_not_pass_by_a_wrong_rest(slope, level, early, tmp_path):
    def rise_and_impact(time):
        rise = np.where(time < 0.3, np.maximum(level + slope * np.minimum(time, 0.0), 0.0), 0.0)
        return rise + half_sine(405.0 - level)(time)

    write_rig(tmp_path, (rise_and_impact,) * 3)
    for path in (tmp_path / "edge").iterdir():
        header, *rows = path.read_text(encoding="utf-8").splitlines()
        path.write_text("\n".join([header, *rows[round(1000 * (3.0 - early)) :], ""]), encoding="utf-8")
    protocol = cdtool.protocol(write_protocol(tmp_path))
    assert protocol.points[0].repetitions[0].curve.peak < 400.0
    assert protocol.verdict.outcome == "incomplete" and "rest_decides" in kinds(protocol)


@pytest.mark.parametrize("early", [0.1, 0.3, 0.5])
def test_a_trigger_shortly_before_the_contact_and_an_offset_of_the_cell_are_no_slow_rise(early, tmp_path):
    write_rig(tmp_path, ())
    for number in (1, 2, 3):
        path = tmp_path / "edge" / f"{number}.csv"
        write_log(path, half_sine(390.0), rest=50.0)
        header, *rows = path.read_text(encoding="utf-8").splitlines()
        path.write_text("\n".join([header, *rows[round(1000 * (3.0 - early)) :], ""]), encoding="utf-8")
    assert kinds(cdtool.protocol(write_protocol(tmp_path))) == []


def test_rows_that_the_reader_drops_are_never_a_pass(tmp_path):
    write_rig(tmp_path, (*FORCES, half_sine(900.0)))
    header, rest = (tmp_path / "edge" / "04.csv").read_text(encoding="utf-8").split("\n", 1)
    (tmp_path / "edge" / "04.csv").unlink()
    # The rig appended the next test: its clock begins again.
    with (tmp_path / "edge" / "03.csv").open("a", encoding="utf-8") as opened:
        opened.write(rest)
    protocol = cdtool.protocol(write_protocol(tmp_path))
    assert header and (protocol.verdict.outcome, kinds(protocol)) == ("incomplete", ["data_lost"])
    assert "run backward" in str(protocol.verdict.reasons[0].values["message"])


def test_a_pattern_without_a_file_is_named_where_other_recordings_are_there(tmp_path):
    write_rig(tmp_path, FORCES)
    path = write_protocol(tmp_path, logs='logs = ["edge/*.csv", "edge/o4.csv"]')
    text = path.read_text(encoding="utf-8")
    path.write_text(f'{text}\n[[protocol.exclusion]]\nlogs = ["edge/9.csv"]\nreason = "slipped"\n', encoding="utf-8")
    wanted = [("protocol.exclusion[1].logs", "edge/9.csv"), ("protocol.point[1].logs", "edge/o4.csv")]
    for verdict in (cdtool.protocol(path).verdict, check_protocol(path).verdict):
        assert [(reason.values["entry"], reason.values["pattern"]) for reason in verdict.reasons] == wanted
        sentence = "protocol.exclusion[1].logs: no file matches edge/9.csv"
        assert words_of("en").reasons(verdict, "incomplete")[0] == sentence


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"logs": 'group = "edges"'}, "no group 'edges'"),
        ({"logs": 'logs = ["*.toml"]'}, "is not in a group of"),
        ({"day": '"31/3/2026"'}, "is '31/3/2026' (give a day as 2026-03-31)"),
        ({"day": "2026-03-31T10:00:00"}, "is 2026-03-31 10:00:00 (give a day as 2026-03-31)"),
        ({"language": "fr"}, "protocol.language"),
        ({"more": "speed = 1"}, "protocol.point[1].speed: unknown key"),
        ({"more": "obstacle = 3"}, "protocol.point[1].obstacle"),
        (
            {"more": '[[protocol.deviation]]\npoint = "x"\ntext = "a"\nreason = "b"'},
            "deviation[1].point: names the measuring point 'x'",
        ),
        ({"logs": 'group = "edge"\nlogs = ["a"]'}, "is given with logs"),
        ({"more": '[[protocol.point]]\nname = "b"\nprofile = "en_1"'}, "unknown force profile 'en_1'"),
        ({"more": '[[protocol.point]]\nname = "b"\ngroup = "edge"'}, "is also of the point 1"),
    ],
)
def test_a_wrong_file_names_file_and_key(changes, words, rig, tmp_path):
    for name in ("benchmark.toml", "machine.toml", "edge"):
        (tmp_path / name).symlink_to(rig / name)
    path = write_protocol(tmp_path, **changes)
    with pytest.raises((ConfigurationError, UsageError)) as fault:
        check_protocol(path)
    assert words in str(fault.value) and "protocol.toml" in str(fault.value)


def test_a_table_in_the_benchmark_file_is_the_same_protocol(rig, made, tmp_path):
    for name in ("machine.toml", "edge"):
        (tmp_path / name).symlink_to(rig / name)
    table = (rig / "protocol.toml").read_text(encoding="utf-8").replace('benchmark = "benchmark.toml"\n', "")
    path = tmp_path / "benchmark.toml"
    path.write_text((rig / "benchmark.toml").read_text(encoding="utf-8") + table, encoding="utf-8")
    own = cdtool.protocol(path)
    assert own.verdict.outcome == "pass" and own.files[0].role == "benchmark"


def test_a_draft_knows_what_the_recordings_show_and_lists_the_rest(rig, tmp_path):
    draft = draft_protocol(rig / "benchmark.toml", rig / "draft.toml")
    plan = read_protocol_file(draft.path).plan
    assert (plan.points[0].name, plan.points[0].group, plan.points[0].repetitions) == ("edge", "edge", 3)
    assert plan.points[0].speed_m_per_s == pytest.approx(0.2)
    assert plan.force_instrument is not None and plan.force_instrument.sample_rate_hz == pytest.approx(1000.0)
    checked = check_protocol(draft.path)
    empty = [reason for reason in checked.verdict.reasons if reason.kind == "no_value"]
    # The profile is one of the values to fill in, and a reason of its own.
    assert len(empty) + 1 == draft.to_fill_in and checked.recordings == {"edge": 3}
    with pytest.raises(UsageError, match="already exists"):
        draft_protocol(rig / "benchmark.toml", draft.path)
    with pytest.raises(UsageError, match=r"\.toml"):
        draft_protocol(rig / "benchmark.toml", tmp_path / "draft.txt")


def test_a_draft_takes_the_test_points_of_the_benchmark_and_names_logs_relative_to_itself(rig, tmp_path):
    text = (rig / "benchmark.toml").read_text(encoding="utf-8")
    force = '[force]\nprofile = "en_12453_wide_gap"\n[points.low]\nlogs = ["edge/0[12].csv"]\n'
    (rig / "points.toml").write_text(text + force, encoding="utf-8")
    (rig / "plans").mkdir()
    draft = draft_protocol(rig / "points.toml", rig / "plans" / "draft.toml")
    (point,) = read_protocol_file(draft.path).plan.points
    assert (point.name, point.profile, point.obstacle_stiffness_n_per_mm) == ("low", "en_12453_wide_gap", 500.0)
    assert point.logs == ("../edge/01.csv", "../edge/02.csv") and point.repetitions == 3
    assert check_protocol(draft.path).recordings == {"low": 2}


def test_before_anything_is_recorded_a_plan_can_be_drafted_and_checked(tmp_path):
    write_rig(tmp_path, [])
    path = write_protocol(tmp_path)
    reasons = {reason.kind: reason.due for reason in check_protocol(path).verdict.reasons}
    assert reasons == {"not_measured": "test_day", "benchmark_unreadable": "test_day"}
    draft = draft_protocol(None, tmp_path / "empty.toml")
    assert [point.logs for point in read_protocol_file(draft.path).plan.points] == [("point_1/*.csv",)]
