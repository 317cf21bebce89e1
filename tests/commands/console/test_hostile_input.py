"""Hostile input of every kind: one line, a documented exit status, no traceback, bounded memory."""

from __future__ import annotations

import gzip
import json
import os
import re
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from isal import isal_zlib

from cdtool.base.errors import RecordingError
from cdtool.results.traces.file import read_traces
from tests.command import cdtool
from tests.command_server import CommandServer, Ended, command_server
from tests.synthetic.robots import JOINTS, six_joint_urdf
from tests.time_bounds import bounded, check

ROOT = Path(__file__).parents[3]
GATE = ROOT / "sample_logs" / "gate"
MACHINE = (GATE / "machine.toml").read_text(encoding="utf-8")
SECONDS, MIB = 5.0, 300
LONGEST_LINE = 300
# What every command imports: not part of its memory.
IMPORTS = (
    "cdtool.commands.app",
    "cdtool.commands.console.console",
    "cdtool.formats.channels.reading",
    "cdtool.base.settings",
    "cdtool.base.kernels",
)


@pytest.fixture(scope="module")
def commands() -> Iterator[CommandServer]:
    """Run commands as in separate processes, which have done their imports."""
    nothing = GATE / "none.toml"
    with command_server(*IMPORTS) as server:
        for arguments in (("info", LOG, "-m", nothing), ("report", nothing), ("signature", "show", nothing)):
            server.warm_up(*arguments, status=2)
        yield server


@pytest.fixture(scope="module")
def refused(commands: CommandServer) -> Callable[..., Ended]:
    return partial(check_refused, commands)


def check_refused(commands: CommandServer, *arguments: object, words: Sequence[str] = ()) -> Ended:
    """Run the command, which must exit with one error line, with status 2, and within the memory limit."""
    done = commands.run(*arguments)
    assert "Traceback" not in done.err, done.err
    assert done.status == 2, done
    lines = done.err.splitlines()
    assert len(lines) == 1 and lines[0].startswith("error: "), done.err
    assert len(lines[0]) <= LONGEST_LINE, len(lines[0])
    assert all(word in done.err for word in words), done.err
    check(done.seconds, SECONDS)
    assert done.more_mib < MIB, done
    return done


