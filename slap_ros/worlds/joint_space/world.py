# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A Panda among rigid bodies, as a world to be stepped.

A control step: the gripper acts, then the arm moves by the commanded joint displacements in one
control period, pushing what is in its way. The next state is a function of the state and the
action, bit for bit (``docs/physics.md`` says how, and what it costs).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from slap_ros.core import Action, ActionSpace, GripperAxis
from slap_ros.geometry.oriented_box import OrientedBox
from slap_ros.geometry.pose import Pose
from slap_ros.relational import Feature, State
from slap_ros.worlds.features import JOINT_FEATURES
from slap_ros.worlds.joint_space.arm import (
    POSTURE_AT,
    Obstacle,
    Penetration,
    Posture,
    Surroundings,
    Way,
)
from slap_ros.worlds.joint_space.drive import Drive
from slap_ros.worlds.joint_space.gripper import grip
from slap_ros.worlds.joint_space.raising import (
    MAX_RAISES,
    off_fixed_bodies,
    raised,
    within_limits,
)
from slap_ros.worlds.joint_space.scene import Scene
from slap_ros.worlds.joint_space.simulation import SIMULATIONS, Stepping
from slap_ros.worlds.joint_space.snapshot import SceneIndex, Snapshot
from slap_ros.worlds.joint_space.validation import require_valid
from slap_ros.worlds.layout_index import BodyState
from slap_ros.worlds.panda import HAND, MAX_STEP, grasp_pose
from slap_ros.worlds.simulated_world import SimulatedWorld

ACTION_SPACE = ActionSpace(
    axes=(*JOINT_FEATURES, Feature("gripper", "1")),
    low=(*(-step for step in MAX_STEP), -1.0),
    high=(*MAX_STEP, 1.0),
    gripper=GripperAxis("gripper"),
)
STEPPING = Stepping()

# What moved less than this in a control period, and is slower than this after it, is at rest.
REST_SPEED = 0.02  # m/s and rad/s, along each axis
REST_SHIFT = 2e-4  # m, along each axis
REST_TURN = 1e-3  # 1, of each component of the quaternion
PRESS_LIMIT = 0.006  # m, how far the arm may press bodies into one another; deeper, it yields
JAM_LIMIT = 0.02  # m, where no body moves: between two immovable ones the solver has no answer
CACHE_SIZE = 256  # arrangements of bodies of which it is known whether they are stable


@dataclass(eq=False, slots=True)
class _Arrangement:
    """Free bodies without velocity that are not held, among fixed ones."""

    poses: tuple[tuple[int, Pose], ...] = ()  # each with its index
    boxes: Surroundings[OrientedBox] = field(default_factory=Surroundings)
    stable: bool | None = None  # None: nobody has asked


