# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a plant begins with: bodies, joints and fingers of a state, of either world with a Panda."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from slap_ros.geometry.pose import Pose
from slap_ros.relational import State
from slap_ros.worlds.bodies import Material, RigidBody
from slap_ros.worlds.contact.scene import ContactScene, JointedBody
from slap_ros.worlds.contact.snapshot import ContactIndex
from slap_ros.worlds.joint_space.scene import Scene
from slap_ros.worlds.joint_space.snapshot import SceneIndex

PandaScene = Scene | ContactScene


class PlacedBody(NamedTuple):
    """A body of a scene, where a state has it, and what it is made of there."""

    body: RigidBody
    pose: Pose  # in the base's frame
    material: Material  # without mass where it does not move


class PlacedJointedBody(NamedTuple):
    """A jointed body of a scene, where a state has it and how far open."""

    body: JointedBody
    pose: Pose  # in the base's frame
    opening: float  # m or rad


@dataclass(frozen=True)
class PlacedScene:
    """Bodies around a Panda, and how its arm and its fingers are.

    Args:
        bodies: Bodies of the scene: fixed ones, then those that move.
        joints: Joint positions of the arm, rad.
        fingers: Distance of the left and of the right finger from the middle, m.
        closing: Whether the fingers press on something, or are about to.
        jointed: Bodies of which a part slides or turns.
    """

    bodies: tuple[PlacedBody, ...]
    joints: tuple[float, ...]
    fingers: tuple[float, float]
    closing: bool
    jointed: tuple[PlacedJointedBody, ...] = ()

    @classmethod
    def of(cls, scene: PandaScene, state: State) -> PlacedScene:
        """A scene as a state has it.

        Raises:
            InvalidStateError: The state does not have the scene's bodies.
        """
        if isinstance(scene, ContactScene):
            return cls._of_forces(scene, state)
        index = SceneIndex.of(scene, state.layout)
        snapshot, materials = index.read(state), index.materials(scene, state)
        fixed = index.fixed_poses(scene.fixed, state)
        free = [motion.pose for motion in snapshot.bodies]
        return cls(
            (*_fixed(scene, fixed), *map(PlacedBody, scene.free, free, materials)),
            snapshot.joints,
            (snapshot.finger, snapshot.finger),
            snapshot.held is not None,
        )

    @classmethod
    def _of_forces(cls, scene: ContactScene, state: State) -> PlacedScene:
        index = ContactIndex.of(scene, state.layout)
        snapshot, placement = index.read(state), index.placement(scene, state)
        free = [motion.pose for motion in snapshot.bodies]
        materials = [body.material for body in scene.free]
        openings = [opening.position for opening in snapshot.openings]
        return cls(
            (*_fixed(scene, placement.fixed), *map(PlacedBody, scene.free, free, materials)),
            snapshot.joints,
            snapshot.hand.fingers,
            snapshot.hand.closing,
            tuple(map(PlacedJointedBody, scene.jointed, placement.jointed, openings)),
        )


def _fixed(scene: PandaScene, poses: tuple[Pose, ...]) -> Iterator[PlacedBody]:
    for body, pose in zip(scene.fixed, poses, strict=True):
        yield PlacedBody(body, pose, body.material)
