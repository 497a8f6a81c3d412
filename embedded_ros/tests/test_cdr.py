# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""CDR: round trips, bytes that another implementation agrees with, and clear refusals."""

from __future__ import annotations

import struct
from array import array
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from embedded_ros.types import MessageFieldError, SerializationError, catalogue, message_class
from embedded_ros.types.cdr import deserialize, serialize
from embedded_ros.types.fields import NUMPY_TYPES
from embedded_ros.types.model import FieldType, Shape

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = sorted(STORE.fielddefs)
TEXT = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9)


def values(kind: FieldType) -> st.SearchStrategy:
    if kind.shape is not Shape.SINGLE:
        least = kind.size if kind.shape is Shape.ARRAY else 0
        most = kind.size if kind.size else 4
        return st.lists(values(kind.element), min_size=least, max_size=most)
    if kind.primitive is None:
        return messages(kind.base)
    if kind.primitive.python is bool:
        return st.booleans()
    if kind.primitive.python is bytes:
        return st.binary(min_size=1, max_size=1)
    if kind.primitive.python is str:
        return TEXT.filter(lambda t: not kind.string_bound or len(t.encode()) <= kind.string_bound)
    if kind.primitive.python is float:
        return st.floats(allow_nan=False, width=int(kind.base[5:]))
    limits = np.iinfo(NUMPY_TYPES[kind.base])
    return st.integers(int(limits.min), int(limits.max))


def messages(name: str) -> st.SearchStrategy:
    fields = catalogue().message(name).fields
    return st.builds(message_class(name), **{field.name: values(field.type) for field in fields})


@settings(
    max_examples=150,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(st.data())
def test_any_message_survives_a_round_trip(data: st.DataObject) -> None:
    message = data.draw(st.sampled_from(TYPES).flatmap(messages))
    raw = serialize(message)
    assert len(raw) % 4 == 0
    assert deserialize(raw, message.ros_type) == message
    # rosbags is an independent implementation of the same format.
    theirs = STORE.serialize_cdr(STORE.deserialize_cdr(raw, message.ros_type), message.ros_type)
    assert raw[: len(theirs)] == bytes(theirs)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(TYPES), st.binary(max_size=60))
def test_garbage_is_refused_or_read_but_never_crashes(name: str, garbage: bytes) -> None:
    try:
        deserialize(b"\0\1\0\0" + garbage, name)
    except SerializationError as error:
        assert name.split("/")[2] in str(error) or "expected" in str(error)


def test_alignment_is_counted_from_after_the_header() -> None:
    cls = message_class("rcl_interfaces/msg/IntegerRange")
    raw = serialize(cls(from_value=1, to_value=2, step=3))
    assert raw == b"\0\1\0\0" + struct.pack("<qqQ", 1, 2, 3)
    odd = message_class("sensor_msgs/msg/PointField")(name="ab", offset=7, datatype=1, count=2)
    assert raw[:4] == b"\0\1\0\0"
    assert serialize(odd)[4:] == b"\3\0\0\0ab\0\0\7\0\0\0\1\0\0\0\2\0\0\0"


def test_an_empty_sequence_of_doubles_is_not_padded() -> None:
    cls = message_class("std_msgs/msg/Float64MultiArray")
    assert len(serialize(cls())) == 4 + 4 + 4 + 4  # header, dimensions, offset, length


def test_an_empty_message_is_one_byte_padded() -> None:
    cls = message_class("std_msgs/msg/Empty")
    assert serialize(cls()) == b"\0\1\0\0\0\0\0\0"
    assert deserialize(b"\0\1\0\0\0\0\0\0", "std_msgs/msg/Empty") == cls()


def test_big_endian_senders_are_understood() -> None:
    raw = b"\0\0\0\0" + struct.pack(">III", 0, 0, 2) + b"\0" * 4 + struct.pack(">2d", 1.5, -2.0)
    message = deserialize(raw, "std_msgs/msg/Float64MultiArray")
    assert list(message.data) == [1.5, -2.0]


def test_decoded_arrays_are_writable() -> None:
    joint = message_class("sensor_msgs/msg/JointState")(position=[1.0, 2.0])
    pose = message_class("geometry_msgs/msg/PoseWithCovariance")()
    joint, pose = (deserialize(serialize(m), m.ros_type) for m in (joint, pose))
    joint.position[0] = 5.0
    joint.position.append(3.0)
    pose.covariance[7] = 2.0
    assert list(deserialize(serialize(joint), joint.ros_type).position) == [5.0, 2.0, 3.0]
    assert deserialize(serialize(pose), pose.ros_type).covariance[7] == 2.0


