"""Peak memory of commands on a long MCAP log that is mostly images: do 2 GB of an hour at 1 kHz pass through 1 GB?

Writes logs of an hour and of ten minutes of a gate at 1 kHz, filled up by the images of a camera, without and with
compression, into a temporary folder (5 GB), and runs each command on them in a process of its own. Peaks are read from
/proc: of the whole process, of its own (anonymous) memory, and of file pages, which are libraries mostly and can be
dropped when memory is short. Linux only.

python benchmarks/memory.py [GB of the hour]
"""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, sleep

import numpy as np
from mcap.writer import CompressionType, Writer
from timing import main, table

import cdtool
from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.machine_file import read_machine_file
from cdtool.formats.messages.schemas import DEFINITIONS
from cdtool.recordings.recording import Recording

GIGABYTES = 2.0
HOUR_S, SHORT_S = 3600.0, 600.0
DETECT_AT_MOST_MB, GROWTH_AT_MOST_MB = 1000, 50
GATE = Path(__file__).parents[1] / "sample_logs" / "gate"
DETECTORS = ("gm", "feekf")
_COMMAND = "import sys; sys.argv[0] = 'cdtool'; from cdtool.commands.app import main; main()"
_EVERY_S = 0.005
_FIGURES = ("VmHWM", "RssAnon", "RssFile")

