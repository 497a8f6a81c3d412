# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A* with lazy edge evaluation through the abstract graph, exact or weighted.

What it finds, and under which bounds, is told in :mod:`slap_ros.planning.search`. With a weight
above 1 it is Lazy Weighted A* (Cohen, Phillips and Likhachev: Planning single-arm manipulations
with n-arm robots, RSS 2014): bounds of what is still to come count more than steps that were rolled
out, so that a first plan is found soon, and is at most that many times as long as the shortest.

Where a skill tells bit by bit how long it takes, an edge comes to the front again and again, each
time with a bound that is a little higher. What could only be longer than the plan is never rolled
out to its end. The plan is the one that whole roll-outs would lead to, since the order of all else
is as if the edge had been rolled out when it first came to the front.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import count

from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.failures import Failures
from slap_ros.planning.look_ahead import LookAhead
from slap_ros.planning.model import Model
from slap_ros.planning.options import OptionKind
from slap_ros.planning.search import SearchOutcome, Vertex, plan_to, without_plan
from slap_ros.relational import State, Target


@dataclass(frozen=True)
class SearchLimits:
    """What a search may do, in counts; the defaults limit nothing.

    Args:
        weight: Factor by which bounds of steps to come count more than steps so far, at least 1.
        rollouts: Number of the model's roll-outs, all of its life, at which the search stops; None
            for no limit.
        below: Environment steps that a plan must stay below; None for no limit.
    """

    weight: float = 1.0
    rollouts: int | None = None
    below: int | None = None


UNLIMITED = SearchLimits()


def search_lazily(
    graph: AbstractGraph,
    state: State,
    model: Model,
    limits: SearchLimits = UNLIMITED,
    ahead: LookAhead | None = None,
) -> SearchOutcome:
    """A* with lazy edge evaluation: an edge is rolled out at the front of the queue.

    Until then it counts with the bound of its skill from the state at its source. As long as
    bounds never exceed the true steps, the first goal vertex at the front is the cheapest; the
    text of :mod:`slap_ros.planning.search` says when they may.

    Args:
        graph: The top level.
        state: The low-level state to start from, in the graph's first node.
        model: Rolls options out.
        limits: Weight of the heuristic, and where to stop.
        ahead: What leads to a goal in the graph, where that is known.

    Returns:
        A plan, of least cost where bounds are admissible and the weight is 1, if any path of the
        graph can be executed from ``state`` within the limits.
    """
    return _LazySearch(graph, state, model, limits, ahead or LookAhead.of(graph)).run()


@dataclass(order=True)
class _QueueEntry:
    """A vertex to be expanded, or an edge out of it that was not rolled out yet."""

    priority: float  # g + weight * (steps to come, at least)
    tie: int
    vertex: Vertex = field(compare=False)
    edge: Edge | None = field(compare=False)
    least_steps: int = field(compare=False)  # environment steps that the edge takes
    ties: tuple[int, int] | None = field(compare=False, default=None)  # of what comes of the edge
    f: int = field(compare=False, default=0)  # lower bound of the steps of any plan through it

    @property
    def node(self) -> int:
        """Index of the node that it leads to."""
        return self.vertex.node if self.edge is None else self.edge.target


class _Frontier:
    """The queue of A*; h is a lower bound of the steps to go from a node."""

    def __init__(self, ahead: LookAhead, weight: float) -> None:
        self._ahead, self._weight = ahead, weight
        self._queue: list[_QueueEntry] = []
        self._tie = count()

    def push(
        self,
        vertex: Vertex,
        edge: Edge | None = None,
        least_steps: int = 0,
        tie: int | None = None,
    ) -> None:
        """Put a vertex or an edge into the queue, if a goal can be reached through it.

        Args:
            vertex: To be expanded.
            edge: To be rolled out from the vertex instead.
            least_steps: Lower bound of the environment steps that the edge takes.
            tie: Turn of the entry among equals; None for a turn before all entries so far.
        """
        turn = self.next_tie() if tie is None else tie
        self._put(_QueueEntry(0.0, turn, vertex, edge, least_steps))

    def next_tie(self) -> int:
        """Deeper first among equals: they are nearer to the goal."""
        return -next(self._tie)

    def put_back(self, entry: _QueueEntry, least_steps: int) -> None:
        """Put an edge back of which a part was rolled out, with a higher bound.

        Args:
            entry: Entry that came to the front.
            least_steps: Lower bound of the environment steps that the edge takes.
        """
        entry.least_steps = least_steps
        entry.ties = entry.ties or (self.next_tie(), self.next_tie())
        entry.tie = entry.ties[1]  # before what may come of it, as if that were there already
        self._put(entry)

    def _put(self, entry: _QueueEntry) -> None:
        h = self._ahead.steps_to_go[entry.node]
        if h is not None:
            rolled_out = entry.least_steps if entry.ties else 0  # without success
            so_far, to_come = entry.vertex.g + rolled_out, entry.least_steps - rolled_out + h
            entry.f = so_far + to_come
            entry.priority = so_far + self._weight * to_come
            heapq.heappush(self._queue, entry)

    def pop(self) -> _QueueEntry | None:
        """The best entry; None if the queue is empty."""
        while self._queue:
            best = heapq.heappop(self._queue)
            h = self._ahead.steps_to_go[best.node]
            if h is not None and best.vertex.g + best.least_steps + h <= best.f:
                return best
            self._put(best)  # bounds rose since it was pushed
        return None

    def waiting(self) -> Sequence[_QueueEntry]:
        """All entries, in no order."""
        return self._queue

    def edges_from(self, node: int) -> Sequence[Edge]:
        """The edges out of a node through which a goal can be reached."""
        return self._ahead.forward[node]

    def drop_given_up(self) -> None:
        """Drop the options that were given up, with the bounds that counted on them."""
        self._ahead = self._ahead.without_given_up()


