# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The state of the contact world in which a plant stands: what its own bodies and contacts say."""

from __future__ import annotations

import math

from slap_ros.relational import State
from slap_ros.robot.mujoco.plant import MujocoPlant
from slap_ros.worlds.contact.hand import hand_at
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.snapshot import ContactIndex, Opening, stopped_at_ends
from slap_ros.worlds.panda import FINGER_CLOSED, FINGER_OPEN, grasp_pose


def measured_state(scene: ContactScene, template: State, plant: MujocoPlant) -> State:
    """The state of a plant whose arm stands: its hand is at its target.

    Args:
        scene: Bodies of the scene.
        template: State of the same objects, which has what does not change.
        plant: Plant of the same scene.
    """
    index = ContactIndex.of(scene, template.layout)
    pose, held = grasp_pose(plant.joints), plant.grasped()
    finger = min(max(0.5 * plant.gap, FINGER_CLOSED), FINGER_OPEN)
    x, y, _, _ = pose.quaternion
    hand = hand_at(pose.position, 2.0 * math.atan2(y, x), finger, plant.closing)
    motions, names = plant.motions(), [body.name for body in scene.free]
    openings = plant.openings()
    measured = index.read(template)._replace(
        joints=tuple(plant.joints),
        hand=hand._replace(pose=pose),
        bodies=tuple(motions[name] for name in names),
        openings=tuple(
            Opening(*stopped_at_ends(*openings[body.name], body.joint.high))
            for body in scene.jointed
        ),
        held=None if held is None else names.index(held),
    )
    return index.write(template, measured)
