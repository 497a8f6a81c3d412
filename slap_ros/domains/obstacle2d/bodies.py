# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Obstacle 2D: what to show. The side view stands upright in the world's x-z plane."""

from __future__ import annotations

from slap_ros.core import VisibleBody
from slap_ros.domains.obstacle2d.model import BLOCK, BLOCK_SIZE, ROBOT, SURFACE
from slap_ros.relational import Object, State

THICKNESS = 0.02  # m, of surfaces
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
GREY, BLUE, RED = (0.7, 0.7, 0.7, 1.0), (0.3, 0.45, 0.75, 1.0), (0.85, 0.25, 0.2, 1.0)
WOOD, GREEN = (0.72, 0.6, 0.47, 1.0), (0.3, 0.7, 0.35, 1.0)


def visible_bodies(state: State) -> list[VisibleBody]:
    """Robot, blocks (the target block red), table and target area."""

    def square(obj: Object, colour: tuple[float, float, float, float]) -> VisibleBody:
        x, y = state[obj][:2].tolist()
        return VisibleBody(obj.name, (x, 0.0, y), UPRIGHT, (BLOCK_SIZE,) * 3, colour)

    blocks = state.layout.of_type(BLOCK)
    shown = [square(robot, GREY) for robot in state.layout.of_type(ROBOT)]
    shown += [square(block, RED if block == blocks[0] else BLUE) for block in blocks]
    for surface in state.layout.of_type(SURFACE):
        x, width, is_target = state[surface].tolist()
        below = -BLOCK_SIZE / 2 - THICKNESS / 2 + (THICKNESS / 4 if is_target else 0.0)
        size = (width, BLOCK_SIZE, THICKNESS)
        colour = GREEN if is_target else WOOD
        shown.append(VisibleBody(surface.name, (x, 0.0, below), UPRIGHT, size, colour))
    return shown
