# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A Franka arm and its gripper over franky: one motion at a time, and nothing after a fault.

A thread reads the robot's state and notices how motions end. The first fault stays until
:meth:`FrankaArm.recover` is called; until then nothing is sent that could move the arm.
"""

from __future__ import annotations

import hashlib
import math
import tempfile
import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import numpy as np

from slap_ros.errors import (
    AlreadyRunningError,
    BusyError,
    InvalidCommandError,
    RobotUnreachableError,
    SlapError,
)
from slap_ros.files import sole_use
from slap_ros.geometry.pose import Pose
from slap_ros.robot.blending import MotionLimits, step_peaks
from slap_ros.robot.franka.faults import (
    error_names,
    gripper_fault,
    reflex,
    robot_fault,
    translated,
)
from slap_ros.robot.franka.limits import JERK
from slap_ros.robot.joint_trajectory import TrajectoryPoint
from slap_ros.robot.limits import Limits
from slap_ros.worlds.panda import hand_pose

LOOK_S = 0.01  # s, between two looks at the robot
FINGER_LOOK_S = 0.05  # s, between two looks at the fingers
CONNECT_S = 10.0  # s, after which a robot that accepts a connection and says nothing is given up
STOP_S = 2.0  # s, for a motion to come to rest
AT_REST = 1e-3  # rad/s and rad/s², of what the robot's control wants of each joint
GRIPPER_SPEED = 0.1  # m/s
OPENING = 0.08  # m, of the fingers: whatever is between them counts as grasped
LEAST_SHARE = 0.01  # of the limits, with which the arm goes anywhere
COLLISION_TORQUE, COLLISION_FORCE = 20.0, 30.0  # Nm of each joint, N of the hand


@dataclass(frozen=True)
class FrankaSettings:
    """What an arm is connected by, and where its control stops it.

    Args:
        ip: Address of the robot.
        limits: Limits of its joints.
        speed: Fraction of the largest jerk; velocities and accelerations are in ``limits``.
        collision_torque: Torque about each joint that is taken for a collision, Nm.
        collision_force: Force or torque on the hand that is taken for a collision, N or Nm.
        realtime: Whether a real-time kernel is demanded.
    """

    ip: str
    limits: Limits
    speed: float = 1.0
    collision_torque: float = COLLISION_TORQUE
    collision_force: float = COLLISION_FORCE
    realtime: bool = True

    @property
    def motion_limits(self) -> MotionLimits:
        """What its motions must keep to."""
        return MotionLimits.of(self.limits, tuple(self.speed * jerk for jerk in JERK))


@dataclass(frozen=True)
class ArmReading:
    """What was read of the robot last.

    Args:
        robot_s: Time on the robot's clock, s.
        read_s: Time at which it was read, s of ``time.monotonic``.
        joints: Joint positions, rad.
        velocities: Joint velocities, rad/s.
        gap: Distance between the fingers, m.
        at_rest: Whether the robot's control wants the arm to stand.
    """

    robot_s: float
    read_s: float
    joints: tuple[float, ...]
    velocities: tuple[float, ...]
    gap: float
    at_rest: bool

    @property
    def hand(self) -> Pose:
        """Pose of the hand, in the frame of the base."""
        return hand_pose(self.joints)


@dataclass
class MotionResult:
    """How a motion ended; until it has, ``done`` is not set.

    Args:
        done: Set at the end of the motion.
        error: Why it failed; None where it did not.
        began_s: Time on the robot's clock at which it began, s.
        ended_s: Time on the robot's clock at which it ended, s.
    """

    done: threading.Event = field(default_factory=threading.Event)
    error: SlapError | None = None
    began_s: float = 0.0
    ended_s: float = 0.0


@dataclass(frozen=True)
class ArmProbe:
    """What an arm that stands says of itself.

    Args:
        mode: Name of the mode of the robot's control.
        answers_s: Times that it took to answer commands which move nothing, s.
        gripper_version: Version of the gripper's protocol.
        widest_gap: Largest distance between the fingers, m; 0 before the gripper was homed.
    """

    mode: str
    answers_s: tuple[float, ...]
    gripper_version: int
    widest_gap: float


class FrankaArm:
    """A connected arm."""

    def __init__(self, settings: FrankaSettings) -> None:
        """Connect; nothing moves.

        Args:
            settings: Address, limits and thresholds.

        Raises:
            AlreadyRunningError: Another program of this machine drives the robot.
            RobotUnreachableError: There is no robot, or it does not answer.
            RobotVersionError: It speaks another version of the protocol.
            InvalidParameterError: There is no real-time kernel.
        """
        self.settings = settings
        self.fault: SlapError | None = None
        self.on_reading: Callable[[ArmReading], None] = lambda _: None  # called in another thread
        self._motion: MotionResult | None = None
        self._grip: tuple[MotionResult, Any] | None = None
        self._waiting: Sequence[TrajectoryPoint] = ()  # of a motion that begins once at rest
        self._stack, self._lock = ExitStack(), threading.RLock()
        self._closing = threading.Event()
        self._gap, self._fingers_s = 0.0, -math.inf  # as read last, and when; m, s
        self._require_alone()
        try:
            self._connect()
            with translated():
                self.reading = self._read()
        except BaseException:
            self._stack.close()
            raise
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Bring the arm to rest and disconnect."""
        self.hold()
        self._closing.set()
        self._thread.join(STOP_S)
        self._stack.close()

    # -- motions --------------------------------------------------------------------------------

    def follow(self, points: Sequence[TrajectoryPoint]) -> MotionResult:
        """Begin a motion through points, in place of none.

        Args:
            points: Where the joints are to be, with times that they must not be ahead of. The last
                point is at rest.

        Raises:
            InvalidCommandError: Something moves, or a point is beyond the joints' limits.
            SlapError: A fault that nobody has recovered from.
        """
        self.require_possible(points)
        with self._lock:
            self.require_ready()
            self._motion, self._waiting = MotionResult(), tuple(points)
            return self._motion

    def grip(self, gap: float, force: float) -> MotionResult:
        """Begin to move the fingers to a gap, m; closing ones stop at what is between them.

        Args:
            gap: Distance between the fingers, m.
            force: Force of closing fingers, N.

        Raises:
            InvalidCommandError: Something moves, or there is no such gap.
            SlapError: A fault that nobody has recovered from.
        """
        if not 0.0 <= gap <= OPENING:
            raise InvalidCommandError(f"a gap of {gap} m is not within [0, {OPENING}]")
        with self._lock:
            self.require_ready()
            closing = gap < self.reading.gap
            outcome = MotionResult(began_s=self.reading.robot_s)
            begun = (
                self._gripper.grasp_async(gap, GRIPPER_SPEED, force, OPENING, OPENING)
                if closing
                else self._gripper.move_async(gap, GRIPPER_SPEED)
            )
            self._grip = outcome, begun
            return outcome

    def hold(self) -> None:
        """Bring the arm to rest where it is, within its limits."""
        with self._lock:
            self._waiting = ()
            if self._motion is None or self.fault is not None or not self._robot.is_in_control:
                return
            try:
                with translated():
                    self._robot.move(self._franky.JointStopMotion(), True)
            except SlapError as error:
                self._fail(error)

    def require_ready(self) -> None:
        """Refuse to begin anything after a fault, or while something moves.

        Raises:
            InvalidCommandError: Arm or fingers are moving.
            SlapError: The fault.
        """
        if self.fault is not None:
            raise self.fault
        if self._motion is not None or self._grip is not None:
            raise InvalidCommandError("the arm or the fingers are moving")

    def require_possible(self, points: Sequence[TrajectoryPoint]) -> None:
        """Refuse points beyond the joints' limits.

        Raises:
            InvalidCommandError: Names the joint and the point.
        """
        low, high = self.settings.limits.low, self.settings.limits.high
        for number, point in enumerate(points):
            for i, (least, q, most) in enumerate(
                zip(low, point.positions, high, strict=True), start=1
            ):
                if not least <= q <= most:
                    raise InvalidCommandError(
                        f"joint {i} would go to {q:.4f} rad in point {number}, beyond "
                        f"[{least}, {most}]"
                    )

    def recover(self) -> None:
        """End a fault, because a person asks for it; nothing moves.

        Raises:
            RobotUnreachableError: The robot does not answer.
            RobotReflexError: It does not recover.
        """
        with self._lock:
            if isinstance(self.fault, RobotUnreachableError):
                self._connect()
            with suppress(self._franky.Exception):  # of the motion that the fault ended
                self._robot.join_motion(STOP_S)
            with translated():
                self._robot.recover_from_errors()
                self._await_recovery()
                self.reading = self._read()
            self.fault = None

    def _await_recovery(self) -> None:
        """Wait for a state without errors: the robot agrees before its next state says so."""
        last_s = monotonic() + STOP_S
        while (errors := self._errors()) is not None:
            if monotonic() > last_s:
                raise reflex(errors)
            sleep(LOOK_S)

    def probe(self, times: int) -> ArmProbe:
        """Ask the robot what it says of itself; nothing moves.

        Args:
            times: How often to have it answer a command. The command sets its thresholds again.
        """
        with self._lock, translated():
            answers = []
            for _ in range(times):
                began_s = monotonic()
                self._set_thresholds(self._robot)
                answers.append(monotonic() - began_s)
            return ArmProbe(
                str(self._robot.state.robot_mode).rpartition(".")[2],
                tuple(answers),
                int(self._gripper.server_version),
                float(self._gripper.max_width),
            )

    def _set_thresholds(self, robot: Any) -> None:
        robot.set_collision_behavior(self.settings.collision_torque, self.settings.collision_force)

    # -- the robot ------------------------------------------------------------------------------

    def _require_alone(self) -> None:
        name = hashlib.sha256(self.settings.ip.encode()).hexdigest()[:16]
        folder = Path(tempfile.gettempdir()) / f"slap_ros-franka-{name}"
        try:
            self._stack.enter_context(sole_use(folder))
        except BusyError as error:
            raise AlreadyRunningError(
                f"another program drives the robot at {self.settings.ip}: stop it first"
            ) from error

    def _connect(self) -> None:
        """Connect, and set limits and thresholds; a robot that does not answer is given up."""
        import franky  # an extra

        self._franky = franky
        made: list[Any] = []

        def connect() -> None:
            try:
                made.append(self._connected())
            except Exception as error:
                made.append(error)

        thread = threading.Thread(target=connect, daemon=True)
        thread.start()
        thread.join(CONNECT_S)
        if not made:
            raise RobotUnreachableError(
                f"{self.settings.ip} accepts connections, but does not answer for {CONNECT_S} s: "
                "does another program drive it?"
            )
        if isinstance(made[0], Exception):
            raise robot_fault(made[0]) from made[0]
        self._robot, self._gripper = made[0]

    def _connected(self) -> tuple[Any, Any]:
        settings, franky = self.settings, self._franky
        kind = franky.RealtimeConfig
        robot = franky.Robot(
            settings.ip, realtime_config=kind.Enforce if settings.realtime else kind.Ignore
        )
        robot.joint_velocity_limit.set(settings.limits.velocity)
        robot.joint_acceleration_limit.set(settings.limits.acceleration)
        robot.joint_jerk_limit.set(settings.motion_limits.jerk)
        self._set_thresholds(robot)
        return robot, franky.Gripper(settings.ip)

    def _watch(self) -> None:
        """Read the robot until it is disconnected."""
        while not self._closing.wait(LOOK_S):
            if isinstance(self.fault, RobotUnreachableError):
                continue
            try:
                with self._lock, translated():
                    self._look()
            except SlapError as error:
                self._fail(error)

    def _look(self) -> None:
        self.reading = self._read()
        self.on_reading(self.reading)
        if self.fault is None and (errors := self._errors()) is not None:
            raise reflex(errors)
        if self._motion is not None and self._waiting:
            self._begin(self._motion)
        elif self._motion is not None:
            self._look_at_motion(self._motion)
        if self._grip is not None:
            self._look_at_grip(*self._grip)

    def _read(self) -> ArmReading:
        now_s = monotonic()
        state = self._robot.state
        if now_s - self._fingers_s > FINGER_LOOK_S:
            self._gap, self._fingers_s = float(self._gripper.width), now_s
        wanted = (*map(float, state.dq_d), *map(float, state.ddq_d))
        return ArmReading(
            float(state.time.to_sec()),
            now_s,
            tuple(map(float, state.q)),
            tuple(map(float, state.dq)),
            self._gap,
            max(map(abs, wanted)) < AT_REST,
        )

    def _errors(self) -> str | None:
        """Names of the errors of a robot that was stopped; None where it was not."""
        state = self._robot.state
        mode = self._franky.RobotMode
        stopped = state.robot_mode in (mode.Reflex, mode.UserStopped)
        return error_names(state.current_errors) if stopped else None

    def _begin(self, motion: MotionResult) -> None:
        """Send the motion that waits, once the robot's control wants the arm to stand."""
        if self.reading.at_rest:
            motion.began_s = self.reading.robot_s
            points, self._waiting = self._waiting, ()
            self._robot.move(self._waypoints(points), True)

    def _waypoints(self, points: Sequence[TrajectoryPoint]) -> Any:
        """Points as a motion of franky's planner, which keeps to limits of its own accord.

        The last one has no least time: the planner of franky 2.0 would plan once more for an arm
        that has arrived, and fail. It goes there with the accelerations that it was planned with.
        """
        franky, before, found = self._franky, 0.0, []
        for point in points:
            given: dict[str, Any] = {
                "minimum_time": franky.Duration(max(1, round((point.time_s - before) * 1000)))
            }
            if point is points[-1]:
                given = {"relative_dynamics_factor": self._gentle(points)}
            velocities = point.velocities or (0.0,) * len(point.positions)
            target = franky.JointState(point.positions, velocities)
            found.append(franky.JointWaypoint(target, **given))
            before = point.time_s
        return franky.JointWaypointMotion(found)

    def _gentle(self, points: Sequence[TrajectoryPoint]) -> Any:
        """Fractions of the limits that the last of some points asks for."""
        still = (0.0,) * len(self.reading.joints)
        before = points[-2] if len(points) > 1 else TrajectoryPoint(0.0, self.reading.joints, still)
        peaks = step_peaks(
            np.array((before.positions, points[-1].positions)),
            np.array((before.velocities or still, still)),
            np.array((points[-1].time_s - before.time_s,)),
        )[0]
        shares = (peaks / self.settings.motion_limits.rows()).max(axis=1)
        return self._franky.RelativeDynamicsFactor(*np.clip(shares, LEAST_SHARE, 1.0).tolist())

    def _look_at_motion(self, motion: MotionResult) -> None:
        if not self._robot.poll_motion():
            return
        motion.ended_s = self.reading.robot_s
        self._motion = None
        motion.done.set()

    def _look_at_grip(self, outcome: MotionResult, begun: Any) -> None:
        if not begun.wait(0.0):
            return
        self._grip = None
        outcome.ended_s = self.reading.robot_s
        try:
            begun.get()
        except Exception as error:
            outcome.error = gripper_fault(error)
            self.fault = outcome.error
        outcome.done.set()

    def _fail(self, error: SlapError) -> None:
        """Keep the first fault, and end what is under way with it."""
        with self._lock:
            self.fault = self.fault or error
            self._waiting = ()
            ended = [self._motion, self._grip[0] if self._grip is not None else None]
            self._motion = self._grip = None
        for outcome in ended:
            if outcome is not None:
                outcome.error = error
                outcome.done.set()
