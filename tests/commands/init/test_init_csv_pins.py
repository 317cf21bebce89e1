"""`cdtool init --set csv.KEY=VALUE`: a draft from a table that is not read without settings."""

import tomllib
from pathlib import Path

import pytest

import cdtool as api
from cdtool.base.errors import UsageError
from tests.command import cdtool, one_line

LOGS = Path(__file__).parents[3] / "sample_logs"


@pytest.fixture
def glued(tmp_path):
    """A table whose last name contains separators: more names than cells."""
    rows = "".join(f"{10 * i},{0.01 * i * i:.2f},{2 * i}.0\n" for i in range(60))
    path = tmp_path / "glued.txt"
    path.write_text("Time (ms),Position (mm),Speed (mm/s):Kp=0.1,Kd=0\n" + rows, encoding="utf-8")
    return path


def test_a_table_that_cannot_be_read_names_the_option(glued, tmp_path):
    done = cdtool("init", glued, "-o", tmp_path / "m.toml")
    assert done.status == 2 and "--set csv.header=false" in one_line(done.err)
    assert not (tmp_path / "m.toml").exists()


def test_the_settings_are_used_and_are_part_of_the_draft(glued, tmp_path):
    done = cdtool("init", glued, "-o", tmp_path / "m.toml", "--set", "csv.header=false", "--set", "csv.separator=comma")
    assert done.status == 0, done.err
    values = tomllib.loads((tmp_path / "m.toml").read_text(encoding="utf-8"))
    assert values["csv"] == {"header": False, "separator": "comma"} and values["channels"]["time"]["column"] == 0
    assert cdtool("info", glued, "-m", tmp_path / "m.toml").status == 0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (("--set", "header=false"), "--set header: unknown key"),
        (("--set", "csv.header"), "--set is 'csv.header'"),
        (("--set", "csv.heder=false"), "--set csv.heder: unknown key (did you mean header?"),
        (("--set", "csv.decimal=x"), "--set csv.decimal: is 'x'"),
        (("--set", "csv.encoding=idna"), "--set csv.encoding: is 'idna'"),
        (("--set", "csv.header=false", "--machine", "m.toml"), "--set and --machine: both state how tables are read"),
    ],
)
def test_a_wrong_setting_is_one_line(glued, tmp_path, given, words):
    done = cdtool("init", glued, "-o", tmp_path / ("study" if "--machine" in given else "m.toml"), *given)
    assert done.status == 2 and words in one_line(done.err) and len(done.err.strip().splitlines()) <= 3


def test_a_log_that_is_not_a_table_has_no_settings(tmp_path):
    log = next(iter(sorted(LOGS.rglob("*.mcap"))))
    with pytest.raises(UsageError, match="not a text table"):
        api.init(log, tmp_path / "m.toml", csv={"header": False})


def words_in(tmp_path, words):
    rows = [f"{0.01 * i:.2f},{0.1 * i:.1f},{i % 7}.5" for i in range(200)]
    for number, word in enumerate(words):
        rows[20 + 10 * number] = f"{0.01 * (20 + 10 * number):.2f},{word},0.5"
    path = tmp_path / "words.csv"
    path.write_text("t [s],Position [mm],Current [A]\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path


def test_a_word_in_a_column_of_numbers_is_drafted_as_missing_with_a_mark(tmp_path):
    log = words_in(tmp_path, ["ERROR", "ERROR"])
    done = cdtool("init", log, "-o", tmp_path / "m.toml")
    text = (tmp_path / "m.toml").read_text(encoding="utf-8")
    assert done.status in (0, 3) and tomllib.loads(text)["csv"] == {"missing": ["ERROR"]}
    comment = one_line(text.replace("\n#", ""))
    assert '"ERROR" in line 22, column Position' in comment and "CHECK: do they stand for" in comment
    seen = cdtool("info", log, "-m", tmp_path / "m.toml")
    assert "2 of 200 values are missing" in one_line(seen.out)
