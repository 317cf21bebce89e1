"""Every command with hostile files and options: one line, a documented exit status, no traceback.

`Bench` is a folder with one small valid file of each kind; `attempts` draws commands with one file or option mutated.
"""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.command import Outcome, cdtool
from tests.fuzz.hostile_values import Mutations
from tests.synthetic.robots import JOINTS, six_joint_urdf

STATUSES = (0, 1, 2, 3, 4)
LONGEST_LINE = 300
_TRIGGERS = (
    "recording,time_s,detector,blind_until_s\nstiff/01.csv,6.1,plc,\nsoft/01.csv,,plc,\nstiff/02.csv,1.0,plc,2.0\n"
)
_EXPECTED = "date,temperature_c\n2025-10-01,7.5\n2025-10-02T12:00,8\n"
_LABELS = "recording,start_s,end_s,kind,uncertainty_s\nstiff/01.csv,6.0,6.5,hard,0.01\nstiff/02.csv,6.0,6.4,,\n"
_LIMITS = """[own]
title = "own"
source = "none"
checked = true
average_of = 2
steps = [{ from_s = 0.0, at_most_n = 400.0, name = "first" }, { from_s = 0.5, at_most_n = 150.0, name = "then" }]
"""
_ROBOT = """[machine]
type = "urdf_robot"
urdf = "six.urdf"
joints = [{joints}]
locked = {{ tool = 0.0 }}
drive_inertia = 0.3
[channels]
time = {{ column = "t", unit = "ms" }}
torque = {{ columns = ["i_motor", "i_motor", "i_motor", "i_motor", "i_motor"], unit = "SI" }}
"""
_MORE = """
[threshold]
name = "cusum"
drift = 0.5
[signature]
safety_factor = 4.0
force = true
[activation]
debounce = 5
rearm_s = 0.4
hysteresis = 0.1
latch = false
[force]
limits = "own.toml"
profile = "own"
mass_before_cell_kg = 1.0
[campaigns.a]
logs = ["stiff/01.csv"]
[points.p]
logs = ["stiff/02.csv"]
"""
_INJECT = """machine = "model.toml"
detectors = ["gm", "pt"]
[learn]
logs = ["free/*.csv"]
[signature]
force = true
[inject]
logs = ["holdout/*.csv"]
positions = ["0.9m", "0.5m"]
[inject.obstacles.hard]
stiffness_n_per_mm = 500
"""
_MODEL = """
[model.controller]
speed_gain = 4300
integral_gain = 8000
period = 0.001
[model.drive]
stiffness = 8e4
"""
_PLAN = """[protocol]
benchmark = "benchmark.toml"
language = "de"
[protocol.test]
date = 2026-03-31
temperature_c = 20.5
[[protocol.instrument]]
quantity = "force"
calibrated_on = 2026-01-15
calibration_valid_until = "2027-01-14"
range_n = 10000
sample_rate_hz = 200
[[protocol.point]]
name = "edge"
repetitions = 3
profile = "en_12453_wide_gap"
logs = ["stiff/*.csv"]
peak_pressures_n_per_cm2 = [12.5, 13]
[[protocol.exclusion]]
logs = ["stiff/02.csv"]
reason = "slipped"
"""
# A command line, the file to mutate, and numeric options to set; {} stands for the folder.
_COMMANDS: tuple[tuple[str, str], ...] = (
    ("info stiff/01.csv", "stiff/01.csv"),
    ("info stiff/01.csv -m machine.toml", "machine.toml"),
    ("info stiff/01.csv -m machine.toml", "stiff/01.csv"),
    ("info log.mcap", "log.mcap"),
    ("info log.mat", "log.mat"),
    ("info log.parquet", "log.parquet"),
    ("info stiff/01.csv -m robot.toml", "robot.toml"),
    ("info stiff/01.csv -m robot.toml", "six.urdf"),
    ("init stiff/01.csv -o out.toml --force", "stiff/01.csv"),
    ("inject inject.toml -o injected", "inject.toml"),
    ("inject inject.toml -o injected", "model.toml"),
    ("inject inject.toml -o injected", "holdout/01.csv"),
    ("benchmark inject.toml", "inject.toml"),
    ("coverage inject.toml", "model.toml"),
    ("identify free/01.csv free/02.csv -m machine.toml -o out.toml --force", "free/01.csv"),
    ("identify free/01.csv free/02.csv -m model.toml -o out.toml --force", "model.toml"),
    ("detect stiff/01.csv -m machine.toml -d gm --set threshold.limits=40", "machine.toml"),
    ("detect stiff/01.csv -m machine.toml -d feekf --set threshold.limits=40", "stiff/01.csv"),
    ("detect stiff/01.csv -m machine.toml -s gate.json", "gate.json"),
    ("detect stiff/01.csv -m machine.toml -s gate.json", "stiff/01.csv"),
    ("explain stiff/01.csv -m machine.toml -s gate.json", "gate.json"),
    ("explain stiff/01.csv -m machine.toml -s gate.json", "stiff/01.csv"),
    (
        "learn-signature free/01.csv free/02.csv free/03.csv -m machine.toml -d gm -o out.json",
        "free/01.csv",
    ),
    (
        "learn-signature free/01.csv free/02.csv free/03.csv -m machine.toml -d gm -o out.json",
        "machine.toml",
    ),
    ("benchmark benchmark.toml -o out.json", "benchmark.toml"),
    ("benchmark benchmark.toml -o out.json", "machine.toml"),
    ("benchmark full.toml -o out.json", "full.toml"),
    ("benchmark full.toml -o out.json", "own.toml"),
    ("benchmark labelled.toml -o out.json", "labels.csv"),
    ("protocol check plan.toml", "plan.toml"),
    ("protocol write plan.toml -o out.html", "plan.toml"),
    ("protocol write plan.toml -o out.html", "stiff/01.csv"),
    ("report results.json -o out.md -o out.xml -o out.csv", "results.json"),
    ("report results.json -o out.html", "results.json"),
    ("report results.json -o out.html", "results.traces.json.gz"),
    ("compare results.json other.json -o out.md", "other.json"),
    ("plan --difference-ms 5 --std-ms results.json --detectors gm,pt --group stiff", "results.json"),
    ("score triggers.csv -b benchmark.toml", "triggers.csv"),
    ("score triggers.csv -b labelled.toml", "labels.csv"),
    ("signature show gate.json", "gate.json"),
    ("signature check gate.json free/03.csv -m machine.toml", "gate.json"),
    ("signature update gate.json free/03.csv -m machine.toml", "gate.json"),
    ("study sensors -m machine.toml --study study.toml", "study.toml"),
    ("study sensors -m machine.toml --study study.toml", "machine.toml"),
    ("convert stiff/01.csv out.csv -m machine.toml --force", "machine.toml"),
    ("convert log.mcap out.mcap --recover all --force", "log.mcap"),
)
_NUMBERS = ("0", "-1", "1", "99999999999999999999", "-99999999999999999999", "nan", "inf", "-inf", "1e308", "1e-320")
_WORDS = ("", " ", "x", ",", "1,2,3", "9" * 5000, "\udcff\udcfe", "a\nb", "1e400", "0x10", "--", "\u202e", "/dev/zero")
_OPTIONS: tuple[tuple[str, tuple[str, ...]], ...] = (
    (
        "detect stiff/01.csv -m machine.toml -d gm --set threshold.limits=40",
        (
            *("--set=activation.debounce", "--set=activation.rearm_s", "--set=activation.hysteresis", "-d"),
            *("--set=onset.above_n", "--set=onset.back_to_n", "--set=threshold.limits", "--set=joints"),
            *("--set=operations", "--set=threshold", "--set=from"),
        ),
    ),
    (
        "detect stiff/01.csv -m machine.toml -s gate.json",
        ("--set=activation.debounce", "--set=activation.rearm_s", "--contact-at", "--plot", "-m"),
    ),
    (
        "learn-signature free/01.csv free/02.csv free/03.csv -m machine.toml -d gm -o out.json",
        (
            *("--set=signature.safety_factor", "--set=activation.debounce", "--set=activation.rearm_s", "--set"),
            *("--set=threshold.name", "--set=signature.rule", "--set=signature.alignment", "--set=joints", "-d"),
            "--false-alarm-budget",
        ),
    ),
    ("plan", ("--difference-ms", "--std-ms", "--power", "--missed-at-most", "--false-alarms-at-most", "--level")),
    ("plan --difference-ms 5 --std-ms 3", ("--power", "--level", "--group", "--std-ms")),
    ("plan --missed-at-most 5%", ("--level", "--power")),
    ("plan --false-alarms-at-most 1/1000op", ("--level", "--power")),
    ("compare results.json other.json", ("--level", "-o")),
    (
        "study sensors -m machine.toml",
        ("--set", "-o"),
    ),
    ("simulate gate --set free=1 --set holdout=0 --set stiff=0 --set soft=0 -o sim", ("--seed", "--set")),
    ("benchmark benchmark.toml -o out.json", ("--detectors", "--jobs")),
    ("score triggers.csv -b benchmark.toml", ("--set=triggers.clock", "--jobs")),
    ("info stiff/01.csv", ("-m",)),
    (
        "explain stiff/01.csv -m machine.toml -s gate.json",
        ("--set=activation.debounce", "--set=onset.above_n", "--plot", "--set=joints"),
    ),
)


