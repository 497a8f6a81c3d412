# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The scene as boxes, upright: KinDER's y is height. Lengths in m."""

from __future__ import annotations

import numpy as np

from kinder_obstruction.model import ROBOT, SURFACE, TARGET
from slap_ros.core import VisibleBody
from slap_ros.relational import Object, State

DEPTH = 0.2  # of everything, which has none
PURPLE, RED, GREY = (0.5, 0.0, 0.5, 1.0), (0.75, 0.1, 0.1, 1.0), (0.6, 0.6, 0.6, 1.0)
SHEET = 0.002  # how far the surface stands out of the table, to be seen

Rectangle = tuple[str, float, float, float, float, float, tuple[float, float, float, float]]


def visible_bodies(state: State) -> list[VisibleBody]:
    """Robot, surface and blocks."""
    rectangles: list[Rectangle] = []
    for obj in state.layout.objects:
        rectangles += _robot(state, obj) if obj.type == ROBOT else [_rectangle(state, obj)]
    return [_body(*rectangle) for rectangle in rectangles]


def _rectangle(state: State, obj: Object) -> Rectangle:
    x, y, turn, width, height = (
        float(state.get(obj, name)) for name in ("x", "y", "theta", "width", "height")
    )
    colour = PURPLE if obj.type in (TARGET, SURFACE) else RED
    return obj.name, x, y, turn, width, height + (SHEET if obj.type == SURFACE else 0.0), colour


def _robot(state: State, robot: Object) -> list[Rectangle]:
    def get(name: str) -> float:
        return float(state.get(robot, name))

    x, y, turn = get("x"), get("y"), get("theta")
    ahead, left = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])

    def part(name: str, forward: float, aside: float, size: tuple[float, float]) -> Rectangle:
        at_x, at_y = (np.array([x, y]) + forward * ahead + aside * left).tolist()
        return f"{robot.name}/{name}", at_x, at_y, turn, *size, GREY

    arm, finger = get("arm_joint"), (get("finger_width"), get("finger_height"))
    palm = (get("gripper_base_width"), get("gripper_base_height"))
    base = get("base_radius") * np.sqrt(2.0)  # the square within the circle
    return [
        part("base", 0.0, 0.0, (base, base)),
        part("arm", arm / 2, 0.0, (arm, palm[0])),
        part("palm", arm, 0.0, palm),
        part("left_finger", arm + finger[0] / 2, get("finger_gap") / 2, finger),
        part("right_finger", arm + finger[0] / 2, -get("finger_gap") / 2, finger),
    ]


def _body(
    name: str,
    x: float,
    y: float,
    turn: float,
    width: float,
    height: float,
    colour: tuple[float, float, float, float],
) -> VisibleBody:
    half = -turn / 2  # about the world's y, which points away from who looks along it
    quaternion = (0.0, float(np.sin(half)), 0.0, float(np.cos(half)))
    return VisibleBody(name, (x, 0.0, y), quaternion, (width, DEPTH, height), colour)
