# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The features that physics needs in a state; it keeps no other state between steps.

A domain's robot is a :data:`ROBOT`; the types of its free bodies begin with
:data:`BODY_FEATURES`, as in ``Type("block", BODY_FEATURES)``; fixed bodies whose place differs
from task to task begin with :data:`POSE_FEATURES`. Free bodies whose mass or friction differs from
task to task have :data:`MATERIAL_FEATURES` as well; the scene's numbers then only are defaults.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from slap_ros.geometry.pose import IDENTITY, NO_ROTATION, ORIGIN, Pose, Vector
from slap_ros.relational import Feature, Type
from slap_ros.worlds.panda import FINGER_OPEN, JOINTS
from slap_ros.worlds.scene import CUBE_MATERIAL, Material

POSE_FEATURES = (
    *(Feature(axis, "m") for axis in ("x", "y", "z")),
    *(Feature(f"q{axis}", "1") for axis in ("x", "y", "z", "w")),
)
VELOCITY_FEATURES = (
    *(Feature(f"v{axis}", "m/s") for axis in ("x", "y", "z")),
    *(Feature(f"w{axis}", "rad/s") for axis in ("x", "y", "z")),
)
MATERIAL_FEATURES = (Feature("mass", "kg"), Feature("friction", "1"))
BODY_FEATURES = (*POSE_FEATURES, *VELOCITY_FEATURES, Feature("held", "1"))

JOINT_FEATURES = tuple(Feature(f"joint{i + 1}", "rad") for i in range(JOINTS))
# The held body's pose in the hand's frame; no turn at the origin while nothing is held.
GRASP_FEATURES = tuple(Feature(f"grasp_{f.name}", f.unit) for f in POSE_FEATURES)
ROBOT = Type("robot", (*JOINT_FEATURES, Feature("finger", "m"), *GRASP_FEATURES))


def robot_features(
    joints: Sequence[float], finger: float = FINGER_OPEN, grasp: Pose = IDENTITY
) -> Mapping[str, float]:
    """A robot's features, for ``State.build``.

    Args:
        joints: Joint positions, rad.
        finger: Distance of each finger from the middle, m.
        grasp: The held body's pose in the hand's frame.

    Returns:
        A value for each feature of :data:`ROBOT`, by name.
    """
    values = (*joints, finger, *grasp.position, *grasp.quaternion)
    return dict(zip((f.name for f in ROBOT.features), values, strict=True))


def pose_features(pose: Pose) -> Mapping[str, float]:
    """A fixed body's features, for ``State.build``."""
    values = (*pose.position, *pose.quaternion)
    return dict(zip((f.name for f in POSE_FEATURES), values, strict=True))


def body_features(
    position: Vector,
    quaternion: tuple[float, float, float, float] = NO_ROTATION,
    velocity: Vector = ORIGIN,
    angular_velocity: Vector = ORIGIN,
    held: bool = False,
) -> Mapping[str, float]:
    """A free body's features, for ``State.build``, all in the base's frame.

    Args:
        position: m.
        quaternion: x y z w, of length 1.
        velocity: m/s.
        angular_velocity: rad/s.
        held: Whether it is in the hand.

    Returns:
        A value for each of :data:`BODY_FEATURES`, by name.
    """
    values = (*position, *quaternion, *velocity, *angular_velocity, float(held))
    return dict(zip((f.name for f in BODY_FEATURES), values, strict=True))


def material_features(material: Material = CUBE_MATERIAL) -> Mapping[str, float]:
    """What a free body is made of, for ``State.build``."""
    return dict(zip((f.name for f in MATERIAL_FEATURES), material, strict=True))
