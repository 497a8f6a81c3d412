# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The physics step against plain stepping: ``python -m benchmarks.physics_step [--json]``.

Both in one process, in turns, in CPU time. Plain stepping is what one writes first: the Panda's
articulated URDF, placed at its joint targets, then 30 substeps of 1/240 s, always.

``--pushes 200`` also asks how true pushes are: the same scripted pushes of a tower of three, by
plain stepping, by ours, and by a fine-step reference that is neither marked at rest nor skipped;
and how many of these steps come out differently, in any bit, when replayed in another order.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.geometry.pose import Pose, conjugate, multiply
from slap_ros.meshes.obj import to_obj
from slap_ros.meshes.solid import Solid
from slap_ros.relational import Object, State, Type
from slap_ros.worlds.bullet import PANDA, pybullet
from slap_ros.worlds.features import BODY_FEATURES, body_features
from slap_ros.worlds.joint_space.arm import Arm
from slap_ros.worlds.joint_space.drive import Drive
from slap_ros.worlds.joint_space.features import ROBOT, robot_features
from slap_ros.worlds.joint_space.scene import (
    CUBE_EDGE,
    REFERENCE_FRICTION,
    TABLE,
    TABLE_TOP,
    Body,
    Scene,
    cube,
)
from slap_ros.worlds.joint_space.simulation import Simulation, Stepping
from slap_ros.worlds.joint_space.snapshot import SceneIndex
from slap_ros.worlds.joint_space.world import ACTION_SPACE, STEPPING, PandaWorld
from slap_ros.worlds.layout_index import BodyState
from slap_ros.worlds.panda import (
    FINGER_OPEN,
    HOME,
    JOINT_HIGH,
    JOINT_LOW,
    JOINTS,
    MAX_STEP,
    grasp_pose,
    jacobian,
)

Array = NDArray[np.float64]

BLOCK = Type("block", BODY_FEATURES)
NAMES = ("T", "B", "C", "D")
BOTTOM = NAMES.index("B")  # of the tower
TOWER_AT = (0.5, 0.0)  # m
SCENE = Scene((TABLE, *(cube(name) for name in NAMES)))
FINE = Stepping(substeps=128, iterations=150)

EPISODE = 50  # steps from home with random actions
EPISODES = 20
TOWER_PUSHES = 12  # there and back again
ROUNDS = 3  # the best counts: others share the machine
STILL = 0.02  # m/s and rad/s
FALLEN = 0.02  # m, by which a block of the tower came down
MOST_SETTLING = 24  # steps


def tower() -> State:
    """B, C, D stacked in the middle of the table, T beside them, the arm at home."""
    places = [(0.375, -0.2, 0), (*TOWER_AT, 0), (*TOWER_AT, 1), (*TOWER_AT, 2)]
    features = {ROBOT("robot"): robot_features(HOME)}
    for name, (x, y, level) in zip(NAMES, places, strict=True):
        z = TABLE_TOP + CUBE_EDGE * (level + 0.5)
        features[BLOCK(name)] = body_features((x, y, z))
    return State.build(features)


def with_joints(state: State, joints: Array | Sequence[float]) -> State:
    """The state with the arm elsewhere."""
    (robot,) = state.layout.of_type(ROBOT)
    return state.replace({(robot, f"joint{i + 1}"): q for i, q in enumerate(joints)})


# -- pushes -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Push:
    """A straight push with the hand pointing down."""

    joints: Array  # rad, (7,), at the start
    actions: Array  # (steps, 8)


def pushes(count: int, seed: int) -> list[Push]:
    """Pushes through the tower at random heights, directions, offsets, yaws and speeds."""
    rng = np.random.default_rng(seed)
    found: list[Push] = []
    while len(found) < count:
        push = _push(rng)
        if push is not None:
            found.append(push)
    return found


