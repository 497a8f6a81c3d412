# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot as a world of the domain: commands become safe motions, measurements become states.

Where a command leads is computed by the domain's own world, which is set to the measured state
first: so the real arm, too, slides along the table where the simulated one would. What is measured
becomes a state only if that world accepts it, because the planner's model then does as well.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

import numpy as np

from slap_ros.core import Action, Domain
from slap_ros.errors import (
    InvalidMeasurementError,
    InvalidParameterError,
    InvalidStateError,
    NoDetectionError,
    NoJointStateError,
    OpenLoopOnlyError,
    UnsafeCommandError,
)
from slap_ros.geometry.pose import Pose
from slap_ros.perception.percept import known_part
from slap_ros.relational import GroundAtom, Object, State
from slap_ros.robot.grasp_tracking import (
    GRASPED,
    expected_pose,
    grasp_as_seen,
    is_lost,
    narrowest_width,
)
from slap_ros.robot.hidden_objects import PredictedMotion, pushed_aside
from slap_ros.robot.joint_reading import JointReading
from slap_ros.robot.known_scene import KnownScene
from slap_ros.robot.limits import STEP_TOLERANCE, JointMotion, Joints, Limits
from slap_ros.robot.line_of_sight import Ways, is_slanted
from slap_ros.robot.scene_config import SceneConfig
from slap_ros.robot.state_assembly import Grasp, feature_values
from slap_ros.robot.tracking import (
    LONGEST,
    Detection,
    PoseEstimate,
    Track,
    TrackingSettings,
    measured_pose,
    still,
)
from slap_ros.worlds.contact.features import ROBOT as HAND_OF_FORCES
from slap_ros.worlds.features import JOINT_FEATURES
from slap_ros.worlds.joint_space.features import GRASP_FEATURES, ROBOT
from slap_ros.worlds.joint_space.world import PandaWorld
from slap_ros.worlds.panda import FINGER_OPEN

GAP_OPEN = 2.0 * FINGER_OPEN  # m, between the fingers
GAP_SHUT = 0.0  # m
FARTHEST = 10.0  # m, from the base; what is detected further away is in another unit
PRESSED = 0.002  # m, by which what is held may be told to be inside a table: it cannot be
HIGHEST = 0.03  # m, by which it is raised for that
DRIFT = 0.02  # rad, of a joint of an arm that is taken to stand


class Doubt(NamedTuple):
    """What is not taken for true where all together cannot be."""

    predicted: bool = False  # where the model has moved what is hidden
    seen: Object | None = None  # an object whose detections are not believed


class GripperAction(Enum):
    """What the gripper does before the arm moves."""

    KEEP = "keep"
    CLOSE = "close"
    OPEN = "open"


@dataclass(frozen=True)
class SafeCommand:
    """One command, within the arm's limits: first the gripper acts, then the arm moves."""

    gripper: GripperAction
    motion: JointMotion
    after: State  # of the domain's own world, which took the same step


