# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot's cell as a world of the domain: commands become safe motions, measurements states.

Where a command leads is computed by the domain's own world, which is set to the measured state
first: so the real arm, too, slides along the table where the simulated one would. What is measured
is handed on only if that world accepts it, for the planner's does then as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

from slap_ros.core import Action, Domain
from slap_ros.errors import (
    InvalidMeasurementError,
    InvalidParameterError,
    InvalidStateError,
    UnsafeCommandError,
)
from slap_ros.geometry.pose import IDENTITY, ORIGIN, Pose, Vector
from slap_ros.physics.features import (
    GRASP_FEATURES,
    JOINT_FEATURES,
    POSE_FEATURES,
    ROBOT,
    VELOCITY_FEATURES,
)
from slap_ros.physics.panda import FINGER_OPEN, JOINTS, hand_pose
from slap_ros.physics.settling import resting_poses
from slap_ros.physics.world import PandaWorld
from slap_ros.relational import Feature, Object, State
from slap_ros.robot.limits import STEP_TOLERANCE, JointMotion, Limits
from slap_ros.robot.scene_config import SceneConfig
from slap_ros.robot.tracking import Detection, PoseEstimate, Track, TrackingSettings, measured_pose

GAP_OPEN = 2.0 * FINGER_OPEN  # m, between the fingers
GAP_SHUT = 0.0  # m
GRASPED = 0.5  # of the expected gap; with less there is nothing between the fingers
FOLLOWS = 0.03  # m, between a held object and where the hand has it; further away it was lost
DRIFT = 0.02  # rad, of a joint of an arm that is taken to stand
STANDS = 0.05  # rad/s, of each joint of an arm at rest


class GripperAction(Enum):
    """What the gripper is to do before the arm moves."""

    KEEP = "keep"
    CLOSE = "close"
    OPEN = "open"


@dataclass(frozen=True)
class SafeCommand:
    """One command, checked."""

    gripper: GripperAction
    motion: JointMotion


@dataclass(frozen=True)
class JointReading:
    """What the robot says of its joints."""

    stamp_s: float
    joints: tuple[float, ...]  # rad
    velocities: tuple[float, ...] = ()  # rad/s; none: not told
    gap: float | None = None  # m, between the fingers; None: not told

    def __post_init__(self) -> None:
        """Refuse what is no measurement.

        Raises:
            InvalidMeasurementError: Not seven joints, or not finite.
        """
        numbers = (*self.joints, *self.velocities, 0.0 if self.gap is None else self.gap)
        if len(self.joints) != JOINTS or not all(map(math.isfinite, numbers)):
            raise InvalidMeasurementError(f"joint positions {self.joints} are not {JOINTS} numbers")

    @property
    def still(self) -> bool:
        """Whether the arm stands, as far as it says."""
        return all(abs(v) <= STANDS for v in self.velocities)


@dataclass(frozen=True)
class Grasp:
    """What the hand holds."""

    obj: Object
    pose: Pose  # in the hand's frame
    finger: float  # m, of each from the middle


