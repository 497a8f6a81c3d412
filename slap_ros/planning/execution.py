# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Closed-loop execution of plans in a world: monitoring and bounded replanning.

The ensemble does the same with one node per part; both use :class:`OptionExecution`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter

from slap_ros.core import Action, Domain, World
from slap_ros.errors import (
    ErrorCode,
    InvalidStateError,
    NoDetectionError,
    PlanningLimitError,
    SkillNotApplicableError,
    UnsolvableError,
)
from slap_ros.perception import ExactPerceiver, Perceiver, Percept
from slap_ros.planning.option_execution import OptionExecution, OptionResult
from slap_ros.planning.options import Option, OptionKind
from slap_ros.planning.plan import PlanEdge, PlanningResult
from slap_ros.planning.planner import ImprovingPlanner, Planner
from slap_ros.relational import AtomSpace, State

MAX_REPLANS = 5  # default; a deterministic world needs none
# What keeps a plan from being made. What was perceived wrongly may be perceived better next time.
UNPLANNED = (UnsolvableError, PlanningLimitError, InvalidStateError, NoDetectionError)
# Outcomes of an edge after which a new plan from wherever the robot is now makes sense.
DIVERGENCES = frozenset(
    {
        ErrorCode.SKILL_NOT_APPLICABLE,
        ErrorCode.SKILL_STEP_LIMIT,
        ErrorCode.SKILL_STOPPED_SHORT,
        ErrorCode.INVALID_COMMAND,
    }
)
FINAL = frozenset({ErrorCode.STEP_LIMIT, ErrorCode.NO_DETECTION})  # another plan is no help


@dataclass(frozen=True)
class ExecutedEdge:
    """An edge of a plan as it was executed.

    Args:
        option: Name of the option.
        objects: Names of what it was applied to.
        kind: operator or shortcut.
        steps: Environment steps executed.
        reached: Whether its target was reached.
    """

    option: str
    objects: tuple[str, ...]
    kind: str
    steps: int
    reached: bool


@dataclass
class PlanExecution:
    """One plan of an episode, or an attempt to make one, and what came of it.

    Args:
        first_step: Environment steps taken before it.
        planned: Plan with the effort of finding it; None where none was found.
        seconds: Time that planning took, s.
        outcomes: How the execution of each edge ended, in order, up to the first that failed.
        steps: Environment steps that each of these edges took.
        unplanned: Why none was found; without a reason where one was.
        improves: Whether it is a shorter rest of the plan before it, found while an edge of that
            was executed.
    """

    first_step: int
    planned: PlanningResult | None = None
    seconds: float = 0.0
    outcomes: list[OptionResult] = field(default_factory=list)
    steps: list[int] = field(default_factory=list)
    unplanned: OptionResult = field(default_factory=lambda: OptionResult(ErrorCode.NONE))
    improves: bool = False


@dataclass
class EpisodeResult:
    """What happened in one episode: a task that was solved, or not.

    Args:
        success: Whether the goal was reached.
        states: All of them, the first the initial one.
        actions: All of them, one per environment step.
        shortcut_steps: Environment steps executed that shortcuts took.
        edges: What was executed, in order, of all plans.
        replans: Plans that replaced a diverged one.
        planning_seconds: Planning time of all plans together, s; what was found while the robot
            moved took none.
        edges_rolled_out: Options simulated for all plans.
        error: Why it ended, unless it is a success.
        plans: Every plan, in order, with what came of it.
    """

    success: bool = False
    states: list[State] = field(default_factory=list)
    actions: list[Action] = field(default_factory=list)
    shortcut_steps: int = 0
    edges: list[ExecutedEdge] = field(default_factory=list)
    replans: int = 0
    planning_seconds: float = 0.0
    edges_rolled_out: int = 0
    error: OptionResult = field(default_factory=lambda: OptionResult(ErrorCode.NONE))
    plans: list[PlanExecution] = field(default_factory=list)

    @property
    def plan_length(self) -> int:
        """Environment steps executed."""
        return len(self.actions)

    @property
    def bound(self) -> float | None:
        """Bound of the first plan that was made; None without one, or where nothing is proven."""
        made = (one.planned for one in self.plans if one.planned is not None)
        first = next(made, None)
        return None if first is None else first.bound


