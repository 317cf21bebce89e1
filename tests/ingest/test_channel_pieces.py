"""Mapped channels converted piece by piece: the same rows, times and findings as for channels in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.errors import CdtoolError, RecordingError
from cdtool.findings import Finding
from cdtool.formats import time_order
from cdtool.formats.mcap.write import Stream, write_mcap
from cdtool.ingest.channel_pieces import ChannelPieces
from cdtool.machine_file import MachineFile, read_machine_file
from cdtool.messages.schemas import DEFINITIONS
from cdtool.workflows.channel_rows import ChannelRows, channel_rows
from cdtool.workflows.convert.converting import convert

START_NS = 1_700_000_000_123_456_789
MACHINE = """[machine]
type = "linear_axis"
joints = ["a", "b"]
coordinates = "load"

[channels.mcap]
CLOCK
speed = { topic = "/joints", field = "velocity[:]", unit = "mm/s" }
position = { topic = "/joints", field = "position[:]", unit = "mm", saturation = [-2.0, 2.0] }
torque = { topic = "/joints", field = "effort[:]", scale = [1.0, -1.0] }
force = { topic = "/cell", field = "wrench.force.z", time_offset = OFFSET }
event = { topic = "/event", field = "wrench.force.x" }
"""


def machine(folder: Path, clock: str = "log", offset: float = 0.0) -> MachineFile:
    text = MACHINE.replace("CLOCK", f'time = {{ clock = "{clock}" }}').replace("OFFSET", str(offset))
    (folder / "machine.toml").write_text(text)
    return read_machine_file(folder / "machine.toml")


def write(path: Path, seed: int, start: float = 0.0, rows: int = 300, cell: bool = True) -> Path:
    """Write two joints at 100 Hz with gaps, repeated stamps and faulty values, a load cell at 50 Hz, and two events."""
    random = np.random.default_rng(seed)
    time = start + np.arange(rows) / 100.0 + 0.5 * (np.arange(rows) > rows // 2)
    time[random.integers(1, rows, 5)] -= 0.01
    fields = {name: random.normal(size=(rows, 2)) for name in ("position", "velocity", "effort")}
    fields["velocity"][random.choice(rows, 12, replace=False), 0] = [*[np.nan] * 9, np.inf, -np.inf, -0.0]
    fields["effort"][:, 1] = 3.0
    joints = Stream("/joints", "sensor_msgs/msg/JointState", time, fields, ("a", "b"))
    cell_time = start + 0.003 + np.arange(rows // 2) / 50.0
    wrench = Stream("/cell", "geometry_msgs/msg/WrenchStamped", cell_time, {"wrench.force.z": cell_time**2})
    events = {"wrench.force.x": np.array([1.0, 2.0])}
    event = Stream("/event", "geometry_msgs/msg/WrenchStamped", start + np.array([0.5, 1.0]), events)
    write_mcap(path, [joints, *([wrench] if cell else []), event], start_ns=START_NS)
    return path


def write_out_of_order(path: Path, most: int, seed: int = 0) -> Path:
    """Write a log whose messages are up to `most` positions late; the header stamps are 2 ms earlier."""
    from mcap.reader import make_reader
    from mcap.writer import Writer

    source = write(path.with_name("in_order.mcap"), seed)
    with source.open("rb") as file:
        messages = list(make_reader(file).iter_messages())
    order = np.argsort(np.arange(len(messages)) + np.random.default_rng(1).uniform(0, most + 1e-9, len(messages)))
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=4000)
        writer.start()
        channels: dict[str, int] = {}
        for i in order.tolist():
            schema, channel, message = messages[i]
            if channel.topic not in channels:
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, "cdr", kind)
            later = message.log_time + 2_000_000
            writer.add_message(channels[channel.topic], later, message.data, message.log_time + 1_000_000)
        writer.finish()
    source.unlink()
    return path


def table(rows: ChannelRows | ChannelPieces) -> dict[str, bytes]:
    """Return all bytes of times and values by group, as a writer receives them: no row is later than the next part."""
    by_group: dict[str, list[list[np.ndarray]]] = {group.name: [] for group in rows.groups}
    latest = -np.inf
    for ready in rows.parts(rows.groups):
        times = [part.time for part in ready if part is not None]
        assert min(float(time[0]) for time in times) >= latest
        latest = max(float(time[-1]) for time in times)
        for group, part in zip(rows.groups, ready, strict=True):
            if part is not None:
                by_group[group.name].append([part.time, *part.flat])
    for group in rows.groups:
        assert sum(len(part[0]) for part in by_group[group.name]) == group.rows
    return {
        name: b"".join(np.concatenate(column).tobytes() for column in zip(*parts, strict=True))
        for name, parts in by_group.items()
    }


def as_shown(finding: Finding) -> tuple[str, str, str]:
    return finding.kind, finding.severity, str(finding)


def assert_same_as_in_memory(log: Path, machine_file: MachineFile) -> tuple[Finding, ...]:
    """Assert the same groups, rows and findings as in memory; return the findings."""
    pieces, whole = channel_rows(log, machine_file), ChannelRows(log, machine_file)
    assert isinstance(pieces, ChannelPieces)
    assert pieces.origin == whole.origin
    for mine, its in zip(pieces.groups, whole.groups, strict=True):
        assert (mine.name, mine.rows, mine.start, mine.joints) == (its.name, its.rows, its.start, its.joints)
        assert [(c.name, c.unit, c.values.shape) for c in mine.columns] == [
            (c.name, c.unit, c.values.shape) for c in its.columns
        ]
    assert table(pieces) == table(whole)
    # The numbers are summed in another order: they are equal to the digits shown, but not to the bit.
    assert [*map(as_shown, pieces.findings)] == [*map(as_shown, whole.findings)]
    return pieces.findings


@settings(max_examples=25, deadline=None)
@given(
    clock=st.sampled_from(["log", "publish", "header"]),
    offset=st.sampled_from([0.0, 0.25, -0.25]),
    most=st.sampled_from([0, 3, 40]),
    waiting=st.sampled_from([16, 1 << 15]),
    seed=st.integers(0, 1000),
)
def test_channels_in_pieces_equal_those_in_memory(tmp_path_factory, clock, offset, most, waiting, seed):
    folder = tmp_path_factory.mktemp("log")
    log = write_out_of_order(folder / "log.mcap", most, seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(time_order.by_time, "__defaults__", (waiting,))
        kinds = {finding.kind for finding in assert_same_as_in_memory(log, machine(folder, clock, offset))}
    assert kinds >= {"infinite_values", "saturated_values", "repeated_stamps", "sample_gaps", "missing_values"}


@pytest.mark.parametrize("count", [1, 3])
def test_parts_in_pieces_equal_those_in_memory(tmp_path, count):
    folder = tmp_path / "bag"
    folder.mkdir()
    for number in range(count):
        write(folder / f"bag_{number}.mcap", number, start=5.0 * number, cell=number != 1)
    names = "".join(f"    - bag_{number}.mcap\n" for number in range(count + 1))
    (folder / "metadata.yaml").write_text(f"bag:\n  relative_file_paths:\n{names}")
    lost, *others = assert_same_as_in_memory(folder, machine(tmp_path))
    assert lost == Finding("part_missing", "", {"part": f"bag_{count}.mcap", "metadata": "metadata.yaml"})
    assert ("position", "bag_0.mcap") in {(finding.channel, finding.file) for finding in others}


def test_parts_that_overlap_are_refused_as_in_memory(tmp_path):
    folder = tmp_path / "bag"
    folder.mkdir()
    for number in range(2):
        write(folder / f"bag_{number}.mcap", number, start=1.0 * number)
    faults = []
    for read in (channel_rows, ChannelRows):
        with pytest.raises(RecordingError, match="overlaps the previous part") as fault:
            read(folder, machine(tmp_path))
        faults.append(str(fault.value))
    assert faults[0] == faults[1]


def test_a_missing_load_cell_is_noted_as_in_memory(tmp_path):
    findings = assert_same_as_in_memory(write(tmp_path / "log.mcap", 1, cell=False), machine(tmp_path))
    assert [finding.channel for finding in findings if finding.kind in ("absent_truth", "absent_file")] == ["force"]


def test_a_converted_log_has_its_exact_times_when_read_in_pieces(tmp_path):
    converted = convert(write(tmp_path / "log.mcap", 2), tmp_path / "out.mcap", machine=machine(tmp_path))
    again = read_machine_file(converted.machine_files[0])
    assert_same_as_in_memory(tmp_path / "out.mcap", again)
    first, second = (channel_rows(tmp_path / name, known) for name, known in (
        ("log.mcap", machine(tmp_path)), ("out.mcap", again)
    ))  # fmt: skip
    assert table(first) == table(second) and first.origin == second.origin


def test_a_log_with_a_coarse_clock_is_read_into_memory(tmp_path):
    time = np.floor(np.arange(200) / 5) / 20.0
    write_mcap(
        tmp_path / "log.mcap",
        [Stream("/speed", "std_msgs/msg/Float64", time, {"data": np.arange(200.0)})],
        start_ns=START_NS,
    )
    text = '[machine]\ntype = "linear_axis"\ncoordinates = "load"\n[channels.mcap]\n'
    (tmp_path / "machine.toml").write_text(text + 'speed = { topic = "/speed", field = "data" }\n')
    rows = channel_rows(tmp_path / "log.mcap", read_machine_file(tmp_path / "machine.toml"))
    assert isinstance(rows, ChannelRows) and any(finding.kind == "coarse_clock" for finding in rows.findings)


def number_arrays(path: Path, lengths: list[int]) -> Path:
    """Write messages with one array each, of these lengths."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        text = DEFINITIONS["sensor_msgs/msg/JointState"].text.encode()
        channel = writer.register_channel(
            "/joints", "json", writer.register_schema("sensor_msgs/msg/JointState", "ros2msg", text)
        )
        for i, length in enumerate(lengths):
            numbers = ", ".join(str(float(k)) for k in range(length))
            writer.add_message(channel, i * 10**7, f'{{"position": [{numbers}]}}'.encode(), i * 10**7)
        writer.finish()
    return path


@pytest.mark.parametrize(
    "lengths",
    [[2] * 9, [0, 0, 2, 2, 0, 2, 2], [0] * 7, [2, 2, 3, 2, 2], [3] * 6],
    ids=["uniform", "some empty", "all empty", "of two lengths", "of another length than the joints"],
)
def test_whole_arrays_are_accepted_or_refused_as_in_memory(tmp_path, lengths):
    log = number_arrays(tmp_path / "log.mcap", lengths)
    text = MACHINE.partition("CLOCK")[0] + 'position = { topic = "/joints", field = "position[:]", unit = "m" }\n'
    (tmp_path / "machine.toml").write_text(text)
    known = read_machine_file(tmp_path / "machine.toml")
    try:
        ChannelRows(log, known)
    except CdtoolError as fault:
        with pytest.raises(type(fault)) as mine:
            channel_rows(log, known)
        assert str(mine.value) == str(fault)
    else:
        assert_same_as_in_memory(log, known)