@dataclass
class RobotWorld:
    """A robot and the objects around it, as far as they are measured.

    Args:
        domain: Domain with a Panda.
        scene_config: Objects of the scene, and how they are detected.
        limits: Limits of the arm.
        tracking: Settings of how far detections can be trusted.

    Raises:
        InvalidParameterError: The domain has another robot, or lets its joints jump.
        OpenLoopOnlyError: Its robot is a hand that acts by forces.
        InvalidStateError: Physics does not allow the scene.
    """

    domain: Domain
    scene_config: SceneConfig
    limits: Limits
    tracking: TrackingSettings = field(default_factory=TrackingSettings)

    def __post_init__(self) -> None:
        _require_panda(self.domain, self.limits)
        self._scene = KnownScene.of(self.domain, self.scene_config.template)
        self._tracks = {obj: Track(self.tracking) for obj in self.scene_config.detected}
        self._left_out: frozenset[Object] = frozenset()  # of a task: no picture showed them
        self._frames = {
            how.frame: (obj, how)
            for obj, frames in self.scene_config.detected.items()
            for how in frames
        }
        self._pictures: deque[float] = deque(maxlen=LONGEST)  # stamps, each once
        self._reading: JointReading | None = None
        self._grasp: Grasp | None = None
        self._candidate: Grasp | None = None  # what the gripper is to close around
        self._lost = False  # what was held: the gripper is to be opened
        self._state: State | None = None
        self._measured: State | None = None  # the state before those that are expected
        self._predicted: PredictedMotion | None = None  # since the state, where objects may hide

    # -- measurements ---------------------------------------------------------------------------

    def add_detection(self, frame: str, stamp_s: float, base: Pose, seen: Pose) -> None:
        """Take a detection; frames that belong to no object are ignored.

        Args:
            frame: Name of the child frame.
            stamp_s: Time of the measurement, s.
            base: Pose of the parent frame in the base's frame; of a tag's, the camera's.
            seen: Pose of the child frame in its parent.

        Raises:
            InvalidMeasurementError: Not finite, no pose, further away than anything a robot works
                with, or not newer than the last one.
        """
        if frame not in self._frames:
            return
        obj, how = self._frames[frame]
        found, is_tag = measured_pose(*seen), how.tag_size is not None
        pose = base.compose(found).compose(how.offset)
        if math.hypot(*pose.position) > FARTHEST:
            raise InvalidMeasurementError(
                f"{obj.name} is detected {math.hypot(*pose.position):.6g} m away from the robot: "
                "are positions in m?"
            )
        if not is_tag:
            self._tracks[obj].add(Detection(stamp_s, pose, frame))
        elif not is_slanted(found):
            pose = self._likelier(obj, Ways.of(base, found, how.offset))
            self._tracks[obj].add(Detection(stamp_s, pose, frame, base.position))
        self.add_picture(stamp_s)

    def add_picture(self, stamp_s: float) -> None:
        """Take that a picture was searched: what none of several shows is hidden.

        Args:
            stamp_s: Time at which it was taken, s.
        """
        if not self._pictures or stamp_s > self._pictures[-1]:
            self._pictures.append(stamp_s)

    def _likelier(self, obj: Object, ways: Ways) -> Pose:
        grasp, last = self._grasp, self._tracks[obj].last_at_rest
        if grasp is not None and grasp.obj == obj and self._reading is not None:
            return ways.in_hand(expected_pose(grasp, self._reading))
        return ways.at_rest(last.pose if last is not None else None)

    def add_joint_reading(self, reading: JointReading) -> None:
        """Take joint positions.

        Raises:
            InvalidMeasurementError: They are older than the last ones.
        """
        if self._reading is not None and reading.stamp_s < self._reading.stamp_s:
            raise InvalidMeasurementError("joint positions are older than those before")
        self._reading = reading

    @property
    def newest_joints_s(self) -> float:
        """Stamp of the newest joint positions; minus infinity without any."""
        return -math.inf if self._reading is None else self._reading.stamp_s

    @property
    def joints(self) -> Joints:
        """The newest joint positions, rad.

        Raises:
            NoJointStateError: There were none yet.
        """
        if self._reading is None:
            raise NoJointStateError("no joint positions yet")
        return self._reading.joints

    def joint_distance(self, joints: Sequence[float]) -> float:
        """How far the joint that is furthest off is from where it should be, rad."""
        if self._reading is None:
            return math.inf
        return max(abs(a - b) for a, b in zip(self._reading.joints, joints, strict=True))

    def undetected(self, since_s: float) -> list[str]:
        """Names of the objects that were not detected since then, held ones left out."""
        held = self._grasp.obj if self._grasp is not None else None
        return [o.name for o, t in self._followed if o != held and t.newest_s <= since_s]

    def what_is_missing(self, since_s: float) -> str:
        """What was not detected since then, in words, and what to do about what is hidden."""
        missing = ", ".join(self.undetected(since_s)) or "none at all"
        never = ", ".join(self.undetected(-math.inf))
        if not (self._pictures and never):
            return missing
        return (
            f"{missing}; others are seen, but never yet {never}: move what is in front of it, or "
            "the camera"
        )

    def seldom_detected(self, since_s: float) -> list[str]:
        """Names of those that were detected since then, but too few times to be known."""
        held = self._grasp.obj if self._grasp is not None else None
        return [
            o.name
            for o, t in self._followed
            if o != held and t.newest_s > since_s and t.estimate(since_s) is None
        ]

    # -- the state ------------------------------------------------------------------------------

    @property
    def left_out(self) -> list[str]:
        """Names of the objects that the task lacks, since no picture had shown them."""
        return sorted(obj.name for obj in self._left_out)

    def measure_first(self, since_s: float, moving: bool = False) -> State | None:
        """The state in which a task begins: without objects that no picture has ever shown.

        A task that is not about them can be solved all the same (SLAP D.4).

        Args:
            since_s: Time at which the arm came to rest, s.
            moving: See :meth:`measure`.

        Returns:
            The state; None while measurements are missing, or something moves.

        Raises:
            InvalidStateError: As :meth:`measure`.
        """
        never = (obj for obj, track in self._tracks.items() if track.newest_s == -math.inf)
        self._leave_out(obj for obj in never if self._is_hidden(self._tracks[obj], since_s))
        return self.measure(since_s, moving)

    def default_goal(self, state: State) -> frozenset[GroundAtom]:
        """The goal of a task that has none of its own, whether what it is about was seen or not.

        Args:
            state: The state in which the task begins.
        """
        template = self.scene_config.template
        return self.domain.default_goal(state.over(template.layout, template))

    def require_seen(self, goal: Iterable[GroundAtom]) -> None:
        """Refuse a goal about objects that were left out.

        Raises:
            NoDetectionError: It is about one.
        """
        about = {obj for atom in goal for obj in atom.objects}
        if missing := sorted(obj.name for obj in about & self._left_out):
            raise NoDetectionError(
                f"the goal is about what no picture has shown yet: {', '.join(missing)}: move what "
                "is in front of it, or the camera"
            )

    def _leave_out(self, objects: Iterable[Object]) -> None:
        template = self.scene_config.template
        known = known_part(template, {obj.name for obj in objects})
        left_out = frozenset(template.objects) - frozenset(known.objects)
        if left_out == self._left_out:
            return
        self._scene.model.close()
        self._scene = KnownScene.of(self.domain, known)
        self._left_out = left_out
        self._state = self._measured = self._predicted = None  # of other objects

    @property
    def _followed(self) -> list[tuple[Object, Track]]:
        """The objects of the task that are detected."""
        return [(obj, t) for obj, t in self._tracks.items() if obj not in self._left_out]

    def measure(self, since_s: float, moving: bool = False) -> State | None:
        """The state since the arm came to rest, once measured.

        Args:
            since_s: Time at which the arm came to rest, s. Older measurements do not count.
            moving: Whether to take a state in which objects still move, with velocities from
                finite differences.

        Returns:
            The state; None while measurements are missing, or something moves.

        Raises:
            InvalidStateError: What is measured cannot be; better measurements may follow.
        """
        try:
            return self._attempt(since_s, moving)
        except InvalidStateError as error:
            doubts = list(self._doubts(since_s, moving))
            return self._in_doubt(since_s, moving, doubts, error)

    def _in_doubt(
        self, since_s: float, moving: bool, doubts: Sequence[Doubt], error: InvalidStateError
    ) -> State | None:
        """The first state that can be; raises ``error`` where there is none."""
        predicted = self._predicted
        for doubt in doubts:
            self._predicted = None if doubt.predicted else predicted
            with suppress(InvalidStateError):
                return self._attempt(since_s, moving, doubt.seen)
        self._predicted = predicted  # for better measurements
        raise error

    def _doubts(self, since_s: float, moving: bool) -> Iterator[Doubt]:
        """What may be wrong with what is known, the likeliest first.

        What is seen leaves no room for what the model has moved: hidden ones have stayed. Or
        something is seen where it cannot be, however long one waits: its tags are covered. That is
        rather what seems to have moved far.
        """
        if self._predicted is not None:
            yield Doubt(predicted=True)
        if not (moving and self.tracking.hidden_after):
            return
        moved = {obj: track.strayed(since_s) for obj, track in self._followed}
        for obj in sorted(moved, key=lambda obj: -moved[obj]):
            if moved[obj] > 0.0:
                yield Doubt(seen=obj)
                if self._predicted is not None:
                    yield Doubt(predicted=True, seen=obj)

    def _attempt(self, since_s: float, moving: bool, covered: Object | None = None) -> State | None:
        reading = self._reading
        if reading is None or reading.stamp_s <= since_s or not reading.at_rest:
            return None
        hidden = {o for o, t in self._followed if o == covered or self._is_hidden(t, since_s)}
        estimates = self._estimates(reading, since_s, hidden)
        held = self._grasp.obj if self._grasp is not None else None
        known = {o: s for o, s in estimates.items() if s is not None and o != held}
        if len(known) < len(self._followed) - (held is not None):
            return None
        if not moving and not self._settled(estimates, since_s):
            return None
        if self._grasp is not None:
            self._grasp = grasp_as_seen(self._grasp, reading, estimates.get(self._grasp.obj))
        state = self._scene.assembler.assemble(reading, known, self._grasp)
        if aside := self._pushed_aside(state, known, hidden & known.keys()):
            known |= aside
            state = self._scene.assembler.assemble(reading, known, self._grasp)
        self._scene.model.reset(state)
        for obj, estimate in known.items():
            self._tracks[obj].remember(estimate)
        self._state = self._measured = state
        self._predicted = None
        return state

    def _pushed_aside(
        self, state: State, known: Mapping[Object, PoseEstimate], hidden: Collection[Object]
    ) -> dict[Object, PoseEstimate]:
        free = zip(self._scene.bodies, self._scene.model.scene.free, strict=True)
        bodies = {obj: body for obj, body in free if obj in known}
        moved = pushed_aside(state, bodies, hidden) if hidden else {}
        return {obj: still(pose, known[obj].weight) for obj, pose in moved.items()}

    def _estimates(
        self, reading: JointReading, since_s: float, hidden: Collection[Object]
    ) -> dict[Object, PoseEstimate | None]:
        """What is known of each object; the hand is empty from now on if it lost what it held."""
        grasp = self._grasp
        if grasp is not None and grasp.obj in self._tracks:
            self._tracks[grasp.obj].expect(expected_pose(grasp, reading))
        estimates = {
            obj: self._hidden(obj, track) if obj in hidden else track.estimate(since_s)
            for obj, track in self._followed
        }
        if grasp is not None and is_lost(grasp, reading, estimates.get(grasp.obj)):
            self._grasp, self._lost = None, True
        return estimates

    def _is_hidden(self, track: Track, since_s: float) -> bool:
        """Whether pictures since then, and since it was seen last, do not show it.

        Where none of the last pictures shows anything, something covers the camera.
        """
        enough, unseen_s = self.tracking.hidden_after, max(since_s, track.newest_s)
        newest_s = max(one.newest_s for one in self._tracks.values())
        if not self._pictures or newest_s < self._pictures[0]:
            return False
        return 0 < enough <= sum(stamp_s > unseen_s for stamp_s in self._pictures)

    def _hidden(self, obj: Object, track: Track) -> PoseEstimate | None:
        """What is known of an object that pictures do not show: nothing, if they never did."""
        last = track.last_at_rest
        moved = self._predicted.moved(obj) if self._predicted is not None else None
        return last if last is None or moved is None else still(moved, last.weight)

    def _settled(self, estimates: Mapping[Object, PoseEstimate | None], since_s: float) -> bool:
        """Whether everything that is seen has come to rest: what is hidden in the hand has."""
        return all(
            seen.at_rest if seen is not None else self._tracks[obj].newest_s <= since_s
            for obj, seen in estimates.items()
        )

    # -- commands -------------------------------------------------------------------------------

    def plan_command(self, action: Action) -> SafeCommand:
        """The motion that a command asks for, from the last state, measured or expected.

        Raises:
            InvalidCommandError: It is not in the domain's action space.
            UnsafeCommandError: It would take the arm beyond its limits, see :class:`Limits`; or the
                arm is no longer where it was measured.
            InvalidStateError: There is no state yet.
        """
        if self._state is None or self._measured is None:
            raise InvalidStateError("nothing is measured yet")
        self._scene.model.reset(self._state)
        after = self._scene.model.step(action)
        start = self._joints(self._state)
        target = self._scene.model.joints_off_fixed_bodies(tuple(start), PRESSED, HIGHEST)
        if self.tracking.hidden_after:
            actions = self.domain.action_space
            self._predicted = PredictedMotion.of(self._scene.model, actions, self._state, after)
        moved = self.joint_distance(self._joints(self._measured))
        if moved > DRIFT:
            raise UnsafeCommandError(
                f"the arm was moved by {moved:.3f} rad since it was measured: call reset_task"
            )
        motion = self.limits.motion(start, target, self.domain.execution.control_period_s)
        return SafeCommand(self._grip(after), motion, after)

    def expect(self, command: SafeCommand) -> State | None:
        """Go on from where a command leads, before the arm has moved.

        Args:
            command: Command that answers the last state.

        Returns:
            The state that is expected, which the next command is to answer. None where it has to be
            measured: where more moves than the arm with what it holds, or an atom changes.
        """
        before, after = self._state, command.after
        assert before is not None
        moved = command.motion.target == tuple(self._joints(after))
        if not moved or command.gripper is not GripperAction.KEEP or self._disturbs(before, after):
            return None
        if self._scene.space.abstract(after) != self._scene.space.abstract(before):
            return None
        self._state = after
        return after

    def _joints(self, state: State) -> list[float]:
        return feature_values(state, self._scene.robot, JOINT_FEATURES)

    def _disturbs(self, before: State, after: State) -> bool:
        """Whether an object moves, or begins to, that the arm does not carry."""
        held = self._grasp.obj if self._grasp is not None else None
        loose = (obj for obj in after.objects if obj not in (self._scene.robot, held))
        return any(tuple(before[obj]) != tuple(after[obj]) for obj in loose)

    def _grip(self, after: State) -> GripperAction:
        held = [obj for obj in self._scene.bodies if after.get(obj, "held") > 0.5]
        if self._grasp is None and held:
            x, y, z, *turn = feature_values(after, self._scene.robot, GRASP_FEATURES)
            qx, qy, qz, qw = turn
            finger = float(after.get(self._scene.robot, "finger"))
            pose = Pose((x, y, z), (qx, qy, qz, qw))
            body = self._scene.model.scene.free[self._scene.bodies.index(held[0])]
            self._candidate = Grasp(held[0], pose, finger, narrowest_width(body, pose))
            return GripperAction.CLOSE
        if self._lost or (self._grasp is not None and not held):
            return GripperAction.OPEN
        return GripperAction.KEEP

    def confirm_grasp(self, gap: float) -> bool:
        """Take what the gripper closed around as held, if the fingers stand far enough apart.

        Args:
            gap: Distance between the fingers, m.

        Returns:
            Whether something is in the hand.
        """
        candidate, self._candidate = self._candidate, None
        if candidate is None or not gap > GRASPED * candidate.width:
            return False
        self._grasp, self._lost = candidate, False
        self._tracks[candidate.obj].forget()
        return True

    def confirm_release(self) -> None:
        """Take the hand as empty."""
        if self._grasp is not None and self._reading is not None:
            let_go_at = expected_pose(self._grasp, self._reading)
            self._tracks[self._grasp.obj].let_go(let_go_at)
        self._grasp, self._lost = None, False

    def close(self) -> None:
        """Release the model's resources."""
        self._scene.model.close()


