"""The GitHub Action: its steps run in bash with a stand-in for GitHub's program; no input reaches a shell as code."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

yaml = pytest.importorskip("yaml")

ROOT = Path(__file__).parents[2]
ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
STEPS = ACTION["runs"]["steps"]

# The calls of `gh api` that the action makes, on comments in a file. With GH_FAILS=read every call is refused, with
# GH_FAILS=write those that write: the token of a fork may read.
GH = """
import json, os, pathlib, sys
fails = os.environ.get("GH_FAILS")
if fails == "read" or fails == "write" and "--method" in sys.argv:
    sys.exit("HTTP 403: Resource not accessible by integration")
store = pathlib.Path(os.environ["COMMENTS"])
comments = json.loads(store.read_text()) if store.exists() else []
words = sys.argv[1:]
assert words[0] == "api", words
if "--method" not in words:
    assert words[1:3] == ["--paginate", "repos/owner/gate/issues/7/comments"], words
    assert "env.MARK" in words[4] and '.user.type == "Bot"' in words[4]
    found = [item for item in comments if item["bot"] and item["body"].startswith(os.environ["MARK"])]
    print("\\n".join(str(item["id"]) for item in found))
    sys.exit()
method, path = words[words.index("--method") + 1 :][:2]
(field,) = [word for word in words if word.startswith("body=@")]
body = pathlib.Path(field.removeprefix("body=@")).read_text(encoding="utf-8")
if method == "POST":
    assert path == "repos/owner/gate/issues/7/comments"
    comments.append({"id": 100 + len(comments), "bot": True, "body": body})
else:
    assert method == "PATCH"
    (found,) = [item for item in comments if path == f"repos/owner/gate/issues/comments/{item['id']}"]
    found["body"] = body
store.write_text(json.dumps(comments))
"""
# A benchmark that notes its arguments and writes the summary that it is given.
CDTOOL = """
import json, os, pathlib, sys
words = sys.argv[1:]
pathlib.Path("arguments.json").write_text(json.dumps(words))
for at, word in enumerate(words):
    if word == "-o" and words[at + 1].endswith(".md") and "SUMMARY" in os.environ:
        pathlib.Path(words[at + 1]).write_text(os.environ["SUMMARY"], encoding="utf-8")
sys.exit(int(os.environ.get("STATUS_TO_RETURN", "0")))
"""


def step(name: str) -> dict[str, Any]:
    (found,) = [item for item in STEPS if item.get("name") == name]
    return dict(found)


class Runner:
    """Run the steps as a runner does: bash that stops at the first failure, inputs as variables of the environment."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        programs = folder / "programs"
        programs.mkdir()
        for name, text in (("gh", GH), ("cdtool", CDTOOL)):
            (programs / name).write_text(f"#!{sys.executable}\n{text}", encoding="utf-8")
            (programs / name).chmod(0o755)
        (programs / "python").symlink_to(sys.executable)
        self.inputs = {
            "BENCHMARK": "benchmark.toml",
            "ARGUMENTS": "",
            "OUTPUT": "out",
            "VERSION": "",
            "EXTRAS": "",
            "NUMBER": "7",
            "GH_TOKEN": "none",
        }
        self.environment = {
            **os.environ,
            "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
            "GITHUB_REPOSITORY": "owner/gate",
            "GITHUB_OUTPUT": str(folder / "output.txt"),
            "GITHUB_STEP_SUMMARY": str(folder / "step_summary.md"),
            "RUNNER_TEMP": str(folder),
            "COMMENTS": str(folder / "comments.json"),
        }

    def run(self, name: str) -> subprocess.CompletedProcess[str]:
        output = self.folder / "output.txt"
        status = output.read_text().strip().rpartition("=")[2] if output.exists() else ""
        given = {**self.inputs, "STATUS": status}
        environment = {key: given[key] for key in step(name).get("env", {})}
        return subprocess.run(
            ["bash", "--noprofile", "--norc", "-e", "-o", "pipefail", "-c", step(name)["run"]],
            capture_output=True,
            text=True,
            cwd=self.folder,
            env={**self.environment, **environment},
            check=False,
        )

    def all_steps(self) -> int:
        """Run all steps after the installation; return the status of the last one."""
        for name in ("Benchmark", "Summary", "Comment on the pull request"):
            done = self.run(name)
            assert done.returncode == 0, (name, done.stderr)
        return self.run("Status").returncode

    def comments(self) -> list[dict[str, Any]]:
        path = self.folder / "comments.json"
        return list(json.loads(path.read_text())) if path.exists() else []


