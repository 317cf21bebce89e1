"""The names of array elements in the messages of a topic."""

from __future__ import annotations

import pytest

from cdtool.formats.mcap import Mcap
from tests.formats.mcap_files import STREAMS, by_hand, written  # noqa: F401


def test_element_names_are_in_the_order_of_the_first_message(written):  # noqa: F811
    assert Mcap().element_names(written(), "/joint_states") == ("base", "shoulder_joint", "elbow.joint")


def test_element_names_in_json_are_in_the_order_of_the_first_message(by_hand):  # noqa: F811
    path = by_hand([(1, 1, {"name": ["b", "a"], "position": [1.0, 2.0]}), (2, 2, {"name": ["a", "b"]})])
    assert Mcap().element_names(path, "/a") == ("b", "a")


@pytest.mark.parametrize("topic", ["/imu", "/force", "/nowhere"])
def test_element_names_are_empty_without_an_array_of_names_or_without_the_topic(written, topic):  # noqa: F811
    assert Mcap().element_names(written(), topic) == ()


@pytest.mark.parametrize(("encoding", "content"), [("json", b"{"), ("json", b"[]"), ("morse", b"...")])
def test_element_names_are_empty_if_the_first_message_cannot_be_decoded(by_hand, encoding, content):  # noqa: F811
    assert Mcap().element_names(by_hand([(1, 1, content)], encoding), "/a") == ()