def require_robot(domain: Domain, initial: State) -> None:
    """Refuse a domain without a Panda before anything is started for it.

    Raises:
        InvalidParameterError: Its robot is another one, or its world is disturbed on purpose.
        OpenLoopOnlyError: Its robot is a hand that acts by forces.
    """
    _require_closed_loop(domain)
    if domain.make_model is not None:
        raise InvalidParameterError(
            f"{domain} has disturbances of its own, which only a simulation can have; use another "
            "preset, or --world sim"
        )
    if ROBOT not in domain.types or not isinstance(domain.make_world(initial), PandaWorld):
        raise InvalidParameterError(
            f"{domain.name} has no Panda, which the robots here are; use --world sim"
        )


def _require_closed_loop(domain: Domain) -> None:
    """Refuse a domain whose states cannot be measured on an arm that stands between commands."""
    if HAND_OF_FORCES in domain.types:
        raise OpenLoopOnlyError(
            f"{domain.name} cannot run on this robot, whose arm stands between two commands: its "
            "skills act on where the hand was told to be and on its velocity, which nothing "
            "measures then. The robot in MuJoCo is commanded while it moves: use --world mujoco. "
            "Or record a run in simulation: `slap bag replay BAG --to robot --dry-run` checks its "
            "motion"
        )


def _require_panda(domain: Domain, limits: Limits) -> None:
    _require_closed_loop(domain)
    if ROBOT not in domain.types:
        raise InvalidParameterError(f"{domain.name} has no Panda, which a real robot is here")
    reach, _ = domain.action_space.split(np.array(domain.action_space.high))
    if any(a > b + STEP_TOLERANCE for a, b in zip(reach, limits.step, strict=True)):
        raise InvalidParameterError(
            f"preset {domain.preset} of {domain.name} lets joints jump by up to {max(reach):.2f} "
            "rad in a step, which a real arm must not: use preset fair"
        )
