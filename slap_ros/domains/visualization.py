# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What domains with a Panda show alike: the arm, and animations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from slap_ros.core import Animate, PictureSize, VisibleBody
from slap_ros.geometry.pose import IDENTITY
from slap_ros.motion.arm_shapes import ARM_SHAPES, BASE
from slap_ros.relational import State
from slap_ros.worlds.panda import LINKS, link_poses
from slap_ros.worlds.viewpoint import Viewpoint
from slap_ros.worlds.visuals import Visuals

METAL = (0.88, 0.9, 0.92, 1.0)  # of the arm


def arm_bodies(joints: Sequence[float], fingers: tuple[float, float]) -> list[VisibleBody]:
    """The arm: a box around each of its links.

    Args:
        joints: Positions of the seven joints, rad.
        fingers: Distances of the left and the right finger from the middle, m.

    Returns:
        One for each link, named after it.
    """
    links = dict(zip(LINKS, link_poses(joints, *fingers), strict=True))
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


def animation(
    visuals_of: Callable[[State], Visuals], period_s: float, view: Viewpoint | None = None
) -> Animate:
    """The function that writes states as an animation.

    Args:
        visuals_of: Function from the first of the states to what there is to see.
        period_s: Duration of a control step, s.
        view: Viewpoint of the animation.

    Returns:
        The function that writes it, one frame per control step.
    """

    def animate(
        path: Path,
        states: Sequence[State],
        size: PictureSize | None,
        progress: Callable[[int], None],
    ) -> None:
        from slap_ros.worlds.rendering import Camera, write_animation  # only here are they needed

        seen_from = view or Viewpoint()
        if size is not None:
            seen_from = replace(seen_from, width=size.width, height=size.height)
        with Camera(visuals_of(states[0]), seen_from) as camera:
            write_animation(path, camera, states, period_s, progress)

    return animate
