# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state made of measurements, with objects where physics would have them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import IDENTITY, ORIGIN, Pose
from slap_ros.relational import Feature, Object, State
from slap_ros.robot.joint_reading import JointReading
from slap_ros.robot.tracking import PoseEstimate
from slap_ros.worlds.features import JOINT_FEATURES, POSE_FEATURES, VELOCITY_FEATURES, pose_of
from slap_ros.worlds.joint_space.arm import Arm, Obstacle, Surroundings
from slap_ros.worlds.joint_space.features import GRASP_FEATURES, ROBOT
from slap_ros.worlds.joint_space.raising import Configuration, off_fixed_bodies
from slap_ros.worlds.joint_space.scene import Scene
from slap_ros.worlds.joint_space.settling import resting_poses
from slap_ros.worlds.panda import FINGER_OPEN, JOINT_HIGH, JOINT_LOW, hand_pose

BEYOND_LIMIT = 0.02  # rad, by which a joint at its limit may be measured beyond it
# m, by which the arm may be measured deeper in a fixed body than the model has it: its hand is not
# the model's box, and what is pressed upon gives way.
TOO_DEEP = 0.003

Changes = dict[tuple[Object, str], float]


@dataclass(frozen=True)
class Grasp:
    """What the hand holds."""

    obj: Object
    pose: Pose  # in the hand's frame
    finger: float  # m, of each from the middle, as the model has it
    width: float = 0.0  # m, between the fingers where the object is narrowest


class StateAssembler:
    """Puts measurements into the state of a scene."""

    def __init__(self, template: State, scene: Scene) -> None:
        """Assemble states like ``template``, whose bodies are those of ``scene``."""
        self._template, self._scene = template, scene
        (self._robot,) = template.layout.of_type(ROBOT)
        self._bodies = [template.layout.object(body.name) for body in scene.free]

    def assemble(
        self, reading: JointReading, known: Mapping[Object, PoseEstimate], grasp: Grasp | None
    ) -> State:
        """The state that was measured.

        Args:
            reading: Joints of the arm, at rest.
            known: Poses of detected objects, in the base's frame, without what is held.
            grasp: Held object and its pose in the hand; None if the hand is empty.

        Returns:
            The state: resting objects stand upon one another, what is held is where the hand is,
            an arm that is a little too deep in a fixed body is raised, and objects that are not
            detected are as in the template.
        """
        fixed = self._fixed_boxes(known)
        joints = self._joints_outside(possible_joints(reading.joints), grasp, fixed)
        changes = self._robot_changes(joints, grasp)
        flat = self._resting_poses(known, fixed)
        for obj, estimate in known.items():
            pose = estimate.pose
            if obj in self._bodies:
                pose = flat.get(self._bodies.index(obj), pose)
                motion = (*estimate.velocity, *estimate.spin)
                changes |= _named(obj, VELOCITY_FEATURES, motion) | {(obj, "held"): 0.0}
            changes |= _pose_changes(obj, pose)
        if grasp is not None:
            hand = hand_pose(joints)
            changes |= _pose_changes(grasp.obj, hand.compose(grasp.pose))
            changes |= _named(grasp.obj, VELOCITY_FEATURES, (*ORIGIN, *ORIGIN))
            changes |= {(grasp.obj, "held"): 1.0}
        return self._template.replace(changes)

    def _joints_outside(
        self, joints: Sequence[float], grasp: Grasp | None, fixed: Sequence[OrientedBox]
    ) -> Configuration:
        """The joints with the arm raised where it is a little too deep in a fixed body."""
        if grasp is None:
            held, pose, finger = None, IDENTITY, FINGER_OPEN
        else:
            held, pose = self._scene.free[self._bodies.index(grasp.obj)], grasp.pose
            finger = grasp.finger
        return off_fixed_bodies(
            tuple(joints),
            tuple(joints),
            lambda q: Arm.at(q, finger, held, pose),
            Surroundings(Obstacle.of(box) for box in fixed),
            TOO_DEEP,
        )

    def _robot_changes(self, joints: Configuration, grasp: Grasp | None) -> Changes:
        pose = IDENTITY if grasp is None else grasp.pose
        finger = FINGER_OPEN if grasp is None else grasp.finger
        return {
            **_named(self._robot, JOINT_FEATURES, joints),
            **_named(self._robot, GRASP_FEATURES, (*pose.position, *pose.quaternion)),
            (self._robot, "finger"): finger,
        }

    def _fixed_boxes(self, known: Mapping[Object, PoseEstimate]) -> list[OrientedBox]:
        return [
            body.at(self._fixed_pose(body.name, body.pose, known))
            for body in self._scene.fixed
            if body.solid
        ]

    def _resting_poses(
        self, known: Mapping[Object, PoseEstimate], fixed: Sequence[OrientedBox]
    ) -> dict[int, Pose]:
        """Where physics would have objects that do not move, by the index of their body."""
        steady = {
            i: known[o].pose for i, o in enumerate(self._bodies) if o in known and known[o].at_rest
        }
        eyes = {i: eye for i in steady if (eye := known[self._bodies[i]].eye) is not None}
        return resting_poses(steady, self._scene.free, fixed, eyes)

    def _fixed_pose(self, name: str, otherwise: Pose, known: Mapping[Object, PoseEstimate]) -> Pose:
        obj = self._template.layout.by_name.get(name)
        if obj is None:
            return otherwise
        if obj in known:
            return known[obj].pose
        return pose_of(self._template, obj)


def possible_joints(measured: Sequence[float]) -> list[float]:
    """Where the joints are: a real arm at a limit overshoots, and encoders have noise.

    Args:
        measured: Joint positions as measured, rad.

    Returns:
        The same, at the limit where they are a little beyond it; what is further beyond stays.
    """
    at_limits = (
        min(max(q, low), high) for low, q, high in zip(JOINT_LOW, measured, JOINT_HIGH, strict=True)
    )
    return [
        limited if abs(limited - q) <= BEYOND_LIMIT else q
        for limited, q in zip(at_limits, measured, strict=True)
    ]


def feature_values(state: State, obj: Object, features: Sequence[Feature]) -> list[float]:
    """Some features of an object.

    Args:
        state: State with the object.
        obj: Object of the state.
        features: Features to read.

    Returns:
        Their values, in the order asked for.
    """
    return [float(state.get(obj, f.name)) for f in features]


def _pose_changes(obj: Object, pose: Pose) -> Changes:
    return _named(obj, POSE_FEATURES, (*pose.position, *pose.quaternion))


def _named(obj: Object, features: Sequence[Feature], values: Sequence[float]) -> Changes:
    names = (feature.name for feature in features)
    return {(obj, name): float(v) for name, v in zip(names, values, strict=True)}
