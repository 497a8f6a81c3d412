# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Skills where shortcuts have led: a search for plans with shortcuts tries them there.

A shortcut may end where no skill has left the world before, and so a skill may fail there that
succeeds in plans without shortcuts. Each skill that the search tries there is carried out again, as
a plan of one stage, from which the curriculum learns as from any other.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Protocol

from slap_ros.acquisition.curriculum.plan_rollout import PlanRollout
from slap_ros.acquisition.curriculum.rollouts import carry_out_stage
from slap_ros.core import Domain, Task
from slap_ros.errors import NoSkillsError, PlanningLimitError, UnsolvableError
from slap_ros.planning.graph_planner import GraphPlanner
from slap_ros.planning.options import Option
from slap_ros.planning.problem import Problem
from slap_ros.planning.shortcut_source import ShortcutSource
from slap_ros.planning.watched_model import WatchedModel
from slap_ros.relational import RewardTemplate, State, ground_operators
from slap_ros.skills.acquired_domain import acquired_domain
from slap_ros.skills.skill_library import AcquiredSkill, SkillLibrary

MOST_TRIED = 8  # skills of a task that are carried out again, those that were tried first


class ShortcutsChoice(Protocol):
    """The shortcuts to plan with, as a value that other processes can be sent."""

    @property
    def digest(self) -> str:
        """A hash of what the shortcuts do."""
        ...

    def grounded(self, domain: Domain, initial: State) -> ShortcutSource:
        """The shortcuts over the objects of a task.

        Args:
            domain: Domain with the skills to plan with.
            initial: State with the objects of the task.
        """
        ...


@dataclass(frozen=True)
class AfterShortcuts:
    """The search for plans with shortcuts, from which skills are taken that it tried after them.

    Args:
        shortcuts: Shortcuts to plan with.
        skills: Skills to plan with, by operator name.
        rewards: Rewards by operator name, whose metrics are told of a failed stage.
    """

    shortcuts: ShortcutsChoice
    skills: Mapping[str, AcquiredSkill]
    rewards: Mapping[str, RewardTemplate]

    def roll_out(self, domain: Domain, task: Task, index: int) -> list[PlanRollout]:
        """Carry out the skills that the search tried where shortcuts had led.

        Args:
            domain: Domain of the task, without skills.
            task: Task to plan for.
            index: Index of the task.

        Returns:
            A plan of one stage for each of these skills; none where the skills at hand make no
            plan.
        """
        learned = SkillLibrary(domain.name, tuple(self.skills.values()))
        skilled = acquired_domain(domain, learned)
        return [
            self._carry_out(skilled, option, state, index)
            for option, state in self._tried(skilled, task)[:MOST_TRIED]
        ]

    def _tried(self, domain: Domain, task: Task) -> list[tuple[Option, State]]:
        """The skills that the search tried after shortcuts, and the states where they began."""
        initial = task.initial_state
        with suppress(NoSkillsError):
            model = WatchedModel.of(domain, initial)
            problem = replace(Problem.of(domain, initial), model=model)
            planner = GraphPlanner(problem, shortcuts=self.shortcuts.grounded(domain, initial))
            with suppress(UnsolvableError, PlanningLimitError):  # what was tried counts
                planner.plan(initial, model.space.mask(task.goal))
            return model.tried_after_shortcuts
        return []

    def _carry_out(self, domain: Domain, option: Option, state: State, index: int) -> PlanRollout:
        """A plan of one stage: an option in a state where a shortcut has led."""
        name, space = option.skill.name, domain.atom_space(state)
        (operator,) = (
            ground
            for ground in ground_operators([self.skills[name].operator], space)
            if ground.objects == option.objects
        )
        stage = carry_out_stage(
            domain,
            domain.make_world(state),
            space,
            operator,
            self.skills[name].in_domain(domain),
            self.rewards,
        )
        return PlanRollout(index, (str(operator),), (stage,))
