# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans from where no operators lead to the goal: a skill changed more than they say, or stopped.

A block that was pushed or dropped may lie where no operator knows it: half on a target, say, on
which there is then no room, though it is not on it. To pick it up makes room, and only the model
knows that. A robot may also stop on the way of a skill, in an abstract state in which no skill
begins: what it holds is off the table, say, and not yet above everything. So options are tried out
in the model, until one ends in an abstract state from which operators lead to the goal, though no
operator leads there.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
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

# Which options are tried in an abstract state, a mask, in order.
Candidates = Callable[[int], Sequence[tuple[GroundOperator, Option]]]

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
        return self._plan_past(state, self._applicable) or self._plan_past(state, self._startable)

    def _plan_past(self, state: State, candidates: Candidates) -> tuple[Plan, AbstractGraph] | None:
        for start, before, option, rollout in self._tried(state, candidates):
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

    def _tried(
        self, state: State, candidates: Candidates
    ) -> Iterator[tuple[State, tuple[PlanEdge, ...], Option, Rollout]]:
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
            for ground, option in candidates(abstract):
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

    def _applicable(self, abstract: int) -> Sequence[tuple[GroundOperator, Option]]:
        return [one for one in self.problem.operators if one[0].applicable(abstract)]

    def _startable(self, abstract: int) -> Sequence[tuple[GroundOperator, Option]]:
        """Those for which nothing is missing but what they delete themselves; least missing first.

        A skill that was stopped on its way has deleted a part of it already.
        """
        missing = [
            (ground.preconditions & ~abstract, (ground, option))
            for ground, option in self.problem.operators
        ]
        able = [(lacks, one) for lacks, one in missing if not lacks & ~one[0].delete_effects]
        return [one for lacks, one in sorted(able, key=lambda pair: pair[0].bit_count())]

    def _may_lead_on(self, abstract: int) -> bool:
        """Whether each atom of the goal can be reached, as far as operators say."""
        return not unreachable_atoms(abstract, self.goal, self.problem.grounds)
