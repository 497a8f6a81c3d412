# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Initial states to train a shortcut from, each of another task (SLAP §4.2).

The paper takes them from the graphs that it explored. There, one task gives one state; here, a
task costs no more than the options that lead to where the shortcut begins.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slap_ros.core import Domain, Task
from slap_ros.errors import SlapError
from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.graph_beyond import EdgeBeyond, add_beyond
from slap_ros.planning.options import hold_option
from slap_ros.planning.problem import Problem
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import AtomSpace, Predicate, State
from slap_ros.shortcuts.kept_shortcuts import NOTHING_KEPT, KeptShortcuts, graph_of
from slap_ros.shortcuts.shortcut_candidate import OperatorPath
from slap_ros.shortcuts.signature import Change, Signature
from slap_ros.shortcuts.signature_grounder import SignatureGrounder
from slap_ros.shortcuts.signature_matcher import SignatureMatcher
from slap_ros.shortcuts.way_on import steps_to_goal

_Choice = tuple[tuple[Edge, ...], int, int]  # path, node at its end, node behind the shortcut


@dataclass(frozen=True)
class Start:
    """An initial state of the shortcut MDP, and the change to be made from there."""

    state: State
    space: AtomSpace
    change: Change

    @property
    def target(self) -> int:
        """The abstract state to reach."""
        return self.change.apply(self.space.abstract(self.state))


