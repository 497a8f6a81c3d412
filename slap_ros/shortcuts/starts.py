# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Initial states to train a shortcut from, each of another task (SLAP §4.2).

The paper takes them from the graphs that it explored. There, one task gives one state; here, a
task costs no more than the options that lead to where the shortcut begins.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slap_ros.core import Domain
from slap_ros.errors import SlapError
from slap_ros.planning.abstract_graph import AbstractGraph, Edge, build_abstract_graph
from slap_ros.planning.planner import Problem
from slap_ros.relational import AtomSpace, State
from slap_ros.shortcuts.explore import Origin, ways_to_goal
from slap_ros.shortcuts.practice import Start
from slap_ros.shortcuts.reach import Reach
from slap_ros.shortcuts.sight import learner_interface
from slap_ros.shortcuts.signature import Change, Signature


@dataclass(frozen=True)
class StartRecord:
    """A start as plain data, to be kept and to be sent to other processes."""

    seed: int
    index: int  # of the task
    features: tuple[float, ...]
    add: int
    delete: int

    def as_json(self) -> dict[str, Any]:
        """Plain data; masks as hexadecimal text, for they may be long."""
        return {
            "seed": self.seed,
            "index": self.index,
            "features": list(self.features),
            "add": hex(self.add),
            "delete": hex(self.delete),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> StartRecord:
        """The record of :meth:`as_json`."""
        features = tuple(float(value) for value in data["features"])
        add, delete = int(data["add"], 16), int(data["delete"], 16)
        return cls(int(data["seed"]), int(data["index"]), features, add, delete)


def recall(domain: Domain, records: Sequence[StartRecord]) -> list[Start]:
    """The starts of records. Tasks over the same objects share their atoms."""
    spaces: dict[object, AtomSpace] = {}
    starts = []
    for record in records:
        initial = domain.task(record.seed, record.index).initial_state
        key = (initial.layout.objects, domain.atom_space(initial).static_truth)
        space = spaces.setdefault(key, domain.atom_space(initial))
        state = State(initial.layout, np.array(record.features))
        starts.append(Start(state, space, Change(record.add, record.delete)))
    return starts


def find_start(
    domain: Domain,
    seed: int,
    index: int,
    signature: Signature,
    origin: Origin,
    operator_steps: Mapping[str, float],
) -> StartRecord | None:
    """Where a shortcut of this signature would begin in a task; None if nowhere.

    Of all sources that the operators of ``origin`` lead to, the one from which the shortcut gets
    nearest to the goal.
    """
    task = domain.task(seed, index)
    problem = Problem.of(domain, task.initial_state)
    space = problem.model.space
    try:
        graph = build_abstract_graph(
            space.abstract(task.initial_state), space.mask(task.goal), problem.operators
        )
    except SlapError:  # a task that cannot be solved teaches nothing here
        return None
    to_go = ways_to_goal(graph, operator_steps)
    reach = Reach(signature, space, learner_interface(domain).grasping)
    choices = [
        (to_go[j], path, j)
        for path in _paths(graph, origin)
        for j in reach.targets(graph.nodes, path[-1].target if path else 0)
        if np.isfinite(to_go[j])
    ]
    for _, path, j in sorted(choices, key=lambda choice: choice[0]):
        state = _execute(problem, graph, path, task.initial_state)
        if state is not None:
            i = path[-1].target if path else 0
            change = Change.between(graph.nodes[i], graph.nodes[j])
            return StartRecord(seed, index, tuple(state.data), change.add, change.delete)
    return None


def _paths(graph: AbstractGraph, origin: Origin) -> Iterator[tuple[Edge, ...]]:
    """Sequences of edges from the start with these operators."""
    forward = graph.forward_edges()

    def extend(path: tuple[Edge, ...]) -> Iterator[tuple[Edge, ...]]:
        if len(path) == len(origin):
            yield path
            return
        for edge in forward[path[-1].target if path else 0]:
            if edge.option.skill.name == origin[len(path)]:
                yield from extend((*path, edge))

    return extend(())


def _execute(
    problem: Problem, graph: AbstractGraph, path: Sequence[Edge], state: State
) -> State | None:
    for edge in path:
        rollout = problem.model.roll_out(edge.option, state, graph.nodes[edge.target])
        if not rollout.reached:
            return None
        state = rollout.final
    return state
