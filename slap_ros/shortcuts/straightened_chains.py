# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pairs of skills, one after the other, whose execution is made shorter while a task is explored.

What two skills do with two contacts, one after the other, no random rollout does. The skills
themselves show that it can be done, and where the shortcut in their place is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from slap_ros.core import Domain
from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.problem import Problem
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import State
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.signature import Change, Signature
from slap_ros.shortcuts.signature_matcher import SignatureMatcher
from slap_ros.shortcuts.straightening import ChainExecutor, StraightenedExecution, Straightener

Pair = tuple[Edge, Edge]


class StraightenedChains:
    """The pairs of skills of one task's graph."""

    def __init__(
        self, domain: Domain, problem: Problem, graph: AbstractGraph, regrasps: bool = False
    ) -> None:
        """Execute nothing yet.

        Args:
            domain: Domain with the skills.
            problem: Operators and model over the task's objects.
            graph: Abstract planning graph of the task.
            regrasps: Whether skills may change what is held on the way alone.
        """
        self._regrasps = regrasps
        self._domain, self._space, self._graph = domain, problem.model.space, graph
        self._forward = graph.forward_edges()
        self.steps = 0  # environment steps so far

    def leading_from(self, node: int) -> Iterator[Pair]:
        """Yield the pairs of forward edges from a node, one pair for each node that they lead to.

        Args:
            node: Index of the node.
        """
        reached: set[int] = set()
        for first in self._forward[node]:
            for second in self._forward[first.target]:
                if second.target not in reached:
                    reached.add(second.target)
                    yield first, second

    def most_steps(self, pair: Pair, tries: int) -> int:
        """Environment steps that :meth:`straighten` takes at most, with so many tries."""
        return (tries + 2) * sum(edge.option.skill.step_limit for edge in pair)

    def straighten(
        self, state: State, node: int, pair: Pair, tries: int, rng: np.random.Generator
    ) -> StraightenedExecution | None:
        """Execute both skills, and make the execution shorter.

        Args:
            state: State in which the first one begins.
            node: Index of the node that stands for the state.
            pair: Edges of the skills.
            tries: Number of stretches that are tried.
            rng: Generator that draws the stretches.

        Returns:
            The execution; None where a skill fails, or the shortcut lacks actions that they take.
        """
        executor = ChainExecutor(self._domain, self._space, state)
        commands = executor.commands(state, pair, self._graph.nodes)
        self.steps += executor.steps
        if commands is None:
            return None
        signature, change = self._lifted(node, pair)
        encoder = ObservationEncoder(self._domain, self._space, signature, change)
        straightener = Straightener(self._domain, encoder, state)
        found = straightener.shorten(commands, tries, rng)
        self.steps += straightener.steps
        return found

    def signature(self, node: int, pair: Pair) -> Signature:
        """The signature of the shortcut in the place of two skills, which matches this change.

        Where the same can be done with more objects, the whole of that would be the change that a
        signature matches. Skills show it with one of them, so that it is counted.

        Args:
            node: Index of the node in which the shortcut begins.
            pair: Edges of the skills.
        """
        signature, _ = self._lifted(node, pair)
        grasping = learner_interface(self._domain).grasping
        matcher = SignatureMatcher(signature, self._space, grasping)
        if pair[1].target in matcher.targets(self._graph.nodes, node):
            return signature
        return replace(signature, counted=True)

    def _lifted(self, node: int, pair: Pair) -> tuple[Signature, Change]:
        """The change that two skills make from a node, and the signature that it has by itself."""
        interface = learner_interface(self._domain)
        before, between, after = (
            self._graph.nodes[i] for i in (node, pair[0].target, pair[1].target)
        )
        change = Change.between(before, after)
        signature = Signature.between(before, after, self._space, interface.grasping)
        if not self._regrasps:
            return signature, change
        held = interface.grasp_atoms(self._space)
        on_the_way = bool((before ^ between) & held) and not (before ^ after) & held
        return replace(signature, regrasps=on_the_way), change
