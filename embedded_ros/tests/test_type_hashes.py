# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Type hashes equal those that ROS 2 itself publishes."""

import pytest
from rosbags.typesys import Stores, get_typestore

from embedded_ros import sources
from embedded_ros.types import (
    action_type_hash,
    catalogue,
    message_class,
    message_type_hash,
    service_type_hash,
)

# Published in rmw_zenoh's design document and in the tests of other clients of ROS 2 Jazzy.
PUBLISHED_MESSAGES = {
    "std_msgs/msg/String": "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    "rosgraph_msgs/msg/Clock": "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    "sensor_msgs/msg/Range": "b42b62562e93cbfe9d42b82fe5994dfa3d63d7d5c90a317981703f7388adff3a",
}
PUBLISHED_ACTION_PARTS = {
    "example_interfaces/action/Fibonacci_Goal": (
        "226cb437e4355dcd3e914f930382a3b0cc1da81545bd319ed554e95a03255f51"
    ),
    "example_interfaces/action/Fibonacci_SendGoal_Request": (
        "3d088942b413247db536576f0286768c6be8fcd5d0c9a5d544f359fba090a238"
    ),
    "example_interfaces/action/Fibonacci_SendGoal_Response": (
        "d8c07bb3d5b766fe4b43159c9a5222af5214e2fcc29229b991d826166c512be1"
    ),
    "example_interfaces/action/Fibonacci_GetResult_Request": (
        "c8a4f5e7d13b81286ee1043e2ecd084281cecf1ff06aaa799464f5f15479f003"
    ),
    "example_interfaces/action/Fibonacci_FeedbackMessage": (
        "c1de71afd52e49a89c53d8262366884185bc0a02f78ce051c4e46b0a7fe59bb2"
    ),
    "action_msgs/srv/CancelGoal_Request": (
        "3d3c84653c1f96918086887e1dcb236faec88b81a5b14fd4cf4840065bcdf8af"
    ),
    "action_msgs/msg/GoalStatusArray": (
        "6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e"
    ),
}
PUBLISHED_SERVICE = (
    "example_interfaces/srv/AddTwoInts",
    "e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a",
)


@pytest.mark.parametrize(
    ("name", "digest"), [*PUBLISHED_MESSAGES.items(), *PUBLISHED_ACTION_PARTS.items()]
)
def test_messages_hash_as_published(name: str, digest: str) -> None:
    assert message_type_hash(name) == f"RIHS01_{digest}"


def test_a_service_hashes_as_published() -> None:
    """Covers char as uint8: it occurs in every service's event message."""
    name, digest = PUBLISHED_SERVICE
    assert service_type_hash(name) == f"RIHS01_{digest}"


def test_all_messages_hash_as_another_implementation_says() -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    compared = 0
    for name in store.fielddefs:
        if not _contains_char(name):  # there rosbags is known to be wrong
            assert message_type_hash(name) == store.hash_rihs01(name), name
            compared += 1
    assert compared > 140


def test_all_constants_are_those_of_another_implementation() -> None:
    """A hash does not cover them."""
    compared = 0
    for name, (theirs, _) in get_typestore(Stores.ROS2_JAZZY).fielddefs.items():
        ours = {constant.name: constant.value for constant in message_class(name).spec.constants}
        for key, _, value in theirs:
            own = ours.pop(key)
            assert (own[0] if isinstance(own, bytes) else own) == value, (name, key)
            compared += 1
        assert not ours, name
    assert compared > 200


def test_every_shipped_interface_parses_and_hashes() -> None:
    hashes = set()
    for package in sources.shipped():
        for kind, type_hash in (
            ("msg", message_type_hash),
            ("srv", service_type_hash),
            ("action", action_type_hash),
        ):
            for name in catalogue().names(package, kind):
                hashes.add(type_hash(f"{package}/{kind}/{name}"))
    assert len(hashes) > 60


def _contains_char(name: str) -> bool:
    fields = message_class(name).spec.fields
    return any(
        f.type.base == "char" or (f.type.primitive is None and _contains_char(f.type.base))
        for f in fields
    ) or name.startswith("rmw_dds_common")
