# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Features that states of all worlds have: joints of the arm, poses and velocities of bodies."""

from __future__ import annotations

from collections.abc import Mapping

from slap_ros.geometry.pose import NO_ROTATION, ORIGIN, Pose, Vector
from slap_ros.relational import Column, Feature, Object, State
from slap_ros.worlds.panda import JOINTS

POSE_FEATURES = (
    *(Feature(axis, "m") for axis in ("x", "y", "z")),
    *(Feature(f"q{axis}", "1") for axis in ("x", "y", "z", "w")),
)
POSE_NAMES = tuple(feature.name for feature in POSE_FEATURES)
VELOCITY_FEATURES = (
    *(Feature(f"v{axis}", "m/s") for axis in ("x", "y", "z")),
    *(Feature(f"w{axis}", "rad/s") for axis in ("x", "y", "z")),
)
BODY_FEATURES = (*POSE_FEATURES, *VELOCITY_FEATURES, Feature("held", "1"))

JOINT_FEATURES = tuple(Feature(f"joint{i + 1}", "rad") for i in range(JOINTS))


def pose_of(state: State, obj: Object) -> Pose:
    """Where an object is, in the base's frame.

    Args:
        state: A single state.
        obj: Object of the state, with :data:`POSE_FEATURES`.
    """
    x, y, z, qx, qy, qz, qw = state.gather(Column.of(obj), POSE_NAMES)[0].tolist()
    return Pose((x, y, z), (qx, qy, qz, qw))


def pose_features(pose: Pose) -> Mapping[str, float]:
    """A body's pose as features, for ``State.build`` or ``State.replace``."""
    values = (*pose.position, *pose.quaternion)
    return dict(zip(POSE_NAMES, values, strict=True))


def body_features(
    position: Vector,
    quaternion: tuple[float, float, float, float] = NO_ROTATION,
    velocity: Vector = ORIGIN,
    angular_velocity: Vector = ORIGIN,
    held: bool = False,
) -> Mapping[str, float]:
    """A free body's features, for ``State.build``, all in the base's frame.

    Args:
        position: Position, m.
        quaternion: Orientation as a unit quaternion, x y z w.
        velocity: Velocity, m/s.
        angular_velocity: Angular velocity, rad/s.
        held: Whether the body is in the hand.

    Returns:
        A value for each of :data:`BODY_FEATURES`, by name.
    """
    values = (*position, *quaternion, *velocity, *angular_velocity, float(held))
    return dict(zip((f.name for f in BODY_FEATURES), values, strict=True))
