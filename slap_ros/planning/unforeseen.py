# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans from where no operators lead to the goal, because a skill changes more than they say.

A block that was pushed or dropped may lie where no operator knows it: half on a target, say, on
which there is then no room, though it is not on it. To pick it up makes room, and only the model
knows that. A robot may also stop on the way of a skill, in an abstract state in which no skill
begins: what it holds is off the table, say, and not yet above everything. So options are tried out
in the model, until one ends in an abstract state from which operators lead to the goal, though no
operator leads there.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

from slap_ros.errors import PlanningLimitError, UnsolvableError
from slap_ros.planning.abstract_graph import AbstractGraph
from slap_ros.planning.failures import unreachable_atoms
from slap_ros.planning.model import Rollout
from slap_ros.planning.options import Option
from slap_ros.planning.plan import Plan, PlanEdge
from slap_ros.planning.problem import Problem
from slap_ros.planning.recovery import SearchTo
from slap_ros.relational import GroundOperator, State, Target

MOST_ROLLOUTS = 80  # of options that are tried


@dataclass(frozen=True)
class UnforeseenSearch:
    """Looks for an option that does more than its operator says, breadth first.

    Args:
        problem: The model, and the ground operators with their options.
        goal: Mask of atoms that must hold.
        search_to: Searches from another state.
    """

    problem: Problem
    goal: int
    search_to: SearchTo

    def plan(self, state: State) -> tuple[Plan, AbstractGraph] | None:
        """A plan past such an option, and the graph of what follows; None if none is found.

        Args:
            state: State from which no operators lead to the goal.
        """
        if self._may_lead_on(self.problem.model.space.abstract(state)):
            return None  # nothing is missing: atoms of the goal never hold together
        for start, before, option, rollout in self._tried(state):
            if not self._may_lead_on(rollout.abstract):
                continue
            aside = Target.exactly(rollout.abstract)
            ended = self.problem.model.roll_out(option, start, aside)
            if not ended.reached or not ended.steps:
                continue  # what it does lasts for a moment alone
            with suppress(UnsolvableError, PlanningLimitError):
                graph, outcome = self.search_to(ended.final, self.goal)
                if outcome.plan is not None:
                    edge = PlanEdge(option, aside, ended.steps)
                    return Plan((*before, edge, *outcome.plan.edges)), graph
        return None

    def _tried(self, state: State) -> Iterator[tuple[State, tuple[PlanEdge, ...], Option, Rollout]]:
        """Options as they end in the model, each with the state that it starts in and the way.

        One that has moved the robot is not tried again from another state.
        """
        model = self.problem.model
        left, seen = MOST_ROLLOUTS, {model.space.abstract(state)}
        moved: set[Option] = set()
        queue: deque[tuple[State, tuple[PlanEdge, ...]]] = deque([(state, ())])
        while queue:
            here, before = queue.popleft()
            abstract = model.space.abstract(here)
            for ground, option in self._startable(abstract):
                if option in moved:
                    continue
                if not left:
                    return
                left -= 1
                target = option.target(ground.apply(abstract))
                rollout = model.roll_out(option, here, target)
                yield here, before, option, rollout
                if rollout.steps:
                    moved.add(option)
                if rollout.reached and rollout.abstract not in seen:
                    seen.add(rollout.abstract)
                    edge = PlanEdge(option, target, rollout.steps)
                    queue.append((rollout.final, (*before, edge)))

    def _startable(self, abstract: int) -> list[tuple[GroundOperator, Option]]:
        """The options that may start: nothing is missing, or only what they delete themselves.

        A skill that was stopped has deleted a part of it already.

        Args:
            abstract: Abstract state to start from.

        Returns:
            The options with their operators, those first for which the least is missing.
        """
        missing = {
            number: ground.preconditions & ~abstract
            for number, (ground, _) in enumerate(self.problem.operators)
        }
        able = [
            number
            for number, (ground, _) in enumerate(self.problem.operators)
            if not missing[number] & ~ground.delete_effects
        ]
        able.sort(key=lambda number: missing[number].bit_count())
        return [self.problem.operators[number] for number in able]

    def _may_lead_on(self, abstract: int) -> bool:
        """Whether each atom of the goal can be reached, as far as operators say."""
        grounds = [ground for ground, _ in self.problem.operators]
        return not unreachable_atoms(abstract, self.goal, grounds)
