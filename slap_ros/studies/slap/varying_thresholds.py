# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A task whose predicates have another threshold in each environment step (SLAP D.3).

Threshold by threshold, the same state may be another abstract state, and a plan another plan. A
skill that is half done is not a node of the abstract graph, so a plan is not simply made afresh in
each step. Instead, the plan in hand is judged in each step, with the threshold of that step: it
stays if every edge still ends where the planner foresaw it, neither earlier nor elsewhere.
Otherwise the planner plans with the threshold of that step, from where the robot is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from slap_ros.core import Action, Domain, Task
from slap_ros.errors import PlanningLimitError, SkillNotApplicableError, UnsolvableError
from slap_ros.planning.option_execution import OptionExecution, OptionResult
from slap_ros.planning.plan import Plan, PlanEdge
from slap_ros.planning.planner import Planner
from slap_ros.relational import AtomSpace, State

MakePlanner = Callable[[Domain, State], Planner]


@dataclass
class ForeseenPlan:
    """A plan with the states through which it leads in the planner's model.

    Args:
        plan: Plan that was made.
        states: State before each step, and the last one.
        actions: Action of each step.
        ends: For each edge, the number of steps after which it ends.
        step: Number of steps taken so far.
    """

    plan: Plan
    states: list[State]
    actions: list[Action] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)
    step: int = 0

    @property
    def done(self) -> bool:
        """Whether all steps are taken."""
        return self.step == len(self.actions)

    def next_action(self) -> Action:
        """The action of the next step, which counts as taken."""
        self.step += 1
        return self.actions[self.step - 1]

    def holds(self, state: State, space: AtomSpace) -> bool:
        """Whether the rest of the plan is right under the thresholds of an atom space.

        Args:
            state: State that the world is in.
            space: The task's atoms, with these thresholds.
        """
        if state.key != self.states[self.step].key:
            return False
        ahead = self.states[self.step :]
        batch = State(state.layout, np.stack([one.data for one in ahead]))
        abstract = space.abstract_each(batch)
        begins = [0, *self.ends]
        return all(
            self._ends_right(edge, begin, end, abstract)
            for edge, begin, end in zip(self.plan.edges, begins, self.ends, strict=False)
            if end >= self.step
        )

    def _ends_right(self, edge: PlanEdge, begin: int, end: int, abstract: list[int]) -> bool:
        """Whether an edge ends where it was foreseen to, and not before."""
        for step in range(max(begin + 1, self.step), end + 1):
            reached = edge.target.reached(abstract[step - self.step])
            if (reached and edge.option.accepts(self.states[step])) != (step == end):
                return False
        return True


def foresee(domain: Domain, space: AtomSpace, state: State, plan: Plan) -> ForeseenPlan | None:
    """Execute a plan in the planner's model.

    Args:
        domain: Domain with the thresholds under which the plan was made.
        space: The task's atoms, with these thresholds.
        state: State in which the plan begins.
        plan: Plan to execute.

    Returns:
        The plan and where it leads; None if it fails in the model.
    """
    model, foreseen = domain.model_world(state), ForeseenPlan(plan, [state])
    for edge in plan.edges:
        try:
            execution = OptionExecution(
                edge.option,
                edge.target,
                space,
                domain.action_space,
                state,
                expected_steps=edge.predicted_steps,
            )
        except SkillNotApplicableError:
            return None
        while not isinstance(
            action := execution.advance(state, space.abstract(state)), OptionResult
        ):
            state = model.step(action)
            foreseen.actions.append(action)
            foreseen.states.append(state)
        if not action.reached:
            return None
        foreseen.ends.append(len(foreseen.actions))
    return foreseen


@dataclass
class ThresholdEpisode:
    """What happened in an episode.

    Args:
        steps: Number of environment steps.
        replans: Number of times that a plan was looked for after the first, found or not.
        waits: Number of environment steps in which the robot held still, as there was no plan.
        planning_seconds: Planning time of all plans together, s.
        failure: Why the episode ended; empty where the plan was carried out to its end.
    """

    steps: int = 0
    replans: int = -1  # the first plan is none
    waits: int = 0
    planning_seconds: float = 0.0
    failure: str = ""


@dataclass
class VaryingExecutor:
    """Solves a task while thresholds vary from step to step.

    Args:
        draw: Gives the domain with the thresholds of the next step.
        make_planner: Makes a planner for a domain, and the objects of a state.
        max_replans: Number of times that a plan is looked for after the first, at most.
    """

    draw: Callable[[], Domain]
    make_planner: MakePlanner
    max_replans: int

    def run(self, domain: Domain, task: Task) -> tuple[ThresholdEpisode, State]:
        """Solve a task in the domain's world.

        Args:
            domain: Domain of the world.
            task: Task to solve.

        Returns:
            What happened, and the state in which the world is left.
        """
        world, episode = domain.make_world(task.initial_state), ThresholdEpisode()
        plan: ForeseenPlan | None = None
        while True:
            drawn, state = self.draw(), world.state
            space = drawn.atom_space(task.initial_state)
            current = plan if plan is not None and plan.holds(state, space) else None
            if current is None and episode.replans == self.max_replans:
                episode.failure = f"the plan was wrong again after {self.max_replans} replans"
                return episode, state
            if current is None:
                current = self._plan(drawn, space, task, state, episode)
            if current is not None and current.done:
                return episode, state
            if episode.steps == task.step_limit:
                episode.failure = f"the goal was not reached in {task.step_limit} steps"
                return episode, state
            # Without a plan, the one before stays in hand: the next threshold may suit it again.
            plan = plan if current is None else current
            episode.waits += current is None
            episode.steps += 1
            hold = domain.action_space.hold
            world.step(hold if current is None else current.next_action())

    def _plan(
        self, drawn: Domain, space: AtomSpace, task: Task, state: State, episode: ThresholdEpisode
    ) -> ForeseenPlan | None:
        """A plan from a state, with the thresholds of this step; None where there is none."""
        episode.replans += 1
        started = perf_counter()
        try:
            found = self.make_planner(drawn, state).plan(state, space.mask(task.goal))
        except (UnsolvableError, PlanningLimitError):
            return None
        finally:
            episode.planning_seconds += perf_counter() - started
        return foresee(drawn, space, state, found.plan)
