"""`-o` may replace a file of the kind that the command writes, recognised by content, and no other."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.command import FEW, cdtool

TEXT = "x"


@pytest.fixture
def folder(gate_folder: Path, tmp_path: Path) -> Path:
    """A separate folder: 3 logs to learn from, an impact, the machine file, a benchmark file."""
    for name in ("free/01.csv", "free/02.csv", "free/03.csv", "stiff/01.csv", "machine.toml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copyfile(gate_folder / name, tmp_path / name)
    (tmp_path / "benchmark.toml").write_text(
        'machine = "machine.toml"\ndetectors = ["gm"]\n[signature]\nforce = true\n[learn]\nlogs = ["free/*.csv"]\n'
        '[impacts.stiff]\nlogs = ["stiff/*.csv"]\n',
        encoding="utf-8",
    )
    return tmp_path


def learn(folder: Path, output: Path):
    logs = sorted((folder / "free").glob("*.csv"))
    return cdtool("learn-signature", *logs, "-m", folder / "machine.toml", "-d", "gm", FEW, "-o", output)


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.mark.parametrize("name", ["free/01.csv", "machine.toml", "benchmark.toml", "free/../machine.toml", "new.csv"])
def test_a_signature_is_written_only_to_a_json_name(folder, name):
    before = bytes_of(folder)
    done = learn(folder, folder / name)
    assert done.status == 2 and "must end in .json" in done.err
    assert bytes_of(folder) == before


@pytest.mark.parametrize("way", ["symlink_to", "hardlink_to"])
def test_a_json_link_to_a_recording_is_refused(folder, way):
    link = folder / "link.json"
    getattr(link, way)(folder / "free" / "01.csv")
    before = bytes_of(folder)
    done = learn(folder, link)
    assert done.status == 2 and "link.json: already exists and contains no signature" in done.err
    assert bytes_of(folder) == before


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("stiff/01.csv", "table of cdtool"),
        ("notes.csv", "table of cdtool"),
        ("settings.json", "results of cdtool benchmark"),
        ("README.md", "Markdown report"),
        ("page.html", "HTML report"),
        ("build.xml", "JUnit report"),
    ],
)
def test_a_report_never_replaces_another_file(folder, name, kind):
    path = folder / name
    if not path.exists():
        path.write_text(TEXT, encoding="utf-8")
    before = bytes_of(folder)
    done = cdtool("benchmark", folder / "benchmark.toml", "-o", folder / "fine.json", "-o", path)
    assert done.status == 2 and f"contains no {kind}" in done.err and done.err.count("\n") == 1
    assert bytes_of(folder) == before


def test_a_folder_with_a_recording_under_a_report_s_name_is_refused(folder):
    shutil.copyfile(folder / "free" / "01.csv", folder / "stiff" / "contacts.csv")
    before = bytes_of(folder)
    done = cdtool("benchmark", folder / "benchmark.toml", "-o", folder / "stiff")
    assert done.status == 2 and "contacts.csv: already exists" in done.err
    assert bytes_of(folder) == before


def test_reports_can_be_written_again_any_number_of_times(folder):
    targets = [
        word
        for name in ("r.json", "r.html", "r.md", "r.xml", "r.csv", "r.svg", "all")
        for word in ("-o", folder / name)
    ]
    (folder / "r.csv").touch()  # an empty file has no content to lose
    first = cdtool("benchmark", folder / "benchmark.toml", *targets)
    assert first.status == 0, first.err
    written = bytes_of(folder)
    again = cdtool("benchmark", folder / "benchmark.toml", *targets)
    assert again.status == 0, again.err
    assert bytes_of(folder) == written
    made_again = cdtool("report", folder / "all" / "results.json", "-o", folder / "all", "-o", folder / "r.json")
    assert made_again.status == 0, made_again.err


def test_a_comparison_never_replaces_the_results_that_it_compares(folder):
    for name in ("old.json", "new.json"):
        assert cdtool("benchmark", folder / "benchmark.toml", "-o", folder / name).status == 0
    (folder / "link.json").symlink_to(folder / "new.json")
    shutil.copyfile(folder / "new.json", folder / "third.json")
    before = bytes_of(folder)
    for name, why in (("old.json", "read by this"), ("link.json", "read by this"), ("third.json", "no comparison")):
        done = cdtool("compare", folder / "old.json", folder / "new.json", "-o", folder / name)
        assert done.status == 2 and why in done.err
    assert bytes_of(folder) == before
    for _ in range(2):
        done = cdtool(
            "compare", folder / "old.json", folder / "new.json", "-o", folder / "c.json", "-o", folder / "c.md"
        )
        assert done.status == 0, done.err


@pytest.mark.parametrize("name", ["r.png", "r.svg", "r.pdf", "r.traces.json.gz"])
def test_a_figure_or_traces_of_another_program_are_not_replaced_without_force(folder, name):
    (folder / name).write_text(TEXT, encoding="utf-8")
    target = folder / (name if "traces" not in name else "r.json")
    before = bytes_of(folder)
    done = cdtool("benchmark", folder / "benchmark.toml", "-o", target)
    assert done.status == 2 and f"{name}: already exists and contains no" in done.err and "--force" in done.err
    assert bytes_of(folder) == before
    done = cdtool("benchmark", folder / "benchmark.toml", "-o", target, "--force")
    assert done.status == 0, done.err
    assert (folder / name).read_bytes() != TEXT.encode()
    assert cdtool("benchmark", folder / "benchmark.toml", "-o", target).status == 0


def test_plots_are_drawn_again_over_figures_of_cdtool_only(folder):
    signature, plot = folder / "s.json", folder / "p.png"
    assert learn(folder, signature).status == 0
    log = (folder / "stiff" / "01.csv", "-m", folder / "machine.toml", "--signature", signature)
    commands = (
        ("detect", *log, "--plot", plot),
        ("explain", *log, "--plot", plot),
        ("study", "sensors", "-m", folder / "machine.toml", "--set", "impact.speed=0.2", "-o", plot),
    )
    for words in commands:
        plot.write_text(TEXT, encoding="utf-8")
        done = cdtool(*words)
        assert done.status == 2 and "p.png: already exists and contains no figure of cdtool" in done.err, words
        assert plot.read_text(encoding="utf-8") == TEXT
        assert [cdtool(*words, "--force").status, cdtool(*words).status] == [0, 0], words


def test_other_files_in_a_report_folder_stay(folder):
    report = folder / "report"
    report.mkdir()
    (report / "notes.txt").write_text(TEXT, encoding="utf-8")
    before = bytes_of(folder)
    done = cdtool("benchmark", folder / "benchmark.toml", "-o", report)
    assert done.status == 2 and "notes.txt: is not part of a cdtool report" in done.err and done.err.count("\n") == 1
    assert bytes_of(folder) == before
    assert cdtool("benchmark", folder / "benchmark.toml", "-o", report, "--force").status == 0
    assert (report / "notes.txt").read_text(encoding="utf-8") == TEXT and (report / "report.html").exists()


def test_a_report_folder_is_replaced_as_a_whole_without_outdated_figures(folder):
    report = folder / "report"
    assert cdtool("benchmark", folder / "benchmark.toml", "-o", report).status == 0
    shutil.copyfile(report / "latency.png", report / "triggers_of-last-year.png")
    assert cdtool("benchmark", folder / "benchmark.toml", "-o", report).status == 0
    assert not (report / "triggers_of-last-year.png").exists() and (report / "triggers_stiff.png").exists()
    assert not [name for name in bytes_of(folder) if ".cdtool-" in name]


def test_force_never_overwrites_an_input(folder):
    (folder / "stiff" / "01.csv").rename(folder / "stiff" / "contacts.csv")
    before = bytes_of(folder)
    for target in (folder / "stiff" / "contacts.csv", folder / "stiff"):
        done = cdtool("benchmark", folder / "benchmark.toml", "-o", target, "--force")
        assert done.status == 2 and "is read by this command" in done.err
    assert bytes_of(folder) == before


def test_dotfiles_are_never_logs(folder):
    for name in ("free/.04.csv", "free/.cdtool-0123456789abcdef-0123456789abcdef.tmp", "stiff/.hidden/02.csv"):
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copyfile(folder / "free" / "03.csv", folder / name)
    text = (folder / "benchmark.toml").read_text(encoding="utf-8").replace("stiff/*.csv", "stiff/**/*.csv")
    for pattern in ("free/*", "free/*.csv", "free/**/*"):
        (folder / "benchmark.toml").write_text(text.replace("free/*.csv", pattern), encoding="utf-8")
        done = cdtool("benchmark", folder / "benchmark.toml", "--json", "-o", folder / "r.csv")
        assert done.status == 0 and "stiff/01.csv" in done.out, done.err
        assert not [name for name in (".hidden", "/.04", ".cdtool-") if name in done.out + done.err]