@pytest.fixture
def runner(tmp_path: Path) -> Runner:
    if shutil.which("bash") is None:
        pytest.skip("bash is not installed")
    return Runner(tmp_path)


def test_a_second_run_replaces_the_comment_and_other_comments_stay(runner):
    of_a_person = {"id": 1, "bot": False, "body": "<!-- cdtool benchmark copied by hand -->"}
    (runner.folder / "comments.json").write_text(json.dumps([of_a_person]))
    for summary in ("first | 20 ms\n", "second | 25 ms\n"):
        runner.environment["SUMMARY"] = summary
        assert runner.all_steps() == 0
        person, own = runner.comments()
        assert person == of_a_person
        assert re.fullmatch(rf"<!-- cdtool benchmark [0-9a-f]{{16}} -->\n{re.escape(summary)}", own["body"])
    assert (runner.folder / "step_summary.md").read_text() == "first | 20 ms\nsecond | 25 ms\n"


def test_a_violated_limit_is_commented_on_and_fails_the_last_step(runner):
    runner.environment |= {"SUMMARY": "limit violated\n", "STATUS_TO_RETURN": "1"}
    assert runner.all_steps() == 1
    assert "limit violated" in runner.comments()[0]["body"]


@pytest.mark.parametrize(
    ("fails", "why"), [("read", "cannot be read"), ("write", "a fork, or no pull-requests: write")]
)
def test_a_fork_whose_token_may_not_write_gets_a_notice_and_no_failure(runner, fails, why):
    runner.environment |= {"SUMMARY": "table\n", "GH_FAILS": fails}
    assert runner.all_steps() == 0
    (line,) = runner.run("Comment on the pull request").stdout.splitlines()
    assert line.startswith("::notice::") and why in line and "page of the job" in line
    assert not runner.comments() and (runner.folder / "step_summary.md").read_text() == "table\n"


def test_every_input_reaches_a_step():
    text = json.dumps([item.get("env", {}) | item.get("with", {}) | {"if": item.get("if", "")} for item in STEPS])
    for name in ACTION["inputs"]:
        assert f"inputs.{name}" in text, name


@pytest.mark.parametrize("name", ["$(touch hacked).toml", '"; touch hacked; ".toml', "`touch hacked`", "--json"])
def test_inputs_are_never_run_as_code_or_taken_as_options(runner, name):
    runner.inputs |= {"BENCHMARK": name, "ARGUMENTS": "--jobs 2 $(touch hacked) ;touch hacked"}
    runner.environment["SUMMARY"] = "table\n"
    assert runner.all_steps() == 0
    assert not (runner.folder / "hacked").exists()
    words = json.loads((runner.folder / "arguments.json").read_text())
    assert words[-2:] == ["--", name] and words[:5] == ["benchmark", "--jobs", "2", "$(touch", "hacked)"]


@pytest.mark.parametrize(
    ("version", "extras"), [("0.1.0; touch hacked", ""), ("--index-url=x", ""), ("", "a]; x"), ("", "$(touch hacked)")]
)
def test_a_version_or_extra_of_another_form_is_refused_before_anything_is_installed(runner, version, extras):
    runner.inputs |= {"VERSION": version, "EXTRAS": extras}
    done = runner.run("Install cdtool")
    assert done.returncode == 2 and "::error::" in done.stdout and not (runner.folder / "hacked").exists()


def test_no_expression_of_github_is_part_of_a_script_and_its_actions_are_pinned():
    for item in STEPS:
        assert "${{" not in item.get("run", "")
        assert item.get("shell") == "bash" or re.fullmatch(r"[\w/-]+@[0-9a-f]{40}", item["uses"])
    assert set(ACTION["outputs"]) == {"status", "output"}


def test_every_input_of_the_action_is_described_in_the_documentation():
    page = (ROOT / "docs" / "ci.md").read_text(encoding="utf-8")
    for name in ACTION["inputs"]:
        assert f"| `{name}` |" in page, name
