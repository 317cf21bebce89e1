from __future__ import annotations

import pytest

from cdtool.formats.messages.decoders import decoder_for
from cdtool.formats.messages.layout import TEXT, SchemaError
from cdtool.formats.messages.ros_definitions import parse_definitions
from cdtool.formats.messages.schemas import DEFINITIONS
from tests.formats.messages.batches import batch_of, fields_of

RULE = "=" * 80


def members(text):
    return parse_definitions("test_msgs/msg/Thing", text.encode(), 2).members


def test_types_arrays_defaults_constants_and_comments_are_distinguished():
    parsed = members(
        "# Thing\nint32 FIVE=5\nstring TEXT='a # b'\nfloat64 a 1.5\nstring<=10 b \"x = y\"\nint8[3] c [1, 2, 3]\n"
        "float32[<=4] d\nstring<=3[<=2] e\nbyte f  # comment\nchar g\n\tbool[] i"
    )
    assert [(member.name, member.kind, member.array, member.length) for member in parsed] == [
        ("a", "f8", False, None),
        ("b", TEXT, False, None),
        ("c", "i1", True, 3),
        ("d", "f4", True, None),
        ("e", TEXT, True, None),
        ("f", "u1", False, None),
        ("g", "u1", False, None),
        ("i", "?", True, None),
    ]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("not ? a definition", "is not a field"),
        ("float64", "is not a field"),
        ("float64 a,b", "is not a field"),
        ("float65 a", "type 'float65' of test_msgs/Thing.a is not defined"),
        ("float64[0] a", "cannot be parsed"),
        ("float64[<=] a", "cannot be parsed"),
        ("float64<=3 a", "only strings can have a length limit"),
        ("int8 a\nint8 a", "two fields 'a'"),
        ("Thing a", "contains itself"),
        (f"A a\n{RULE}\nMSG: test_msgs/A\nB b\n{RULE}\nMSG: test_msgs/B\nA a", "contains itself"),
        (f"A a\n{RULE}\nint8 x", "instead of MSG:"),
        (f"A a\n{RULE}\nMSG: test_msgs/A\nint8 x\n{RULE}\nMSG: test_msgs/A\nint16 x", "has two different definitions"),
        ("int64 a\n---\nint64 sum", "of a service or action"),
        ("\udcff", "not UTF-8"),
    ],
)
def test_a_text_that_is_not_a_message_definition_is_refused_with_the_reason(text, problem):
    with pytest.raises(SchemaError, match=problem.replace("?", r"\?")):
        parse_definitions("test_msgs/msg/Thing", text.encode(errors="surrogateescape"), 2)


def test_a_survey_lists_every_number_except_the_header_stamp():
    def fields(name):
        return decoder_for("cdr", "ros2msg", name, DEFINITIONS[name].encode()).fields(batch_of([]))

    assert fields("geometry_msgs/msg/WrenchStamped") == [f"wrench.{a}.{b}" for a in ("force", "torque") for b in "xyz"]
    assert fields("sensor_msgs/msg/JointState") == ["position[:]", "velocity[:]", "effort[:]"]
    assert fields("std_msgs/msg/Float64MultiArray") == ["layout.data_offset", "data[:]"]
    assert "orientation_covariance[:]" in fields("sensor_msgs/msg/Imu")
    assert decoder_for("cdr", "ros2msg", "a/b", b"float64[17] a\nfloat64[16] b").fields(batch_of([])) == [
        "a[:]",
        "b[:]",
    ]


@pytest.mark.parametrize(
    ("field", "problem", "known"),
    [
        ("wrench.forces.z", "there is no 'forces'", ("force", "torque")),
        ("wrench.force", "'wrench.force' has members, it is not a number", tuple(f"wrench.force.{i}" for i in "xyz")),
        ("header.frame_id", "'header.frame_id' is a string, not a number", ()),
        ("wrench.force.z[0]", "'z' is not an array", ("z",)),
        ("wrench.force.z.x", "there is no 'x'", ()),
    ],
)
def test_a_missing_field_is_reported_with_the_fields_that_exist(field, problem, known):
    name = "geometry_msgs/msg/WrenchStamped"
    decoder = decoder_for("cdr", "ros2msg", name, DEFINITIONS[name].encode())
    (field_values,) = decoder.decode(batch_of([b"\0\1\0\0" + bytes(64)]), fields_of(field)).fields
    assert (field_values.fault.problem, field_values.fault.known) == (problem, known)
    assert field_values.state.tolist() == [2]
