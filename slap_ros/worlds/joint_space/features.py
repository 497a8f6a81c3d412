# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The features that joint-space physics needs in a state; it keeps no other state between steps.

A domain's robot is a :data:`ROBOT`; the types of its free bodies begin with
:data:`~slap_ros.worlds.features.BODY_FEATURES`, as in ``Type("block", BODY_FEATURES)``; fixed
bodies whose place differs from task to task begin with
:data:`~slap_ros.worlds.features.POSE_FEATURES`. Free bodies whose mass or friction differs from
task to task have :data:`MATERIAL_FEATURES` as well; the scene's numbers then only are defaults.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from slap_ros.geometry.pose import IDENTITY, Pose
from slap_ros.relational import Feature, Type
from slap_ros.worlds.bodies import Material
from slap_ros.worlds.features import JOINT_FEATURES, POSE_FEATURES
from slap_ros.worlds.joint_space.scene import CUBE_MATERIAL
from slap_ros.worlds.panda import FINGER_OPEN

MATERIAL_FEATURES = (Feature("mass", "kg"), Feature("friction", "1"))
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


def material_features(material: Material = CUBE_MATERIAL) -> Mapping[str, float]:
    """What a free body is made of, for ``State.build``."""
    return dict(zip((f.name for f in MATERIAL_FEATURES), material, strict=True))