class _LazySearch:
    """One run of :func:`search_lazily`."""

    def __init__(
        self,
        graph: AbstractGraph,
        state: State,
        model: Model,
        limits: SearchLimits,
        ahead: LookAhead,
    ) -> None:
        """See :func:`search_lazily`."""
        self._graph, self._model, self._limits = graph, model, limits
        self._goals = ahead.goals
        self._frontier = _Frontier(ahead, limits.weight)
        start = Vertex(0, state, 0)
        self._cheapest = {start.key: 0}
        self._failures = Failures()
        self._failed: list[Vertex] = []  # where operators that failed have left the robot
        self._frontier.push(start)

    def run(self) -> SearchOutcome:
        """Until the best entry of the queue is a goal vertex, or a limit is reached."""
        limits = self._limits
        while (best := self._frontier.pop()) is not None:
            vertex, edge = best.vertex, best.edge
            if limits.below is not None and best.f >= limits.below:
                continue
            if edge is not None:
                if self._is_too_much(vertex, edge):
                    return self._stopped(best)
                self._evaluate(best, edge)
            elif vertex.node in self._goals:
                return SearchOutcome(plan_to(self._graph, vertex), at_least=self._at_least(best))
            elif vertex.g == self._cheapest[vertex.key]:
                self._expand(vertex)
        found = without_plan(self._graph, self._failed, self._model, self._failures)
        return replace(found, at_least=limits.below)

    def _is_too_much(self, vertex: Vertex, edge: Edge) -> bool:
        """Whether an edge takes a roll-out more than the limit."""
        model, limit = self._model, self._limits.rollouts
        if limit is None or model.executed < limit:
            return False
        return not model.knows(edge.option, vertex.state, self._target(edge))

    def _stopped(self, best: _QueueEntry) -> SearchOutcome:
        """The outcome at the limit of roll-outs: the best plan that waits in the queue."""
        at_least = self._at_least(best)
        for entry in list(self._frontier.waiting()):
            if entry.ties and entry.edge is not None:
                self._roll_out(entry, entry.edge)
        goals = [one for one in self._frontier.waiting() if one.vertex.node in self._goals]
        if goals:
            nearest = min(goals, key=lambda one: one.vertex.g)
            plan = plan_to(self._graph, nearest.vertex)
            return SearchOutcome(plan, at_least=at_least, stopped=True)
        reason = f"no plan after {self._limits.rollouts} roll-outs"
        return SearchOutcome(None, reason=reason, at_least=at_least, stopped=True)

    def _at_least(self, best: _QueueEntry) -> int:
        """Steps that any plan takes that is through the best entry or what waits behind it."""
        waiting = (entry.f for entry in self._frontier.waiting())
        bound = min([best.f, *waiting])
        return bound if self._limits.below is None else min(bound, self._limits.below)

    def _target(self, edge: Edge) -> Target:
        return edge.option.target(self._graph.nodes[edge.target])

    def _expand(self, vertex: Vertex) -> None:
        """Queue the edges out of a vertex, each with its bound.

        Where a plan is to be made shorter, not those that lead back: a block that is picked up and
        put down again lies a little elsewhere, so that there would be no end to such circles. For a
        first plan, that may be what makes the next option possible.
        """
        before = set() if self._limits.below is None else set(vertex.nodes())
        for edge in self._frontier.edges_from(vertex.node):
            if edge.target in before:
                continue
            self._frontier.push(vertex, edge, edge.option.least_steps(vertex.state))

    def _evaluate(self, entry: _QueueEntry, edge: Edge) -> None:
        """Roll an edge out, or so much of it that its bound rises."""
        if entry.ties is None and edge.option.given_up():
            return
        state, least = entry.vertex.state, entry.least_steps
        raised = self._model.raised_bound(edge.option, state, self._target(edge), least)
        if raised > least:
            self._frontier.put_back(entry, raised)
            self._drop_given_up(edge)
        else:
            self._roll_out(entry, edge)

    def _roll_out(self, entry: _QueueEntry, edge: Edge) -> None:
        """Roll an edge out to its end, and queue where it leads and its next attempt."""
        vertex, target = entry.vertex, self._target(edge)
        rollout = self._model.roll_out(edge.option, vertex.state, target)
        if edge.option.attempt == 0:
            self._failures.add(edge.option, target, rollout)
        if rollout.reached:
            mine, following = entry.ties or (None, None)
            g = vertex.g + rollout.steps
            reached = Vertex(edge.target, rollout.final, g, vertex, edge)
            if g < self._cheapest.get(reached.key, g + 1):
                self._cheapest[reached.key] = g
                self._frontier.push(reached, tie=mine)
            option = edge.option.next_attempt()
            if option is not None:  # it takes longer, but the next option may take less
                self._frontier.push(vertex, replace(edge, option=option), rollout.steps, following)
            return
        if rollout.moved_and_failed and edge.option.kind is OptionKind.OPERATOR:
            g = vertex.g + rollout.steps
            self._failed.append(Vertex(edge.target, rollout.final, g, vertex, edge))
        self._drop_given_up(edge)

    def _drop_given_up(self, edge: Edge) -> None:
        if edge.option.given_up():
            self._frontier.drop_given_up()