def written(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
    return path


LOG = GATE / "stiff" / "03.csv"


def benchmark_text() -> str:
    """The sample benchmark file with absolute paths."""
    text = (GATE / "benchmark.toml").read_text(encoding="utf-8").replace("machine.toml", str(GATE / "machine.toml"))
    return re.sub(r'"([a-z]+/\*)', rf'"{GATE}/\1', text)


# --- TOML: a machine file, a benchmark file, force limits, a study

TOML_BOMBS = {
    "an integer of 5000 digits": ("load_mass = " + "7" * 5000, ("machine.toml", "more than 4300 digits")),
    "an integer of 400 digits": ("[channels]\nscale = " + "7" * 400, ("channels.scale", "400 digits", "64 bits")),
    "100000 brackets": ("a = " + "[" * 100_000, ("machine.toml", "nested too deeply")),
    "100000 braces": ("a = " + "{ b = " * 100_000, ("nested too deeply",)),
    "a key of 20000 parts": ("\n" + ".".join("a" * 20_000) + " = 1", ("a key of more than 16 parts at line 2",)),
    "a table of 20000 quoted parts": ("[" + " . ".join(["'a'"] * 20_000) + "]", ("a key of more than 16 parts",)),
    "a word of a million letters": ("a" * 1_000_000, ("not valid TOML",)),
    "a text that does not end": ('a = """' + '\\"""' * 200_000, ("not valid TOML",)),
    "3 MiB": ("#" * 3 * 2**20, ("has 3 MiB; at most 1 are read",)),
    "no UTF-8": (b"\xff\xfe\x00", ("not UTF-8 text",)),
}


@pytest.mark.parametrize("name", TOML_BOMBS)
def test_a_toml_bomb_is_refused_in_one_line(refused, tmp_path, name):
    content, words = TOML_BOMBS[name]
    refused("info", LOG, "-m", written(tmp_path / "machine.toml", content), words=words)


@pytest.mark.parametrize("key", ["machine", "logs", "limits", "labels"])
def test_a_nul_in_a_path_is_one_line(refused, tmp_path, key):
    text = benchmark_text()
    if key == "machine":
        text = text.replace("machine.toml", "ma\\u0000chine.toml")
    elif key == "logs":
        text = text.replace("free/*.csv", "fr\\u0000ee/*.csv")
    elif key == "labels":
        text = text.replace("[onset]", '[onset]\nlabels = "la\\u0000bels.csv"')
    else:
        text += '\n[force]\nlimits = "li\\u0000mits.toml"\nprofile = "x"\n'
    refused("benchmark", written(tmp_path / "benchmark.toml", text))


# --- JSON: signatures, results, traces


def json_bombs() -> dict[str, tuple[bytes, tuple[str, ...]]]:
    return {
        "100000 brackets": (b"[" * 100_000, ("nested more than 64 deep",)),
        "100000 objects": (b'{"a":' * 100_000, ("nested more than 64 deep",)),
        "an integer of 5000 digits": (b'{"schema_version": ' + b"7" * 5000 + b"}", ("5000 digits",)),
        "a number beyond the largest": (b'{"schema_version": 1e999}', ("1e999",)),
        "NaN": (b'{"schema_version": NaN}', ("NaN is not a JSON number",)),
        "no UTF-8": (b'{"a": "\xff"}', ("not UTF-8 text",)),
        "a text of a million quotes": (b'"' + b'\\"' * 1_000_000, ("damaged at line 1",)),
        "15 million lists": (b"[" + b"[]," * 15_000_000 + b"[]]", ("MiB of memory", "refused")),
        "no object": (b"[]", ()),
        "nothing": (b"", ()),
    }


@pytest.mark.parametrize("name", json_bombs())
def test_a_json_bomb_is_refused_in_one_line(refused, tmp_path, name):
    content, words = json_bombs()[name]
    path = written(tmp_path / "given.json", content)
    refused("report", path, "-o", tmp_path / "out.md", words=("given.json", *words))
    if len(content) < 2**20:
        refused("signature", "show", path, words=("given.json", *words))


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> Path:
    """The folder of a benchmark's results with their traces."""
    folder = tmp_path_factory.mktemp("bench")
    done = cdtool("benchmark", GATE / "benchmark.toml", "--detectors", "gm", "-o", folder / "results.json")
    assert done.status in (0, 1), done.err
    assert (folder / "results.traces.json.gz").exists()
    return folder


def with_traces(bench: Path, folder: Path, traces: bytes) -> Path:
    written(folder / "results.json", (bench / "results.json").read_bytes())
    written(folder / "results.traces.json.gz", traces)
    return folder / "results.json"


def packed_repeatedly(begin: bytes, repeated: bytes, times: int) -> bytes:
    """Return a gzip file of a text and many copies of another one, which is compressed once: its block is repeated."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    first, block = (packer.compress(text) + packer.flush(zlib.Z_FULL_FLUSH) for text in (begin, repeated))
    checksum = zlib.crc32(begin)
    for _ in range(times):
        checksum = zlib.crc32(repeated, checksum)
    size = len(begin) + times * len(repeated)
    head = b"\x1f\x8b\x08\0\0\0\0\0\0\xff"
    return head + first + times * block + packer.flush() + struct.pack("<II", checksum, size % 2**32)


def test_a_repeatedly_packed_text_is_a_valid_file():
    assert gzip.decompress(packed_repeatedly(b"begin,", b"0,1,", 3)) == b"begin,0,1,0,1,0,1,"


@pytest.mark.parametrize("unit", [b"0,", b"[],", b"999,", b" "], ids=["zeros", "lists", "numbers", "blanks"])
def test_traces_that_unpack_to_gigabytes_are_refused(refused, bench, tmp_path, unit):
    begin = b'{"schema_version": 4, "traces": ['
    content = packed_repeatedly(begin, unit * (2**20 // len(unit)), 600)  # 0.6 GB of text, of 0.6 MB
    assert len(content) < 3 * 2**20
    results = with_traces(bench, tmp_path, content)
    refused(
        "report", results, "-o", tmp_path / "out.html", words=("results.traces.json.gz", "MiB of memory", "refused")
    )


def test_damaged_traces_are_one_line_wherever_they_are_damaged(bench, tmp_path):
    """Replace each value of the file by one of a wrong type, and truncate and change the packed bytes."""
    good = json.loads(gzip.decompress((bench / "results.traces.json.gz").read_bytes()))
    random = np.random.default_rng(4)
    trace = good["traces"][0]
    parts = ("panels", "force", "contacts", "view", "start", "joints", "contact", "recording")
    of_a_panel = ("course", "seen", "alarms", "why")
    of_a_course = ("time", "value", "status")
    for wrong in (None, "x", -1, [], {}, [[]], 1e300, 2**62):
        holders = ((trace, parts), (trace["panels"][0], of_a_panel), (trace["panels"][0]["course"], of_a_course))
        for holder, key in ((holder, key) for holder, keys in holders for key in keys):
            kept = dict(holder)
            holder[key] = wrong
            check_damaged(bench, tmp_path, gzip.compress(json.dumps(good).encode(), 1))
            holder.clear()
            holder.update(kept)
    packed = (bench / "results.traces.json.gz").read_bytes()
    for at in random.integers(len(packed), size=12):
        check_damaged(bench, tmp_path, packed[:at])
        check_damaged(bench, tmp_path, packed[:at] + bytes([packed[at] ^ 0x55]) + packed[at + 1 :])
    check_damaged(bench, tmp_path, packed + b"more")


def check_damaged(bench: Path, folder: Path, traces: bytes) -> None:
    results = with_traces(bench, folder, traces)
    try:
        read_traces(folder / "results.traces.json.gz", results.read_text(encoding="utf-8"))
    except RecordingError as fault:
        assert str(fault).startswith(str(folder / "results.traces.json.gz")) and "\n" not in str(fault)
        return
    done = cdtool("report", results, "-o", folder / "out.svg")
    assert "Traceback" not in done.err, done.err
    assert done.status in (0, 1, 2)
    if done.status == 2:
        assert done.err.startswith("error: ") and done.err.count("\n") == 1, done.err
        assert "results.traces.json.gz" in done.err


# --- URDF


def robot(folder: Path, urdf: str) -> Path:
    written(folder / "six.urdf", urdf)
    joints = ", ".join(f'"{name}"' for name in JOINTS)
    channel = (
        'time = { column = "t", unit = "s" }\ntorque = { columns = ["f0", "f1", "f2", "f3", "f4", "f5"], unit = "SI" }'
    )
    text = f'[machine]\ntype = "urdf_robot"\nurdf = "six.urdf"\njoints = [{joints}]\n[channels]\n{channel}\n'
    return written(folder / "machine.toml", text)


URDFS = {
    "two masses": (six_joint_urdf().replace('mass value="4.0"', 'mass value="1 2"'), ("link3", "mass", "'1 2'")),
    "no mass": (six_joint_urdf().replace('mass value="4.0"', 'mass value=""'), ("link3", "mass")),
    "four coordinates": (six_joint_urdf().replace('axis xyz="0 1 0"', 'axis xyz="0 1 0 0"'), ("lift", "xyz")),
    "two coordinates": (six_joint_urdf().replace('axis xyz="0 1 0"', 'axis xyz="0 1"'), ("lift", "xyz")),
    "a long word": (six_joint_urdf().replace('mass value="4.0"', f'mass value="{"9" * 9000}x"'), ("link3", "mass")),
    "a million tags": ("<robot>" + "<a/>" * 1_000_000 + "</robot>", ("six.urdf", "refused")),
    "deep tags": ("<robot>" + "<a>" * 99_000, ("six.urdf",)),
    "a laugh": ('<!DOCTYPE robot [<!ENTITY a "aaaa">]><robot>&a;</robot>', ("six.urdf", "DOCTYPE")),
    "20 MiB": ("<robot>" + " " * (20 * 2**20), ("six.urdf", "20 MiB")),
}


@pytest.mark.parametrize("name", URDFS)
def test_a_hostile_urdf_is_refused_in_one_line(refused, tmp_path, name):
    pytest.importorskip("pinocchio")
    urdf, words = URDFS[name]
    refused("info", LOG, "-m", robot(tmp_path, urdf), words=words)


# --- Not regular files: devices, FIFOs, folders


@pytest.mark.parametrize("kind", ["device", "FIFO", "folder"])
@pytest.mark.parametrize(
    "arguments",
    [
        ("info", "{}"),
        ("info", LOG, "-m", "{}"),
        ("benchmark", "{}"),
        ("detect", LOG, "-m", GATE / "machine.toml", "-s", "{}"),
        ("report", "{}"),
        ("compare", "{}", "{}"),
        ("score", "{}", "-b", GATE / "benchmark.toml"),
        ("signature", "show", "{}"),
        ("study", "sensors", "-m", GATE / "machine.toml", "--study", "{}"),
    ],
    ids=["log", "machine", "benchmark", "signature", "results", "builds", "triggers", "show", "study"],
)
def test_devices_and_pipes_are_refused_before_reading(tmp_path, kind, arguments):
    path = {"device": Path("/dev/zero"), "FIFO": tmp_path / "fifo", "folder": tmp_path / "folder"}[kind]
    if kind == "FIFO":
        os.mkfifo(path)
    if kind == "folder":
        path.mkdir()
    with bounded(SECONDS):
        done = cdtool(*(path if item == "{}" else item for item in arguments))
    assert done.status == 2 and done.err.startswith("error: ") and done.err.count("\n") == 1, done.err
    assert str(path) in done.err


def test_devices_named_in_a_benchmark_file_are_refused(refused, tmp_path):
    text = benchmark_text()
    with_labels = text.replace("[onset]", '[onset]\nlabels = "/dev/zero"')
    refused("benchmark", written(tmp_path / "a.toml", with_labels), words=("/dev/zero", "is not a regular file"))
    with_limits = text + '\n[force]\nlimits = "/dev/zero"\nprofile = "x"\n'
    refused("benchmark", written(tmp_path / "b.toml", with_limits), words=("/dev/zero", "is not a regular file"))


# --- MATLAB


def mat_bomb(path: Path, elements: int, numbers: int, kind: str) -> Path:
    """A file of compressed arrays of zeros, as MATLAB writes them."""
    size = {"double": 8, "int8": 1}[kind]
    storage, array_class = {"double": (9, 6), "int8": (1, 8)}[kind]
    content = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    for i in range(elements):
        body = np.array([6, 8, array_class, 0, 5, 8, numbers, 1], "<u4").tobytes()
        body += np.array([1, 1], "<u4").tobytes() + bytes([97 + i]).ljust(8, b"\0")
        body += np.array([storage, numbers * size], "<u4").tobytes()
        length = len(body) + numbers * size
        packer = isal_zlib.compressobj(level=3)  # as small as zlib's, and in a tenth of the time
        packed = packer.compress(np.array([14, length], "<u4").tobytes() + body)
        for _ in range(numbers * size // 2**20):
            packed += packer.compress(bytes(2**20))
        packed += packer.compress(bytes(numbers * size % 2**20)) + packer.flush()
        content += np.array([15, len(packed)], "<u4").tobytes() + packed
    return written(path, content)


@pytest.mark.parametrize(
    ("elements", "numbers", "kind"),
    [(1, 60 * 2**20, "double"), (3, 16 * 2**20, "double"), (1, 300 * 2**20, "int8")],
    ids=["one array", "three arrays", "small integers"],
)
def test_a_mat_file_that_unpacks_to_gigabytes_is_refused(refused, tmp_path, elements, numbers, kind):
    path = mat_bomb(tmp_path / "a.mat", elements, numbers, kind)
    assert path.stat().st_size < 2 * 2**20
    refused("info", path, words=("a.mat", "unpacks to", "refused"))


def test_a_mat_file_of_zeros_of_a_logs_size_is_read(tmp_path):
    done = cdtool("info", mat_bomb(tmp_path / "a.mat", 2, 100_000, "double"))
    assert done.status == 0 and "100000" in done.out, done


# --- Options and arguments

NUMBERS = ("99999999999999999999", "-99999999999999999999", "0", "-1", "nan", "1e400", "x", "9" * 5000)


@pytest.mark.parametrize("value", NUMBERS, ids=lambda value: value[:24])
def test_a_debounce_with_many_digits_is_one_line(value):
    keys = ("--set=threshold.limits=40", f"--set=activation.debounce={value}")
    done = cdtool("detect", LOG, "-m", GATE / "machine.toml", "-d", "gm", *keys)
    assert done.status == 2 and done.err.startswith("error: ") and done.err.count("\n") == 1, done.err
    assert "debounce" in done.err and len(done.err) <= LONGEST_LINE + 1 and "Traceback" not in done.err


def test_names_that_are_no_utf_8_are_shown_and_refused_in_one_line(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", "from cdtool.commands.app import main; main()", "info", b"/tmp/\xff\xfe\x1b[2J.csv"],
        capture_output=True,
        cwd=ROOT,
        check=False,
    )
    assert done.returncode == 2 and done.stderr.count(b"\n") == 1, done.stderr
    assert done.stderr.startswith(b"error: /tmp/") and b"\x1b" not in done.stderr


def test_an_error_line_is_cut_at_300_characters_and_the_cut_is_marked(tmp_path):
    word = "\x1b[31m" + "long" * 500
    text = MACHINE.replace('column = "t"', f"column = {json.dumps(word)}")
    done = cdtool("info", LOG, "-m", written(tmp_path / "machine.toml", text))
    assert done.status == 2 and done.err.count("\n") == 1
    assert len(done.err) == LONGEST_LINE + 1 and "…" in done.err and "\x1b" not in done.err
    assert "no column" in done.err and "known: " in done.err  # names the problem and the next step


# --- Standard output


def shell(command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a pipeline in bash in which `cdtool` is the command; the status is that of cdtool."""
    program = f"{sys.executable} -c 'from cdtool.commands.app import main; main()'"
    return subprocess.run(
        ["bash", "-c", f'cdtool() {{ {program} "$@"; }}; {command}'],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, **environment},
        check=False,
        errors="replace",
    )