def _push(rng: np.random.Generator) -> Push | None:
    height, direction = rng.uniform(0.09, 0.24), rng.uniform(-math.pi, math.pi)
    offset, yaw = rng.uniform(-0.03, 0.03), rng.uniform(-0.6, 0.6)
    step = 0.03 * rng.choice([0.2, 0.5, 1.0])  # m
    ahead = np.array([math.cos(direction), math.sin(direction), 0.0])
    aside = np.array([-ahead[1], ahead[0], 0.0])
    point = np.array([*TOWER_AT, height]) + offset * aside - 0.14 * ahead
    start = reach(point, yaw, np.array(HOME))
    if start is None:
        return None
    joints, actions = start, []
    for _ in range(int(0.22 / step)):
        point = point + step * ahead
        after = reach(point, yaw, joints)
        if after is None:
            return None
        move = (after - joints) * min(1.0, 1.0 / max(np.abs((after - joints) / MAX_STEP)))
        joints = joints + move
        actions.append([*move, 0.0])
    return Push(start, np.array(actions))


def reach(point: Array, yaw: float, joints: Array) -> Array | None:
    """Joint positions with the grasp point somewhere, the hand pointing down.

    Args:
        point: Position of the grasp point, m, shape (3,).
        yaw: Yaw of the hand, rad.
        joints: Joint positions to begin the search at, rad, shape (7,).

    Returns:
        rad, shape (7,); None where none are found within the limits.
    """
    down = (math.cos(yaw / 2), math.sin(yaw / 2), 0.0, 0.0)
    for _ in range(60):
        position, quaternion = grasp_pose(joints)
        *axis, w = multiply(down, conjugate(quaternion))
        error = np.array([*(point - position), *(2.0 * math.copysign(1.0, w) * np.array(axis))])
        if np.abs(error).max() < 1e-4:
            inside = np.all((joints >= JOINT_LOW) & (joints <= JOINT_HIGH))
            return joints if inside else None
        slopes = jacobian(joints)
        damped = slopes @ slopes.T + 1e-4 * np.eye(6)
        joints = joints + np.clip(slopes.T @ np.linalg.solve(damped, error), -0.2, 0.2)
    return None


# -- worlds -------------------------------------------------------------------------------------


class Stepped(Protocol):
    """A world to compare."""

    def reset(self, joints: Array) -> None:
        """The tower as it was, the arm there."""

    def step(self, action: Array) -> None:
        """Act for one control step."""

    def blocks(self) -> Array:
        """Position, quaternion, velocity and spin of each block, (4, 13)."""


class Ours:
    """The world of ``slap_ros.worlds.joint_space``."""

    def __init__(self) -> None:
        self._start = tower()
        self.world = PandaWorld(SCENE, self._start)
        self._blocks: list[Object] = [self._start.layout.object(name) for name in NAMES]

    def reset(self, joints: Array) -> None:
        """The tower as it was, the arm there."""
        self.world.reset(with_joints(self._start, joints))

    def step(self, action: Array) -> None:
        """Act for one control step."""
        self.world.step(action)

    def blocks(self) -> Array:
        """Position, quaternion, velocity and spin of each block, (4, 13)."""
        return np.array([self.world.state[block][:13] for block in self._blocks])


class Fine:
    """The driven links with fine substeps; nothing is skipped, nothing marked at rest."""

    def __init__(self) -> None:
        self._start = [motion_of(tower(), name) for name in NAMES]
        self._simulation = Simulation(SCENE, FINE)
        self._simulation.place_fixed(tuple(body.pose for body in SCENE.fixed))

    def reset(self, joints: Array) -> None:
        """The tower as it was, the arm there."""
        self._bodies, self._joints = self._start, np.array(joints)

    def step(self, action: Array) -> None:
        """Act for one control step."""
        after = np.clip(self._joints + action[:JOINTS], JOINT_LOW, JOINT_HIGH)
        start, end = (Arm.at(q.tolist(), FINGER_OPEN) for q in (self._joints, after))
        drives = [Drive.between(a, b) for a, b in zip(start.links, end.links, strict=True)]
        self._bodies, self._joints = self._simulation.run(self._bodies, None, drives), after

    def blocks(self) -> Array:
        """Position, quaternion, velocity and spin of each block, (4, 13)."""
        return np.array(
            [
                [*m.pose.position, *m.pose.quaternion, *m.velocity, *m.angular_velocity]
                for m in self._bodies
            ]
        )


