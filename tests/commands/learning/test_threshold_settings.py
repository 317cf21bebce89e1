"""`threshold` of a benchmark file: every rule by name or table, class by class, with its settings checked."""

from __future__ import annotations

from pathlib import Path

import pytest

import cdtool
from cdtool.base.errors import ConfigurationError
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from cdtool.formats.signature_store import write_signature
from cdtool.thresholds.cusum import Cusum
from cdtool.thresholds.limit import Limit
from cdtool.thresholds.signature import Signature
from tests.synthetic.door import MACHINE, write_log

MOTION = {"operations": "motion"}
HEAD = 'machine = "machine.toml"\ndetectors = ["gm"]\noperations = "motion"\n'
LOGS = '[learn]\nlogs = ["free.csv"]\n[impacts.push]\nlogs = ["hits.csv"]\n[holdout]\nlogs = ["quiet.csv"]\n'


@pytest.fixture(scope="module")
def door(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("door")
    (path / "machine.toml").write_text(MACHINE)
    write_log(path / "free.csv", 24, {}, 1)
    write_log(path / "quiet.csv", 6, {}, 2)
    write_log(path / "hits.csv", 6, {1: 60.0, 2: 60.0, 5: 60.0}, 3)
    return path


def written(folder: Path, text: str) -> Path:
    file = folder / "benchmark.toml"
    # A key of the file itself precedes its first table.
    key, table = (text, "") if text.startswith("threshold") else ("", text)
    file.write_text(HEAD + key + LOGS + table, encoding="utf-8")
    return file


@pytest.mark.parametrize(
    "text",
    [
        'threshold = "cusum"\n',
        'threshold = "glr"\n',
        '[threshold]\nname = "trend"\nsides = "one"\nsafety_factor = 8\n',
        '[threshold]\nname = "limit_and_trend"\nlead = 0.01\n',
        '[threshold]\nname = "combined"\nmembers = ["signature", "cusum"]\nactivation = "all"\n',
    ],
)
def test_contacts_in_both_directions_are_found_whatever_the_threshold(door, text):
    results = cdtool.benchmark(written(door, text)).results
    assert [row.outcome for row in results.contacts] == ["detected"] * 3
    assert all(5.0 < row.latency_ms < 200.0 for row in results.contacts)
    # Obstacles oppose the motion: below the band in backward strokes (1 and 5), above it in forward ones.
    if "combined" not in text:
        assert [row.side for row in results.contacts] == ["below", "above", "below"]


def test_a_budget_sets_the_factor_of_each_class_alike(door):
    text = '[threshold]\nname = "cusum"\ndrift = 1.0\n[signature]\nforce = true\n'
    done = cdtool.benchmark(written(door, text), false_alarm_budget="1/8op")
    assert [row.operations for row in done.results.calibration] == [24]
    assert all(row.not_assessable == 0 for row in done.results.exposure)
    assert all(row.outcome == "detected" for row in done.results.contacts)


def test_what_the_signature_learns_is_set_in_its_own_table(door):
    file = written(door, '[threshold]\nname = "cusum"\n[signature]\nposition_step = 0.01\nalignment = "position"\n')
    rule = read_benchmark_file(file).rule
    assert isinstance(rule, Cusum) and rule.safety_factor == Cusum.safety_factor
    assert rule.signature.position_step == 0.01 and rule.signature.alignment == "position"


def test_limits_set_by_hand_replace_learned_ones_and_results_state_it(door):
    setup = read_benchmark_file(written(door, '[threshold]\nname = "limit"\nlimits = 50\n'))
    assert setup.rule == Limit(limits=(50,)) and setup.limits_by_hand == (50,)
    done = cdtool.benchmark(setup)
    assert {row.limit for row in done.results.contacts if row.limit} == {50.0, -50.0}
    assert done.results.provenance["safety_factor_set"] == "by hand"
    learned = cdtool.benchmark(written(door, '[threshold]\nname = "limit"\n')).results
    assert learned.provenance["safety_factor_set"] == "by default"
    assert 50.0 not in {row.limit for row in learned.contacts}


def test_without_its_own_a_rule_takes_the_safety_factor_of_the_signature(door):
    rule = read_benchmark_file(written(door, '[threshold]\nname = "limit"\n[signature]\nsafety_factor = 9\n')).rule
    assert rule == Limit(9.0)
    assert read_benchmark_file(written(door, 'threshold = "limit"\n')).rule == Limit()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('threshold = "cusom"\n', "threshold: is 'cusom'.*did you mean cusum"),
        ('[threshold]\nname = "cusom"\n', "threshold.name: is 'cusom'.*did you mean cusum"),
        ('[threshold]\nname = "cusum"\ndrfit = 1\n', "threshold.drfit: unknown key.*did you mean drift"),
        ('[threshold]\nname = "cusum"\ndrift = "1"\n', "threshold.drift: is '1'.*a number"),
        ('[threshold]\nname = "cusum"\norder = 2.5\n', "threshold.order: is 2.5.*whole number"),
        ('[threshold]\nname = "cusum"\norder = 99\n', "threshold.order: is 99.*from 1 to 20"),
        ('[threshold]\nname = "cusum"\nsignature = "x"\n', "threshold.signature: unknown key"),
        ('[threshold]\nname = "glr"\nwindows = [0.5]\n', "threshold.windows.1.: is 0.5.*whole number"),
        ('[threshold]\nname = "signature"\nsafety_factor = 3\n', r"threshold.safety_factor.*\[signature\]"),
        ('[threshold]\nname = "limit"\nlimits = [0]\n', "threshold.limits.1.: is 0"),
        ('[threshold]\nname = "limit"\nlimits = "a"\n', "threshold.limits: is 'a'.*a number above 0"),
        ('[threshold]\nname = "limit"\nlimits = 4\nsafety_factor = 2\n', "threshold.safety_factor.*by hand"),
        ("[activation]\nlatched = true\n", "activation.latched: unknown key"),
        ("[activation]\nhysteresis = 1\n", "activation.hysteresis: is 1.*below 1"),
        ("[activation]\nrearm_s = -1\n", "activation.rearm_s: is -1"),
        ("[signature]\ndebounce = 5\n", r"signature.debounce: unknown key .it belongs in \[activation\]"),
        ('[threshold]\nname = "combined"\nmembers = ["limit"]\n', "two or more"),
        ("[signature]\nadaptive_level = -1\n", "signature.adaptive_level: is -1"),
        (
            'threshold = "glr"\n[signature]\nadaptive_level = 6\n',
            "threshold: 'glr' does not follow a run.*adaptive_level",
        ),
        (
            'threshold = "glr"\n[signature]\nspeed_range = true\n',
            "threshold: 'glr' has no limits between speeds.*speed_range",
        ),
        (
            '[signature]\nspeed_range = true\nalignment = "time"\n',
            "signature.speed_range: cannot be combined with alignment 'time'.*time_then_position",
        ),
        ('[signature]\nspeed_range = "yes"\n', "signature.speed_range: is 'yes'"),
    ],
)
def test_a_wrong_threshold_is_one_line_that_names_its_key(door, text, said):
    with pytest.raises(ConfigurationError, match=said):
        read_benchmark_file(written(door, text))


