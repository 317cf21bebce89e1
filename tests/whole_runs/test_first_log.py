"""A stranger's logs without header, free runs or model: from `init` to latencies (docs/first-log.md), reduced."""

from benchmarks.robot_collisions import score_all


def test_every_collision_is_detected_without_a_false_alarm_and_its_onset_is_right_to_a_sample(tmp_path, capsys):
    assert score_all(tmp_path, 14), capsys.readouterr().out
    lines = capsys.readouterr().out.splitlines()
    assert sum("14 of 14 detected, 0 false alarms" in line for line in lines) >= 3
