# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The features that contact physics needs in a state, and nothing else that it remembers.

A domain's robot is a :data:`ROBOT`; the types of its free bodies begin with
:data:`~slap_ros.worlds.features.BODY_FEATURES`, those of its jointed bodies have
:data:`DRAWER_FEATURES` or :data:`LID_FEATURES`. Fixed and jointed bodies whose place differs from
task to task have :data:`~slap_ros.worlds.features.POSE_FEATURES` as well.
"""

from __future__ import annotations

from collections.abc import Mapping

from slap_ros.errors import InvalidStateError
from slap_ros.relational import Feature, Type
from slap_ros.worlds.contact.arm import arm_joints
from slap_ros.worlds.contact.hand import HandState
from slap_ros.worlds.features import JOINT_FEATURES, POSE_FEATURES, VELOCITY_FEATURES

TARGET_FEATURES = (
    *(Feature(f"target_{axis}", "m") for axis in ("x", "y", "z")),
    Feature("target_yaw", "rad"),
)
FINGER_FEATURES = (
    Feature("left_finger", "m"),
    Feature("right_finger", "m"),
    Feature("left_finger_velocity", "m/s"),
    Feature("right_finger_velocity", "m/s"),
)
GRIPPER = Feature("gripper", "1")  # what it was told last: 1 to close, -1 to open
HAND_FEATURES = (
    *POSE_FEATURES,
    *VELOCITY_FEATURES,
    *TARGET_FEATURES,
    *FINGER_FEATURES,
    GRIPPER,
)
ROBOT = Type("robot", (*JOINT_FEATURES, *HAND_FEATURES))

DRAWER_FEATURES = (Feature("opening", "m"), Feature("opening_velocity", "m/s"))
LID_FEATURES = (Feature("opening", "rad"), Feature("opening_velocity", "rad/s"))


def hand_values(hand: HandState) -> tuple[float, ...]:
    """The values of :data:`HAND_FEATURES`."""
    return (
        *hand.pose.position,
        *hand.pose.quaternion,
        *hand.velocity,
        *hand.angular_velocity,
        *hand.target,
        hand.target_yaw,
        *hand.fingers,
        *hand.finger_velocities,
        1.0 if hand.closing else -1.0,
    )


def robot_features(hand: HandState) -> Mapping[str, float]:
    """A robot's features, for ``State.build``; ``contact.hand.hand_at`` makes hands.

    Raises:
        InvalidStateError: The arm cannot have its hand there.
    """
    joints = arm_joints(hand.pose)
    if joints is None:
        raise InvalidStateError(f"the arm cannot have its hand at {hand.pose.position} m")
    values = (*joints, *hand_values(hand))
    return dict(zip((f.name for f in ROBOT.features), values, strict=True))


def opening_features(opening: float) -> Mapping[str, float]:
    """The features of a jointed body that stands, for ``State.build``: its opening, m or rad."""
    return {"opening": opening, "opening_velocity": 0.0}
