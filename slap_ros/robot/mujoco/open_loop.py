# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded motion played by the robot in MuJoCo without looking, as LG-SAIL's robot does (§5.5).

The arm goes from one recorded configuration to the next, each from rest to rest, and the fingers
close and open where the recording says so. What came of it is measured once, at the end. For the
domains of the contact world, whose states no robot can measure on the way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from slap_ros.errors import InvalidParameterError
from slap_ros.geometry.pose import Vector, conjugate, dot, rotate
from slap_ros.relational import State
from slap_ros.robot.dry_run import DryRun
from slap_ros.robot.gripper import GAP_OPEN, GAP_SHUT, GripperAction
from slap_ros.robot.limits import PANDA, Limits
from slap_ros.robot.mujoco.contact_state import measured_state
from slap_ros.robot.mujoco.model import compiled, scene_around, scene_spec
from slap_ros.robot.mujoco.plant import PERIOD_S, MujocoPlant
from slap_ros.robot.mujoco.plant_controllers import REACH, TOLERANCES, PlantControllers
from slap_ros.robot.recorded_motion import RecordedMotion, RecordedWaypoint
from slap_ros.worlds.contact.command import HandCommand
from slap_ros.worlds.contact.features import ROBOT
from slap_ros.worlds.contact.scene import ContactScene
from slap_ros.worlds.features import pose_of
from slap_ros.worlds.panda import grasp_pose

COMING_TO_REST_S = 1.0  # at the end, for what was let go
X: Vector = (1.0, 0.0, 0.0)


@dataclass(frozen=True)
class GraspDeviation:
    """How something lies in the hand, beside how it lies there in the recording.

    Args:
        thing: Name of what the recording's hand holds.
        step: Step of the recording.
        closed: Whether the fingers have just closed; else they are about to open.
        shift_m: Distance between both places in the hand, m.
        turn_rad: Angle between both directions of its x axis, which is that of what is round, rad.
        askew_rad: Angle in the recording from the hand's x axis, along which its pads are wide, to
            the nearest axis of the thing, rad.
    """

    thing: str
    step: int
    closed: bool
    shift_m: float
    turn_rad: float
    askew_rad: float


class OpenLoopPlayer:
    """Plays a recorded motion on a plant of its own, with the forces of the domain's hand.

    Args:
        recorded: Motion in a domain of the contact world.
        limits: Limits of the arm; without any, those of a Panda at half its speed.

    Raises:
        InvalidSceneError: MuJoCo cannot express the scene.
        InvalidParameterError: It is a domain of another world.
    """

    def __init__(self, recorded: RecordedMotion, limits: Limits | None = None) -> None:
        self._recorded = recorded
        self._limits = recorded.limits_of(limits or PANDA.scaled(0.5, REACH))
        initial = recorded.states[0]
        scene = scene_around(recorded.domain, initial)
        if not isinstance(scene, ContactScene):
            raise InvalidParameterError(f"the hand of {recorded.domain.name} has no forces")
        self._scene = scene
        self.plant = MujocoPlant(compiled(scene_spec(scene, initial)), scene, initial)
        self._controllers = PlantControllers(self.plant, TOLERANCES, scene.hand.grip_n)
        self.grasps: list[GraspDeviation] = []  # so far

    def play(self) -> State:
        """Play the motion to its end; the state that is measured then.

        Raises:
            UnsafeCommandError: The motion goes beyond the limits; nothing moved.
            ControllerAbortedError: The arm is held up, or the fingers closed around nothing; the
                robot then holds.
            ControllerTimeoutError: The fingers do not come to rest.
        """
        checked = DryRun.of(self._recorded, self._limits)
        checked.require_safe()
        for waypoint, motion in zip(self._recorded.waypoints, checked.motions, strict=True):
            self._act(waypoint)
            self._controllers.move(motion)
        for _ in range(round(COMING_TO_REST_S / PERIOD_S)):
            self._controllers.pass_period()
        command = HandCommand.to_stay(grasp_pose(self.plant.joints), self.plant.closing)
        return measured_state(self._scene, self._recorded.states[0], self.plant, command)

    def _act(self, waypoint: RecordedWaypoint) -> None:
        """Close or open the fingers before a waypoint, where the arm still stands."""
        step = waypoint.step - 1
        if waypoint.gripper is GripperAction.CLOSE:
            self._controllers.move_fingers(GAP_SHUT)
            waypoint.require_grasp(self.plant.gap)
            self._note(step, closed=True)
        elif waypoint.gripper is GripperAction.OPEN:
            self._note(step, closed=False)
            self._controllers.move_fingers(GAP_OPEN)

    def _note(self, step: int, closed: bool) -> None:
        """Note how what the recording holds lies in the hand."""
        state, hand = self._recorded.states[step], grasp_pose(self.plant.joints)
        (robot,) = state.layout.of_type(ROBOT)
        for name, motion in self.plant.motions().items():
            thing = state.layout.object(name)
            if state.get(thing, "held") > 0.5:
                here = hand.inverse().compose(motion.pose)
                there = pose_of(state, robot).inverse().compose(pose_of(state, thing))
                self.grasps.append(
                    GraspDeviation(
                        name,
                        step,
                        closed,
                        math.dist(here.position, there.position),
                        _angle(rotate(here.quaternion, X), rotate(there.quaternion, X)),
                        math.acos(min(1.0, max(map(abs, rotate(conjugate(there.quaternion), X))))),
                    )
                )


def _angle(first: Vector, second: Vector) -> float:
    """The angle between two unit vectors, rad."""
    return math.acos(min(1.0, max(-1.0, dot(first, second))))
