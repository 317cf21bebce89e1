"""The figures of a report folder: those with content, under safe names."""

from __future__ import annotations

from dataclasses import asdict, replace

import pytest

from cdtool.commands.scoring.force_rows import force_rows
from cdtool.report.plots.folder_figures import write_figures
from cdtool.report.writers.base import Report
from cdtool.results.evaluated import Evaluated, evaluate
from cdtool.results.results import RecordingResult, Results
from cdtool.results.traces.trace import Trace
from cdtool.truth.force.curve import force_time_curve
from cdtool.truth.force.limits import ForceProfile, ForceStep
from cdtool.truth.force.verdict import assess_force
from tests.report.bench import Bench, contact
from tests.report.hostile import HOSTILE
from tests.results.sweeps import swept

PROFILE = ForceProfile("gap", "A gap", "a standard", False, (ForceStep(0.0, 400.0, "dynamic"),))


@pytest.fixture
def hit(bench: Bench, simulated) -> Trace:
    return bench.trace(simulated("stiff", 1), "stiff", ("momentum", "pure_inertia"))


@pytest.fixture
def free(bench: Bench, simulated) -> Trace:
    return bench.trace(simulated("none", 77), "holdout", ("momentum", "pure_inertia"))


def with_forces(results: Results, bench: Bench, simulated, *names: str, profile: str = "gap") -> Results:
    """The same with the force rows of logs of those names, all made from the first stiff impact."""
    recording = simulated("stiff", 1)
    (hit,) = bench.trace(recording, "stiff", ("momentum",)).contacts
    curve = force_time_curve(recording, hit)
    verdict = assess_force(curve, replace(PROFILE, name=profile))
    rows = [
        row
        for name in names
        for row in force_rows(RecordingResult(name, "stiff", "", 1.0, 1, 1), {1: verdict}, {1: curve})
    ]
    late = [replace(contact("momentum", "stiff", 60.0, name=name), onset_s=hit.start) for name in names]
    profiles = {**results.provenance.get("force_profiles", {}), profile: asdict(replace(PROFILE, name=profile))}
    return replace(
        results,
        provenance={**results.provenance, "force_profiles": profiles},
        forces=(*results.forces, *rows),
        contacts=(*results.contacts, *late),
    )


def written(folder) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_all_figures_are_written_and_named_with_a_caption(results, bench, simulated, hit, free, tmp_path):
    rows = swept("momentum", "stiff", lambda m: 60.0 * m, lambda m: 3 if m < 1.0 else 0)
    full = replace(with_forces(results, bench, simulated, hit.recording), sweep=tuple(rows))
    images = write_figures(Report(evaluate(full), (hit, free)), tmp_path)
    names = ["latency.png", "survival.png", "amoc.png", "forces.png", "triggers_stiff.png", "triggers_holdout.png"]
    assert [image.name for image in images] == names
    assert written(tmp_path) == sorted(names)
    assert all(image.caption for image in images)
    assert [image.group for image in images] == [None, None, None, None, "stiff", "holdout"]
    assert f"{hit.recording}: all detectors" == images[4].caption


def test_groups_with_similar_names_or_a_path_get_safe_and_different_file_names(evaluated: Evaluated, hit, tmp_path):
    groups = ("a b", "A/B", "../../etc/passwd", *HOSTILE.values())
    results = replace(evaluated.results, groups=groups)
    traces = tuple(replace(hit, group=group) for group in groups)
    images = write_figures(Report(evaluate(results), traces), tmp_path)
    assert sorted(image.name for image in images) == written(tmp_path)
    triggers = [image for image in images if image.name.startswith("triggers_")]
    assert [image.group for image in triggers] == list(groups)
    assert len({image.name for image in triggers}) == len(groups)
    assert [image.name for image in triggers[:3]] == [
        "triggers_a-b.png",
        "triggers_a-b-2.png",
        "triggers_etc-passwd.png",
    ]
