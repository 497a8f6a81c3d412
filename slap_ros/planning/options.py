# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options: skills applied to objects, and their execution against an expected abstract state."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from enum import Enum
from numbers import Real

import numpy as np

from slap_ros.core import (
    Action,
    ActionSpace,
    DemandingSkill,
    Domain,
    ForeseeingPolicy,
    Policy,
    Skill,
)
from slap_ros.errors import ErrorCode, InvalidCommandError, InvalidDomainError, UnknownSkillError
from slap_ros.relational import AtomSpace, Object, State, Target

PATIENCE = 2  # times as many steps as in the model, after which a shortcut has led elsewhere
LEAST_PATIENCE = 10  # steps


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


@dataclass(frozen=True)
class OptionResult:
    """How the execution of an option or of a plan ended.

    Args:
        code: NONE where the target was reached.
        reason: In words, why not.
    """

    code: ErrorCode
    reason: str = ""

    @property
    def reached(self) -> bool:
        """Whether the target abstract state was reached."""
        return self.code is ErrorCode.NONE


@dataclass
class OptionExecution:
    """An option that is being executed, in the planner's model or on the robot: the same code.

    Args:
        option: What is executed.
        target: Where it ends.
        space: The task's atoms, for messages.
        actions: What the robot can do; any other action of the policy ends the option.
        state: Where it starts; then the newest state, of the same objects: what is not detected any
            more stays where it was, and what was not detected at the start is left out.
        hold_steps: Environment steps for which to hold at its end where the target is not perceived
            yet, as debounced atoms are late.
        steps: Environment steps commanded so far.
        expected_steps: Environment steps that the option takes in the planner's model; 0 where that
            is not known. A shortcut that takes far longer is over: it has led elsewhere, and its
            policy was never trained there.

    Raises:
        SkillNotApplicableError: The skill cannot start in this state.
        InvalidDomainError: The skill starts, but gives no policy.
    """

    option: Option
    target: Target
    space: AtomSpace
    actions: ActionSpace
    state: State
    hold_steps: int = 0
    steps: int = 0
    expected_steps: int = 0
    _policy: Policy = field(init=False, repr=False)
    _foreseeing: ForeseeingPolicy | None = field(init=False, repr=False)  # the same, if it is one
    _held_steps: int = field(default=0, init=False)  # at its end
    _start: int | None = field(default=None, init=False)  # the abstract state in which it begins

    def __post_init__(self) -> None:
        policy = self.option.skill.start(self.state, self.option.objects)
        if not callable(policy):
            raise InvalidDomainError(
                f"skill {self.option.skill.name}: start gives {type(policy).__name__}, expected a "
                "policy: what is called with a state gives an action, or None at its end"
            )
        self._policy = policy
        self._foreseeing = policy if isinstance(policy, ForeseeingPolicy) else None

    def advance(
        self, state: State, abstract: int, missing: Collection[str] = ()
    ) -> Action | OptionResult:
        """The next action, or how the option ended.

        Args:
            state: The newest state, as perceived.
            abstract: Abstract state of ``state``, as perceived; a mask.
            missing: Names of objects that were not detected for too long; the option ends where it
                is about one of them.

        Returns:
            An action within ``actions``, or the result.
        """
        self.state = state = state.over(self.state.layout, self.state)
        if self._start is None:
            self._start = abstract
        if unseen := [obj.name for obj in self.option.objects if obj.name in missing]:
            return OptionResult(
                ErrorCode.NO_DETECTION,
                f"{self.option}: not seen for too long: {', '.join(unseen)}",
            )
        if self.target.reached(abstract) and self.steps > 0 and self.option.accepts(state):
            return OptionResult(ErrorCode.NONE)
        if self.steps >= self._step_limit:
            return self._missed(ErrorCode.SKILL_STEP_LIMIT, self._start, abstract)
        action = self._next(state)
        if action is None:
            return self._missed(ErrorCode.SKILL_STOPPED_SHORT, self._start, abstract)
        try:
            self.actions.check(action)
        except InvalidCommandError as error:
            return OptionResult(error.code, f"{self.option}: {error}")
        self.steps += 1
        return action

    @property
    def foreseen(self) -> State | None:
        """The state after the newest action in the model; None where the policy does not know."""
        return None if self._foreseeing is None else self._foreseeing.foreseen

    @property
    def _step_limit(self) -> int:
        """Environment steps after which the option has failed."""
        longest = self.option.skill.step_limit
        if self.option.kind is not OptionKind.SHORTCUT or self.expected_steps == 0:
            return longest
        return min(longest, max(LEAST_PATIENCE, PATIENCE * self.expected_steps))

    def _missed(self, code: ErrorCode, start: int, abstract: int) -> OptionResult:
        """The result of an option that has ended elsewhere.

        Args:
            code: How it ended.
            start: The abstract state in which it began.
            abstract: The abstract state in which it ended.
        """
        why = self.target.why_missed(start, abstract, self.space)
        return OptionResult(code, f"{self.option} ended after {self.steps} steps{why}")

    def _next(self, state: State) -> Action | None:
        """The policy's next action; at its end, none after ``hold_steps`` steps of holding."""
        action = self._policy(state) if self._held_steps == 0 else None
        if action is None and self._held_steps < self.hold_steps:
            self._held_steps += 1
            return self.actions.hold
        return action