@dataclass
class Executor:
    """Solves a task in a world: plan, execute, monitor, replan on divergence.

    Args:
        domain: The task's domain.
        planner: Planner with a model of its own, not this world.
        world: Where environment steps count.
        space: The task's atoms.
        goal: Mask of the atoms to reach.
        step_limit: Environment steps.
        max_replans: How often a diverged plan may be replaced.
        perceiver: Gives what is known of the world; without one, everything is.
        hold_steps: See :class:`OptionExecution`.
        begin_with: Plan to execute first, from the world's state; without one, it is planned.
    """

    domain: Domain
    planner: Planner
    world: World
    space: AtomSpace
    goal: int
    step_limit: int
    max_replans: int = MAX_REPLANS
    perceiver: Perceiver | None = None
    hold_steps: int = 0
    begin_with: PlanningResult | None = None
    _percept: Percept = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._perceiver = self.perceiver or ExactPerceiver(
            self.space, changing=not self.domain.is_foreseeable
        )
        self._percept = self._perceiver.perceive(self.world.state)

    def run(self) -> EpisodeResult:
        """Solve from the world's current state; the result says why where it could not."""
        episode = EpisodeResult(states=[self.world.state])
        while True:
            result, unplanned = self._plan_and_execute(episode)
            if result.reached:
                episode.success = True
                return episode
            if result.code in FINAL or (unplanned and self._percept.exact):
                episode.error = result
                return episode
            if episode.replans == self.max_replans:
                episode.error = OptionResult(
                    ErrorCode.REPLANS_EXHAUSTED,
                    f"diverged again after {self.max_replans} replans: {result.reason}",
                )
                return episode
            episode.replans += 1
            if unplanned and episode.plan_length < self.step_limit:
                # Another percept may be right where this one has no plan.
                self._act(self.domain.action_space.hold, episode)

    def _plan_and_execute(self, episode: EpisodeResult) -> tuple[OptionResult, bool]:
        """One plan, up to its end or divergence; second, whether there was no plan."""
        try:
            planned = self._plan(episode)
        except UNPLANNED as error:
            episode.plans[-1].unplanned = OptionResult(error.code, str(error))
            return episode.plans[-1].unplanned, True
        return self._execute(planned, episode), False

    def _plan(self, episode: EpisodeResult) -> PlanningResult:
        execution = PlanExecution(episode.plan_length)
        episode.plans.append(execution)
        if self.begin_with is not None and len(episode.plans) == 1:
            result, execution.seconds = self.begin_with, self.begin_with.seconds
            episode.planning_seconds += execution.seconds
        else:
            started = perf_counter()
            try:
                start = self.domain.to_plan_from(self._percept.state)
                result = self.planner.plan(start, self.goal)
            finally:
                execution.seconds = perf_counter() - started
                episode.planning_seconds += execution.seconds
        execution.planned = result
        episode.edges_rolled_out += result.edges_rolled_out
        return result

    def _execute(self, planned: PlanningResult, episode: EpisodeResult) -> OptionResult:
        number = 0
        while number < len(planned.plan.edges):
            # A robot would move meanwhile; the world waits.
            shorter = self._improve_rest(planned, number)
            result = self._execute_next(planned.plan.edges[number], episode)
            if not result.reached:
                return result
            number += 1
            if shorter is not None:
                planned, number = shorter, 0
                execution = PlanExecution(episode.plan_length, shorter, improves=True)
                episode.plans.append(execution)
                episode.edges_rolled_out += shorter.edges_rolled_out
        return OptionResult(ErrorCode.NONE)

    def _improve_rest(self, planned: PlanningResult, number: int) -> PlanningResult | None:
        if not isinstance(self.planner, ImprovingPlanner):
            return None
        start = self.domain.to_plan_from(self._percept.state)
        return self.planner.improve_rest(planned, number, start, self.goal)

    def _execute_next(self, edge: PlanEdge, episode: EpisodeResult) -> OptionResult:
        """Execute an edge of the newest plan, and note what came of it."""
        execution, before = episode.plans[-1], episode.plan_length
        result = self._execute_edge(edge, episode)
        steps = episode.plan_length - before
        execution.outcomes.append(result)
        execution.steps.append(steps)
        episode.edges.append(_executed(edge.option, steps, result.reached))
        return result

    def _execute_edge(self, edge: PlanEdge, episode: EpisodeResult) -> OptionResult:
        try:
            execution = OptionExecution(
                edge.option,
                edge.target,
                self.space,
                self.domain.action_space,
                self._percept.state,
                self.hold_steps,
                expected_steps=edge.predicted_steps,
            )
        except SkillNotApplicableError as error:
            return OptionResult(error.code, str(error))
        while True:
            percept = self._percept
            action = execution.advance(percept.state, percept.abstract, percept.missing)
            if isinstance(action, OptionResult):
                return action
            if episode.plan_length == self.step_limit:
                return OptionResult(
                    ErrorCode.STEP_LIMIT, f"the goal was not reached in {self.step_limit} steps"
                )
            episode.shortcut_steps += edge.option.kind is OptionKind.SHORTCUT
            self._act(action, episode)

    def _act(self, action: Action, episode: EpisodeResult) -> None:
        episode.actions.append(action)
        episode.states.append(self.world.step(action))
        self._percept = self._perceiver.perceive(episode.states[-1])


def _executed(option: Option, steps: int, reached: bool) -> ExecutedEdge:
    objects = tuple(obj.name for obj in option.objects)
    return ExecutedEdge(option.skill.name, objects, option.kind.name.lower(), steps, reached)