@pytest.mark.parametrize(
    "arguments",
    [
        "list detectors",
        "detect --help",
        f"detect {LOG} -m {GATE}/machine.toml -d gm --set threshold.limits=1000",
        f"detect {LOG} -m {GATE}/machine.toml -d gm --set threshold.limits=1000 --json",
    ],
)
def test_a_closed_pipe_causes_no_traceback_and_keeps_the_status(arguments):
    for command, shown in ((f"cdtool {arguments} | head -1", True), (f"cdtool {arguments} | true", False)):
        done = shell(f"{command}; echo ${{PIPESTATUS[0]}}")
        assert done.stderr == "", done.stderr
        assert done.stdout.splitlines()[-1] == "0"
        assert shown == (len(done.stdout.splitlines()) > 1) or arguments.endswith("--help")


def test_a_closed_pipe_does_not_hide_a_violated_limit(tmp_path):
    text = benchmark_text().replace("{ max = 40 }", "{ max = 1 }")
    benchmark = written(tmp_path / "benchmark.toml", text)
    done = shell(f"cdtool benchmark {benchmark} --detectors pi -o {tmp_path}/r.json | head -1; echo ${{PIPESTATUS[0]}}")
    assert done.stdout.splitlines()[-1] == "1", done
    assert "Traceback" not in done.stderr and "ignored" not in done.stderr


