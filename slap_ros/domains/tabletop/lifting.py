# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is held, lifted off what it touches: on a robot, pushing ends on the table.

In the planner's physics, what is pushed along a table by a held block ends inside the table or
above it, and is on nothing. A robot's block ends on it, where predicates have it stand: so a plan
would first put it down, to pick it up again. Every way of the arm begins upwards, so that planning
may begin a few millimetres higher.
"""

from __future__ import annotations

from collections.abc import Callable

from slap_ros.domains.tabletop.state_access import (
    JOINT_NAMES,
    grasp_of,
    held_body,
    joints_of,
    robot_of,
)
from slap_ros.domains.tabletop.visualization import SceneOf
from slap_ros.motion import linear_motion, shifted
from slap_ros.relational import Object, State
from slap_ros.worlds.features import pose_features, pose_of
from slap_ros.worlds.panda import grasp_pose

CLEAR = 0.006  # m, over what it touches: more than predicates, and errors of height, allow for


def lifting(scene_of: SceneOf) -> Callable[[State], State]:
    """What lifts the held body of a scene; a state in which it touches nothing is left alone."""

    def lift(state: State) -> State:
        held = held_body(state)
        rise = 0.0 if held is None else _rise(scene_of, state, held)
        return state if held is None or rise <= 0.0 else _lifted(state, held, rise)

    return lift


def _rise(scene_of: SceneOf, state: State, held: Object) -> float:
    """By how much the held body has to be lifted, m, until nothing is right below it."""
    scene, objects = scene_of(state), state.layout.by_name
    body = next(body for body in scene.free if body.name == held.name)
    box = body.at(pose_of(state, held))
    others = [one.at(pose_of(state, objects[one.name])) for one in scene.free if one is not body]
    others += [
        one.at(pose_of(state, objects[one.name]) if one.name in objects else one.pose)
        for one in scene.fixed
        if one.solid
    ]
    gaps = [box.bottom - other.top for other in others if other.grown(CLEAR).overlaps(box)]
    return max((CLEAR - gap for gap in gaps if abs(gap) <= CLEAR), default=0.0)


def _lifted(state: State, held: Object, rise: float) -> State:
    """The state with the hand higher by some metres; as it is where the arm cannot go there."""
    start = joints_of(state)
    way = linear_motion(start, shifted(grasp_pose(start), (0.0, 0.0, rise)))
    if way is None:
        return state
    joints = [float(q) for q in way[-1]]
    pose = grasp_pose(joints).compose(grasp_of(state))
    robot = robot_of(state)
    changes = {(robot, name): q for name, q in zip(JOINT_NAMES, joints, strict=True)}
    placed = {(held, name): value for name, value in pose_features(pose).items()}
    return state.replace(changes | placed)
