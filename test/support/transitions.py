# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States in the thick of it, what was done in them, and what came of it.

All blocks are alike, or each is of a material of its own that differs from push to push, or they
are no blocks but toys of many pieces.

``python -m support.transitions FILE`` replays recorded pairs and prints how many come out
differently.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.physics_step import SCENE, pushes, tower, with_joints
from slap_ros.geometry.pose import Pose
from slap_ros.relational import State
from slap_ros.worlds.features import body_features
from slap_ros.worlds.joint_space.features import ROBOT, robot_features
from slap_ros.worlds.joint_space.gripper import finger_around
from slap_ros.worlds.joint_space.scene import Scene
from slap_ros.worlds.joint_space.world import PandaWorld
from slap_ros.worlds.panda import GRASP_POINT, HOME, MAX_STEP, hand_pose
from support.materials import mixed
from support.toys import TOYS, heap

HIGH = np.array([*MAX_STEP, 1.0])
GRASP = Pose((0.002, -0.003, GRASP_POINT))  # not quite in the middle
KINDS: dict[str, tuple[Scene, Callable[[np.random.Generator], State]]] = {
    "alike": (SCENE, lambda _: tower()),
    "mixed": (SCENE, mixed),
    "toys": (TOYS, heap),
}


@dataclass(frozen=True)
class Transitions:
    """``after[i]`` is what ``actions[i]`` makes of ``before[i]``."""

    kind: str  # of KINDS
    before: np.ndarray  # (pairs, features)
    actions: np.ndarray  # (pairs, 8)
    after: np.ndarray

    def save(self, path: Path) -> None:
        np.savez(path, kind=self.kind, before=self.before, actions=self.actions, after=self.after)

    @classmethod
    def load(cls, path: Path) -> Transitions:
        with np.load(path) as file:
            return cls(str(file["kind"]), file["before"], file["actions"], file["after"])

    @property
    def scene(self) -> Scene:
        return KINDS[self.kind][0]

    @property
    def start(self) -> State:
        """A state of the same objects."""
        return KINDS[self.kind][1](np.random.default_rng(0))

    def state(self, i: int) -> State:
        return State(self.start.layout, self.before[i].copy())

    def differing(self, world: PandaWorld, order: Iterable[int]) -> list[int]:
        """The pairs that come out differently, in any bit."""
        different = []
        for i in order:
            world.reset(self.state(i))
            if world.step(self.actions[i]).key != self.after[i].tobytes():
                different.append(i)
        return different


def holding(state: State, name: str, joints=HOME, scene: Scene = SCENE) -> State:
    """The state with one block in the hand."""
    (robot,) = state.layout.of_type(ROBOT)
    block = state.layout.object(name)
    pose = hand_pose(joints).compose(GRASP)
    (body,) = (body for body in scene.free if body.name == name)
    features = {
        robot: robot_features(joints, finger_around(body, GRASP), GRASP),
        block: body_features(pose.position, pose.quaternion, held=True),
    }
    changes = {(obj, f): value for obj, given in features.items() for f, value in given.items()}
    return state.replace(changes)


def in_the_air(state: State, rng: np.random.Generator) -> State:
    """The state with block T thrown."""
    block = state.layout.object("T")
    turn = rng.normal(size=4)
    turn /= np.linalg.norm(turn)
    features = body_features(
        (0.35, -0.25, rng.uniform(0.15, 0.4)),
        tuple(turn.tolist()),
        tuple(rng.normal(0, 0.5, 3).tolist()),
        tuple(rng.normal(0, 4, 3).tolist()),
    )
    return state.replace({(block, name): value for name, value in features.items()})


def record(count: int, seed: int, kind: str = "alike") -> Transitions:
    """Pairs from pushes with an empty and a full hand, throws, and a gripper that acts."""
    rng = np.random.default_rng(seed)
    scene, make = KINDS[kind]
    rows: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    with PandaWorld(scene, make(rng)) as world:
        for number, push in enumerate(pushes(count // 9, seed)):
            standing = make(rng)
            start = with_joints(standing, push.joints)
            if number % 3 == 1:
                start = holding(standing, "T", tuple(push.joints.tolist()), scene)
            elif number % 3 == 2:
                start = in_the_air(start, rng)
            world.reset(start)
            quiet = np.zeros((3, 8))
            for action in np.concatenate([push.actions, quiet])[::2]:
                noisy = np.clip(action + rng.normal(0, 0.01, 8), -HIGH, HIGH)
                if rng.random() < 0.1:
                    noisy[7] = rng.choice([-1.0, 1.0])
                before = world.state
                rows.append((before.data, noisy, world.step(noisy).data))
    chosen = rng.permutation(len(rows))[:count]
    return Transitions(kind, *(np.array([rows[i][part] for i in chosen]) for part in range(3)))


def main() -> None:
    transitions = Transitions.load(Path(sys.argv[1]))
    order = np.random.default_rng(77).permutation(len(transitions.before))
    with PandaWorld(transitions.scene, transitions.start) as world:
        for _ in range(20):
            world.step(HIGH * [1, 1, 1, 1, 1, 1, 1, 0])  # another history first
        differing = transitions.differing(world, order)
    sys.stdout.write(f"{len(differing)} of {len(order)} differ\n")


if __name__ == "__main__":
    main()
