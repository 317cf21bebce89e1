"""What a release consists of: wheel, source distribution, version, workflows, hooks, image and citation agree."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

from tests.command import cdtool
from tests.project.pages import ROOT, script_at

yaml = pytest.importorskip("yaml")

PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = PYPROJECT["project"]
WORKFLOWS = {path.name: path for path in (ROOT / ".github" / "workflows").glob("*.yml")}
FALLBACK = PYPROJECT["tool"]["setuptools_scm"]["fallback_version"]


def parsed(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def release() -> ModuleType:
    return script_at(ROOT / ".ci" / "release.py")


def built(source: Path, target: Path, kind: str) -> Path:
    """Build a `wheel` or an `sdist` of a folder, without the network."""
    target.mkdir(exist_ok=True)
    code = f"import sys; from setuptools import build_meta; print(build_meta.build_{kind}(sys.argv[1]))"
    done = subprocess.run([sys.executable, "-c", code, target], cwd=source, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    (made,) = target.iterdir()
    return made


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A part of the package and what its build reads, in a repository of its own."""
    pytest.importorskip("setuptools_scm")
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    folder = tmp_path / "source"
    (folder / "cdtool" / "base").mkdir(parents=True)
    for name in (
        "__init__.py",
        "base/__init__.py",
        "base/version.py",
        "py.typed",
    ):  # of the whole package a build takes ten times as long
        shutil.copy(ROOT / "cdtool" / name, folder / "cdtool" / name)
    for name in ("pyproject.toml", "README.md", "LICENSE", ".gitattributes", ".git_archival.txt"):
        shutil.copy(ROOT / name, folder)
    (folder / "tests").mkdir()
    (folder / "tests" / "test_one.py").write_text("def test_one():\n    assert True\n", encoding="utf-8")
    git(folder, "init", "-q")
    commit(folder, "first")
    return folder


def git(folder: Path, *words: str) -> None:
    identity = ("-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false")
    subprocess.run(["git", *identity, *words], cwd=folder, check=True, capture_output=True)


def commit(folder: Path, words: str) -> None:
    git(folder, "add", "--all")
    git(folder, "commit", "-qm", words, "--allow-empty")


def version_of(wheel: Path) -> str:
    return wheel.name.split("-")[1]


def test_the_wheel_consists_of_the_package_and_its_data(copy, tmp_path):
    shutil.rmtree(copy / "cdtool")
    shutil.copytree(ROOT / "cdtool", copy / "cdtool", ignore=shutil.ignore_patterns("__pycache__"))
    with zipfile.ZipFile(built(copy, tmp_path / "wheel", "wheel")) as archive:
        names = set(archive.namelist())
    own = {name for name in names if not name.split("/")[0].endswith(".dist-info")}
    files = {path for path in (ROOT / "cdtool").rglob("*") if path.is_file() and "__pycache__" not in path.parts}
    assert own == {path.relative_to(ROOT).as_posix() for path in files}
    assert "cdtool/py.typed" in own and any(name.endswith("licenses/LICENSE") for name in names)


def test_a_tag_is_the_version_and_each_commit_after_it_has_its_own(copy, tmp_path):
    before = version_of(built(copy, tmp_path / "before", "wheel"))
    assert re.fullmatch(rf"{FALLBACK.removesuffix('0')}1\+g[0-9a-f]+", before)
    git(copy, "tag", "v0.1.0")
    assert version_of(built(copy, tmp_path / "tagged", "wheel")) == "0.1.0"
    commit(copy, "second")
    assert version_of(built(copy, tmp_path / "after", "wheel")).startswith("0.1.1.dev1+g")


def test_a_source_distribution_has_the_tests_and_builds_the_same_wheel_without_git(copy, tmp_path):
    git(copy, "tag", "v0.1.0")
    packed = built(copy, tmp_path / "sdist", "sdist")
    with tarfile.open(packed) as archive:
        archive.extractall(tmp_path / "unpacked", filter="data")
    (source,) = (tmp_path / "unpacked").iterdir()
    assert (source / "tests" / "test_one.py").is_file() and not (source / ".git").exists()
    first, second = built(copy, tmp_path / "a", "wheel"), built(source, tmp_path / "b", "wheel")
    assert first.name == second.name == "cdtool-0.1.0-py3-none-any.whl"
    with zipfile.ZipFile(first) as one, zipfile.ZipFile(second) as other:
        assert set(one.namelist()) == set(other.namelist())


def test_a_copy_without_git_and_an_archive_of_a_commit_can_be_built(copy, tmp_path):
    git(copy, "tag", "v0.1.0")
    git(copy, "archive", "--output", str(tmp_path / "archive.tar"), "HEAD")
    shutil.rmtree(copy / ".git")
    assert version_of(built(copy, tmp_path / "wheel", "wheel")) == FALLBACK
    with tarfile.open(tmp_path / "archive.tar") as archive:
        archive.extractall(tmp_path / "archive", filter="data")
    assert version_of(built(tmp_path / "archive", tmp_path / "of_archive", "wheel")) == "0.1.0"


CHANGES = "# Changelog\n\n## 0.1.0 - {date}\n\n### Added\n\n- One thing.\n\n## 0.0.9 - 2026-01-01\n\nOld.\n"