@dataclass(frozen=True)
class Attempt:
    """A command line, and the file that was mutated for it with its content; no file where an option was."""

    arguments: tuple[str, ...]
    file: str = ""
    content: bytes = b""

    @property
    def shown(self) -> str:
        """The command line, on one line."""
        return f"cdtool {' '.join(map(repr, self.arguments))[:400]}" + (f"  # {self.file} mutated" if self.file else "")


def make_bench(folder: Path) -> None:
    """Write one small valid file of each kind."""
    done = cdtool(
        "simulate",
        "gate",
        *["--set", "free=5", "--set", "holdout=1", "--set", "stiff=2", "--set", "soft=1", "--seed", "5", "-o"],
        folder,
    )
    assert done.status == 0, done.err
    for log in folder.glob("*/*.csv"):  # a fifth of the samples is enough, and fast
        lines = log.read_text().splitlines()
        log.write_text("\n".join([lines[0], *lines[1::5]]) + "\n")
    benchmark = (folder / "benchmark.toml").read_text()
    lines = [line for line in benchmark.splitlines() if not line.startswith("detectors")]
    benchmark = "\n".join(['detectors = ["gm", "pt"]', *lines]) + "\n"
    assert "[signature]\nforce = true" in benchmark
    (folder / "benchmark.toml").write_text(benchmark)
    (folder / "full.toml").write_text(benchmark.partition("[signature]")[0] + _MORE)
    labelled = benchmark.replace("[onset]", '[onset]\nlabels = "labels.csv"')
    (folder / "labelled.toml").write_text(labelled)
    (folder / "labels.csv").write_text(_LABELS)
    (folder / "inject.toml").write_text(_INJECT)
    (folder / "plan.toml").write_text(_PLAN)
    (folder / "model.toml").write_text((folder / "machine.toml").read_text() + _MODEL)
    (folder / "triggers.csv").write_text(_TRIGGERS)
    (folder / "expected.csv").write_text(_EXPECTED)
    (folder / "own.toml").write_text(_LIMITS)
    (folder / "six.urdf").write_text(six_joint_urdf())
    (folder / "robot.toml").write_text(_ROBOT.format(joints=", ".join(f'"{name}"' for name in JOINTS[:5])))
    shutil.copy(Path(__file__).parents[2] / "docs" / "examples" / "gate_study.toml", folder / "study.toml")
    machine = ("-m", folder / "machine.toml", "--set=signature.force=true")
    signature = ("learn-signature", *sorted(folder.glob("free/*.csv")), *machine)
    for arguments in (
        (*signature, "-d", "gm", "-o", folder / "gate.json"),
        ("benchmark", folder / "benchmark.toml", "-o", folder / "results.json"),
        ("convert", folder / "stiff" / "01.csv", folder / "log.mcap", "-m", folder / "machine.toml"),
        ("convert", folder / "stiff" / "01.csv", folder / "log.parquet"),
    ):
        done = cdtool(*arguments)
        assert done.status in (0, 1), (arguments, done.err)
    from scipy.io import savemat

    time = np.arange(200.0)
    savemat(folder / "log.mat", {"t": time, "x": np.sin(time), "m": np.ones((200, 3))}, do_compression=True)
    shutil.copy(folder / "results.json", folder / "other.json")


