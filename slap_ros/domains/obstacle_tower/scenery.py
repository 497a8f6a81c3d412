# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle Tower: what stands around the robot, as bodies for the physics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from slap_ros.domains.domain import VisibleBody
from slap_ros.domains.obstacle_tower.model import BLOCK, SURFACE
from slap_ros.physics.scene import TABLE, Box, Colour, Scene, cube
from slap_ros.relational import State

RED: Colour = (0.85, 0.25, 0.2, 1.0)
BLUE: Colour = (0.3, 0.45, 0.75, 1.0)
GREEN: Colour = (0.3, 0.7, 0.35, 1.0)


def scene_of(state: State) -> Scene:
    """The bodies of a state: the table, plates for the targets, cubes; the target block is red."""
    bodies = [TABLE]
    for surface in state.layout.of_type(SURFACE):
        if state.get(surface, "is_target") > 0.5:
            x, y, z = (float(state.get(surface, f"half_{axis}")) for axis in ("x", "y", "z"))
            bodies.append(Box(surface.name, (x, y, z), colour=GREEN, solid=False))
    for number, block in enumerate(state.layout.of_type(BLOCK)):
        bodies.append(cube(block.name, BLUE if number else RED))
    return Scene(tuple(bodies))


def visible_bodies(state: State) -> list[VisibleBody]:
    """Everything that stands around the robot."""
    boxes = {box.name: box for box in scene_of(state).bodies}
    shown = []
    for name, box in boxes.items():
        x, y, z, qx, qy, qz, qw = state[state.layout.object(name)][:7].tolist()
        width, depth, height = (2.0 * half for half in box.half_extents_m)
        shown.append(
            VisibleBody(name, (x, y, z), (qx, qy, qz, qw), (width, depth, height), box.colour)
        )
    return shown


def animate(path: Path, states: Sequence[State], progress: Callable[[int], None]) -> None:
    """Write states, one a control step, as an animation; ``progress`` is told the frames done."""
    from slap_ros.physics.rendering import Camera, write_animation  # only here are they needed

    with Camera(scene_of(states[0])) as camera:
        write_animation(path, camera, states, progress)