@pytest.fixture
def ready(tmp_path: Path) -> Path:
    """Files of a version that can be released."""
    (tmp_path / "CHANGELOG.md").write_text(CHANGES.format(date="2026-02-03"), encoding="utf-8")
    (tmp_path / "CITATION.cff").write_text("version: 0.1.0\ndate-released: 2026-02-03\n", encoding="utf-8")
    (tmp_path / "pyproject.toml").write_text('[project.urls]\nRepository = "https://host/x"\n', encoding="utf-8")
    return tmp_path


def test_a_version_that_is_ready_is_released_with_its_section_as_notes(release, ready):
    assert list(release.problems("v0.1.0", ready)) == []
    assert release.notes("v0.1.0", ready) == "### Added\n\n- One thing.\n"


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("CHANGELOG.md", CHANGES.format(date="unreleased"), "has the date 'unreleased'"),
        ("CHANGELOG.md", "# Changelog\n", "the first section is not '## 0.1.0 - DATE'"),
        ("CITATION.cff", "version: 0.0.9\ndate-released: 2026-02-03\n", "version is 0.0.9, not 0.1.0"),
        ("CITATION.cff", "version: 0.1.0\n", "date-released is None"),
        ("pyproject.toml", "[project]\n", "no [project.urls]"),
    ],
)
def test_a_version_that_is_not_ready_is_refused_with_the_file_and_the_reason(release, ready, name, text, reason):
    (ready / name).write_text(text, encoding="utf-8")
    found = list(release.problems("v0.1.0", ready))
    assert any(line.startswith(name) and reason in line for line in found), found


def test_a_tag_of_another_form_is_refused(release, ready):
    assert list(release.problems("0.1", ready)) == ["0.1: is not a tag as v1.2.3"]


def test_the_changelog_and_the_citation_name_the_version_of_the_fallback():
    version = FALLBACK.partition(".dev")[0]
    sections = re.findall(r"^## (\S+) - \S+$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    citation = parsed(ROOT / "CITATION.cff")
    assert sections[0] == citation["version"] == version
    assert citation["license"] == PROJECT["license"] and set(citation["keywords"]) <= set(PROJECT["keywords"])


def test_ci_tests_each_python_that_the_project_accepts():
    accepted = SpecifierSet(PROJECT["requires-python"])
    versions = [f"3.{minor}" for minor in range(8, 30) if f"3.{minor}" in accepted]
    assert parsed(WORKFLOWS["ci.yml"])["jobs"]["python"]["strategy"]["matrix"]["python"] == versions
    named = [text.rpartition(" ")[2] for text in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", text)]
    assert named == versions


def test_workflows_pin_their_actions_and_ask_for_few_rights():
    example = ROOT / "docs" / "examples" / "github-actions.yml"
    for name, path in (*WORKFLOWS.items(), (example.name, example)):
        text, values = path.read_text(encoding="utf-8"), parsed(path)
        assert "pull_request_target" not in text, name
        for used in re.findall(r"uses: (\S+)", text):
            assert re.fullmatch(r"[\w./-]+@[0-9a-f]{40}", used), (name, used)
        assert values["permissions"] in ({"contents": "read"}, {}), name
        for job, content in values["jobs"].items():
            assert content["timeout-minutes"] <= 90, (name, job)
            rights = content.get("permissions", values.get("permissions"))
            assert isinstance(rights, dict), (name, job)
            for step in content["steps"]:
                assert not re.search(r"\$\{\{.*(head_ref|title|body|\.ref)", step.get("run", "")), (name, job)
    publish = parsed(WORKFLOWS["release.yml"])["jobs"]["publish"]
    assert publish["permissions"] == {"id-token": "write"} and publish["environment"] == "pypi"


def test_hooks_are_commands_of_cdtool_that_check_a_benchmark_file():
    for hook in parsed(ROOT / ".pre-commit-hooks.yaml"):
        words = shlex.split(hook["entry"])
        assert words[0] == "cdtool" and hook["language"] == "python" and hook["pass_filenames"] is False
    dry = shlex.split(parsed(ROOT / ".pre-commit-hooks.yaml")[0]["entry"])[1:]
    assert cdtool(*dry, ROOT / "sample_logs" / "gate" / "benchmark.toml").status == 0
    assert cdtool(*dry, ROOT / "sample_logs" / "gate" / "machine.toml").status == 2


def test_the_image_installs_every_dependency_by_version_and_hash():
    text = (ROOT / "docker" / "requirements.txt").read_text(encoding="utf-8")
    pins = {
        canonicalize_name(name): version for name, version in re.findall(r"^([\w.-]+)==([\w.]+)", text, re.MULTILINE)
    }
    for required in map(Requirement, PROJECT["dependencies"]):
        assert pins[canonicalize_name(required.name)] in required.specifier, required
    assert text.count("--hash=sha256:") >= len(pins) and "://" not in text
    build = (ROOT / "docker" / "build.txt").read_text(encoding="utf-8")
    for required in map(Requirement, PYPROJECT["build-system"]["requires"]):
        (version,) = re.findall(rf"^{required.name}==([\w.]+)", build, re.MULTILINE)
        assert version in required.specifier
