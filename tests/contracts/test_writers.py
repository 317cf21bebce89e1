"""What holds for every registered report writer, those of installed plug-ins included."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import pytest

from cdtool.base.errors import UsageError
from cdtool.base.files.foreign import refuse_other_kind
from cdtool.commands.compare.comparison import compare
from cdtool.commands.protocol.assessment.assessment import assess_point, judge
from cdtool.commands.protocol.assessment.plan import MachineParticulars, MeasuringPoint, TestPlan
from cdtool.commands.protocol.assessment.protocol import FileDigest, Protocol
from cdtool.commands.protocol.document.document import protocol_document
from cdtool.report.outputs import check_outputs, write_outputs
from cdtool.report.writers import WRITERS, known_suffixes, writer_of
from cdtool.report.writers.base import Report, Subject
from tests.report.hostile import HOSTILE
from tests.report.html.html_case import case
from tests.synthetic.builds import build_results

NAMES = WRITERS.names(plugins=True)
SUFFIXES = [(name, suffix) for name in NAMES for suffix in WRITERS.load(name).suffixes]
SUBJECTS = get_args(Subject)


@pytest.fixture(scope="module", params=["plain names", "hostile names"])
def reports(request) -> dict[str, object]:
    """What the writers of each subject write."""
    added = "" if request.param == "plain names" else "".join(HOSTILE.values())
    evaluated, traces = case(lambda name: name + added)
    provenance = {"tool": "cdtool", **evaluated.results.provenance}
    del provenance["force_profiles"]  # a figure needs profiles with names
    benchmark = Report(replace(evaluated, results=replace(evaluated.results, provenance=provenance)), traces)
    builds = [build_results({("momentum", f"stiff{added}"): [40.0 + late] * 12}, window_s={}) for late in (0.0, 5.0)]
    return {
        "benchmark": benchmark,
        "comparison": compare(builds[0], builds[1]),
        "protocol": protocol_document(_protocol(added)),
    }


def _protocol(added: str) -> Protocol:
    """Return a protocol of a point that is not measured yet."""
    point = MeasuringPoint(name=f"edge{added}", repetitions=3)
    plan = TestPlan(machine=MachineParticulars(type=f"door{added}"), points=(point,))
    points = (assess_point(point, None, ()),)
    files = (FileDigest(f"protocol{added}.toml", "0" * 64, "protocol"),)
    return Protocol(plan, points, judge(plan, points, f"protocol{added}.toml"), files)


def _skip_without_library(name: str) -> None:
    if WRITERS.load(name).needs:
        pytest.importorskip(WRITERS.load(name).needs)


@pytest.mark.parametrize(("name", "suffix"), SUFFIXES)
def test_what_it_writes_is_known_as_its_own_and_the_same_report_gives_the_same_bytes(name, suffix, reports, tmp_path):
    subject = WRITERS.load(name).subject
    _skip_without_library(name)
    assert type(writer_of(tmp_path / f"report{suffix.upper()}", subject)) is WRITERS.load(name)
    contents = []
    for folder in ("a", "b", "a"):  # the third replaces the first
        target = tmp_path / folder / f"report{suffix}"
        target.parent.mkdir(exist_ok=True)
        assert write_outputs(reports[subject], [target], subject=subject) == [target]
        files = WRITERS.load(name)().files(target)
        assert set(files) == set(target.parent.iterdir())
        held = [file for path in files for file in (sorted(path.rglob("*")) if path.is_dir() else [path])]
        contents.append([(file.name, file.read_bytes()) for file in held if file.is_file()])
        for path in files:
            refuse_other_kind(path, WRITERS.load(name).kinds[path.suffix])
    assert all(content for _, content in contents[0]) and contents[0] == contents[1] == contents[2]


@pytest.mark.parametrize(("name", "suffix"), SUFFIXES)
def test_it_replaces_no_file_of_another_program_unasked(name, suffix, tmp_path):
    subject = WRITERS.load(name).subject
    _skip_without_library(name)
    for path in WRITERS.load(name)().files(tmp_path / f"report{suffix}"):
        path.write_bytes(b"written by hand")
        writes_folder = WRITERS.load(name).writes_folder
        with pytest.raises(UsageError, match=r"already exists and (contains no|is not a folder)"):
            check_outputs([tmp_path / f"report{suffix}"], force=writes_folder, subject=subject)
        if not writes_folder:
            check_outputs([tmp_path / f"report{suffix}"], force=True, subject=subject)
        path.unlink()


@pytest.mark.parametrize("name", NAMES)
def test_it_says_what_it_writes(name):
    writer = WRITERS.load(name)
    assert writer.__doc__ and (writer.suffixes or writer.in_folder)
    assert writer.subject in SUBJECTS and set(writer.suffixes) <= set(known_suffixes(writer.subject))


def test_a_folder_holds_what_every_writer_with_content_writes_there(reports, tmp_path):
    report = reports["benchmark"]
    write_outputs(report, [tmp_path / "all"])
    writers = [WRITERS.load(name)() for name in WRITERS.table]
    wanted = {writer.in_folder for writer in writers if writer.in_folder and writer.has_content(report)}
    names = {path.name for path in (tmp_path / "all").iterdir()}
    assert len(wanted) > 4 and wanted <= names
    write_outputs(report, [tmp_path / "all"])  # all of it is known as its own
    assert {path.name for path in (tmp_path / "all").iterdir()} == names


@pytest.mark.parametrize("subject", SUBJECTS)
def test_an_unknown_suffix_names_those_that_can_be_written(subject, tmp_path):
    with pytest.raises(UsageError) as refused:
        check_outputs([tmp_path / "report.xyz"], subject=subject)
    assert all(suffix in str(refused.value) for suffix in known_suffixes(subject))


def test_a_folder_is_only_written_for_a_benchmark(tmp_path):
    with pytest.raises(UsageError, match="--output is"):
        check_outputs([tmp_path / "folder"], subject="comparison")
