# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A measured hand that is inside something by the planner's shapes, moved out of it.

The planner's palm is a box, and a Panda's is bevelled: where the real one leans on a lid, the box
is inside of it. Such a state is possible, but no plan can begin in it. So the plan begins where the
hand comes free by the shortest way, as MoveIt's start state adapters have it.
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

# The palm's lower edges reach 18 mm out of a Panda's hand, and contacts give way by a little. A
# hand that is deeper inside something is not there by its shape.
DEEPEST = 0.02  # m
CLEAR = 1e-4  # m, between the hand and what it was moved out of
ROUNDS = 12  # in which the hand is moved out of what it is in, one thing after the other


def cleared(scene: ContactScene, state: State) -> State:
    """The state that a plan begins in where a hand was measured.

    Args:
        scene: Bodies of the scene.
        state: Measured state.

    Returns:
        The same state, unless the hand is so deep in something that no world would begin in it.
        Then one with the hand, its target and what it holds moved out of everything that the hand
        is in. The state is not changed where that is further than :data:`DEEPEST`, where there is
        no room, or where the arm cannot have its hand there: a world refuses it.
    """
    index = ContactIndex.of(scene, state.layout)
    snapshot = index.read(state)
    boxes = snapshot.hand.boxes()
    obstacles = hand_obstacles(scene, snapshot, index.placement(scene, state))
    if not too_deep(boxes, obstacles):
        return state
    way = _way_out(boxes, obstacles)
    moved = None if way is None else _moved(snapshot, way)
    return state if moved is None else index.write(state, moved)


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


def _moved(snapshot: ContactSnapshot, way: Vector) -> ContactSnapshot | None:
    """The physics with the hand, its target and what it holds moved; None out of the arm's reach.

    Args:
        snapshot: Physics of the state.
        way: Translation of the hand, m.
    """
    shift, hand = Pose(way), snapshot.hand
    pose = shift.compose(hand.pose)
    joints = arm_joints(pose)
    if joints is None:
        return None
    bodies = list(snapshot.bodies)
    if snapshot.held is not None:
        held = bodies[snapshot.held]
        bodies[snapshot.held] = held._replace(pose=shift.compose(held.pose))
    return snapshot._replace(
        joints=joints,
        hand=hand._replace(pose=pose, target=shift.apply(hand.target)),
        bodies=tuple(bodies),
    )


def _length(way: Vector) -> float:
    return math.hypot(*way)
