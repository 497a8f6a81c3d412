# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Message classes behave as rclpy's do."""

import copy
import pickle

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from control_msgs.action import FollowJointTrajectory, GripperCommand
from diagnostic_msgs.msg import DiagnosticStatus
from example_interfaces.srv import AddTwoInts
from geometry_msgs.msg import Pose, Quaternion
from rcl_interfaces.msg import ParameterType
from sensor_msgs.msg import JointState
from std_msgs.msg import Header, String
from visualization_msgs.msg import Marker


def test_defaults_are_those_of_the_interface_files() -> None:
    assert (Quaternion().x, Quaternion().w) == (0.0, 1.0)
    assert Pose().orientation.w == 1.0
    assert (String().data, Header().frame_id, Time().sec) == ("", "", 0)
    assert len(JointState().position) == 0


def test_defaults_are_not_shared() -> None:
    first, second = JointState(), JointState()
    first.name.append("a")
    first.position.append(1.0)
    first.header.frame_id = "x"
    assert second == JointState()


def test_constants() -> None:
    assert DiagnosticStatus.OK == b"\x00"
    assert DiagnosticStatus(level=DiagnosticStatus.ERROR).level == b"\x02"
    assert Marker.CUBE == 1
    assert ParameterType.PARAMETER_DOUBLE == 3
    assert FollowJointTrajectory.Result.GOAL_TOLERANCE_VIOLATED == -5


def test_unknown_keywords_are_refused() -> None:
    with pytest.raises(TypeError, match="dat"):
        String(dat="x")
    with pytest.raises(AttributeError):
        String().dat = "x"


def test_fields_and_types() -> None:
    assert JointState.get_fields_and_field_types() == {
        "header": "std_msgs/Header",
        "name": "sequence<string>",
        "position": "sequence<double>",
        "velocity": "sequence<double>",
        "effort": "sequence<double>",
    }
    assert "name" in JointState().__slots__


def test_equality_and_repr() -> None:
    assert String(data="a") == String(data="a") != String(data="b")
    assert String() != Header()
    assert repr(String(data="a")) == "std_msgs.msg.String(data='a')"
    assert "position=[1.0]" in repr(JointState(position=np.array([1.0])))
    with pytest.raises(TypeError):
        hash(String())


def test_messages_copy_and_pickle() -> None:
    message = JointState(name=["a"], position=[1.0])
    for twin in (copy.deepcopy(message), pickle.loads(pickle.dumps(message))):
        assert twin == message
        assert twin is not message


def test_services_and_actions() -> None:
    assert AddTwoInts.Request(a=1).a == 1
    assert type(AddTwoInts.Response()).__name__ == "AddTwoInts_Response"
    assert GripperCommand.Goal().command.max_effort == 0.0
    assert FollowJointTrajectory.Feedback().header.frame_id == ""
    with pytest.raises(NotImplementedError):
        AddTwoInts()


def test_an_unknown_name_says_what_there_is() -> None:
    with pytest.raises(ImportError):
        from std_msgs.msg import Strin  # noqa: F401
    import std_msgs.msg

    with pytest.raises(AttributeError, match=r"has no msg 'Strin'; it has: .*String"):
        _ = std_msgs.msg.Strin
    assert "String" in dir(std_msgs.msg)
