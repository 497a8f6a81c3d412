# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The state of the contact world in which a plant is: what its bodies, joints and contacts say.

Where the hand is pulled, and what its gripper was told, is no measurement: whoever commands the
plant says it.
"""

from __future__ import annotations

from slap_ros.relational import State
from slap_ros.robot.mujoco.plant import MujocoPlant
from slap_ros.robot.servoing import moving_hand
from slap_ros.robot.state_assembly import possible_joints
from slap_ros.worlds.contact.command import HandCommand
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.snapshot import ContactIndex, Opening, stopped_at_ends


def measured_state(
    scene: ContactScene, template: State, plant: MujocoPlant, command: HandCommand
) -> State:
    """The state of a plant, in motion or not.

    Args:
        scene: Bodies of the scene.
        template: State of the same objects, which has what does not change.
        plant: Plant of the same scene.
        command: What the hand was told last.
    """
    index, held = ContactIndex.of(scene, template.layout), plant.grasped()
    joints = tuple(possible_joints(plant.joints))
    hand = moving_hand(
        joints, plant.joint_velocities, plant.fingers, plant.finger_velocities, command
    )
    motions, names = plant.motions(), [body.name for body in scene.free]
    openings = plant.openings()
    measured = index.read(template)._replace(
        joints=joints,
        hand=hand,
        bodies=tuple(motions[name] for name in names),
        openings=tuple(
            Opening(*stopped_at_ends(*openings[body.name], body.joint.high))
            for body in scene.jointed
        ),
        held=None if held is None else names.index(held),
    )
    return index.write(template, measured)