def attempts(folder: Path, seed: int, count: int) -> Iterator[Attempt]:
    """So many commands, each with one file or one option mutated."""
    for number in range(count):
        random = np.random.default_rng([seed, number])
        mutations = Mutations(random)
        if random.random() < 0.3:
            command, options = mutations.pick(_OPTIONS)
            value = mutations.pick(_NUMBERS if random.random() < 0.6 else _WORDS)
            option = mutations.pick(options)
            given = (f"{option}={value}",) if option.startswith("--set=") else (option, value)
            yield Attempt((*_placed(command, folder), *given))
        else:
            command, file = mutations.pick(_COMMANDS)
            content = (folder / file).read_bytes()
            yield Attempt(_placed(command, folder), file, mutations.content(content, Path(file).suffix))


def run(attempt: Attempt, folder: Path) -> Outcome:
    """Run it in this process, and put the file back."""
    path = folder / attempt.file if attempt.file else None
    before = path.read_bytes() if path else b""
    signature = (folder / "gate.json").read_bytes()
    try:
        if path:
            path.write_bytes(attempt.content)
        with contextlib.chdir(folder):  # what a hostile name makes stays in it
            return cdtool(*attempt.arguments)
    finally:
        (folder / "gate.json").write_bytes(signature)
        shutil.rmtree(folder / "injected", ignore_errors=True)
        if path:
            path.write_bytes(before)


def complaint(outcome: Outcome) -> str:
    """What is wrong with how a command ended; nothing where all is as documented."""
    lines = outcome.err.splitlines()
    if "Traceback" in outcome.err:
        return "a traceback: " + " | ".join(lines[-1:])
    if outcome.status not in STATUSES:
        return f"exit status {outcome.status}"
    if any(len(line) > LONGEST_LINE for line in lines):
        return f"a line of {max(map(len, lines))} characters"
    if outcome.status == 2 and not any(line.startswith(("error: ", "left out: ")) for line in lines):
        return f"no error line: {outcome.err[:200]!r} {outcome.out[:200]!r}"
    if outcome.status == 2 and len(lines) > 1 and sum(line.startswith("error: ") for line in lines) > 3:
        return f"{len(lines)} lines"
    return ""


def _placed(command: str, folder: Path) -> Sequence[str]:
    """The words of a command line, files below the folder."""
    words = command.split()
    return tuple(str(folder / word) if _is_file(word) else word for word in words)


def _is_file(word: str) -> bool:
    return "." in word and not word.startswith("-") and word.rpartition(".")[2].isalpha()