START_NS, STEP_NS, SECOND_NS = 1_700_000_000 * 10**9, 10**6, 10**9
IMAGE_EVERY = 100  # samples
JOINT, CAMERA = "/joint_states", "/camera"
# Topic -> message type, and the channels that its numbers are, in the order of the message.
TOPICS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    JOINT: ("sensor_msgs/msg/JointState", ("position", "speed", "torque")),
    "/accelerometer": ("std_msgs/msg/Float64", ("acceleration",)),
    "/load_cell": ("std_msgs/msg/Float64", ("force",)),
}
MACHINE_CHANNELS = """
[channels.mcap]
torque = { topic = "/joint_states", field = "effort[0]" }
speed = { topic = "/joint_states", field = "velocity[0]" }
position = { topic = "/joint_states", field = "position[0]" }
acceleration = { topic = "/accelerometer", field = "data" }
force = { topic = "/load_cell", field = "data" }
"""
_IMAGE = """std_msgs/Header header
string format
uint8[] data
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


@dataclass(frozen=True)
class Peak:
    """Peak memory [MB] of a process: total, its own, of files; and its run time [s]."""

    whole: float
    own: float
    files: float
    seconds: float


def measure() -> bool:
    if not Path("/proc/self/status").exists():
        sys.exit("error: peaks are read from /proc, which this system does not have")
    size = 1e9 * (float(sys.argv[1]) if len(sys.argv) > 1 else GIGABYTES)
    held = True
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepared = _prepare(folder)
        for compression in ("none", "zstd"):
            logs = {"1 h": folder / "hour.mcap", "10 min": folder / "short.mcap"}
            for log, seconds in zip(logs.values(), (HOUR_S, SHORT_S), strict=True):
                write_log(log, prepared, seconds, compression, size * seconds / HOUR_S)
            print(f"\ncompression {compression}: {logs['1 h'].stat().st_size / 1e9:.2f} GB of 1 h", flush=True)
            held &= _measured(folder, logs)
    return held


def _prepare(folder: Path) -> Recording:
    """The machine file of the long logs, signatures for it, and the run that the logs repeat."""
    known = read_machine_file(GATE / "machine.toml")
    text = (GATE / "machine.toml").read_text(encoding="utf-8")
    (folder / "machine.toml").write_text(text.partition("[channels]")[0] + MACHINE_CHANNELS, encoding="utf-8")
    free = sorted(map(str, (GATE / "free").iterdir()))
    for detector in DETECTORS:
        learn = ["learn-signature", *free, "--machine", str(GATE / "machine.toml"), "--detectors", detector]
        _peak([*learn, "-o", str(folder / f"{detector}.json")])
    recording: Recording = read_as_logged(GATE / "free" / "01.mcap", known).recording
    return recording


def _measured(folder: Path, logs: Mapping[str, Path]) -> bool:
    machine = ["--machine", str(folder / "machine.toml")]
    mapped = {
        f"detect {name}": ["detect", "LOG", *machine, "--signature", str(folder / f"{name}.json")] for name in DETECTORS
    }
    mapped["detect gm --plot"] = [*mapped["detect gm"], "--plot", str(folder / "plot.png")]
    for suffix in (".parquet", ".mcap"):
        convert = ["convert", "LOG", str(folder / f"out{suffix}"), *machine, "--force"]
        mapped[f"convert --machine to {suffix}"] = convert
    bounded = {
        "info": ["info", "LOG"],
        "convert to .parquet": ["convert", "LOG", str(folder / "out.parquet"), "--force"],
        "convert to .mcap": ["convert", "LOG", str(folder / "out.mcap"), "--force"],
        "convert --recover": ["convert", "LOG", str(folder / "recovered.mcap"), "--recover", "all", "--force"],
    }
    held, rows = True, []
    for task, arguments in (mapped | bounded).items():
        peaks = {}
        for length, log in logs.items():
            peaks[length] = _peak([str(log) if part == "LOG" else part for part in arguments])
            peak = peaks[length]
            figures = (f"{megabytes:.0f}" for megabytes in (peak.whole, peak.own, peak.files))
            rows.append((task, length, *figures, f"{peak.seconds:.1f}"))
        hour, growth = peaks["1 h"].whole, peaks["1 h"].whole - peaks["10 min"].whole
        if task in mapped:
            held &= _verdict(f"{task} of 1 h, peak MB", hour, DETECT_AT_MOST_MB)
        else:
            held &= _verdict(f"{task}: 1 h over 10 min, MB more", growth, GROWTH_AT_MOST_MB)
    table(("command", "log", "peak MB", "own", "files", "s"), rows)
    return held


def _peak(arguments: Sequence[str]) -> Peak:
    """Run a command in a new process; stop the benchmark if it fails."""
    package = str(Path(cdtool.__file__).parents[1])
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, (package, os.environ.get("PYTHONPATH"))))}
    begin = perf_counter()
    most = dict.fromkeys(_FIGURES, 0)
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(
            [sys.executable, "-c", _COMMAND, *arguments], env=environment, stdout=output, stderr=subprocess.STDOUT
        )
        while process.poll() is None:
            for name, kilobytes in _status(process.pid).items():
                most[name] = max(most[name], kilobytes)
            sleep(_EVERY_S)
        if process.returncode:
            output.seek(0)
            sys.exit(f"error: cdtool {arguments[0]}: status {process.returncode}\n{output.read()}")
    figures = (most[name] * 1024 / 1e6 for name in _FIGURES)
    return Peak(*figures, perf_counter() - begin)


def _status(number: int) -> dict[str, int]:
    """Return the kilobytes of a process; empty if it has just ended."""
    try:
        lines = Path(f"/proc/{number}/status").read_text(encoding="utf-8").splitlines()
    except OSError:
        return {}
    pairs = (line.partition(":")[::2] for line in lines)
    return {name: int(value.split()[0]) for name, value in pairs if name in _FIGURES}


def _verdict(name: str, megabytes: float, at_most: float) -> bool:
    held = megabytes <= at_most
    print(f"{'ok  ' if held else 'FAIL'}  {name}: {megabytes:.0f} wanted at most {at_most:g}", flush=True)
    return held


def write_log(path: Path, run: Recording, seconds: float, compression: str, size: float = 0.0) -> None:
    """Write so many seconds at 1 kHz of the run's channels in motor units, filled up by images to `size` bytes."""
    samples = {name: run[name].values[:, 0].tolist() for _, names in TOPICS.values() for name in names}
    length = min(len(values) for values in samples.values())
    travel = samples["position"][length - 1] - samples["position"][0]
    noise = np.random.default_rng(0).bytes(1 << 20)
    count = round(seconds * SECOND_NS / STEP_NS)
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType[compression.upper()])
        writer.start(profile="ros2", library="cdtool")
        channels = {topic: _channel(writer, topic, kind) for topic, (kind, _) in TOPICS.items()}
        image = writer.register_schema("sensor_msgs/msg/CompressedImage", "ros2msg", _IMAGE.encode())
        camera = writer.register_channel(CAMERA, "cdr", image)
        sensors = [item for item in TOPICS.items() if item[0] != JOINT]
        written = pending = 0  # bytes in the file, and of images that wait in a chunk
        for i in range(count):
            stamp, k = START_NS + i * STEP_NS, i % length
            position = samples["position"][k] + i // length * travel
            joint = _joint_state(stamp, position, samples["speed"][k], samples["torque"][k])
            writer.add_message(channels[JOINT], stamp, joint, stamp, i)
            for topic, (_, (name, *_)) in sensors:
                value = struct.pack("<4sd", b"\0\1\0\0", samples[name][k])
                writer.add_message(channels[topic], stamp, value, stamp, i)
            if size and i % IMAGE_EVERY == 0:
                pending = pending if file.tell() == written else 0
                written = file.tell()
                missing = round(size * (i + 1) / count) - written - pending
                content = noise[: min(max(missing, 1000), len(noise) - 100)]
                pending += len(content)
                writer.add_message(camera, stamp, _compressed_image(stamp, content), stamp, i // IMAGE_EVERY)
        writer.finish()


def _channel(writer: Writer, topic: str, kind: str) -> int:
    schema = writer.register_schema(kind, "ros2msg", DEFINITIONS[kind].encode())
    return writer.register_channel(topic, "cdr", schema)


def _joint_state(stamp: int, position: float, speed: float, torque: float) -> bytes:
    """CDR of a JointState of one joint: every float64 stands at a multiple of 8 bytes behind the encapsulation."""
    head = struct.pack("<4siI", b"\0\1\0\0", *divmod(stamp, SECOND_NS))
    frame, names = struct.pack("<I1s3x", 1, b"\0"), struct.pack("<II5s3x", 1, 5, b"gate\0")
    return head + frame + names + struct.pack("<I4xdI4xdI4xd", 1, position, 1, speed, 1, torque)


def _compressed_image(stamp: int, content: bytes) -> bytes:
    head = struct.pack("<4siI", b"\0\1\0\0", *divmod(stamp, SECOND_NS))
    return head + struct.pack("<I1s3xI5s3xI", 1, b"\0", 5, b"jpeg\0", len(content)) + content


if __name__ == "__main__":
    main("memory of long logs", measure)
