# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One of our learners' own environments as a Gymnasium environment: a single episode at a time.

States, observations, actions and rewards are those that shortcuts and skills are learned from, by
the same code.
"""

from __future__ import annotations

from abc import abstractmethod
from itertools import count, islice
from typing import Any, Generic, TypeVar

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from slap_ros.environments.controls import checked
from slap_ros.errors import InvalidParameterError, InvalidStateError
from slap_ros.learning.vec_env import VecEnv, VecEnvStep

Start = TypeVar("Start")
Vector = NDArray[np.float32]
MOST_TASKS = 100  # tasks in which a start is looked for, one after the other


class MdpEnv(gymnasium.Env[Vector, Vector], Generic[Start]):
    """Episodes that begin where something is learned, each in another task.

    ``reset(seed=S, options={"index": I})`` begins in the task that ``slap evaluate`` has at that
    seed and index; without an index, in the next task in which there is something to learn.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 -- Gymnasium's own

    def __init__(self, name: str) -> None:
        """Look for a first start, for what there is to be seen.

        Args:
            name: Name of what is learned, for messages.

        Raises:
            InvalidStateError: None of the first tasks of seed 0 has one.
        """
        self._name = name
        self._starts: dict[tuple[int, int], Start | None] = {}
        self._seed: int | None = None
        self._index = -1
        self._env = self._begin(self._next(0))
        features, axes = self._env.observations.shape[1], self._env.action_map.size
        self.observation_space = spaces.Box(-np.inf, np.inf, (features,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (axes,), np.float32)
        self._seed, self._begun = None, False

    @abstractmethod
    def _find(self, seed: int, index: int) -> Start | None:
        """Where an episode begins in a task; None where there is nothing to learn."""

    @abstractmethod
    def _begin(self, start: Start) -> VecEnv:
        """Our environments, one of them, in which an episode has begun."""

    @abstractmethod
    def _success(self, step: VecEnvStep) -> bool:
        """Whether what is learned was achieved in the step."""

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Vector, dict[str, Any]]:
        """Begin an episode; see the class.

        Raises:
            InvalidParameterError: An option is not known.
            InvalidStateError: There is nothing to learn in the task, or in none of many.
        """
        super().reset(seed=seed)
        for name in options or {}:
            if name != "index":
                raise InvalidParameterError(f"unknown option {name!r}; there is index")
        if seed is not None or self._seed is None:
            self._seed = int(self.np_random.integers(2**31)) if seed is None else seed
            self._index = -1
        index = (options or {}).get("index")
        start = self._next(self._seed) if index is None else self._at(self._seed, int(index))
        self._env, self._begun = self._begin(start), True
        return self._env.observations[0].copy(), {"success": False, "failure": False, "steps": 0}

    def step(self, action: Any) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """Act for one environment step.

        Raises:
            InvalidParameterError: No episode has begun.
            InvalidCommandError: The action is not in the action space; nothing moved.
        """
        if not self._begun:
            raise InvalidParameterError("no episode has begun: call reset() first")
        assert isinstance(self.action_space, spaces.Box)
        step = self._env.step(checked(action, self.action_space)[None])
        info = {
            "success": self._success(step),
            "failure": bool(step.failure[0]),
            "steps": int(step.lengths[0]),
        }
        ended = bool(step.success[0] or step.failure[0])
        seen: Vector = step.final_observations[0].copy()
        return seen, float(step.rewards[0]), ended, bool(step.truncated[0]), info

    # -- which task -------------------------------------------------------------------------------

    def _next(self, seed: int) -> Start:
        """The start of the next task that has one."""
        for index in islice(count(self._index + 1), MOST_TASKS):
            start = self._known(seed, index)
            if start is not None:
                self._index = index
                return start
        raise InvalidStateError(
            f"{self._name} begins in none of {MOST_TASKS} tasks of seed {seed}, from index "
            f"{self._index + 1} on: choose another preset"
        )

    def _at(self, seed: int, index: int) -> Start:
        """The start of a task that was asked for."""
        start, self._index = self._known(seed, index), index
        if start is None:
            raise InvalidStateError(f"{self._name} does not begin in task {index} of seed {seed}")
        return start

    def _known(self, seed: int, index: int) -> Start | None:
        """The start of a task, looked for once."""
        if (seed, index) not in self._starts:
            self._starts[seed, index] = self._find(seed, index)
        return self._starts[seed, index]
