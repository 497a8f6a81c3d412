# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whole tasks for one policy that is both a controller and the options that it chooses from.

As in Scalable Option Learning (Henaff et al. 2025), which SLAP is compared with. An option leads to
an abstract state of the planning graph, by joint displacements, and is paid as a shortcut is. A
skill is an option that is given. The observation says whose turn it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from slap_ros.core import Domain, task_with_goal
from slap_ros.environments.controls import (
    JointControl,
    MixedControl,
    SkillControl,
    checked,
    run_option,
)
from slap_ros.environments.observations import Vector, vector_space
from slap_ros.environments.task_env import TaskEnv
from slap_ros.environments.task_rewards import PotentialReward
from slap_ros.planning.abstract_graph import build_abstract_graph
from slap_ros.planning.problem import Problem
from slap_ros.relational import AtomSpace
from slap_ros.shortcuts.signature import Change

LENGTHS = (1, 2, 5, 10, 100)  # environment steps of an option at most, as the controller says
MOST_OPTIONS = 64  # abstract states that options lead to, the first ones of the graph


class OptionControl(MixedControl):
    """Joints, and an activation for each skill, each option, and each length of an option."""

    def __init__(self, domain: Domain, space: AtomSpace, options: int) -> None:
        """Make room for the options.

        Args:
            domain: Domain with the skills.
            space: Atoms of the tasks, which all have the same objects.
            options: Number of options.
        """
        super().__init__(domain, space)
        (size,) = self.space.shape
        self.space = spaces.Box(-1.0, 1.0, (size + options + len(LENGTHS),), np.float32)


@dataclass
class RunningOption:
    """An option that is under way.

    Args:
        number: Number of the option.
        reward: Reward on the way to its target.
        left: Environment steps that are left.
    """

    number: int
    reward: PotentialReward
    left: int


class OptionTaskEnv(TaskEnv):
    """Tasks in which options take turns with a controller.

    On the controller's turn, the highest activation of an action is a skill, which runs to its end,
    or an option, which begins, for as many steps as the highest of the last activations says: that
    takes no environment step. As long as the option runs, actions move the joints. ``info`` has
    ``controller`` (whose action it was), ``intrinsic`` (the option's reward), ``over`` (whether the
    option ended) and ``controller_next``.
    """

    _running: RunningOption | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """See :meth:`TaskEnv.reset`; it is the controller's turn."""
        self._running = None
        return super().reset(seed=seed, options=options)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Choose, or act as the option that runs.

        Raises:
            InvalidParameterError: No episode has begun.
            InvalidCommandError: The action is not in the action space; nothing moved.
        """
        episode, given = self._under_way, checked(action, self._options.space)
        controller, intrinsic = self._running is None, 0.0
        if controller:
            lengths = given[-len(LENGTHS) :]
            total = self._choose(given[self._axes : -len(LENGTHS)], LENGTHS[int(lengths.argmax())])
        else:
            total, intrinsic = self._move(given[: self._axes])
        solved = episode.solved
        turn = {
            "controller": controller,
            "intrinsic": intrinsic,
            "over": not controller and self._running is None,
            "controller_next": self._running is None,
        }
        cut = episode.at_limit and not solved
        return self._observe(), total, solved, cut, {**self._info(), **turn}

    @property
    def option_count(self) -> int:
        """The number of options."""
        return len(self._nodes)

    def _choose(self, activations: Any, length: int) -> float:
        """Run a skill, or begin an option; the reward of the task."""
        episode, world = self._under_way, self._world
        assert world is not None
        chosen = int(activations.argmax())
        skills = self._options.skills.options
        if chosen < len(skills):
            return self._advance(run_option(skills, chosen, episode, world))
        number = chosen - len(skills)
        change = Change.between(episode.abstract & self._changing, self._nodes[number])
        if not change.add | change.delete:  # it is there already: nothing to do, for a step
            return self._advance(iter([world.step(episode.domain.action_space.hold)]))
        self._running = RunningOption(number, PotentialReward(episode, change), length)
        return 0.0

    def _move(self, displacements: Any) -> tuple[float, float]:
        """Move the joints as the option that runs; rewards of the task and of the option."""
        episode, running = self._under_way, self._running
        assert self._world is not None
        assert running is not None
        total = self._advance(self._options.joints.act(displacements, episode, self._world))
        reached = episode.abstract & self._changing == self._nodes[running.number]
        running.left -= 1
        if reached or not running.left:
            self._running = None
        return total, running.reward.of(episode.state, reached)

    # -- making it --------------------------------------------------------------------------------

    def _make_control(self, name: str) -> JointControl | SkillControl | MixedControl:
        """Skills and options; the latter lead to the abstract states of a first task's graph."""
        del name
        task = task_with_goal(self.domain, 0, 0, self._goal)
        space, problem = self._first, Problem.of(self.domain, task.initial_state)
        goal = space.mask(task.goal)
        graph = build_abstract_graph(space.abstract(task.initial_state), goal, problem.operators)
        self._changing = ~space.static
        distinct = dict.fromkeys(node & self._changing for node in graph.nodes)
        self._nodes = tuple(distinct)[:MOST_OPTIONS]
        self._options = OptionControl(self.domain, space, len(self._nodes))
        (self._axes,) = self._options.joints.space.shape
        return self._options

    def _make_observation_space(self) -> spaces.Space[Any]:
        return vector_space(self.encode.size + 1 + len(self._nodes))

    def _observe(self) -> Vector:
        """The state, and whose turn it is: the controller's, or that of an option."""
        turn = np.zeros(1 + len(self._nodes), np.float32)
        turn[0 if self._running is None else 1 + self._running.number] = 1.0
        observed: Vector = np.concatenate([super()._observe(), turn])
        return observed