class PandaWorld(SimulatedWorld[Scene]):
    """A Panda that follows joint commands, bodies that it pushes, and a gripper that attaches."""

    def __init__(
        self,
        scene: Scene,
        state: State,
        stepping: Stepping = STEPPING,
        actions: ActionSpace = ACTION_SPACE,
    ) -> None:
        """Begin in ``state``.

        Args:
            scene: Bodies of the scene.
            state: State to begin in: one robot, and an object for each free body of the scene.
            stepping: Resolution of the simulation. Another one makes another world.
            actions: Actions that may be commanded: the joints' speed limit, unless a domain has
                another.

        Raises:
            InvalidStateError: A scene that cannot be.
        """
        super().__init__(scene, state.layout)
        self._actions = actions
        self._index = SceneIndex.of(scene, state.layout)
        self._stability: dict[object, bool] = {}
        self._solid = [i for i, body in enumerate(scene.fixed) if body.solid]
        self._fixed_poses: tuple[Pose, ...] = ()
        self._obstacles: Surroundings[Obstacle] = Surroundings()
        self._adopt(state)
        self._simulation = SIMULATIONS.of((scene, stepping))

    def reset(self, state: State) -> None:
        """Continue from ``state``.

        Raises:
            InvalidStateError: A scene that cannot be, or other objects; the world stays as it is.
        """
        self._require_own_objects(state)
        self._adopt(state)

    def _adopt(self, state: State) -> None:
        state.require_finite()
        snapshot = self._index.read(state)
        poses = self._index.fixed_poses(self._scene.fixed, state)
        obstacles = self._obstacles_at(poses)
        materials = self._index.materials(self._scene, state)
        self._posture_at = POSTURE_AT.of(1)
        arm = self._arm(snapshot)
        require_valid(self._scene, snapshot, materials, arm, obstacles)
        self._state, self._snapshot, self._posture = state, snapshot, arm
        self._fixed_poses, self._materials = poses, materials
        self._obstacles = obstacles
        self._arrangement = _Arrangement()

    def _obstacles_at(self, poses: tuple[Pose, ...]) -> Surroundings[Obstacle]:
        """The solid fixed bodies, which mostly stand where they stood before."""
        if poses == self._fixed_poses:
            return self._obstacles
        return Surroundings(Obstacle.of(self._scene.fixed[i].at(poses[i])) for i in self._solid)

    def step(self, action: Action) -> State:
        """Act for one control period.

        Where a motion would drive the arm into a fixed body, the arm slides along the top of it.
        Where it would press bodies into one another, the hand yields upwards, or the arm goes half
        as far. Where that does not help, the motion is not carried out: the arm stays, the bodies
        go on. Nor does the gripper act where its fingers would enter a fixed body.

        Raises:
            InvalidCommandError: The action is not in the action space; nothing moved.
            ValueError: The world is closed.
        """
        self._require_open()
        self._actions.check(action)
        *displacement, command = action.tolist()
        gripped = self._gripped(command)
        start = self._posture
        if gripped is not self._snapshot:  # the fingers are still where they were
            start = self._arm(replace(gripped, finger=self._snapshot.finger))
        goal = gripped.with_joints(within_limits(gripped.joints, displacement))
        before = self._snapshot
        self._snapshot, self._posture = self._after(gripped, goal, start)
        self._state = self._index.write(self._state, before, self._snapshot)
        return self._state

    def joints_off_fixed_bodies(
        self, start: tuple[float, ...], depth: float, highest: float
    ) -> tuple[float, ...]:
        """Where a robot's arm is to go, whose joints are in this state where our physics has them.

        Here what is held may sink into a table by two centimetres. There, the arm would press on it
        as hard as it is stiff, and what is held would turn or slip in the hand.

        Args:
            start: Joint positions before the step, rad.
            depth: How far what is held may reach into a fixed body, m.
            highest: How far it may be raised, m; a wall beside it is no reason to climb over it.

        Returns:
            Joint positions within a step of the start, raised where that is needed and possible.
        """
        return off_fixed_bodies(
            start,
            self._snapshot.joints,
            lambda joints: self._arm(self._snapshot.with_joints(joints)),
            self._obstacles,
            highest,
            depth,
        )

    def _gripped(self, command: float) -> Snapshot:
        """How things are once the gripper acted, if it can."""
        gripped = grip(self._scene, self._snapshot, command)
        if gripped is not self._snapshot:
            arm = self._arm(gripped)
            if arm.to(arm).hits(self._obstacles):
                return self._snapshot
        return gripped

    def _after(self, now: Snapshot, goal: Snapshot, start: Posture) -> tuple[Snapshot, Posture]:
        """Where everything is once the arm went to its goal, or stayed because it must not."""
        sweep = start.to(self._arm(goal))
        if sweep.hits(self._obstacles):
            goal = self._sliding(now, goal, start)
            sweep = start.to(self._arm(goal))
        bodies, depth = self._bodies_after(now, sweep)
        for softer in (_hand_raised, _half_way, _stay):
            if depth <= PRESS_LIMIT or goal is now:
                break
            other = softer(now, goal, depth)
            way = start.to(self._arm(other))
            if other is now or not way.hits(self._obstacles):
                relieved, less = self._bodies_after(now, way)
                if less < depth:
                    goal, sweep, bodies, depth = other, way, relieved, less
        if depth > JAM_LIMIT:
            bodies = self._frozen(now, sweep.end)
        return goal.with_bodies(bodies), sweep.end

    def _sliding(self, now: Snapshot, goal: Snapshot, start: Posture) -> Snapshot:
        """The goal with the arm raised until it enters nothing; ``now`` if it cannot be raised."""
        for _ in range(MAX_RAISES):
            sweep = start.to(self._arm(goal))
            penetration = sweep.deepest_penetration(self._obstacles)
            if penetration is None:
                return now if sweep.hits(self._obstacles) else goal
            goal = goal.with_joints(raised(now.joints, goal.joints, penetration))
        return now

    def _arm(self, snapshot: Snapshot) -> Posture:
        held = None if snapshot.held is None else self._scene.free[snapshot.held]
        return self._posture_at(snapshot.joints, snapshot.finger, held, snapshot.grasp)

    def _bodies_after(self, now: Snapshot, sweep: Way) -> tuple[tuple[BodyState, ...], float]:
        """The free bodies after the arm's sweep, and how far any overlaps another, m."""
        bodies, depth = list(now.bodies), 0.0
        loose = [i for i in range(len(bodies)) if i != now.held]
        if not self._undisturbed(now, loose, sweep):
            after, depth = self._run(bodies, now.held, sweep.drives())
            came_to_rest = all(_rests(bodies[i], after[i]) for i in loose)
            for i in loose:
                bodies[i] = BodyState(bodies[i].pose) if came_to_rest else after[i]
        if now.held is not None:
            bodies[now.held] = BodyState(sweep.end.held_pose)
        return tuple(bodies), depth

    def _run(
        self, bodies: Sequence[BodyState], held: int | None, drives: Sequence[Drive] = ()
    ) -> tuple[list[BodyState], float]:
        """One control period, in the simulation that other worlds use in between.

        Returns:
            The free bodies afterwards, and how far any overlaps another, m.
        """
        simulation = self._simulation
        with simulation.lock:
            simulation.place_fixed(self._fixed_poses)
            simulation.set_materials(self._materials)
            return simulation.run(bodies, held, drives), simulation.deepest()

    def _frozen(self, now: Snapshot, end: Posture) -> tuple[BodyState, ...]:
        """The free bodies as they were, without velocity; the held one with the hand."""
        return tuple(
            BodyState(end.held_pose if i == now.held else body.pose)
            for i, body in enumerate(now.bodies)
        )

    def _undisturbed(self, now: Snapshot, loose: list[int], sweep: Way) -> bool:
        """Whether the bodies stand and the arm stays clear of them: nothing needs computing."""
        bodies = now.bodies
        if not all(bodies[i].still for i in loose):
            return False
        arrangement = self._arrangement_at(tuple([(i, bodies[i].pose) for i in loose]))
        if not sweep.stays_clear(arrangement.boxes):
            return False
        if arrangement.stable is None:
            arrangement.stable = self._stable(now, loose)
        return arrangement.stable

    def _arrangement_at(self, poses: tuple[tuple[int, Pose], ...]) -> _Arrangement:
        """The boxes around free bodies, which mostly stand where they stood before."""
        if poses != self._arrangement.poses:
            boxes = Surroundings(self._scene.free[i].at(pose) for i, pose in poses)
            self._arrangement = _Arrangement(poses, boxes)
        return self._arrangement

    def _stable(self, now: Snapshot, loose: list[int]) -> bool:
        """Whether bodies without velocity would stay where they are if there were no arm.

        They stay where they came to rest by themselves, but not in mid-air, over an edge,
        or where they came to rest leaning on the arm.
        """
        poses = tuple(now.bodies[i].pose for i in loose)
        key = (self._fixed_poses, self._materials, now.held, poses)
        stable = self._stability.get(key)
        if stable is None:
            after, _ = self._run(now.bodies, now.held)
            stable = all(_rests(now.bodies[i], after[i]) for i in loose)
            if len(self._stability) == CACHE_SIZE:
                self._stability.clear()
            self._stability[key] = stable
        return stable


