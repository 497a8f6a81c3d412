# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a person sees: bodies, and animations."""

from __future__ import annotations

from collections.abc import Callable

from slap_ros.core import Animate, VisibleBody
from slap_ros.domains import visualization
from slap_ros.domains.tabletop.state_access import finger_of, joints_of
from slap_ros.geometry.pose import IDENTITY
from slap_ros.meshes.solid import Solid
from slap_ros.relational import State
from slap_ros.worlds.features import pose_of
from slap_ros.worlds.joint_space.scene import Body, Scene
from slap_ros.worlds.joint_space.visuals import SceneVisuals
from slap_ros.worlds.panda import CONTROL_PERIOD_S
from slap_ros.worlds.viewpoint import Viewpoint

SceneOf = Callable[[State], Scene]


def visible_bodies(scene: Scene, state: State) -> list[VisibleBody]:
    """Everything that stands around the robot."""
    return [_visible(body, state) for body in scene.bodies]


def visible_arm(state: State) -> list[VisibleBody]:
    """The arm: a box around each of its links."""
    finger = finger_of(state)
    return visualization.arm_bodies(joints_of(state).tolist(), (finger, finger))


def _visible(body: Body, state: State) -> VisibleBody:
    """A body where the state has it, or else where the scene does."""
    embodied = state.layout.by_name.get(body.name)
    position, quaternion = body.pose if embodied is None else pose_of(state, embodied)
    width, depth, height = (2.0 * half for half in body.at(IDENTITY).half)
    triangles = body.shape.corners if isinstance(body.shape, Solid) else ()
    return VisibleBody(
        body.name, position, quaternion, (width, depth, height), body.colour, triangles
    )


def animation(scene_of: SceneOf, view: Viewpoint | None = None) -> Animate:
    """What writes states, one per control step, as an animation, seen from somewhere."""
    return visualization.animation(
        lambda state: SceneVisuals(scene_of(state)), CONTROL_PERIOD_S, view
    )