def test_limits_set_by_hand_belong_to_one_detector_and_to_no_budget(door):
    hand = '[threshold]\nname = "limit"\nlimits = 50\n'
    file = written(door, hand)
    file.write_text(file.read_text(encoding="utf-8").replace('["gm"]', '["gm", "pt"]'), encoding="utf-8")
    with pytest.raises(ConfigurationError, match="set by hand together with 2 detectors"):
        read_benchmark_file(file)
    file = written(door, hand)
    file.write_text('false_alarm_budget = "1/8op"\n' + file.read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(ConfigurationError, match="set by hand together with a false-alarm budget"):
        read_benchmark_file(file)
    with pytest.raises(ConfigurationError, match="set by hand"):
        cdtool.benchmark(written(door, hand), false_alarm_budget="1/8op")


def test_a_signature_file_gets_the_factor_that_a_benchmark_sets_for_the_same_budget(door, tmp_path):
    text = '[threshold]\nname = "cusum"\n[signature]\nforce = true\n'
    wanted = cdtool.benchmark(written(door, text), false_alarm_budget="1/8op").results.calibration[0]
    learned = cdtool.learn_signature(
        [door / "free.csv"],
        door / "machine.toml",
        "gm",
        rule=Cusum(signature=Signature(force=True)),
        settings=MOTION,
        false_alarm_budget="1/8op",
    ).signature
    assert [item.safety_factor for item in learned.current] == [wanted.safety_factor] * 2
    assert (learned.origin.by, learned.origin.budget) == ("budget", "1/8op")
    assert (learned.origin.operations, learned.origin.alarms) == (wanted.operations, wanted.alarms)
    write_signature(tmp_path / "s.json", learned)
    found = cdtool.detect(door / "hits.csv", door / "machine.toml", signature=tmp_path / "s.json", settings=MOTION)
    assert [found.detections[i].verdict.outcome for i in (1, 2, 5)] == ["alarm"] * 3
    assert found.detected.threshold.endswith(f"set for 1/8op on 24 operations, {wanted.alarms} alarms")