def motion_of(state: State, name: str) -> BodyState:
    """A block that stands upright, at rest."""
    x, y, z = state[state.layout.object(name)][:3].tolist()
    return BodyState(Pose((x, y, z)))


class Plain:
    """The articulated URDF, teleported, and 30 substeps of PyBullet as it comes, always."""

    SUBSTEPS = 30  # of 1/240 s, PyBullet's own
    FINGERS = (9, 10)  # joint indices in the URDF

    def __init__(self, scene: Scene = SCENE, start: State | None = None) -> None:
        """The bodies of a scene as they are in a state; without one, the tower."""
        self._scene = scene
        self._start = tower() if start is None else start
        self._client: int | None = None

    def reset(self, joints: Array) -> None:
        """The tower as it was, the arm there: a new scene, as a reset would not clear contacts."""
        if self._client is None:
            self._client = pybullet.connect(pybullet.DIRECT)
        client = self._client
        pybullet.resetSimulation(physicsClientId=client)
        pybullet.setGravity(0.0, 0.0, -9.81, client)
        scene, reader = self._scene, SceneIndex.of(self._scene, self._start.layout)
        for body, pose in zip(
            scene.fixed, reader.fixed_poses(scene.fixed, self._start), strict=True
        ):
            self._add(body, pose)
        motions = reader.read(self._start).bodies
        self._blocks = [
            self._add(body, motion.pose) for body, motion in zip(scene.free, motions, strict=True)
        ]
        self._robot = pybullet.loadURDF(
            str(PANDA / "panda.urdf"), useFixedBase=True, physicsClientId=client
        )
        for link in range(-1, pybullet.getNumJoints(self._robot, client)):
            for i in range(len(scene.fixed)):
                pybullet.setCollisionFilterPair(self._robot, i, link, -1, 0, client)
        self._joints = np.array(joints)
        self._place()

    def _add(self, body: Body, pose: Pose) -> int:
        client = self._client
        added: int = pybullet.createMultiBody(
            body.mass_kg, self._shape(body), -1, *pose, physicsClientId=client
        )
        pybullet.changeDynamics(
            added, -1, lateralFriction=REFERENCE_FRICTION, physicsClientId=client
        )
        return added

    def _shape(self, body: Body) -> int:
        if isinstance(body.shape, Solid):
            with TemporaryDirectory() as folder:
                file = Path(folder) / f"{body.name}.obj"
                file.write_text(to_obj(body.shape.pieces), encoding="utf-8")
                hulls: int = pybullet.createCollisionShape(
                    pybullet.GEOM_MESH, fileName=str(file), physicsClientId=self._client
                )
            return hulls
        box: int = pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=body.shape, physicsClientId=self._client
        )
        return box

    def _place(self) -> None:
        for i, q in enumerate(self._joints.tolist()):
            pybullet.resetJointState(self._robot, i, q, 0.0, self._client)
        for i in self.FINGERS:
            pybullet.resetJointState(self._robot, i, FINGER_OPEN, 0.0, self._client)

    def step(self, action: Array) -> None:
        """Act for one control step."""
        self._joints = np.clip(self._joints + action[:JOINTS], JOINT_LOW, JOINT_HIGH)
        self._place()
        for _ in range(self.SUBSTEPS):
            pybullet.stepSimulation(self._client)
        self._place()

    def blocks(self) -> Array:
        """Position, quaternion, velocity and spin of each block, (blocks, 13)."""
        rows = []
        for body in self._blocks:
            position, quaternion = pybullet.getBasePositionAndOrientation(body, self._client)
            velocity, angular_velocity = pybullet.getBaseVelocity(body, self._client)
            rows.append([*position, *quaternion, *velocity, *angular_velocity])
        return np.array(rows)


