# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where an object is that no picture shows: where it was, unless the arm pushed it meanwhile.

How it was pushed is what the planner's model says of the command: the prediction of a filter whose
correction has to wait. Whatever is seen again is where it is seen, and what is hidden there has
made room for it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from slap_ros.core import ActionSpace, World
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose
from slap_ros.relational import Object, State
from slap_ros.worlds.features import VELOCITY_FEATURES, pose_of
from slap_ros.worlds.joint_space.scene import Body

LONGEST = 40  # steps after which what still moves is taken to be where it is
CLEAR = 0.002  # m, less a layer of which two objects are apart: measurements are no better
PUSH = 0.002  # m, by which what is hidden is moved at a time, until it has made room
FARTHEST = 0.04  # m, by which it is moved at most: less than a block's edge


@dataclass(frozen=True)
class PredictedMotion:
    """What a command does to objects, as the model has it.

    Args:
        before: State in which the command was given.
        after: State in which the model comes to rest after it.
    """

    before: State
    after: State

    @classmethod
    def of(cls, world: World, actions: ActionSpace, before: State, after: State) -> PredictedMotion:
        """Let the model come to rest: a robot measures nothing before.

        Args:
            world: Model, in the state after the command.
            actions: Actions of the model.
            before: State in which the command was given.
            after: State after the command.

        Returns:
            The motion from the command until nothing moves.
        """
        nothing = np.zeros(len(actions.axes))
        for _ in range(LONGEST):
            if not _moves(after):
                break
            after = world.step(nothing)
        return cls(before, after)

    def moved(self, obj: Object) -> Pose | None:
        """Where an object was pushed to; None for one that stays, or that the hand is to have."""
        if self.after.get(obj, "held") > 0.5:
            return None
        pose = pose_of(self.after, obj)
        return None if pose == pose_of(self.before, obj) else pose


def pushed_aside(
    state: State, bodies: Mapping[Object, Body], hidden: Collection[Object]
) -> dict[Object, Pose]:
    """Where hidden objects are that others, which are seen in their place, have pushed aside.

    Args:
        state: State in which hidden objects are where they were, or where the model has them.
        bodies: Body of each object that can move, but for the one in the hand.
        hidden: Objects that no picture shows.

    Returns:
        The poses of those that are not where the state has them: level with that, away from what
        is seen. Where there is no room within a few centimetres, there is none here.
    """
    placed = [body.at(pose_of(state, obj)) for obj, body in bodies.items() if obj not in hidden]
    moved: dict[Object, Pose] = {}
    for obj, body in bodies.items():
        if obj in hidden:
            start = pose_of(state, obj)
            pose = _aside(start, body, placed) or start
            placed.append(body.at(pose))
            moved |= {obj: pose} if pose != start else {}
    return moved


def _aside(pose: Pose, body: Body, others: Iterable[OrientedBox]) -> Pose | None:
    """The pose, pushed horizontally until the body is clear of others; None without room."""
    others = [box.shrunk(CLEAR) for box in others]
    for _ in range(round(FARTHEST / PUSH)):
        space = body.at(pose).shrunk(CLEAR)
        inside = next((box for box in others if box.overlaps(space)), None)
        if inside is None:
            return pose
        (x, y, z), (from_x, from_y, _) = pose.position, inside.pose.position
        length = math.hypot(x - from_x, y - from_y) or 1.0
        step_x, step_y = PUSH * (x - from_x) / length, PUSH * (y - from_y) / length
        pose = Pose((x + step_x, y + step_y, z), pose.quaternion)
    return None


def _moves(state: State) -> bool:
    names = [feature.name for feature in VELOCITY_FEATURES]
    return any(
        float(state.get(obj, name)) != 0.0
        for obj in state.objects
        if names[0] in obj.type.column
        for name in names
    )
