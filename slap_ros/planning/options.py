# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options: skills applied to objects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from numbers import Real

import numpy as np

from slap_ros.core import ActionSpace, DemandingSkill, Domain, Policy, Skill
from slap_ros.errors import InvalidDomainError, UnknownSkillError
from slap_ros.relational import Object, State, Target


class OptionKind(Enum):
    """Where an option comes from; the values are ``slap_msgs/PlanEdge.kind``."""

    OPERATOR = 0  # given with the domain
    SHORTCUT = 1  # learned


def _any(_: State) -> bool:
    return True


def never() -> bool:
    """False: nobody cancels, and nothing is given up."""
    return False


def _none() -> Option | None:
    return None


@dataclass(frozen=True)
class Option:
    """A skill applied to objects.

    Args:
        kind: Given or learned.
        skill: What controls the robot.
        objects: What it is applied to.
        accepts: Whether it may end in a state in which its target's atoms hold. A shortcut may
            not while objects still move or lie where the next option could not be executed.
        attempt: Which of the rollouts that its skill found it follows, the shortest first.
        next_attempt: Gives the same option with the next rollout, which fails where there is
            none; None for a skill that has one rollout alone.
        given_up: Whether it is not tried any more in this task: its skill failed too often.
        deletes: Where other atoms may appear, those that must not hold at its end, a mask; None
            where exactly the expected atoms must hold.
    """

    kind: OptionKind
    skill: Skill
    objects: tuple[Object, ...]
    accepts: Callable[[State], bool] = field(default=_any, compare=False, repr=False)
    attempt: int = 0
    next_attempt: Callable[[], Option | None] = field(default=_none, compare=False, repr=False)
    given_up: Callable[[], bool] = field(default=never, compare=False, repr=False)
    deletes: int | None = field(default=None, compare=False, repr=False)

    def target(self, expected: int) -> Target:
        """Where it ends.

        Args:
            expected: The atoms that are expected then, a mask.
        """
        if self.deletes is None:
            return Target.exactly(expected)
        return Target(expected, self.deletes & ~expected)

    def least_steps(self, state: State) -> int:
        """Environment steps that it takes at least from a state, by its skill.

        Args:
            state: State in which it would begin.

        Raises:
            InvalidDomainError: The skill answers with something that is no number.
        """
        bound = self.skill.lower_bound(state, self.objects)
        if not isinstance(bound, Real):
            raise InvalidDomainError(
                f"skill {self.skill.name}: lower_bound gives {type(bound).__name__}, expected a "
                "number of steps, at least 0; 1 will do"
            )
        return max(bound, self.skill.least_steps)

    def __hash__(self) -> int:
        # Skills of a task differ in their names, and options are looked up again and again.
        return hash((self.skill.name, self.objects, self.attempt))

    def __str__(self) -> str:
        return f"{self.skill.name}({', '.join(obj.name for obj in self.objects)})"


def given_option(domain: Domain, name: str, objects: Sequence[Object]) -> Option:
    """The option that carries out a domain's operator on objects.

    Args:
        domain: Which has the operator and its skill.
        name: Name of the operator.
        objects: For the operator's parameters, in order.

    Returns:
        The option.

    Raises:
        UnknownSkillError: There is no such operator, or not for such objects.
    """
    parameters = {o.name: o.parameters for o in domain.operators}.get(name)
    if parameters is None:
        raise UnknownSkillError(
            f"unknown skill {name!r}; {domain.name} has {', '.join(domain.skills)}"
        )
    wanted = [variable.type for variable in parameters]
    if len(wanted) != len(objects) or not all(
        obj.type.is_a(t) for obj, t in zip(objects, wanted, strict=True)
    ):
        raise UnknownSkillError(
            f"{name} takes ({', '.join(map(str, wanted))}), got "
            f"({', '.join(f'{obj}: {obj.type}' for obj in objects)})"
        )
    skill, about = domain.skills[name], tuple(objects)
    if isinstance(skill, DemandingSkill):
        return Option(
            OptionKind.OPERATOR, skill, about, accepts=lambda state: skill.accepts(state, about)
        )
    return Option(OptionKind.OPERATOR, skill, about)


@dataclass(frozen=True)
class HoldSkill:
    """Stand still for a step, to perceive again where no plan fits what was perceived."""

    axes: int  # of an action
    name: str = "Hold"
    step_limit: int = 1
    least_steps: int = 1

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """One environment step, from every state."""
        del state, objects
        return self.least_steps

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """The policy that moves nothing, in any state."""
        del state, objects
        return lambda _: np.zeros(self.axes)


HOLD = HoldSkill.name


def hold_option(actions: ActionSpace) -> Option:
    """The option to stand still for a step; it has no target, so it ends at its step limit."""
    return Option(OptionKind.OPERATOR, HoldSkill(len(actions.axes)), ())