# -- speed --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Episode:
    """Where the arm starts and what it does."""

    joints: Array
    actions: Array


def away() -> list[Episode]:
    """Random actions from home, within the speed limit."""
    rng = np.random.default_rng(0)
    high = np.array([*MAX_STEP, 0.0])
    return [
        Episode(np.array(HOME), rng.uniform(-high, high, (EPISODE, 8))) for _ in range(EPISODES)
    ]


def in_tower() -> list[Episode]:
    """Through the tower, back, and through it again, without a pause."""
    return [
        Episode(push.joints, np.concatenate([push.actions, -push.actions[::-1], push.actions]))
        for push in pushes(TOWER_PUSHES, seed=3)
    ]


def steps_per_second(world: Stepped, episodes: list[Episode]) -> float:
    """Control steps a second of CPU time; setting up an episode does not count."""
    seconds = 0.0
    for episode in episodes:
        world.reset(episode.joints)
        world.step(episode.actions[0])
        start = process_time()
        for action in episode.actions[1:]:
            world.step(action)
            world.blocks()
        seconds += process_time() - start
    return sum(len(episode.actions) - 1 for episode in episodes) / seconds


def speed() -> dict[str, float]:
    """Steps a second, plain and ours, and their ratios."""
    plain, ours = Plain(), Ours()
    figures: dict[str, float] = {}
    for name, episodes in (("away", away()), ("contact", in_tower())):
        rates = [
            (steps_per_second(plain, episodes), steps_per_second(ours, episodes))
            for _ in range(ROUNDS)
        ]
        figures[f"{name}_plain_steps_per_s"] = max(rate for rate, _ in rates)
        figures[f"{name}_steps_per_s"] = max(rate for _, rate in rates)
        figures[f"{name}_ratio"] = (
            figures[f"{name}_steps_per_s"] / figures[f"{name}_plain_steps_per_s"]
        )
    return figures


# -- truth --------------------------------------------------------------------------------------


def play(world: Stepped, push: Push) -> Array:
    """The blocks' positions once all is still again, (4, 3)."""
    world.reset(push.joints)
    for action in push.actions:
        world.step(action)
    for _ in range(MOST_SETTLING):
        if np.abs(world.blocks()[:, 7:]).max() < STILL:
            break
        world.step(np.zeros(JOINTS + 1))
    return world.blocks()[:, :3]


def outcomes(world: Stepped, script: list[Push]) -> Iterator[tuple[bool, Array]]:
    """For each push: whether the tower fell, and how far each block was moved in m, (4,)."""
    before = np.array([motion.pose.position for motion in (motion_of(tower(), n) for n in NAMES)])
    for push in script:
        after = play(world, push)
        fell = bool((before[1:, 2] - after[1:, 2] > FALLEN).any())
        yield fell, np.linalg.norm(after[:, :2] - before[:, :2], axis=1)


def truth(count: int, seed: int = 11, plot: Path | None = None) -> dict[str, float]:
    """How plain stepping and ours agree with the fine reference on scripted pushes.

    Args:
        count: Number of pushes.
        seed: Seed of the pushes.
        plot: Folder for the plot; None for no plot.

    Returns:
        The figures by name, lengths in cm.
    """
    script = pushes(count, seed)
    results = {
        name: list(outcomes(world, script))
        for name, world in (("fine", Fine()), ("plain", Plain()), ("ours", Ours()))
    }
    fell = {name: np.array([f for f, _ in result]) for name, result in results.items()}
    moved = {name: np.array([m for _, m in result]) for name, result in results.items()}
    figures = {f"{name}_fell": float(f.mean()) for name, f in fell.items()}
    stayed = moved["fine"][:, BOTTOM] < 0.3  # m: one that fell off the table says little
    for name in ("plain", "ours"):
        figures[f"{name}_agrees"] = float((fell[name] == fell["fine"]).mean())
        off = (moved[name] - moved["fine"])[stayed, BOTTOM]
        figures[f"{name}_bottom_bias_cm"] = float(off.mean() * 100)
        figures[f"{name}_bottom_error_cm"] = float(np.abs(off).mean() * 100)
    if plot is not None:
        draw({name: m[:, BOTTOM] * 100 for name, m in moved.items()}, figures, plot)
    return figures


