# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A learned skill: the approach, then the policy, closed loop. It runs without torch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from slap_ros.core import Action, Approach, Domain, Policy
from slap_ros.errors import InvalidDomainError
from slap_ros.policies.action_map import ActionMap
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.policies.mlp_policy import MlpPolicy
from slap_ros.relational import LiftedOperator, Object, State
from slap_ros.skills.groundings import Grounding, Groundings
from slap_ros.skills.observations import SkillObserver
from slap_ros.skills.reward import OperatorEffects

APPROACH_STEPS = 300  # environment steps after which an approach is given up
NOBODY = np.zeros(1, dtype=np.intp)


def approach_of(domain: Domain) -> Approach:
    """The approach of a domain.

    Raises:
        InvalidDomainError: It has none, so that no skills can be acquired in it.
    """
    if domain.acquisition is None:
        raise InvalidDomainError(
            f"domain {domain.name} does not say what skills are acquired with; give it an "
            "Acquisition with an approach"
        )
    return domain.acquisition.approach


@dataclass(frozen=True, eq=False)
class LearnedSkill:
    """The skill of an operator, for any objects of the operator's types.

    Args:
        operator: Operator that the skill carries out.
        policy: Policy that was learned.
        domain: Domain in which the skill acts.
        horizon: Environment steps of the policy at most, approach not counted.
    """

    operator: LiftedOperator
    policy: MlpPolicy = field(repr=False)
    domain: Domain = field(repr=False)
    horizon: int

    @property
    def name(self) -> str:
        """The operator's name."""
        return self.operator.name

    @property
    def step_limit(self) -> int:
        """Environment steps after which it counts as failed, approach included."""
        return APPROACH_STEPS + self.horizon

    @property
    def least_steps(self) -> int:
        """One environment step: a learned policy does not say how many it will take."""
        return 1

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """One environment step, from every state: never too high."""
        del state, objects
        return self.least_steps

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Begin in a state; all actions are a function of this state and of those after it.

        Args:
            state: State in which the skill begins.
            objects: Objects that the skill is applied to.

        Returns:
            The approach and then the policy; None once the horizon is reached.
        """
        return _PolicyExecution(self, state, objects)

    def accepts(self, state: State, objects: tuple[Object, ...]) -> bool:
        """Whether the operator's effects hold for good, as the skill learned to achieve them.

        Args:
            state: Present state.
            objects: Objects that the skill is applied to.
        """
        (part,) = Groundings([Grounding(state.layout, objects)]).split(state.data[None], NOBODY)
        return bool(OperatorEffects(self.operator, learner_interface(self.domain)).hold(part)[0])

    def act(self, objects: tuple[Object, ...]) -> Callable[[State], Action]:
        """The policy alone, from where the approach ends.

        Args:
            objects: Objects that the skill is applied to.

        Returns:
            What it does in a state, at any time.
        """
        observe, action_map = SkillObserver(self.domain), ActionMap(self.domain, gripper=True)
        groundings: Groundings | None = None

        def policy(state: State) -> Action:
            nonlocal groundings
            if groundings is None or groundings.groundings[0].layout is not state.layout:
                groundings = Groundings([Grounding(state.layout, objects)])
            (part,) = groundings.split(state.data[None], NOBODY)
            action = self.policy.mean(observe(part))[0]
            return action_map(action.astype(np.float64))

        return policy


class _PolicyExecution:
    """A skill that is being executed."""

    def __init__(self, skill: LearnedSkill, state: State, objects: tuple[Object, ...]) -> None:
        self._approach: Policy | None = approach_of(skill.domain)(state, objects)
        self._policy, self._left = skill.act(objects), skill.horizon
        self._patience = APPROACH_STEPS

    def __call__(self, state: State) -> Action | None:
        if self._approach is not None:
            action = self._approach(state)
            if action is not None and self._patience > 0:
                self._patience -= 1
                return action
            if action is not None:
                return None
            self._approach = None
        if self._left == 0:
            return None
        self._left -= 1
        return self._policy(state)
