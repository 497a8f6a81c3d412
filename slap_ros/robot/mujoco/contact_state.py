# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The state of the contact world in which a plant is: what its bodies, joints and contacts say.

Where the hand is pulled, and what its gripper was told, is no measurement: whoever commands the
plant says it.
"""

from __future__ import annotations

import operator

from slap_ros.relational import State
from slap_ros.robot.mujoco.plant import MujocoPlant
from slap_ros.worlds.contact.command import HandCommand
from slap_ros.worlds.contact.hand import HandState
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.snapshot import ContactIndex
from slap_ros.worlds.panda import GraspKinematics


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
    motions, names = plant.motions(), [body.name for body in scene.free]
    measured = index.read(template)._replace(
        joints=tuple(plant.joints),
        hand=_hand(plant, command),
        bodies=tuple(motions[name] for name in names),
        held=None if held is None else names.index(held),
    )
    return index.write(template, measured)


def _hand(plant: MujocoPlant, command: HandCommand) -> HandState:
    """The hand as the joints have it, and where it was told to be."""
    kinematics, rates = GraspKinematics(plant.joints), plant.joint_velocities
    rows = kinematics.jacobian().tolist()
    vx, vy, vz, wx, wy, wz = (sum(map(operator.mul, row, rates)) for row in rows)
    return HandState(
        kinematics.grasp,
        (vx, vy, vz),
        (wx, wy, wz),
        command.target,
        command.target_yaw,
        plant.fingers,
        plant.finger_velocities,
        command.closing,
    )