def draw(moved: dict[str, Array], figures: dict[str, float], folder: Path) -> None:
    """Plot how far the bottom block was pushed, against the reference.

    Args:
        moved: Distances by which the bottom block was moved, cm, shape (pushes,), by kind of
            stepping.
        figures: Figures by name, as :func:`truth` returns them.
        folder: Folder for the plot.
    """
    from matplotlib import pyplot  # only to make the picture

    figure, panels = pyplot.subplots(1, 2, figsize=(8, 4.2), sharex=True, sharey=True)
    for panel, name in zip(panels, ("plain", "ours"), strict=True):
        panel.plot([0, 25], [0, 25], color="0.7", linewidth=1)
        panel.scatter(moved["fine"], moved[name], s=10, alpha=0.6, color="#2a6f97")
        panel.set_title(
            f"{name}: {figures[f'{name}_agrees']:.1%} fall alike, "
            f"bias {figures[f'{name}_bottom_bias_cm']:+.1f} cm",
            fontsize=10,
        )
        panel.set(xlim=(-1, 25), ylim=(-1, 25), aspect="equal")
        panel.set_xlabel("reference, 1/1024 s (cm)")
    panels[0].set_ylabel("way of the bottom block (cm)")
    figure.tight_layout()
    figure.savefig(folder / "physics_pushes.png", dpi=110)


# -- purity -------------------------------------------------------------------------------------


class Unprimed(Simulation):
    """What is left of a simulation's purity without its prime."""

    def _prime(self, bodies: Sequence[BodyState]) -> None:
        pass


def impurity(simulation: Simulation, script: list[Push]) -> float:
    """Share of steps that come out differently, in any bit, after another history."""
    rng = np.random.default_rng(0)
    world = PandaWorld(SCENE, tower())
    world._simulation = simulation
    steps: list[tuple[State, Array, State]] = []
    for push in script:
        world.reset(with_joints(tower(), push.joints))
        for action in push.actions:
            noise = np.append(rng.normal(0, 0.01, JOINTS), 0.0)
            noisy = np.clip(action + noise, ACTION_SPACE.low, ACTION_SPACE.high)
            steps.append((world.state, noisy, world.step(noisy)))
    different = 0
    for i in rng.permutation(len(steps)):
        before, action, after = steps[i]
        world.reset(before)
        different += world.step(action) != after
    return different / len(steps)


def purity(count: int) -> dict[str, float]:
    """The share of impure steps: ours, and without the prime."""
    script = pushes(count, seed=5)
    variants = {
        "impure_ours": Simulation(SCENE, STEPPING),
        "impure_without_prime": Unprimed(SCENE, STEPPING),
    }
    for simulation in variants.values():
        simulation.place_fixed(tuple(body.pose for body in SCENE.fixed))
    return {name: impurity(simulation, script) for name, simulation in variants.items()}


def main() -> None:
    """Measure and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pushes", type=int, default=0, metavar="N", help="also compare N pushes")
    parser.add_argument("--json", action="store_true")
    parser.add_argument(
        "--plot",
        type=Path,
        metavar="FOLDER",
        help="folder for a plot of the pushes (needs matplotlib)",
    )
    arguments = parser.parse_args()
    figures = speed()
    if arguments.pushes:
        figures |= truth(arguments.pushes, plot=arguments.plot)
        figures |= purity(arguments.pushes)
    if arguments.json:
        print(json.dumps(figures))
        return
    for name, value in figures.items():
        print(f"{name:28s} {value:12,.3f}")


if __name__ == "__main__":
    main()
