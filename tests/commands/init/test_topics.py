"""`cdtool init` on topics: SI units are assumed only for known types of messages."""

from __future__ import annotations

import json

import numpy as np
import pytest
from mcap.writer import Writer

from cdtool.formats.mcap.write import Stream, write_mcap
from tests.commands.init.drafts import RPM, drafted, stroke

LEAD = 1.5e-3  # travel per motor angle [m/rad]


def write_json(path, topics):
    """Messages in JSON of unknown types; `topics`: topic -> field -> values at 1 kHz."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        for topic, fields in topics.items():
            schema = writer.register_schema(f"plant.{topic}", "jsonschema", b"{}")
            channel = writer.register_channel(topic, "json", schema)
            for k, row in enumerate(zip(*fields.values(), strict=True)):
                content = dict(zip(fields, map(float, row), strict=True))
                writer.add_message(channel, k * 10**6, json.dumps(content).encode(), k * 10**6)
        writer.finish()
    return path


def test_fields_of_an_unknown_type_get_the_units_of_their_names_with_marks(tmp_path):
    run = stroke()
    drive = {"rpm": run.speed / LEAD * RPM, "current_A": run.torque / 0.4, "pos_mm": run.travel * 1e3}
    draft = drafted(write_json(tmp_path / "a.mcap", {"drive": drive, "loadcell": {"F": run.force}}), tmp_path)
    assert [draft.unit(name) for name in ("speed", "torque", "position", "force")] == ["rpm", "A", "mm", "N"]
    assert all(draft.checked(name) for name in ("speed", "torque", "position", "force"))
    assert draft.machine["coordinates"] == "motor"
    assert draft.machine["transmission_ratio"] == pytest.approx(LEAD, rel=2e-3)
    assert "SI" not in draft.text


def joint_states(folder, factor):
    run = stroke()
    values = {"position": run.travel[:, np.newaxis], "velocity": run.speed[:, np.newaxis] * factor}
    path = folder / "a.mcap"
    write_mcap(path, [Stream("/joint_states", "sensor_msgs/msg/JointState", run.time, values, ("leaf",))], start_ns=1)
    return path


def test_a_known_type_needs_neither_unit_nor_mark(tmp_path):
    draft = drafted(joint_states(tmp_path, 1.0), tmp_path)
    assert "unit" not in draft.channels["position"] and "unit" not in draft.channels["speed"]
    assert not draft.checked("position") and not draft.checked("speed") and draft.checked("type")


def test_a_known_type_whose_numbers_are_not_in_si_units_is_marked(tmp_path):
    draft = drafted(joint_states(tmp_path, RPM), tmp_path)
    assert "must be 1 in SI units" in draft.said("position") and draft.checked("speed")


def test_a_force_sensor_is_never_the_torque(tmp_path):
    """Its torque moves here, and has that name."""
    run = stroke()
    path = tmp_path / "a.mcap"
    cell = {"wrench.torque.x": run.torque, "wrench.force.x": run.force}
    sensor = Stream("/load_cell", "geometry_msgs/msg/WrenchStamped", run.time, cell)
    write_mcap(path, [sensor, Stream("/rpm", "std_msgs/msg/Float64", run.time, {"data": run.speed * RPM})], start_ns=1)
    draft = drafted(path, tmp_path)
    assert "torque" not in draft.channels and draft.channels["force"]["field"] == "wrench.force.x"
    assert draft.channels["speed"]["topic"] == "/rpm" and draft.checked("speed")