@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&-"])
def test_closed_streams_do_not_change_what_a_command_does(tmp_path, closed):
    done = shell(f"cdtool info {LOG} {closed}; echo $?")
    assert done.stdout.splitlines()[-1] == "0" and "Traceback" not in done.stderr, done
    done = shell(f"cdtool convert {LOG} {tmp_path}/out.csv {closed}; echo $?")
    assert done.stdout.splitlines()[-1] == "0"
    lines = (tmp_path / "out.csv").read_text().splitlines()  # no printed line is in the file
    assert all(line.startswith("# ") or re.fullmatch(r"[\w.,+\-]+", line) for line in lines)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_standard_output_is_one_line_and_status_2():
    done = shell(f"cdtool info {LOG} > /dev/full; echo $?")
    assert done.stdout == "2\n"
    assert done.stderr.startswith("error: standard output: No space left") and done.stderr.count("\n") == 1


@pytest.mark.parametrize("encoding", ["cp1252", "ascii", "latin-1", "utf-8:strict"])
def test_characters_that_the_terminal_does_not_have_are_replaced(tmp_path, encoding):
    log = written(tmp_path / "Ω ☃ é.csv", LOG.read_bytes())
    detect = ("detect", log, "-m", GATE / "machine.toml", "-d", "gm", "--set=threshold.limits=1000")
    with command_server(*IMPORTS, environment={"PYTHONIOENCODING": encoding}) as server:
        server.warm_up(*detect)
        for arguments in (("info", log), ("--help",), ("list", "detectors"), detect):
            done = server.run(*arguments)
            assert done.err == "", done.err
            assert done.status == 0 and done.out
            if encoding == "ascii":
                assert done.out.isascii()
        done = server.run("info", tmp_path / "☃.csv")
    assert (done.status, done.out) == (2, "") and done.err.startswith("error: ") and done.err.count("\n") == 1


def test_json_on_a_terminal_without_its_characters_is_the_same_json(tmp_path):
    log = written(tmp_path / "Ω ☃ é.csv", LOG.read_bytes())
    plain, narrow = (
        shell(f"cdtool info '{log}' --json", PYTHONIOENCODING=encoding).stdout for encoding in ("utf-8", "ascii")
    )
    assert narrow.isascii() and json.loads(narrow) == json.loads(plain) and "☃" in plain
