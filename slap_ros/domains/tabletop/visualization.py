# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a person sees: bodies, and animations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from slap_ros.core import Animate, VisibleBody
from slap_ros.domains.tabletop.state_access import finger_of, joints_of, pose_of
from slap_ros.geometry.pose import IDENTITY
from slap_ros.meshes.solid import Solid
from slap_ros.motion.arm_shapes import ARM_SHAPES, BASE
from slap_ros.physics.panda import LINKS, link_poses
from slap_ros.physics.scene import Body, Scene
from slap_ros.physics.viewpoint import Viewpoint
from slap_ros.relational import State

METAL = (0.88, 0.9, 0.92, 1.0)  # of the arm

SceneOf = Callable[[State], Scene]


def visible_bodies(scene: Scene, state: State) -> list[VisibleBody]:
    """Everything that stands around the robot."""
    return [_visible(body, state) for body in scene.bodies]


def visible_arm(state: State) -> list[VisibleBody]:
    """The arm: a box around each of its links."""
    links = dict(zip(LINKS, link_poses(joints_of(state), finger_of(state)), strict=True))
    shapes = [
        ("base", IDENTITY.compose(BASE.pose), BASE.half),
        *(
            (
                shape.link,
                links[shape.link].compose(shape.box.pose),
                tuple(half + shape.radius for half in shape.box.half),
            )
            for shape in ARM_SHAPES
        ),
    ]
    return [
        VisibleBody(f"panda_{name}", *pose, (2.0 * x, 2.0 * y, 2.0 * z), METAL)
        for name, pose, (x, y, z) in shapes
    ]


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
    """What writes states, one a control step, as an animation, seen from somewhere."""

    def animate(path: Path, states: Sequence[State], progress: Callable[[int], None]) -> None:
        from slap_ros.physics.rendering import Camera, write_animation  # only here are they needed

        with Camera(scene_of(states[0]), view) as camera:
            write_animation(path, camera, states, progress)

    return animate