@pytest.mark.parametrize(
    ("name", "field", "value", "complaint"),
    [
        ("std_msgs/msg/String", "data", 3, "std_msgs/msg/String.data: expected string, got int 3"),
        ("std_msgs/msg/String", "data", "a\0b", "zero byte"),
        ("std_msgs/msg/String", "data", None, "expected string, got NoneType"),
        ("std_msgs/msg/Float64", "data", 1, "expected float64, got int 1"),
        ("std_msgs/msg/Float32", "data", 1e300, "does not fit into float32"),
        ("std_msgs/msg/Int8", "data", 128, "std_msgs/msg/Int8.data: 128 does not fit"),
        ("std_msgs/msg/UInt8", "data", -1, "does not fit"),
        ("std_msgs/msg/Int64", "data", True, "expected int64, got bool"),
        ("std_msgs/msg/Int64", "data", np.int64(1), "expected int64, got int64"),
        ("std_msgs/msg/Bool", "data", 1, "expected bool, got int"),
        ("std_msgs/msg/Header", "stamp", 1.0, "expected builtin_interfaces/Time, got float"),
        ("std_msgs/msg/Header", "stamp", None, "std_msgs/msg/Header.stamp: expected"),
        ("sensor_msgs/msg/JointState", "name", "abc", "name: expected string"),
        ("sensor_msgs/msg/JointState", "name", ["a", 1], r"name\[1\]: expected string, got int 1"),
        ("diagnostic_msgs/msg/DiagnosticStatus", "level", 1, "level: expected byte, got int"),
        ("diagnostic_msgs/msg/DiagnosticStatus", "values", [None], r"values\[0\]: expected"),
        ("rmw_dds_common/msg/NodeEntitiesInfo", "node_name", "x" * 257, "bound is 256"),
    ],
)
def test_a_wrong_value_is_named_when_publishing(
    name: str, field: str, value: object, complaint: str
) -> None:
    message = message_class(name)()
    setattr(message, field, value)
    with pytest.raises(MessageFieldError, match=complaint):
        serialize(message)


@pytest.mark.parametrize("value", [["a"], [1e400j], 3, "12", np.zeros((2, 2)), np.array(["a"])])
def test_a_wrong_sequence_is_named_when_assigned(value: object) -> None:
    message = message_class("sensor_msgs/msg/JointState")()
    with pytest.raises(MessageFieldError, match=r"sensor_msgs/msg/JointState\.position"):
        message.position = value


def test_nested_errors_say_the_whole_path() -> None:
    message = message_class("geometry_msgs/msg/PoseStamped")()
    message.pose.position.x = "1"
    with pytest.raises(MessageFieldError, match=r"PoseStamped\.pose\.position\.x: expected"):
        serialize(message)


def test_whatever_holds_numbers_can_be_assigned() -> None:
    message = message_class("sensor_msgs/msg/JointState")()
    for value in (
        [1, 2.0],
        (1.0, 2.0),
        np.array([1.0, 2.0]),
        np.array([1, 2], np.int32),
        array("d", [1, 2]),
    ):
        message.position = value
        assert message.position == array("d", [1.0, 2.0])
    image = message_class("sensor_msgs/msg/Image")(data=b"\1\2")
    assert image.data == array("B", [1, 2])
    uuid = message_class("unique_identifier_msgs/msg/UUID")(uuid=list(range(16)))
    assert uuid.uuid.dtype == np.uint8
    with pytest.raises(MessageFieldError, match="shape"):
        uuid.uuid = [1, 2]


def test_bounds_and_wide_strings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "msg"
    folder.mkdir()
    (folder / "Bounded.msg").write_text(
        "string<=3 text ab\nint32[<=2] few\nstring<=2[<=2] names\n"
        "bool[3] flags [true, false, true]\nbyte[2] raw\nBounded2[2] pair\n"
    )
    (folder / "Bounded2.msg").write_text("uint8 a\nfloat64 b -1.5\n")
    (folder / "Wide.msg").write_text("wstring text\n")
    monkeypatch.setenv("EMBEDDED_ROS_INTERFACES", f"cdr_test_msgs={tmp_path}")
    cls = message_class("cdr_test_msgs/msg/Bounded")
    message = cls(few=[1, 2], names=["x", "yz"], raw=[b"\1", b"\2"])
    assert message.text == "ab"
    assert message.flags == [True, False, True]
    assert message.pair[1].b == -1.5
    assert message.pair[0] is not message.pair[1]
    assert deserialize(serialize(message), message.ros_type) == message
    for field, value in (
        ("text", "abcd"),
        ("names", ["a", "b", "c"]),
        ("names", ["abc"]),
        ("flags", [True]),
        ("pair", []),
        ("raw", [b"12", b"1"]),
    ):
        wrong = cls()
        setattr(wrong, field, value)
        with pytest.raises(MessageFieldError, match=field):
            serialize(wrong)
    with pytest.raises(MessageFieldError, match="few"):
        message.few = [1, 2, 3]
    message.few.extend([3, 4])  # behind the check on assignment
    with pytest.raises(MessageFieldError):
        serialize(message)
    with pytest.raises(Exception, match=r"Wide\.text: wstring is not supported"):
        serialize(message_class("cdr_test_msgs/msg/Wide")())
