# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States in the thick of it, what was done in them, and what came of it.

``python -m support.contact_transitions FILE`` replays recorded ones and prints how many differ.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.workbench import BENCH, HANDLE_AT, Move, Setting, action_towards, position, start
from slap_ros.geometry.pose import Pose
from slap_ros.relational import State
from slap_ros.worlds.contact.hand import hand_at
from slap_ros.worlds.contact.world import ACTION_SPACE, ContactWorld

LOW, HIGH = np.array(ACTION_SPACE.low), np.array(ACTION_SPACE.high)
QUARTER = math.pi / 2


@dataclass(frozen=True)
class Transitions:
    """``after[i]`` is what ``actions[i]`` makes of ``before[i]``."""

    before: np.ndarray  # (steps, features)
    actions: np.ndarray  # (steps, 5)
    after: np.ndarray

    def save(self, path: Path) -> None:
        np.savez(path, before=self.before, actions=self.actions, after=self.after)

    @classmethod
    def load(cls, path: Path) -> Transitions:
        with np.load(path) as file:
            return cls(file["before"], file["actions"], file["after"])

    def state(self, i: int) -> State:
        return State(start().layout, self.before[i].copy())

    def differing(self, world: ContactWorld, order: Iterable[int]) -> list[int]:
        """Those that come out differently, in any bit."""
        different = []
        for i in order:
            world.reset(self.state(i))
            if world.step(self.actions[i]).data.tobytes() != self.after[i].tobytes():
                different.append(int(i))
        return different


def grasping(state: State, name: str, height: float) -> list[Move]:
    """Grasp a thing, lift it, carry it against the other things, let it fall."""
    x, y, z = position(state, name).tolist()
    return [
        Move((x, y, 0.1), 8),
        Move((x, y, z), 8),
        Move((x, y, z), 6, close=True),
        Move((x, y, height), 10, close=True),
        Move((0.6, -y, 0.06), 14, close=True),
        Move((0.6, -y, 0.06), 14),
    ]


def pulling() -> list[Move]:
    """Open the left drawer, let go, push it shut."""
    x, y, z = HANDLE_AT
    return [
        Move((x, y, z), 8, yaw=QUARTER),
        Move((x, y, z), 6, close=True, yaw=QUARTER),
        Move((x - 0.12, y, z), 14, close=True, yaw=QUARTER, fastest=0.01),
        Move((x - 0.12, y, 0.14), 8, yaw=QUARTER),
        Move((x - 0.2, y, 0.14), 5, close=True, yaw=QUARTER),
        Move((x - 0.2, y, z), 8, close=True, yaw=QUARTER),
        Move((x, y, z), 11, close=True, yaw=QUARTER),
    ]


def pushing() -> list[Move]:
    """Turn the lid down from behind and press on it; then through the rod."""
    return [
        Move((0.71, 0.0, 0.1), 6, close=True),
        Move((0.66, 0.0, 0.05), 8, close=True),
        Move((0.7, 0.0, 0.05), 12, close=True),
        Move((0.5, -0.2, 0.02), 12, close=True),
        Move((0.5, -0.05, 0.015), 12, close=True),
    ]


def episodes(rng: np.random.Generator) -> Iterable[tuple[State, list[Move]]]:
    """Where each begins, and what is done."""
    turn = Pose((0.45, 0.1, 0.02), (0.0, 0.0, math.sin(0.3), math.cos(0.3)))
    yield start(Setting(cube=turn)), grasping(start(), "cube", 0.15)
    yield start(), grasping(start(), "rod", 0.12)
    above = (*HANDLE_AT[:2], 0.14)
    yield start(Setting(hand_at(above, QUARTER))), pulling()
    yield start(Setting(hand_at((0.76, 0.0, 0.12)), openings=(0.1, 0.0, 1.5))), pushing()
    in_drawer = Pose((0.55, 0.25, 0.1), (0.0, 0.0, math.sin(0.2), math.cos(0.2)))
    yield start(Setting(hand_at((0.55, 0.25, 0.2)), cube=in_drawer, openings=(0.15, 0.05, 0.3))), []
    place = (float(rng.uniform(0.45, 0.6)), float(rng.uniform(-0.1, 0.1)), 0.1)
    yield start(Setting(hand_at(place))), []


def record(count: int, seed: int) -> Transitions:
    """Scripts with noise; where a script is at its end, random motion downwards."""
    rng = np.random.default_rng(seed)
    rows: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    with ContactWorld(BENCH, start()) as world:
        while len(rows) < count:
            for begin, moves in episodes(rng):
                world.reset(begin)
                script = [move for move in moves for _ in range(move.steps)]
                for k in range(len(script) or 60):
                    if script:
                        action = action_towards(world.state, script[k])
                        action[:4] += rng.normal(0.0, (0.002, 0.002, 0.002, 0.03))
                    else:
                        action = rng.uniform(LOW, HIGH) - [0.0, 0.0, 0.006, 0.0, 0.0]
                    action = np.clip(action, LOW, HIGH)
                    before = world.state
                    rows.append((before.data, action, world.step(action).data))
    chosen = rng.permutation(len(rows))[:count]
    return Transitions(*(np.array([rows[i][part] for i in sorted(chosen)]) for part in range(3)))


def main() -> None:
    recorded = Transitions.load(Path(sys.argv[1]))
    order = np.random.default_rng(77).permutation(len(recorded.before))
    with ContactWorld(BENCH, start()) as world:
        different = recorded.differing(world, order)
    sys.stdout.write(f"{len(different)} of {len(order)} differ")


if __name__ == "__main__":
    main()
