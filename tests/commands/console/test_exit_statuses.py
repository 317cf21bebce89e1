"""Every command is tested for each of its exit statuses, from the list in the code."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from cdtool.base.exit_status import STATUSES_OF
from cdtool.results.evaluated import evaluate
from cdtool.results.files.results_file import to_json
from cdtool.results.limits import LimitRule
from cdtool.results.results import Results
from tests.command import Outcome, cdtool, keys
from tests.formats.mcap.small_files import small_file
from tests.results.judged_results import results as judged_results
from tests.synthetic.builds import MISSED, build_results
from tests.synthetic.force_rig import half_sine, write_protocol, write_rig

ROOT = Path(__file__).parents[3]
GATE = ROOT / "sample_logs" / "gate"
LATENCIES = [40.0 + 0.1 * i for i in range(30)]


class Folder:
    """Files that cause each status of a command."""

    def __init__(self, path: Path, gate: Path, signature: Path) -> None:
        self.path, self.gate, self.signature = path, gate, signature
        self.machine = gate / "machine.toml"
        self.log = gate / "stiff" / "01.csv"
        self.absent = path / "absent.csv"
        self.empty = path / "empty.csv"
        self.empty.touch()
        text = self.log.read_text(encoding="utf-8")
        self.cut = path / "cut.csv"
        self.cut.write_text(text[: text.rindex(",")], encoding="utf-8")
        self.mcap = path / "log.mcap"
        self.messages = small_file(self.mcap)
        whole = self.mcap.read_bytes()
        self.cut_mcap = path / "cut.mcap"
        self.cut_mcap.write_bytes(whole[: whole.index(self.messages[-1][2])])

    def results(self, made: Results, name: str = "results.json") -> Path:
        path = self.path / name
        path.write_text(to_json(made), encoding="utf-8")
        return path

    def free(self, count: int) -> list[Path]:
        return sorted((self.gate / "free").glob("*.csv"))[:count]

    def benchmark(self, more: str = "", detectors: str = "pi", stiff: str = "stiff/01.csv", learn: bool = True) -> Path:
        for name in ("stiff", "soft", "holdout", "free", "machine.toml"):
            if not (self.path / name).exists():
                (self.path / name).symlink_to(self.gate / name)
        head = 'machine = "machine.toml"\n' + (f'detectors = ["{detectors}"]\n' if learn else "")
        head += '[learn]\nlogs = ["free/*.csv"]\n' if learn else ""
        onset = "[onset]\nabove_n = 20.0\nback_to_n = 8.0\n"
        path = self.path / "benchmark.toml"
        path.write_text(f'{head}{onset}[impacts.stiff]\nlogs = ["{stiff}"]\n{more}', encoding="utf-8")
        return path

    def profiles(self, stiff_until_s: float) -> str:
        """A profile met by every contact; that of the group stiff ends at the given time."""
        step = '{{ from_s = {0}, at_most_n = 1e6, name = "{1}" }}'
        easy, late = step.format(0.0, "first"), step.format(stiff_until_s, "second")
        text = f'[easy]\ntitle = "t"\nsource = "s"\nsteps = [{easy}]\n'
        text += f'[late]\ntitle = "t"\nsource = "s"\nsteps = [{easy}, {late}]\n'
        (self.path / "limits_of_force.toml").write_text(text, encoding="utf-8")
        return (
            'force_profile = "late"\n[impacts.soft]\nlogs = ["soft/01.csv"]\nforce_profile = "easy"\n'
            '[force]\nlimits = "limits_of_force.toml"\n'
        )

    def injection(self, positions: str) -> Path:
        """A benchmark with a model of the gate and contacts at these positions."""
        model = "[model.drive]\nstiffness = 8e4\n[model.controller]\nperiod = 0.001\nspeed_gain = 4300\n"
        (self.path / "model.toml").write_text(self.machine.read_text(encoding="utf-8") + model, encoding="utf-8")
        obstacle = "[inject.obstacles.stiff]\nstiffness_n_per_mm = 500\n"
        log = (self.gate / "holdout" / "01.csv").as_posix()
        inject = f'[inject]\nlogs = ["{log}"]\npositions = {positions}\n{obstacle}'
        free = ", ".join(f'"{path.as_posix()}"' for path in self.free(3))
        path = self.path / "inject.toml"
        head = 'machine = "model.toml"\ndetectors = ["gm"]\n'
        path.write_text(f"{head}[signature]\nforce = true\n[learn]\nlogs = [{free}]\n{inject}", encoding="utf-8")
        return path

    @property
    def gate_protocol(self) -> Path:
        return GATE / "protocol.toml"

    def triggers(self, rows: str) -> Path:
        path = self.path / "triggers.csv"
        path.write_text(f"recording,time_s\n{rows}", encoding="utf-8")
        return path


@pytest.fixture
def files(tmp_path: Path, gate_folder: Path, feekf_signature: Path) -> Folder:
    return Folder(tmp_path, gate_folder, feekf_signature)


def _score(files: Folder, more: str = "", rows: str = "stiff/01.csv,6.3\n", *options: object) -> Outcome:
    return cdtool("score", files.triggers(rows), "--benchmark", files.benchmark(more, learn=False), *options)


def _compare(files: Folder, new: Sequence[float | str], *options: object, old: Sequence[float | str] = ()) -> Outcome:
    key = ("momentum", "stiff")
    paths = [
        files.results(build_results({key: list(items)}), f"{name}.json")
        for name, items in (("old", old or new), ("new", new))
    ]
    return cdtool("compare", *paths, *options)


def _report(files: Folder, made: Results, limits: Sequence[LimitRule] = ()) -> Outcome:
    return cdtool("report", files.results(evaluate(made, limits).results))


def _learn(files: Folder, *logs: Path) -> Outcome:
    return cdtool("learn-signature", *logs, "-m", files.machine, "-d", "pi", "-o", files.path / "s.json")


def _detect(files: Folder, *logs: Path) -> Outcome:
    return cdtool("detect", *logs, "-m", files.machine, "-d", "gm", "--set=threshold.limits=400")


def _tune(files: Folder, benchmark: Path) -> Outcome:
    options = ("--false-alarm-budget", "1/3op", "--set", "tune.thresholds=limit", "-o", files.path / "tuned")
    return cdtool("tune", benchmark, *options)


def _update(files: Folder, *logs: Path) -> Outcome:
    shutil.copy(files.signature, files.path / "u.json")
    return cdtool("signature", "update", files.path / "u.json", *logs, "-m", files.machine)


def _write_protocol(files: Folder, peaks: Sequence[float]) -> Outcome:
    write_rig(files.path, [half_sine(peak) for peak in peaks])
    return cdtool("protocol", "write", write_protocol(files.path), "-o", files.path / "p.html")


def _broken_plugin(files: Folder) -> Outcome:
    info = files.path / "odd-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: odd\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text("[cdtool.detectors]\nodd = no_such_module:Plugin\n", encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(files.path)
        return cdtool("list", "detectors")


ONE_RUN = keys(free=1, holdout=0, stiff=0, soft=0)
VIOLATED = '[limits]\n"*.*.missed" = { max = -1 }\n'

DRIVEN: dict[tuple[str, int], Callable[[Folder], Outcome]] = {
    ("info", 0): lambda f: cdtool("info", f.log),
    ("info", 2): lambda f: cdtool("info", f.absent),
    ("info", 3): lambda f: cdtool("info", f.log, f.absent),
    ("init", 0): lambda f: cdtool("init", f.log, "-o", f.path / "m.toml"),
    ("init", 2): lambda f: cdtool("init", f.absent, "-o", f.path / "m.toml"),
    ("init", 3): lambda f: cdtool("init", f.cut, "-o", f.path / "m.toml"),
    ("learn-signature", 0): lambda f: _learn(f, *f.free(11)),
    ("learn-signature", 2): lambda f: _learn(f, f.absent),
    ("learn-signature", 3): lambda f: _learn(f, *f.free(11), f.empty),
    ("detect", 0): lambda f: _detect(f, f.log),
    ("detect", 2): lambda f: _detect(f, f.absent),
    ("detect", 3): lambda f: _detect(f, f.log, f.empty),
    ("explain", 0): lambda f: cdtool("explain", f.log, "-m", f.machine, "-s", f.signature),
    ("explain", 2): lambda f: cdtool("explain", f.absent, "-m", f.machine, "-s", f.signature),
    ("explain", 3): lambda f: cdtool("explain", f.cut, "-m", f.machine, "-s", f.signature),
    ("benchmark", 0): lambda f: cdtool("benchmark", f.benchmark()),
    ("benchmark", 1): lambda f: cdtool("benchmark", f.benchmark(VIOLATED)),
    ("benchmark", 2): lambda f: cdtool("benchmark", f.absent),
    ("benchmark", 3): lambda f: cdtool("benchmark", f.benchmark('[holdout]\nlogs = ["holdout/*.csv", "empty.csv"]\n')),
    ("benchmark", 4): lambda f: cdtool("benchmark", f.benchmark(f.profiles(1000.0))),
    ("report", 0): lambda f: _report(f, judged_results(LATENCIES)),
    ("report", 1): lambda f: _report(f, judged_results([40.0], ["fail"])),
    ("report", 2): lambda f: cdtool("report", f.absent),
    ("report", 3): lambda f: _report(f, judged_results(["not_assessable"], ["pass"])),
    ("report", 4): lambda f: _report(f, judged_results([40.0, 41.0], ["pass", "not_assessable"])),
    ("score", 0): lambda f: _score(f),
    ("score", 1): lambda f: _score(f, VIOLATED),
    ("score", 2): lambda f: _score(f, rows="no/such.csv,x\n"),
    ("score", 3): lambda f: _score(f, rows="stiff/01.csv,6.3\nstiff/01.csv,99999.0\n"),
    ("score", 4): lambda f: _score(
        f, f.profiles(1000.0) + '[limits]\n"*.missed" = { max = 9 }\n', "stiff/01.csv,6.3\nsoft/01.csv,6.4\n"
    ),
    ("compare", 0): lambda f: _compare(f, LATENCIES),
    ("compare", 1): lambda f: _compare(f, [MISSED] * 4, old=LATENCIES[:4]),
    ("compare", 2): lambda f: cdtool("compare", f.absent, f.absent),
    ("compare", 4): lambda f: _compare(f, [160.0] * 4, "--require-power", old=LATENCIES[:4]),
    ("plan", 0): lambda _: cdtool("plan", "--missed-at-most", "5%"),
    ("plan", 2): lambda _: cdtool("plan", "--missed-at-most", "x"),
    ("tune", 0): lambda f: _tune(f, f.benchmark()),
    ("tune", 2): lambda f: _tune(f, f.absent),
    ("tune", 3): lambda f: _tune(f, f.benchmark('[impacts.soft]\nlogs = ["soft/01.csv", "empty.csv"]\n')),
    ("convert", 0): lambda f: cdtool("convert", f.log, f.path / "out.mcap"),
    ("convert", 2): lambda f: cdtool("convert", f.absent, f.path / "out.mcap"),
    ("convert", 3): lambda f: cdtool("convert", f.cut, f.path / "out.mcap"),
    ("identify", 0): lambda f: cdtool("identify", *f.free(3), "-m", f.machine),
    ("identify", 2): lambda f: cdtool("identify", f.absent, "-m", f.machine),
    ("identify", 3): lambda f: cdtool("identify", *f.free(3), f.empty, "-m", f.machine),
    ("inject", 0): lambda f: cdtool("inject", f.injection('["0.5m"]'), "-o", f.path / "injected"),
    ("inject", 2): lambda f: cdtool("inject", f.injection('["50m"]'), "-o", f.path / "injected"),
    ("inject", 3): lambda f: cdtool("inject", f.injection('["0.5m", "50m"]')),
    ("signature show", 0): lambda f: cdtool("signature", "show", f.signature),
    ("signature show", 2): lambda f: cdtool("signature", "show", f.absent),
    ("signature check", 0): lambda f: cdtool("signature", "check", f.signature, *f.free(11), "-m", f.machine),
    ("signature check", 2): lambda f: cdtool("signature", "check", f.signature, f.absent, "-m", f.machine),
    ("signature check", 3): lambda f: cdtool("signature", "check", f.signature, *f.free(11), f.empty, "-m", f.machine),
    ("signature update", 0): lambda f: _update(f, f.gate / "holdout" / "01.csv"),
    ("signature update", 2): lambda f: _update(f, f.absent),
    ("signature update", 3): lambda f: _update(f, f.gate / "holdout" / "01.csv", f.empty),
    ("protocol init", 0): lambda f: cdtool("protocol", "init", f.benchmark(), "-o", f.path / "protocol.toml"),
    ("protocol init", 2): lambda f: cdtool("protocol", "init", f.absent, "-o", f.path / "protocol.toml"),
    ("protocol write", 0): lambda f: _write_protocol(f, (300.0, 310.0, 320.0)),
    ("protocol write", 1): lambda f: cdtool("protocol", "write", f.gate_protocol, "-o", f.path / "p.html"),
    ("protocol write", 2): lambda f: cdtool("protocol", "write", f.absent, "-o", f.path / "p.html"),
    ("protocol write", 4): lambda f: _write_protocol(f, (300.0, 310.0)),
    ("protocol check", 0): lambda f: cdtool("protocol", "check", f.gate_protocol),
    ("protocol check", 2): lambda f: cdtool("protocol", "check", f.machine),
    ("protocol check", 4): lambda f: cdtool("protocol", "check", write_protocol(f.path, valid_until="2026-01-16")),
    ("simulate", 0): lambda f: cdtool("simulate", "gate", *ONE_RUN, "-o", f.path / "gate"),
    ("simulate", 2): lambda f: cdtool("simulate", "gate", "--set", "format=xyz", "-o", f.path / "gate"),
    ("study sensors", 0): lambda _: cdtool(
        "study", "sensors", "-m", GATE / "machine.toml", "--set", "impact.speed=0.2"
    ),
    ("study sensors", 2): lambda f: cdtool("study", "sensors", "-m", f.absent),
    ("list", 0): lambda _: cdtool("list", "machines"),
    ("list", 2): lambda _: cdtool("list", "nothing"),
    ("list", 3): _broken_plugin,
    ("schema", 0): lambda _: cdtool("schema", "machine"),
    ("schema", 2): lambda _: cdtool("schema", "machines"),
}


def test_every_status_of_every_command_is_tested_and_no_other():
    driven = {name: {status for command, status in DRIVEN if command == name} for name, _ in DRIVEN}
    assert driven == {name: set(map(int, of)) for name, of in STATUSES_OF.items()}


@pytest.mark.parametrize(("command", "status"), DRIVEN, ids=[f"{name}-{status}" for name, status in DRIVEN])
def test_a_command_exits_with_the_expected_status(command, status, files):
    done = DRIVEN[command, status](files)
    assert done.status == status, done.err
    assert "Traceback" not in done.err
    assert bool(done.err) or status in (0, 1, 4)


def test_a_wrong_limit_takes_priority_over_a_violation_and_that_over_a_loss(files):
    holdout = '[holdout]\nlogs = ["holdout/01.csv", "empty.csv"]\n'
    assert _score(files, holdout).status == 3
    assert _score(files, holdout + VIOLATED).status == 1
    assert _score(files, holdout + '[limits]\n"*.*.nothing" = { max = 1 }\n').status == 2
    lost = '[impacts.soft]\nlogs = ["soft/01.csv", "empty.csv"]\nforce_profile = "easy"\n'
    more = files.profiles(1000.0).replace('[impacts.soft]\nlogs = ["soft/01.csv"]\nforce_profile = "easy"\n', lost)
    more += '[limits]\n"*.missed" = { max = 9 }\n'
    done = _score(files, more, "stiff/01.csv,6.3\nsoft/01.csv,6.4\n")
    assert done.status == 3 and "force profile not assessable for 1 of 2 contacts" in done.out


def test_a_log_that_is_not_assessable_exits_with_3_and_the_reason(files):
    lines = files.log.read_text(encoding="utf-8").splitlines()
    place = lines[0].split(",").index("motor_torque") if "motor_torque" in lines[0] else 1
    rows = [line.split(",") for line in lines[1:]]
    for row in rows:
        row[place] = "nan"
    path = files.path / "no_torque.csv"
    path.write_text("\n".join([lines[0], *map(",".join, rows)]) + "\n", encoding="utf-8")
    for command in ("detect", "explain"):
        done = cdtool(command, path, "-m", files.machine, "-d", "gm", "--set=threshold.limits=400")
        assert done.status == 3, done.out
        assert f"not assessable: {path}: " in done.err and "100 %" in done.err
