# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A bench to try contact on: cube, rod, two drawers, a lid, a plate with a hole; and scripts."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from slap_ros.geometry.pose import Pose, Vector, from_rotation_vector
from slap_ros.relational import Object, State, Type
from slap_ros.worlds.contact.features import (
    DRAWER_FEATURES,
    LID_FEATURES,
    ROBOT,
    opening_features,
    robot_features,
)
from slap_ros.worlds.contact.hand import HandState, hand_at
from slap_ros.worlds.contact.scene import (
    TABLE,
    BoxPart,
    Compound,
    ContactScene,
    Joint,
    JointedBody,
    JointKind,
    box,
    cylinder,
)
from slap_ros.worlds.contact.world import MAX_SHIFT, MAX_TURN, ContactWorld
from slap_ros.worlds.features import BODY_FEATURES, body_features

THING = Type("thing", BODY_FEATURES)
DRAWER = Type("drawer", DRAWER_FEATURES)
LID = Type("lid", LID_FEATURES)

CUBE = box("cube", (0.02, 0.02, 0.02), mass_kg=0.1)
ROD = cylinder("rod", 0.012, 0.15, mass_kg=0.15)
LYING = from_rotation_vector((0.0, 0.5 * math.pi, 0.0))  # a rod along the base's x
TRAVEL = 0.16  # m, of a drawer


def drawer(name: str, pose: Pose) -> JointedBody:
    """A cabinet, open towards -x, and a drawer with a bar handle that stands on two posts."""
    wall, wide, deep, high = 0.003, 0.09, 0.11, 0.03  # m, halves
    frame = (
        BoxPart((deep, wide, wall), Pose((0.0, 0.0, high))),
        BoxPart((deep, wide, wall), Pose((0.0, 0.0, -high))),
        BoxPart((deep, wall, high), Pose((0.0, wide, 0.0))),
        BoxPart((deep, wall, high), Pose((0.0, -wide, 0.0))),
        BoxPart((wall, wide, high), Pose((deep, 0.0, 0.0))),
    )
    inner, length, sides, thick = 0.078, 0.098, 0.018, 0.004
    moving = (
        BoxPart((length, inner, thick), Pose((0.0, 0.0, -sides))),
        BoxPart((length, thick, sides), Pose((0.0, inner, 0.0))),
        BoxPart((length, thick, sides), Pose((0.0, -inner, 0.0))),
        BoxPart((thick, inner, sides), Pose((length, 0.0, 0.0))),
        BoxPart((thick, inner, 0.024), Pose((-length, 0.0, 0.0))),
        BoxPart((0.007, 0.04, 0.007), Pose((-length - 0.092, 0.0, 0.0))),
        BoxPart((0.044, 0.005, 0.005), Pose((-length - 0.046, 0.035, 0.0))),
        BoxPart((0.044, 0.005, 0.005), Pose((-length - 0.046, -0.035, 0.0))),
    )
    joint = Joint(JointKind.SLIDE, (-1.0, 0.0, 0.0), TRAVEL, damping=5.0, dry_friction=2.0)
    return JointedBody(name, frame, moving, joint, mass_kg=0.6, pose=pose)


def lid(name: str, pose: Pose) -> JointedBody:
    """A box with a lid that turns about its far edge; open when it leans back."""
    frame = (BoxPart((0.03, 0.03, 0.02)),)
    moving = (BoxPart((0.035, 0.035, 0.004), Pose((-0.035, 0.0, 0.0))),)
    joint = Joint(
        JointKind.TURN,
        (0.0, 1.0, 0.0),
        2.0,
        mount=Pose((0.035, 0.0, 0.026)),
        damping=0.02,
        dry_friction=0.02,
    )
    return JointedBody(name, frame, moving, joint, mass_kg=0.1, pose=pose)


