# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The world: a Gymnasium environment that knows nothing of slap_ros. Lengths in m."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

MAX_STEP = 0.1  # displacement along each axis in a step
PERIOD = 0.1  # s, a step; nominal, as nothing moves by itself
LOW = 0.02  # height of the hand below which it touches marbles
HIGHEST = (1.0, 1.0, 0.2)  # of the hand, which is above the tray
GRASP_REACH = 0.03  # from the hand to a marble, seen from above
FAN = 0.25  # half the width of the open fan, along y
GUTTER = 0.9  # x from which on there is no tray
IN_GUTTER = 0.95  # x of a marble in the gutter
CLOSE, OPEN = 0.5, -0.5  # gripper commands beyond which the fan closes or opens

Features = dict[str, np.ndarray[Any, np.dtype[np.float64]]]


class MarblesEnv(gymnasium.Env[Features, Any]):
    """A hand (x, y, z) and marbles (x, y, held), each a dictionary entry by its name.

    Actions: displacement of the hand, then the gripper. The fan closes around a marble below it,
    and otherwise stays open. Open and low, it pushes to the right what it meets. A marble that is
    let go falls where it is; in the gutter it stays.
    """

    action_space = Box(np.float32([-MAX_STEP] * 3 + [-1]), np.float32([MAX_STEP] * 3 + [1]))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Features, dict[str, Any]]:
        """Continue from ``options["state"]``; raises ``ValueError`` where there is none."""
        super().reset(seed=seed)
        if not options or "state" not in options:
            raise ValueError('give the state to begin with: reset(options={"state": ...})')
        self._state: Features = {k: np.array(v, dtype=float) for k, v in options["state"].items()}
        if np.any([(v[:2] < 0.0) | (v[:2] > 1.0) for v in self._state.values()]):
            raise ValueError("hand and marbles are in the unit square")
        return self._observe(), {}

    def step(self, action: Any) -> tuple[Features, float, bool, bool, dict[str, Any]]:
        """The fan acts, then the hand moves."""
        *displacement, command = np.asarray(action, dtype=float)
        hand = self._state["hand"]
        marbles = [v for name, v in self._state.items() if name != "hand"]
        held = next((m for m in marbles if m[2] > 0.5), None)
        if command > CLOSE and held is None:
            held = self._grasp(hand, marbles)
        elif command < OPEN and held is not None:
            held[:] = (IN_GUTTER if held[0] >= GUTTER else held[0], held[1], 0.0)
            held = None
        before = hand.copy()
        hand[:] = np.clip(hand + displacement, 0.0, HIGHEST)
        if held is not None:
            held[:2] = hand[:2]
        elif min(before[2], hand[2]) < LOW:
            self._sweep(before[0], hand, marbles)
        return self._observe(), 0.0, False, False, {}

    def _grasp(self, hand: Any, marbles: list[Any]) -> Any:
        distance = [np.hypot(*(m[:2] - hand[:2])) for m in marbles]
        nearest = int(np.argmin(distance))
        if hand[2] >= LOW or distance[nearest] > GRASP_REACH or marbles[nearest][0] >= GUTTER:
            return None
        marbles[nearest][:] = (*hand[:2], 1.0)
        return marbles[nearest]

    def _sweep(self, start: float, hand: Any, marbles: list[Any]) -> None:
        """Push to the right what is in the way; to the left the fan gives way."""
        for marble in marbles:
            in_the_way = start <= marble[0] <= hand[0] and abs(marble[1] - hand[1]) < FAN
            if in_the_way and marble[0] < GUTTER:
                marble[0] = IN_GUTTER if hand[0] >= GUTTER else hand[0]

    def _observe(self) -> Features:
        return {name: features.copy() for name, features in self._state.items()}
