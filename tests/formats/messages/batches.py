"""Batches of payloads, and a check of decoded batches against the field language."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cdtool.formats.messages.batch import Batch
from cdtool.formats.messages.decoded_batch import ABSENT, OTHER_JOINTS
from cdtool.formats.messages.fields import FieldMissingError, parse_field, stamp_parts


def batch_of(payloads):
    """Return a batch of payloads that are separated by unused bytes."""
    gap = b"\xa5" * 37
    data = np.frombuffer(gap + gap.join(payloads) + gap[: len(payloads) % 3], dtype=np.uint8)
    length = np.array([len(payload) for payload in payloads], dtype=np.int64)
    start = np.cumsum(length + len(gap)) - length
    return Batch(data, start, length, np.zeros(len(payloads), dtype=np.uint64))


def plain(message):
    """Return a message of a ROS decoder, an object with slots, as dictionaries."""
    if isinstance(message, list):
        return [plain(item) for item in message]
    names = getattr(type(message), "__slots__", None) if type(message).__module__ != "builtins" else None
    return message if names is None else {name: plain(getattr(message, name)) for name in names}


def fields_of(*texts):
    return [parse_field(text, "here") for text in texts]


def same(a, b):
    """Return True if the numbers are equal to the bit; all NaNs are equal."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    return a.shape == b.shape and bool(((a.view(np.int64) == b.view(np.int64)) | (np.isnan(a) & np.isnan(b))).all())


def assert_follows_field_language(decoded, messages, wanted, joints=()):
    """Assert that decoded values are those of the field language.

    `messages` are the payloads decoded by a package; None: the package refused the payload, or it is damaged.
    """
    assert decoded.status.tolist() == [int(message is None) for message in messages]
    for field, field_values in zip(wanted, decoded.fields, strict=True):
        first = None
        widths = {}
        for row, message in enumerate(messages):
            if message is None:
                continue
            try:
                value = field.of(message, joints)
            except FieldMissingError as fault:
                assert field_values.state[row] == ABSENT, (field.text, row)
                first = first or fault
                continue
            assert (field_values.state[row] == OTHER_JOINTS) == (value is None), (field.text, row)
            if value is None:
                continue
            if field_values.count is None:
                assert same([field_values.values[row]], [value]), (field.text, row, field_values.values[row], value)
                continue
            value = [] if isinstance(value, float) and math.isnan(value) else value
            widths[row] = len(value)
            assert field_values.count[row] == len(value), (field.text, row)
            if len(value) == field_values.values.shape[1]:
                assert same(field_values.values[row], value), (field.text, row)
            else:
                assert np.isnan(field_values.values[row]).all(), (field.text, row)
        if any(widths.values()):
            assert field_values.values.shape[1] == next(width for _, width in sorted(widths.items()) if width)
        assert (field_values.fault is None) == (first is None), (field.text, field_values.fault, first)
        if first is not None:
            assert (field_values.fault.problem, field_values.fault.advice) == (first.problem, first.advice)


def header_stamp(message: Any) -> int | None:
    """Return the header's time stamp [ns]; None if the message has no header stamp."""
    parts = stamp_parts(message)
    return None if parts is None else int(parts[0]) * 10**9 + int(parts[1])