@dataclass(frozen=True)
class StartRecord:
    """A start as it is written to files and sent to other processes."""

    seed: int
    index: int  # index of the task, drawn with that seed
    features: tuple[float, ...]
    add: int
    delete: int

    def as_json(self) -> dict[str, Any]:
        """A JSON object; masks as hexadecimal text, since they may exceed 64 bits."""
        return {
            "seed": self.seed,
            "index": self.index,
            "features": list(self.features),
            "add": hex(self.add),
            "delete": hex(self.delete),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> StartRecord:
        """The record of :meth:`as_json`.

        Raises:
            KeyError, TypeError, ValueError: The data is no start.
        """
        features = tuple(float(value) for value in data["features"])
        add, delete = int(data["add"], 16), int(data["delete"], 16)
        return cls(int(data["seed"]), int(data["index"]), features, add, delete)


def restore_starts(domain: Domain, records: Sequence[StartRecord]) -> list[Start]:
    """The starts of records, in the same order. Tasks over the same objects share their atoms."""
    spaces: dict[object, AtomSpace] = {}
    starts = []
    for record in records:
        initial = domain.task(record.seed, record.index).initial_state
        key = (initial.layout.objects, domain.atom_space(initial).static_truth)
        space = spaces.setdefault(key, domain.atom_space(initial))
        state = State(initial.layout, np.array(record.features))
        starts.append(Start(state, space, Change(record.add, record.delete)))
    return starts


@dataclass(frozen=True)
class StartGraph:
    """The abstract graph of a task, in which shortcuts begin.

    Args:
        domain: Domain of the task.
        seed: Seed of the task.
        index: Index of the task.
        task: The task.
        problem: Operators and model over the task's objects.
        graph: Graph of the options, from the task's initial state to its goal.
    """

    domain: Domain
    seed: int
    index: int
    task: Task
    problem: Problem
    graph: AbstractGraph

    @classmethod
    def of_task(
        cls, domain: Domain, seed: int, index: int, kept: KeptShortcuts = NOTHING_KEPT
    ) -> StartGraph | None:
        """The graph of a task; None where it cannot be solved, so that it teaches nothing.

        Args:
            domain: Domain of the task.
            seed: Seed of the task.
            index: Index of the task.
            kept: Shortcuts that are options like any other.
        """
        task = domain.task(seed, index)
        problem = Problem.of(domain, task.initial_state)
        space = problem.model.space
        try:
            planner = kept.planner(domain, problem, task.initial_state)
            graph = graph_of(planner, space.abstract(task.initial_state), space.mask(task.goal))
        except SlapError:
            return None
        return cls(domain, seed, index, task, problem, graph)

    def extend(self, signature: Signature) -> None:
        """Add what a shortcut alone leads to, and its own edges, as planning does.

        Args:
            signature: Signature of the shortcut, for which an option stands: it is to be learned.
        """
        standing = hold_option(self.domain.action_space)
        grounder = SignatureGrounder(*self._about(signature))
        leaving = [
            EdgeBeyond.of(i, change.apply(node), standing)
            for i, node in enumerate(self.graph.nodes)
            for change in grounder.changes(node)
        ]
        add_beyond(self.graph, leaving, self.problem.operators)

    def find(
        self,
        signature: Signature,
        operator_path: OperatorPath | None,
        operator_steps: Mapping[str, float],
        rng: np.random.Generator | None = None,
    ) -> StartRecord | None:
        """The start of a shortcut of this signature; None where the task has none.

        Args:
            signature: Signature of the shortcut.
            operator_path: See :func:`find_start`.
            operator_steps: Mean environment steps of each operator, by name.
            rng: See :func:`find_start`.
        """
        matcher = SignatureMatcher(*self._about(signature))
        to_go = steps_to_goal(self.graph, operator_steps)
        choices = _nearest_to_goal_first(self.graph, operator_path, matcher, to_go)
        if rng is not None:
            choices = _shuffled([c for c in choices if to_go[c[2]] < to_go[c[1]]], rng)
        nodes = self.graph.nodes
        for path, i, j in choices:
            state = _execute(self.problem, self.graph, path, self.task.initial_state)
            if state is not None:
                change = Change.between(nodes[i], nodes[j])
                data = tuple(state.data)
                return StartRecord(self.seed, self.index, data, change.add, change.delete)
        return None

    def _about(self, signature: Signature) -> tuple[Signature, AtomSpace, Collection[Predicate]]:
        """What finds the pairs of abstract states that a signature matches."""
        return signature, self.problem.model.space, learner_interface(self.domain).grasping


def find_start(
    domain: Domain,
    seed: int,
    index: int,
    signature: Signature,
    operator_path: OperatorPath | None,
    operator_steps: Mapping[str, float],
    beyond: bool = False,
    rng: np.random.Generator | None = None,
    kept: KeptShortcuts = NOTHING_KEPT,
) -> StartRecord | None:
    """The start of a shortcut of this signature in a task.

    Of all sources that the operators of ``operator_path`` lead to, it is the one from which the
    shortcut gets nearest to the goal, or one that is drawn.

    Args:
        domain: Domain of the task.
        seed: Seed of the task.
        index: Index of the task.
        signature: Signature of the shortcut.
        operator_path: Names of the operators that lead from the initial state to the start; None
            for whatever operators lead to one, as few as can be.
        operator_steps: Mean environment steps of each operator, by name.
        beyond: Whether the shortcut leads to abstract states that operators alone do not reach.
        rng: Generator that draws one of the sources from which the shortcut leads on; None for the
            one that is nearest to the goal.
        kept: Shortcuts that are options like any other.

    Returns:
        The start; None where the task has none, or cannot be solved at all.
    """
    graph = StartGraph.of_task(domain, seed, index, kept)
    if graph is None:
        return None
    if beyond:
        graph.extend(signature)
    return graph.find(signature, operator_path, operator_steps, rng)


def _shuffled(choices: Sequence[_Choice], rng: np.random.Generator) -> list[_Choice]:
    return [choices[i] for i in rng.permutation(len(choices)).tolist()]


def _nearest_to_goal_first(
    graph: AbstractGraph,
    operator_path: OperatorPath | None,
    matcher: SignatureMatcher,
    to_go: Sequence[float],
) -> list[_Choice]:
    """Paths to where a shortcut may begin, with the nodes where it begins and ends."""
    choices = []
    paths = shortest_paths(graph) if operator_path is None else _paths(graph, operator_path)
    for path in paths:
        source = path[-1].target if path else 0
        targets = matcher.targets(graph.nodes, source)
        choices += [(path, source, target) for target in targets if np.isfinite(to_go[target])]
    return sorted(choices, key=lambda choice: to_go[choice[2]])


def shortest_paths(graph: AbstractGraph) -> Iterator[tuple[Edge, ...]]:
    """A sequence of edges from the initial state to each node, with as few edges as can be."""
    forward = graph.forward_edges()
    found: dict[int, tuple[Edge, ...]] = {0: ()}
    queue = deque([0])
    while queue:
        node = queue.popleft()
        yield found[node]
        for edge in forward[node]:
            if edge.target not in found:
                found[edge.target] = (*found[node], edge)
                queue.append(edge.target)


def _paths(graph: AbstractGraph, operator_path: OperatorPath) -> Iterator[tuple[Edge, ...]]:
    """Sequences of edges from the initial state with these operators."""
    forward = graph.forward_edges()

    def extend(path: tuple[Edge, ...]) -> Iterator[tuple[Edge, ...]]:
        if len(path) == len(operator_path):
            yield path
            return
        for edge in forward[path[-1].target if path else 0]:
            if edge.option.skill.name == operator_path[len(path)]:
                yield from extend((*path, edge))

    return extend(())


def _execute(
    problem: Problem, graph: AbstractGraph, path: Sequence[Edge], state: State
) -> State | None:
    for edge in path:
        target = edge.option.target(graph.nodes[edge.target])
        rollout = problem.model.roll_out(edge.option, state, target)
        if not rollout.reached:
            return None
        state = rollout.final
    return state
