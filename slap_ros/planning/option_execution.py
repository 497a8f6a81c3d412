# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The execution of an option against an expected abstract state."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

from slap_ros.core import Action, ActionSpace, ForeseeingPolicy, Policy
from slap_ros.errors import ErrorCode, InvalidCommandError, InvalidDomainError
from slap_ros.planning.options import Option, OptionKind
from slap_ros.relational import AtomSpace, State, Target

PATIENCE = 2  # times as many steps as in the model, after which a shortcut has led elsewhere
LEAST_PATIENCE = 10  # steps


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
