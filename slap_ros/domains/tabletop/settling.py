# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measured poses of what lies still, put where physics would have them."""

from __future__ import annotations

from collections.abc import Callable

from slap_ros.domains.tabletop.visualization import SceneOf
from slap_ros.relational import Object, State
from slap_ros.worlds.features import POSE_FEATURES, VELOCITY_FEATURES, pose_of
from slap_ros.worlds.joint_space.settling import resting_poses


def settling(scene_of: SceneOf) -> Callable[[State], State]:
    """What puts the bodies of a scene down; those that move or are held are left alone."""

    def settle(state: State) -> State:
        scene, objects = scene_of(state), state.layout.by_name
        resting = {
            i: pose_of(state, objects[body.name])
            for i, body in enumerate(scene.free)
            if _rests(state, objects[body.name])
        }
        fixed = [
            body.at(pose_of(state, objects[body.name]) if body.name in objects else body.pose)
            for body in scene.fixed
            if body.solid
        ]
        changes = {
            (objects[scene.free[i].name], feature.name): value
            for i, pose in resting_poses(resting, scene.free, fixed).items()
            for feature, value in zip(
                POSE_FEATURES, (*pose.position, *pose.quaternion), strict=True
            )
        }
        return state.replace(changes)

    return settle


def _rests(state: State, body: Object) -> bool:
    moves = any(state.get(body, feature.name) != 0.0 for feature in VELOCITY_FEATURES)
    return not moves and not state.get(body, "held") > 0.5
