# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The planner's model: options rolled out in a world of its own, and cached."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

from slap_ros.core import ActionSpace, Domain, GradualSkill, World
from slap_ros.errors import (
    ErrorCode,
    InvalidStateError,
    SkillNotApplicableError,
    TaskCanceledError,
)
from slap_ros.planning.option_execution import OptionExecution, OptionResult
from slap_ros.planning.options import Option, never
from slap_ros.relational import AtomSpace, State, Target

REACHED = OptionResult(ErrorCode.NONE)
MOST_KEPT = 20_000  # roll-outs: some fifty plans that take all of their effort

Key = tuple[Option, Target, bytes]


@dataclass(frozen=True)
class Rollout:
    """The outcome of an option in the model.

    Args:
        reached: Whether it ended in its target.
        steps: Environment steps taken.
        final: The state in which it ended.
        abstract: Abstract state of ``final``, as a mask.
        result: How it ended, with the reason where its target was not reached.
    """

    reached: bool
    steps: int
    final: State
    abstract: int = 0
    result: OptionResult = REACHED

    @property
    def moved_and_failed(self) -> bool:
        """Whether it took steps and ended elsewhere than in its target."""
        return self.steps > 0 and not self.reached


class Model:
    """The known transition function (the paper's f).

    A roll-out is a function of the option, its target and the state, bit for bit, so each is
    made once and then cached; the oldest are forgotten, so that a long run needs no more memory.
    """

    def __init__(
        self,
        world: World,
        space: AtomSpace,
        actions: ActionSpace,
        is_canceled: Callable[[], bool] = never,
    ) -> None:
        """Start with an empty cache.

        Args:
            world: World in which options are rolled out; nobody else may use it.
            space: The task's atoms.
            actions: What the robot can do.
            is_canceled: Whether nobody wants a plan any more; asked before each step.
        """
        self.space = space
        self.executed = 0  # roll-outs made so far; those from the cache do not count
        self._world = world
        self._actions = actions
        self._is_canceled = is_canceled
        self._cache: dict[Key, Rollout] = {}
        self._begun: dict[Key, None] = {}  # roll-outs of which a part was made
        self._ends: dict[bytes, None] = {}  # keys of the states in which roll-outs ended

    @classmethod
    def of(cls, domain: Domain, initial: State, is_canceled: Callable[[], bool] = never) -> Self:
        """A model for the tasks over some objects.

        Args:
            domain: Domain of the tasks.
            initial: A state with these objects.
            is_canceled: See the class.
        """
        space = domain.atom_space(initial)
        return cls(domain.model_world(initial), space, domain.action_space, is_canceled)

    def knows(self, option: Option, state: State, target: Target) -> bool:
        """Whether a roll-out was made or begun before.

        Args:
            option: What would be executed.
            state: Where it would start.
            target: Where it should end.
        """
        key = (option, target, state.key)
        return key in self._cache or key in self._begun

    def raised_bound(self, option: Option, state: State, target: Target, steps: int) -> int:
        """A better bound of an option's steps, by a part of its roll-out; that counts as one.

        Args:
            option: What would be executed.
            state: Where it would start.
            target: Where it should end.
            steps: Lower bound of the environment steps that is known.

        Returns:
            A higher bound; ``steps`` where the roll-out has to be made to find out more.
        """
        key = (option, target, state.key)
        raised = steps if key in self._cache else self._raised(option, state, target, steps)
        if raised > steps and key not in self._begun:
            self._begin(key)
        return raised

    def _raised(self, option: Option, state: State, target: Target, steps: int) -> int:
        del target
        skill = option.skill
        if not isinstance(skill, GradualSkill):
            return steps
        return skill.raised_bound(state, option.objects, steps)

    def _begin(self, key: Key) -> None:
        self.executed += 1
        self._begun[key] = None
        _forget_oldest(self._begun)

    def roll_out(self, option: Option, state: State, target: Target) -> Rollout:
        """Execute an option until it reaches its target or ends otherwise.

        Args:
            option: What is executed.
            state: Where it starts.
            target: Where it shall end.

        Returns:
            The outcome; not reached in no steps where the skill cannot start in the state, or the
            world refuses a state in which another roll-out ended: a hand that presses may end
            where nothing can begin.

        Raises:
            InvalidStateError: The world refuses the state, which no roll-out has led to.
            TaskCanceledError: Nobody wants the plan any more.
        """
        key = (option, target, state.key)
        if key not in self._cache:
            if key not in self._begun:
                self._begin(key)
            self._cache[key] = self._simulate(option, state, target)
            del self._begun[key]
            _forget_oldest(self._cache)
        return self._cache[key]

    def _simulate(self, option: Option, state: State, target: Target) -> Rollout:
        rollout = self._execute(option, state, target)
        self._ends[rollout.final.key] = None
        _forget_oldest(self._ends)
        return rollout

    def _execute(self, option: Option, state: State, target: Target) -> Rollout:
        if (refusal := self._reset_to(state)) is not None:
            return Rollout(False, 0, state, self.space.abstract(state), refusal)
        is_behind = False  # the world, where steps were foreseen
        try:
            execution = OptionExecution(option, target, self.space, self._actions, state)
        except SkillNotApplicableError as error:
            result = OptionResult(error.code, str(error))
            return Rollout(False, 0, state, self.space.abstract(state), result)
        while True:
            if self._is_canceled():
                raise TaskCanceledError("canceled")
            abstract = self.space.abstract(state)
            action = execution.advance(state, abstract)
            if isinstance(action, OptionResult):
                return Rollout(action.reached, execution.steps, state, abstract, action)
            foreseen = execution.foreseen
            if foreseen is not None:
                state, is_behind = foreseen, True
                continue
            if is_behind:
                self._world.reset(state)
            state, is_behind = self._world.step(action), False

    def _reset_to(self, state: State) -> OptionResult | None:
        """Let the world begin in a state; why it refuses one in which another roll-out ended.

        Raises:
            InvalidStateError: It refuses any other state.
        """
        try:
            self._world.reset(state)
        except InvalidStateError as error:
            if state.key not in self._ends:
                raise
            return OptionResult(error.code, str(error))
        return None


class CountedModel(Model):
    """A model for one plan: it counts from 0, and roll-outs known from earlier plans count as well.

    So a limit of roll-outs leads to the same plan, whatever was planned before. What is known takes
    no time.
    """

    def __init__(self, model: Model) -> None:
        """Count what is asked of a model from now on."""
        super().__init__(model._world, model.space, model._actions)
        self._model = model

    def _raised(self, option: Option, state: State, target: Target, steps: int) -> int:
        return self._model.raised_bound(option, state, target, steps)

    def _simulate(self, option: Option, state: State, target: Target) -> Rollout:
        return self._model.roll_out(option, state, target)


def _forget_oldest(kept: dict[Any, Any]) -> None:
    """Keep no more than :data:`MOST_KEPT` entries, after one was added."""
    if len(kept) > MOST_KEPT:
        del kept[next(iter(kept))]