@dataclass
class RobotWorld:
    """What is known of the robot and what stands around it.

    Args:
        domain: One with a Panda.
        workplace: What there is.
        limits: What the arm may do.
        sensing: How well detections can be trusted.

    Raises:
        InvalidParameterError: The domain has another robot, or lets it jump.
        InvalidStateError: The workplace cannot be.
    """

    domain: Domain
    scene_config: SceneConfig
    limits: Limits
    tracking: TrackingSettings = field(default_factory=TrackingSettings)

    def __post_init__(self) -> None:
        _require_panda(self.domain, self.limits)
        template = self.scene_config.template
        (self._robot,) = template.layout.of_type(ROBOT)
        world = self.domain.make_world(template)
        if not isinstance(world, PandaWorld):
            raise InvalidParameterError(f"the world of {self.domain.name} has no Panda")
        self._world = world
        self._bodies = [template.layout.object(body.name) for body in world.scene.free]
        self._tracks = {obj: Track(self.tracking) for obj in self.scene_config.seen}
        self._frames = {how.frame: (obj, how) for obj, how in self.scene_config.seen.items()}
        self._reading: JointReading | None = None
        self._grasp: Grasp | None = None
        self._candidate: Grasp | None = None  # what the gripper is to close around
        self._lost = False  # what was held: the gripper is to be opened
        self._state: State | None = None

    # -- measurements ---------------------------------------------------------------------------

    def add_detection(self, frame: str, stamp_s: float, base: Pose, seen: Pose) -> None:
        """Take a detection; frames that are no object's are none of ours.

        Args:
            frame: The child frame.
            stamp_s: When it was seen.
            base: Pose of the parent frame in the base's.
            seen: Pose of the child frame in its parent.

        Raises:
            InvalidMeasurementError: Not finite, no pose, or not newer than the last one.
        """
        if frame not in self._frames:
            return
        obj, how = self._frames[frame]
        pose = base.compose(measured_pose(*seen)).compose(how.offset)
        self._tracks[obj].add(Detection(stamp_s, pose))

    def add_joint_reading(self, reading: JointReading) -> None:
        """Take what the robot says of its joints; what is older than the last is left aside.

        Raises:
            InvalidMeasurementError: It is older than the last one.
        """
        if self._reading is not None and reading.stamp_s < self._reading.stamp_s:
            raise InvalidMeasurementError("joint positions are older than those before")
        self._reading = reading

    @property
    def newest_joints_s(self) -> float:
        """Stamp of the newest joint positions; minus infinity without any."""
        return -math.inf if self._reading is None else self._reading.stamp_s

    def joint_distance(self, joints: Sequence[float]) -> float:
        """How far the joint that is furthest off is from where it should be, rad."""
        if self._reading is None:
            return math.inf
        return max(abs(a - b) for a, b in zip(self._reading.joints, joints, strict=True))

    def undetected(self, since_s: float) -> list[str]:
        """Names of the objects that were not detected since then, held ones left out."""
        held = self._grasp.obj if self._grasp is not None else None
        return [o.name for o, t in self._tracks.items() if o != held and t.newest_s <= since_s]

    # -- the state ------------------------------------------------------------------------------

    def measure(self, since_s: float, moving: bool = False) -> State | None:
        """The state since the arm came to rest, once measured.

        Args:
            since_s: When the arm came to rest.
            moving: Whether to take a state in which objects still move, with velocities from
                finite differences.

        Returns:
            None while measurements are missing, or something moves.

        Raises:
            InvalidStateError: What is measured cannot be; better measurements may follow.
        """
        reading = self._reading
        if reading is None or reading.stamp_s <= since_s or not reading.still:
            return None
        estimates = {obj: track.estimate(since_s) for obj, track in self._tracks.items()}
        self._detect_grasp_loss(reading, estimates)
        held = self._grasp.obj if self._grasp is not None else None
        known = {o: s for o, s in estimates.items() if s is not None and o != held}
        if len(known) < len(self._tracks) - (held is not None):
            return None
        if not moving and not all(s.steady for s in known.values()):
            return None
        state = self._assemble(reading, known)
        self._world.reset(state)
        for obj, estimate in known.items():
            self._tracks[obj].remember(estimate)
        self._state = state
        return state

    def _detect_grasp_loss(
        self, reading: JointReading, estimates: Mapping[Object, PoseEstimate | None]
    ) -> None:
        """Whether what the hand holds does not follow it any more, or the fingers are shut."""
        grasp = self._grasp
        if grasp is None:
            return
        expected = hand_pose(reading.joints).compose(grasp.pose).position
        seen = estimates.get(grasp.obj)
        strayed = seen is not None and math.dist(seen.pose.position, expected) > FOLLOWS
        shut = reading.gap is not None and reading.gap < GRASPED * 2.0 * grasp.finger
        if strayed or shut:
            self._grasp, self._lost = None, True

    def _assemble(self, reading: JointReading, known: Mapping[Object, PoseEstimate]) -> State:
        """The state, objects put where physics would have them."""
        grasp = self._grasp
        changes = _robot_changes(self._robot, reading, grasp)
        fixed = [
            body.at(self._fixed_pose(body.name, body.pose, known))
            for body in self._world.scene.fixed
            if body.solid
        ]
        resting = {
            i: known[o].pose for i, o in enumerate(self._bodies) if o in known and known[o].steady
        }
        flat = resting_poses(resting, self._world.scene.free, fixed)
        for obj, estimate in known.items():
            pose = estimate.pose
            if obj in self._bodies:
                pose = flat.get(self._bodies.index(obj), pose)
                motion = (*estimate.velocity, *estimate.spin)
                changes |= _named(obj, VELOCITY_FEATURES, motion) | {(obj, "held"): 0.0}
            changes |= _named(obj, POSE_FEATURES, (*pose.position, *pose.quaternion))
        if grasp is not None:
            pose = hand_pose(reading.joints).compose(grasp.pose)
            changes |= _named(grasp.obj, POSE_FEATURES, (*pose.position, *pose.quaternion))
            changes |= _named(grasp.obj, VELOCITY_FEATURES, (*ORIGIN, *ORIGIN))
            changes |= {(grasp.obj, "held"): 1.0}
        return self.scene_config.template.replace(changes)

    def _fixed_pose(self, name: str, otherwise: Pose, known: Mapping[Object, PoseEstimate]) -> Pose:
        obj = self.scene_config.template.layout.by_name.get(name)
        if obj is None:
            return otherwise
        if obj in known:
            return known[obj].pose
        return _pose(self.scene_config.template, obj)

    # -- commands -------------------------------------------------------------------------------

    def plan_command(self, action: Action) -> SafeCommand:
        """What a command from the last state comes to.

        Raises:
            InvalidCommandError: It is not in the domain's action space.
            UnsafeCommandError: It would take the arm beyond its limits, see :class:`Limits`; or the
                arm is no longer where it was measured.
            InvalidStateError: There is no state yet.
        """
        if self._state is None:
            raise InvalidStateError("nothing is measured yet")
        self._world.reset(self._state)
        after = self._world.step(action)
        start, target = (_values(s, self._robot, JOINT_FEATURES) for s in (self._state, after))
        moved = self.joint_distance(start)
        if moved > DRIFT:
            raise UnsafeCommandError(
                f"the arm was moved by {moved:.3f} rad since it was measured: call reset_task"
            )
        motion = self.limits.motion(start, target, self.domain.execution.control_period_s)
        return SafeCommand(self._grip(after), motion)

    def _grip(self, after: State) -> GripperAction:
        held = [obj for obj in self._bodies if after.get(obj, "held") > 0.5]
        if self._grasp is None and held:
            x, y, z, *turn = _values(after, self._robot, GRASP_FEATURES)
            qx, qy, qz, qw = turn
            finger = float(after.get(self._robot, "finger"))
            self._candidate = Grasp(held[0], Pose((x, y, z), (qx, qy, qz, qw)), finger)
            return GripperAction.CLOSE
        if self._lost or (self._grasp is not None and not held):
            return GripperAction.OPEN
        return GripperAction.KEEP

    def confirm_grasp(self, gap: float) -> bool:
        """Whether something is in the hand now that the fingers stand ``gap`` m apart."""
        candidate, self._candidate = self._candidate, None
        if candidate is None or not gap > GRASPED * 2.0 * candidate.finger:
            return False
        self._grasp, self._lost = candidate, False
        self._tracks[candidate.obj].forget()
        return True

    def confirm_release(self) -> None:
        """The hand is empty now."""
        if self._grasp is not None:
            self._tracks[self._grasp.obj].forget()
        self._grasp, self._lost = None, False

    def close(self) -> None:
        """Give the world back."""
        self._world.close()


