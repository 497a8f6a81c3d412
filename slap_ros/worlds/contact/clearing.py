# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A measured hand that is where the planner's hand cannot be, moved to where that can be, nearby.

The planner's palm is a box, and a Panda's is bevelled: where the real one leans on a lid, the box
is inside of it. And a Panda's elbow may be a little out of its plane, so that at the end of a joint
the planner's arm cannot quite have the hand there. Such states are possible, but no plan can begin
in them. So the plan begins beside, as MoveIt's start state adapters have it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from slap_ros.geometry.minimum_translation import minimum_translation
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import ORIGIN, Pose, Vector
from slap_ros.relational import State
from slap_ros.worlds.contact.arm import arm_joints
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.snapshot import ContactIndex, ContactSnapshot
from slap_ros.worlds.contact.validation import hand_obstacles, too_deep
from slap_ros.worlds.panda import JOINT_HIGH, JOINT_LOW, grasp_pose

# The palm's lower edges reach 18 mm out of a Panda's hand, and contacts give way by a little. A
# hand that is deeper inside something is not there because of its shape.
DEEPEST = 0.02  # m
FROM_END = 1e-4  # rad, of a joint from its end
CLEAR = 1e-4  # m, between the hand and what it was moved out of
ROUNDS = 12  # in which the hand is moved out of what it is in, one thing after the other


def cleared(scene: ContactScene, state: State) -> State:
    """The state that a plan begins in where a hand was measured.

    Args:
        scene: Bodies of the scene.
        state: Measured state.

    Returns:
        The same state, unless the hand is so deep in something, or an arm so near the end of a
        joint, that no world would begin in it. Then one with the hand, its target and what it holds
        moved out of everything that the hand is in. The state is not changed where that is further
        than :data:`DEEPEST`, where there is no room, or where the arm cannot have its hand there: a
        world refuses it.
    """
    index = ContactIndex.of(scene, state.layout)
    measured = index.read(state)
    snapshot = _in_plane(measured)
    obstacles = hand_obstacles(scene, snapshot, index.placement(scene, state))
    if too_deep(snapshot.hand.boxes(), obstacles):
        way = _way_out(snapshot.hand.boxes(), obstacles)
        snapshot = (
            measured if way is None else _moved(snapshot, Pose(way).compose(snapshot.hand.pose))
        )
    return state if snapshot is measured else index.write(state, snapshot)


def _in_plane(snapshot: ContactSnapshot) -> ContactSnapshot:
    """The physics with the elbow in its plane, where the hand can be nowhere else."""
    if arm_joints(snapshot.hand.pose) is not None:
        return snapshot
    q1, q2, _, *rest = (
        min(max(q, low + FROM_END), high - FROM_END)
        for q, low, high in zip(snapshot.joints, JOINT_LOW, JOINT_HIGH, strict=True)
    )
    return _moved(snapshot, grasp_pose((q1, q2, 0.0, *rest)))


def _way_out(boxes: Sequence[OrientedBox], obstacles: Sequence[OrientedBox]) -> Vector | None:
    """The way of a hand out of everything, the deepest overlap first, m; None without a short one.

    Args:
        boxes: Boxes of the hand.
        obstacles: Boxes that it must not be inside.
    """
    way = ORIGIN
    for _ in range(ROUNDS):
        there = [box.at(Pose(way)) for box in boxes]
        shifts = (minimum_translation(box, other) for box in there for other in obstacles)
        shift = max((one for one in shifts if one is not None), key=_length, default=None)
        if shift is None:
            return way
        further = 1.0 + CLEAR / max(_length(shift), CLEAR)
        x, y, z = (w + further * s for w, s in zip(way, shift, strict=True))
        way = (x, y, z)
        if _length(way) > DEEPEST:
            break
    return None


def _moved(snapshot: ContactSnapshot, pose: Pose) -> ContactSnapshot:
    """The physics with the hand, its target and what it holds moved; as it is out of reach.

    Args:
        snapshot: Physics of the state.
        pose: Pose of the hand.
    """
    hand, joints = snapshot.hand, arm_joints(pose)
    way = tuple(p - q for p, q in zip(pose.position, hand.pose.position, strict=True))
    if joints is None or math.hypot(*way) > DEEPEST:
        return snapshot
    bodies = list(snapshot.bodies)
    if snapshot.held is not None:
        held = bodies[snapshot.held]
        there = pose.compose(hand.pose.inverse()).compose(held.pose)
        bodies[snapshot.held] = held._replace(pose=there)
    x, y, z = (t + w for t, w in zip(hand.target, way, strict=True))
    return snapshot._replace(
        joints=joints, hand=hand._replace(pose=pose, target=(x, y, z)), bodies=tuple(bodies)
    )


def _length(way: Vector) -> float:
    return math.hypot(*way)
