# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot in MuJoCo at a bench, commanded in each control period while it moves.

Nothing waits for the arm to arrive, for the fingers to close, or for anything to come to rest: the
next state is what is measured when the control period is over. It is for the domains of the contact
world, whose skills act on velocities and contacts; ``closed_loop`` is for the others. One process,
without ROS, and time is the plant's. A state is what can be measured, so a step is not a function
of it: use it to execute plans, not to plan.
"""

from __future__ import annotations

from collections.abc import Iterable

from slap_ros.core import Action, Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.relational import GroundAtom, State
from slap_ros.robot.measured_world import MeasuredWorld
from slap_ros.robot.mujoco.arm import JOINT_POSITIONS, PERIOD_S, ArmControl
from slap_ros.robot.mujoco.contact_state import measured_state
from slap_ros.robot.mujoco.model import compiled, scene_around, scene_spec
from slap_ros.robot.mujoco.plant import MujocoPlant
from slap_ros.robot.mujoco.plant_controllers import REACH, UNCHECKED, PlantControllers
from slap_ros.robot.servoing import HandServo
from slap_ros.worlds.contact.arm import CONTROL_PERIOD_S
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.contact.snapshot import ContactIndex

PERIODS = round(CONTROL_PERIOD_S / PERIOD_S)  # of the plant in a control period


class ContactLoopWorld(MeasuredWorld):
    """A world of a hand that acts by forces, whose states are measured on a plant of its own.

    Args:
        domain: Domain of the contact world.
        initial: State of a task, in which the plant begins.
        control: How the arm goes to joint positions.

    Raises:
        InvalidSceneError: MuJoCo cannot express the scene.
        InvalidParameterError: It is a domain of another world.
    """

    def __init__(
        self, domain: Domain, initial: State, control: ArmControl = JOINT_POSITIONS
    ) -> None:
        scene = scene_around(domain, initial)
        if not isinstance(scene, ContactScene):
            raise InvalidParameterError(
                f"the hand of {domain.name} has no forces: its robot in MuJoCo is ClosedLoopWorld"
            )
        self._scene = scene
        self._servo = HandServo(ContactIndex.of(scene, initial.layout), initial, REACH)
        self.plant = MujocoPlant(
            compiled(scene_spec(scene, initial, control)), scene, initial, control
        )
        self._controllers = PlantControllers(self.plant, UNCHECKED, scene.hand.grip_n)
        self._state = self._measured(initial)

    def step(self, action: Action) -> State:
        """Act for one control period, and measure.

        Raises:
            InvalidCommandError: The action is not in the action space; nothing moved.
        """
        command = self._servo.act(self._state, action)
        if (gap := command.gripper.gap) is not None:
            self._controllers.command_fingers(gap)
        self._controllers.replace_motion(command.points)
        for _ in range(PERIODS):
            self._controllers.pass_period()
        self._state = self._measured(self._state)
        return self._state

    def require_seen(self, goal: Iterable[GroundAtom]) -> None:
        """Take every goal: poses are exact, and nothing is hidden."""

    def close(self) -> None:
        """Do nothing: the plant is released with the world."""

    def _measured(self, template: State) -> State:
        return measured_state(self._scene, template, self.plant, self._servo.command)