def _require_panda(domain: Domain, limits: Limits) -> None:
    if ROBOT not in domain.types:
        raise InvalidParameterError(f"{domain.name} has no Panda, which a real robot is here")
    *reach, _ = domain.action_space.high
    if any(a > b + STEP_TOLERANCE for a, b in zip(reach, limits.step, strict=True)):
        raise InvalidParameterError(
            f"preset {domain.preset} of {domain.name} lets joints jump by up to {max(reach):.2f} "
            "rad in a step, which a real arm must not: use preset fair"
        )


def _robot_changes(
    robot: Object, reading: JointReading, grasp: Grasp | None
) -> dict[tuple[Object, str], float]:
    pose = IDENTITY if grasp is None else grasp.pose
    finger = FINGER_OPEN if grasp is None else grasp.finger
    return {
        **_named(robot, JOINT_FEATURES, reading.joints),
        **_named(robot, GRASP_FEATURES, (*pose.position, *pose.quaternion)),
        (robot, "finger"): finger,
    }


def _named(
    obj: Object, features: Sequence[Feature], values: Sequence[float]
) -> dict[tuple[Object, str], float]:
    names = (feature.name for feature in features)
    return {(obj, name): float(v) for name, v in zip(names, values, strict=True)}


def _values(state: State, obj: Object, features: Sequence[Feature]) -> list[float]:
    return [float(state.get(obj, f.name)) for f in features]


def _pose(state: State, obj: Object) -> Pose:
    x, y, z, qx, qy, qz, qw = _values(state, obj, POSE_FEATURES)
    position: Vector = (x, y, z)
    return Pose(position, (qx, qy, qz, qw))
