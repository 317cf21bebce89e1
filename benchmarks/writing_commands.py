"""Every command that writes, for kills and failing calls: its arguments, and the previous files."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

Run = Callable[[Sequence[str]], None]


@dataclass(frozen=True)
class Case:
    """A command: `new` is what is run, `old` is run before to make what is there; {out} is the folder to write to.

    `same_bytes`: it writes the same bytes each time.
    """

    name: str
    new: tuple[str, ...]
    old: tuple[str, ...] = ()
    same_bytes: bool = True

    def arguments(self, out: Path, *, old: bool = False) -> list[str]:
        return [word.replace("{out}", str(out)) for word in (self.old if old else self.new)]


def prepare(folder: Path, run: Run) -> None:
    """Make the inputs: recordings, signatures, results, triggers; `run` runs a command."""
    gate = folder / "gate"
    run(
        [
            "simulate",
            "gate",
            "--set",
            "free=4",
            "--set",
            "holdout=1",
            "--set",
            "stiff=2",
            "--set",
            "soft=0",
            "-o",
            str(gate),
        ]
    )
    (folder / "benchmark.toml").write_text(
        'machine = "gate/machine.toml"\ndetectors = ["gm"]\n[signature]\nforce = true\n'
        '[learn]\nlogs = ["gate/free/*.csv"]\n[impacts.stiff]\nlogs = ["gate/stiff/*.csv"]\n',
        encoding="utf-8",
    )
    free = [str(gate / "free" / f"0{number}.csv") for number in (1, 2, 3)]
    machine, few = ("-m", str(gate / "machine.toml")), "--set=signature.force=true"
    for name, logs in (("a", free[:2]), ("b", free)):
        run(["learn-signature", *logs, *machine, "-d", "gm", few, "-o", str(folder / f"{name}.json")])
        detectors = {"a": "pt", "b": "gm"}[name]
        run(
            ["benchmark", str(folder / "benchmark.toml"), "--detectors", detectors, "-o", str(folder / f"r{name}.json")]
        )
        text = f"recording,time_s\ngate/stiff/01.csv,{2.0 if name == 'a' else 2.5}\n"
        (folder / f"t{name}.csv").write_text(text, encoding="utf-8")
    for name, language in (("a", "en"), ("b", "de")):
        (folder / f"protocol_{name}.toml").write_text(
            f'[protocol]\nbenchmark = "benchmark.toml"\nlanguage = "{language}"\n'
            '[[protocol.point]]\nname = "edge"\ngroup = "stiff"\nprofile = "en_12453_wide_gap"\n',
            encoding="utf-8",
        )
    model = (
        "[model.controller]\nspeed_gain = 4300\nintegral_gain = 8000\nperiod = 0.001\n[model.drive]\nstiffness = 8e4\n"
    )
    text = (gate / "machine.toml").read_text(encoding="utf-8") + model
    (gate / "model.toml").write_text(text, encoding="utf-8")
    for name, stiffness in (("a", 100), ("b", 500)):
        (folder / f"inject_{name}.toml").write_text(
            'machine = "gate/model.toml"\ndetectors = ["gm"]\n[learn]\nlogs = ["gate/free/0[123].csv"]\n'
            '[signature]\nforce = true\n[inject]\nlogs = ["gate/holdout/*.csv"]\n'
            f'positions = ["0.9m"]\nstiffnesses_n_per_mm = [{stiffness}]\n',
            encoding="utf-8",
        )
    for number in (1, 2):
        lines = (gate / "stiff" / f"0{number}.csv").read_text(encoding="utf-8").splitlines(keepends=True)
        (folder / f"{number}.csv").write_text("".join(lines[:800]), encoding="utf-8")
        run(["convert", str(folder / f"{number}.csv"), str(folder / f"{number}.mcap")])
        shutil.copy(folder / "rb.json", folder / f"same{number}.json")


def cases(inputs: Path) -> list[Case]:
    """All of them; `prepare` has made their inputs."""
    gate = inputs / "gate"
    machine = ("-m", f"{gate}/machine.toml")
    free = [f"{gate}/free/0{number}.csv" for number in (1, 2, 3, 4)]
    stiff = [f"{gate}/stiff/0{number}.csv" for number in (1, 2)]
    b = f"{inputs}/b.json"
    every = [
        word
        for suffix in ("json", "html", "md", "xml", "csv", "png", "svg", "pdf")
        for word in ("-o", "{out}/r." + suffix)
    ]
    learn = ("-d", "gm", "--set=signature.force=true", "-o", "{out}/s.json")
    benchmark = ("benchmark", f"{inputs}/benchmark.toml", "--detectors")
    score = ("score", "-b", f"{inputs}/benchmark.toml", "-o", "{out}/r.json", "-o", "{out}/r.html")
    compare = ("-o", "{out}/c.md", "-o", "{out}/c.json")
    return [
        Case(
            "learn-signature",
            ("learn-signature", *free, *machine, *learn),
            ("learn-signature", *free[:2], *machine, *learn),
        ),
        Case(
            "signature update",
            ("signature", "update", "{out}/s.json", free[3], *machine, "--reserve", "30"),
            ("learn-signature", *free[:3], *machine, *learn),
        ),
        Case("benchmark", (*benchmark, "gm", *every), (*benchmark, "pt", *every)),
        Case("benchmark, protocol", _protocol(inputs, "b"), _protocol(inputs, "a")),
        Case("protocol write", _written(inputs, "b"), _written(inputs, "a")),
        Case(
            "protocol init",
            ("protocol", "init", f"{inputs}/benchmark.toml", "-o", "{out}/p.toml", "--force"),
            ("protocol", "init", "-o", "{out}/p.toml", "--force"),
        ),
        Case("benchmark, folder", (*benchmark, "gm", "-o", "{out}/report"), (*benchmark, "pt", "-o", "{out}/report")),
        Case(
            "report, folder",
            ("report", f"{inputs}/rb.json", "-o", "{out}/report"),
            ("report", f"{inputs}/ra.json", "-o", "{out}/report"),
        ),
        Case("score", (*score, f"{inputs}/tb.csv"), (*score, f"{inputs}/ta.csv")),
        Case(
            "compare",
            ("compare", f"{inputs}/rb.json", f"{inputs}/same1.json", *compare),
            ("compare", f"{inputs}/ra.json", f"{inputs}/ra.json", *compare),
        ),
        Case(
            "detect",
            _plot("detect", stiff[1], *machine, "--signature", b),
            _plot("detect", stiff[0], *machine, "--signature", b),
        ),
        Case("detect, folder", ("detect", *stiff, *machine, "--signature", b, "--plot", "{out}/plots")),
        Case(
            "explain",
            _plot("explain", stiff[1], *machine, "--signature", b),
            _plot("explain", stiff[0], *machine, "--signature", b),
        ),
        Case(
            "convert, recover",
            ("convert", f"{inputs}/2.mcap", "{out}/r.mcap", "--recover", "verified", "--force"),
            ("convert", f"{inputs}/1.mcap", "{out}/r.mcap", "--recover", "verified", "--force"),
        ),
        Case(
            "init",
            ("init", f"{inputs}/2.csv", "-o", "{out}/m.toml", "--force"),
            ("init", f"{inputs}/1.csv", "-o", "{out}/m.toml", "--force"),
        ),
        Case("identify", _identify(free[:2], machine), _identify(free[1:3], machine)),
        Case(
            "inject",
            ("inject", f"{inputs}/inject_b.toml", "-o", "{out}/injected"),
            (
                "simulate",
                "gate",
                "--set",
                "free=1",
                "--set",
                "holdout=0",
                "--set",
                "stiff=0",
                "--set",
                "soft=0",
                "-o",
                "{out}/logs",
            ),
        ),
        Case("tune", _tune(f"{inputs}/benchmark.toml", "trend"), _tune(f"{inputs}/benchmark.toml", "limit")),
        Case("inject, map", _coverage(f"{inputs}/inject_b.toml"), _coverage(f"{inputs}/inject_a.toml")),
        *(
            Case(f"simulate {kind}", ("simulate", kind, *some, "-o", "{out}/logs"))
            for kind, some in (
                ("gate", ("--set", "free=1", "--set", "holdout=0", "--set", "stiff=1", "--set", "soft=0")),
                (
                    "arm",
                    (
                        "--set",
                        "free=1",
                        "--set",
                        "holdout=0",
                        "--set",
                        "stiff=1",
                        "--set",
                        "soft=0",
                        "--set",
                        "format=mixed",
                    ),
                ),
            )
        ),
        *(
            Case(
                f"convert {suffix}",
                _convert(f"{inputs}/2.csv", suffix, *machine),
                _convert(f"{inputs}/1.csv", suffix, *machine),
            )
            for suffix in ("csv", "mcap", "parquet")
        ),
        Case("study sensors", _sensors(machine, "0.3"), _sensors(machine, "0.2")),
    ]


def _protocol(inputs: Path, name: str) -> tuple[str, ...]:
    return (
        "benchmark",
        f"{inputs}/benchmark.toml",
        "-p",
        f"{inputs}/protocol_{name}.toml",
        "-o",
        "{out}/protocol.html",
    )


def _written(inputs: Path, name: str) -> tuple[str, ...]:
    return ("protocol", "write", f"{inputs}/protocol_{name}.toml", "-o", "{out}/protocol.html")


def _plot(*words: str) -> tuple[str, ...]:
    return (*words, "--plot", "{out}/p.png")


def _identify(logs: Sequence[str], machine: Sequence[str]) -> tuple[str, ...]:
    return ("identify", *logs, *machine, "-o", "{out}/m.toml", "--force")


def _tune(setup: str, threshold: str) -> tuple[str, ...]:
    options = ("--set", f"tune.thresholds={threshold}", "--false-alarm-budget", "1/op", "--force", "-o", "{out}/tuned")
    return ("tune", setup, "--detectors", "gm", *options)


def _coverage(setup: str) -> tuple[str, ...]:
    return ("inject", setup, "-o", "{out}/p.html", "--force")


def _convert(log: str, suffix: str, *machine: str) -> tuple[str, ...]:
    return ("convert", log, "{out}/x." + suffix, *machine, "--force")


def _sensors(machine: Sequence[str], speed: str) -> tuple[str, ...]:
    return ("study", "sensors", *machine, "--set", f"impact.speed={speed}", "-o", "{out}/p.svg")
