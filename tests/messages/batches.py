"""Payloads -> a batch, and what the field language says of messages that a package has decoded."""

from __future__ import annotations

import math

import numpy as np

from cdtool.messages.batch import Batch
from cdtool.messages.columns.decoded_batch import ABSENT, OTHER_JOINTS
from cdtool.messages.fields import FieldMissingError, parse_field


def batch_of(payloads):
    """The payloads with bytes between them that belong to none."""
    gap = b"\xa5" * 37
    data = np.frombuffer(gap + gap.join(payloads) + gap[: len(payloads) % 3], dtype=np.uint8)
    length = np.array([len(payload) for payload in payloads], dtype=np.int64)
    start = np.cumsum(length + len(gap)) - length
    return Batch(data, start, length, np.zeros(len(payloads), dtype=np.uint64))


def fields_of(*texts):
    return [parse_field(text, "here") for text in texts]


def same(a, b):
    """The same number to the bit, any NaN being as good as another."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    return a.shape == b.shape and bool(((a.view(np.int64) == b.view(np.int64)) | (np.isnan(a) & np.isnan(b))).all())


def assert_as_the_field_language(gathered, messages, wanted, joints=()):
    """`messages` are what the package made of the payloads; None: it refused, or they are damaged."""
    assert gathered.status.tolist() == [int(message is None) for message in messages]
    for field, picked in zip(wanted, gathered.picked, strict=True):
        first = None
        widths = {}
        for row, message in enumerate(messages):
            if message is None:
                continue
            try:
                value = field.of(message, joints)
            except FieldMissingError as fault:
                assert picked.state[row] == ABSENT, (field.text, row)
                first = first or fault
                continue
            assert (picked.state[row] == OTHER_JOINTS) == (value is None), (field.text, row)
            if value is None:
                continue
            if picked.count is None:
                assert same([picked.values[row]], [value]), (field.text, row, picked.values[row], value)
                continue
            value = [] if isinstance(value, float) and math.isnan(value) else value
            widths[row] = len(value)
            assert picked.count[row] == len(value), (field.text, row)
            if len(value) == picked.values.shape[1]:
                assert same(picked.values[row], value), (field.text, row)
            else:
                assert np.isnan(picked.values[row]).all(), (field.text, row)
        if any(widths.values()):
            assert picked.values.shape[1] == next(width for _, width in sorted(widths.items()) if width)
        assert (picked.fault is None) == (first is None), (field.text, picked.fault, first)
        if first is not None:
            assert (picked.fault.problem, picked.fault.advice) == (first.problem, first.advice)