def holed_plate(half_hole_m: float, x: float = 0.66, z: float = 0.2) -> Compound:
    """An upright plate with a square hole along x."""
    side = 0.05  # m, half the width of what is around the hole
    far, long = half_hole_m + side, 2.0 * side + half_hole_m
    parts = (
        BoxPart((0.03, long, side), Pose((0.0, 0.0, far))),
        BoxPart((0.03, long, side), Pose((0.0, 0.0, -far))),
        BoxPart((0.03, side, half_hole_m), Pose((0.0, far, 0.0))),
        BoxPart((0.03, side, half_hole_m), Pose((0.0, -far, 0.0))),
    )
    return Compound("plate", parts, friction=0.5, pose=Pose((x, 0.0, z)))


LEFT_DRAWER = drawer("left", Pose((0.72, 0.25, 0.034)))
RIGHT_DRAWER = drawer("right", Pose((0.72, -0.25, 0.034)))
HANDLE_AT = (0.72 - 0.19, 0.25, 0.034)  # m, the left drawer's while it is closed
THE_LID = lid("lid", Pose((0.72, 0.0, 0.021)))
BENCH = ContactScene((TABLE, CUBE, ROD, LEFT_DRAWER, RIGHT_DRAWER, THE_LID))
LOOSE = ContactScene((TABLE, CUBE, ROD))  # without anything jointed


HAND = hand_at((0.5, 0.0, 0.2))
CUBE_AT = Pose((0.45, 0.1, 0.02))
ROD_AT = Pose((0.5, -0.12, 0.012), LYING)


@dataclass(frozen=True)
class Setting:
    """Where things are at the beginning."""

    hand: HandState = HAND
    cube: Pose = CUBE_AT
    rod: Pose = ROD_AT
    openings: tuple[float, ...] = (0.0, 0.0, 1.2)  # of left, right and lid


AS_USUAL = Setting()


def start(setting: Setting = AS_USUAL, scene: ContactScene = BENCH) -> State:
    """A state of a scene with cube, rod and, if it has them, drawers and lid."""
    features: dict[Object, Mapping[str, float]] = {ROBOT("robot"): robot_features(setting.hand)}
    poses = {"cube": setting.cube, "rod": setting.rod}
    for body in scene.free:
        features[THING(body.name)] = body_features(*poses[body.name])
    for jointed, opening in zip(scene.jointed, setting.openings, strict=False):
        kind = DRAWER if jointed.joint.kind is JointKind.SLIDE else LID
        features[kind(jointed.name)] = opening_features(opening)
    return State.build(features)


def lying_above(name: str, height: float) -> Vector:
    """So high above where a thing of the bench lies at the beginning, m."""
    x, y, z = {"cube": CUBE_AT, "rod": ROD_AT}[name].position
    return (x, y, z + height)


def hand_of(state: State) -> np.ndarray:
    """The hand's position."""
    return position(state, "robot")


def position(state: State, name: str) -> np.ndarray:
    """An object's position, m."""
    obj = state.layout.object(name)
    return np.array([float(state.get(obj, axis)) for axis in ("x", "y", "z")])


def value(state: State, name: str, feature: str) -> float:
    """One feature of an object."""
    return float(state.get(state.layout.object(name), feature))


@dataclass(frozen=True)
class Move:
    """Go to a place in so many steps, with the gripper open or closed."""

    to: Vector
    steps: int
    close: bool = False
    yaw: float = 0.0
    fastest: float = MAX_SHIFT  # m a step


def action_towards(state: State, move: Move) -> np.ndarray:
    """The action of one step of a move."""
    robot = state.layout.object("robot")
    target = [float(state.get(robot, f"target_{axis}")) for axis in ("x", "y", "z")]
    shift = np.clip(np.array(move.to) - target, -move.fastest, move.fastest)
    turn = np.clip(move.yaw - float(state.get(robot, "target_yaw")), -MAX_TURN, MAX_TURN)
    return np.array([*shift, turn, 1.0 if move.close else -1.0])


def perform(
    world: ContactWorld, moves: list[Move], watch: Callable[[State], None] = lambda _: None
) -> State:
    """Carry moves out, one after the other."""
    for move in moves:
        for _ in range(move.steps):
            watch(world.step(action_towards(world.state, move)))
    return world.state
