# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The MDP of a skill (LG-SAIL §4) for any learner, as skills of our own are learned in it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from slap_ros.acquisition.curriculum.initiation_states import InitiationStates
from slap_ros.acquisition.curriculum.jobs import horizon_of
from slap_ros.acquisition.curriculum.rollouts import roll_out
from slap_ros.acquisition.training.settings import AcquisitionSettings
from slap_ros.acquisition.training.skill_env import Initiation, SkillMdp, SkillVecEnv
from slap_ros.core import Domain, task_with_goal
from slap_ros.environments.mdp_env import MdpEnv
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.vec_env import VecEnv, VecEnvStep
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import LiftedOperator, RewardTemplate, State
from slap_ros.skills.domain_choice import NO_SKILLS, SHIPPED, DomainChoice, chosen_skills
from slap_ros.skills.groundings import Groundings
from slap_ros.skills.reward import SkillReward
from slap_ros.skills.skill import LearnedSkill, approach_of


class SkillEnv(MdpEnv[Initiation]):
    """Episodes of one operator's skill; all last as long, and success does not end them.

    Each begins where a plan comes to the operator, the approach done. The skills before it are
    those of a library.
    """

    def __init__(
        self,
        domain: str,
        preset: str = "",
        *,
        operator: str = "",
        goal: str | None = None,
        skills: str = "shipped",
    ) -> None:
        """Choose an operator, and look for where its skill begins.

        Args:
            domain: Name of the domain.
            preset: Preset, maybe with settings; empty for the first.
            operator: Name of the operator; empty for the first.
            goal: Goal of every task, by name or as atoms; None for each task's own.
            skills: Folder of a library of skills, which brings its operators and rewards;
                ``shipped`` for the one that ships, ``none`` for the operators and rewards that the
                domain was given by hand, with no skill.

        Raises:
            InvalidParameterError: There is no such preset or operator.
            InvalidDomainError: No skills can be acquired in the domain.
            InvalidStateError: The skill begins in none of many tasks.
        """
        self.domain = DomainChoice(domain, preset, NO_SKILLS).make()
        approach_of(self.domain)  # refuses a domain without
        choice = DomainChoice(domain, preset, SHIPPED if skills == "shipped" else skills)
        self._learned, self._operators, rewards = _known(self.domain, choice)
        names = [one.name for one in self._operators]
        if operator and operator not in names:
            raise InvalidParameterError(
                f"unknown operator {operator!r}; there are {', '.join(names)}"
            )
        self.operator = self._operators[names.index(operator) if operator else 0]
        self._goal = goal
        self._reward = SkillReward(
            self.operator, rewards[self.operator.name], learner_interface(self.domain)
        )
        super().__init__(f"the skill of {self.operator.name}")

    def _find(self, seed: int, index: int) -> Initiation | None:
        task = task_with_goal(self.domain, seed, index, self._goal)
        rollout = roll_out(self.domain, task, index, self._operators, self._learned)
        begun = InitiationStates.of(self.operator.name, [rollout]).all
        if not begun:
            return None
        layout = task.initial_state.layout
        objects = tuple(layout.object(name) for name in begun[0].objects)
        return Initiation(State(layout, np.array(begun[0].state)), objects)

    def _begin(self, start: Initiation) -> VecEnv:
        share = AcquisitionSettings().dense_share
        mdp = SkillMdp(self.domain, self._reward, Groundings([start.grounding]), share)
        self._worlds = SkillVecEnv(mdp, [start], 1, horizon_of(self.domain), (0,))
        return self._worlds

    def _success(self, step: VecEnvStep) -> bool:
        """Whether the operator's effects held in some step of an episode, once it has ended."""
        return bool(step.truncated[0] and self._worlds.succeeded[0])


def _known(
    domain: Domain, choice: DomainChoice
) -> tuple[Mapping[str, LearnedSkill], tuple[LiftedOperator, ...], Mapping[str, RewardTemplate]]:
    """Skills, operators and rewards of a library; else operators and rewards by hand alone."""
    library = chosen_skills(choice)
    if library is None:
        assert domain.acquisition is not None
        return {}, domain.acquisition.operators, domain.acquisition.rewards
    learned = {one.operator.name: one.in_domain(domain) for one in library.skills}
    rewards = {one.operator.name: one.template for one in library.skills}
    return learned, tuple(one.operator for one in library.skills), rewards