def _half_way(now: Snapshot, goal: Snapshot, depth: float) -> Snapshot:
    """The goal half as far away: what is pressed has more time to give way."""
    del depth
    joints = tuple((a + b) / 2.0 for a, b in zip(now.joints, goal.joints, strict=True))
    return goal.with_joints(joints)


def _stay(now: Snapshot, goal: Snapshot, depth: float) -> Snapshot:
    """The arm where it is."""
    del goal, depth
    return now


def _hand_raised(now: Snapshot, goal: Snapshot, depth: float) -> Snapshot:
    """The goal with the hand higher by ``depth`` m; an arm that was not to move stays."""
    if goal.joints == now.joints:
        return now
    penetration = Penetration(HAND, grasp_pose(goal.joints).position, depth)
    return goal.with_joints(raised(now.joints, goal.joints, penetration))


def _rests(before: BodyState, after: BodyState) -> bool:
    """Whether a body hardly moved in a control period and hardly moves now."""
    (position, quaternion), (old_position, old_quaternion) = after.pose, before.pose
    return (
        all(abs(v) < REST_SPEED for v in (*after.velocity, *after.angular_velocity))
        and all(abs(x - y) < REST_SHIFT for x, y in zip(position, old_position, strict=True))
        and all(abs(x - y) < REST_TURN for x, y in zip(quaternion, old_quaternion, strict=True))
    )
