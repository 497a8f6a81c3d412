# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A library's shortcuts in one task: the pairs of abstract states that they may join."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial

from slap_ros.core import Domain
from slap_ros.planning.abstract_graph import AbstractGraph, Edge
from slap_ros.planning.graph_beyond import EdgeBeyond
from slap_ros.planning.landmark_cut import RelaxedOperator
from slap_ros.planning.options import Option, OptionKind
from slap_ros.planning.shortcut_source import Largest
from slap_ros.policies.learner_interface import learner_interface
from slap_ros.relational import Object, State, Target
from slap_ros.shortcuts.ground_shortcut import GroundShortcut, least_steps
from slap_ros.shortcuts.observation_encoder import ObservationEncoder
from slap_ros.shortcuts.sampling import DEFAULT, Sampling
from slap_ros.shortcuts.shortcut import Shortcut
from slap_ros.shortcuts.shortcut_rollouts import ShortcutRollouts
from slap_ros.shortcuts.shortcut_trial import ShortcutRollout
from slap_ros.shortcuts.signature import Change, concerned
from slap_ros.shortcuts.signature_grounder import SignatureGrounder
from slap_ros.shortcuts.signature_matcher import SignatureMatcher


class GroundedShortcuts:
    """Shortcuts over the objects of a task. Rollouts are made in a world of its own."""

    def __init__(
        self,
        domain: Domain,
        shortcuts: Sequence[Shortcut],
        initial: State,
        sampling: Sampling = DEFAULT,
    ) -> None:
        """Ground shortcuts over the objects of a task.

        Args:
            domain: Domain for which the shortcuts were learned.
            shortcuts: Learned shortcuts.
            initial: State with the objects of the task.
            sampling: Settings of how shortcuts are tried out in the model.
        """
        self.shortcuts = tuple(shortcuts)
        self._domain = domain
        self._space = domain.atom_space(initial)
        self._rollouts = ShortcutRollouts(domain, initial, sampling)
        about = [(s.signature, self._space, learner_interface(domain).grasping) for s in shortcuts]
        self._matchers = [SignatureMatcher(*each) for each in about]
        self._grounders = [SignatureGrounder(*each) for each in about]
        self._encoders: dict[tuple[str, Change], ObservationEncoder] = {}
        self._concerned: dict[Change, tuple[Object, ...]] = {}

    def edges(self, graph: AbstractGraph) -> list[Edge]:
        """An edge for each pair of nodes that no option joins and a shortcut may (Alg. 2)."""
        joined = {(edge.source, edge.target) for edge in graph.edges}
        found = []
        for shortcut, matcher in zip(self.shortcuts, self._matchers, strict=True):
            for i, j in matcher.pairs(graph.nodes):
                if (i, j) not in joined:
                    change = Change.between(graph.nodes[i], graph.nodes[j])
                    found.append(Edge(i, j, self._option(shortcut, change)))
        return found

    def beyond(self, graph: AbstractGraph, within: Collection[str]) -> list[EdgeBeyond]:
        """What each other shortcut would change in each node, of as many objects as in training."""
        return [
            EdgeBeyond(i, change.apply(node), partial(self._option, shortcut, change))
            for shortcut, grounder in zip(self.shortcuts, self._grounders, strict=True)
            if shortcut.name not in within
            for i, node in enumerate(graph.nodes)
            for change in grounder.changes(node)
        ]

    def relaxed(self) -> list[RelaxedOperator]:
        """Each shortcut with all instances of what it adds, which need nothing."""
        return [
            RelaxedOperator(0, matcher.may_be_added, least_steps(shortcut))
            for shortcut, matcher in zip(self.shortcuts, self._matchers, strict=True)
        ]

    def may_begin(self, abstract: int) -> bool:
        """See :class:`~slap_ros.planning.shortcut_source.ShortcutSource`."""
        return any(matcher.may_begin(abstract) for matcher in self._matchers)

    def whole_changes(self, abstract: int, largest: Largest) -> list[EdgeBeyond] | None:
        """See :class:`~slap_ros.planning.shortcut_source.ShortcutSource`."""
        found = []
        for shortcut, matcher in zip(self.shortcuts, self._matchers, strict=True):
            if not matcher.may_begin(abstract):
                continue
            target = largest(abstract, matcher.may_be_added, matcher.left_alone)
            if target is None:
                return None
            change = Change.between(abstract, target)
            if matcher.matches(abstract, target):
                make_option = partial(self._option, shortcut, change)
                found.append(EdgeBeyond(0, target, make_option))
            elif shortcut.signature.may_match_part(change, self._space):
                return None
        return found

    def forget_failures_since_now(self) -> Callable[[], None]:
        """See :class:`~slap_ros.planning.shortcut_source.ShortcutSource`."""
        return self._rollouts.forget_failures_since_now()

    def option(self, name: str, source: int, target: Target, attempt: int = 0) -> Option | None:
        """A shortcut from an abstract state to a target.

        Args:
            name: Name of the shortcut.
            source: Abstract state in which the shortcut begins, a mask.
            target: Target that the shortcut shall reach.
            attempt: Number of the successful rollout to follow, from 0, the shortest first.

        Returns:
            The option; None where there is no such shortcut, or it does not match the change.
        """
        change = Change(target.required & ~source, target.forbidden & source)
        for shortcut in self.shortcuts:
            if shortcut.name == name and shortcut.signature.matches(change, source, self._space):
                return self._option(shortcut, change, attempt)
        return None

    def cached_rollouts(self) -> Iterator[tuple[str, tuple[ShortcutRollout, ...]]]:
        """The name of each shortcut that was tried, and its successes, once for each state."""
        return self._rollouts.cached()

    def _option(self, shortcut: Shortcut, change: Change, attempt: int = 0) -> Option:
        encoder = partial(self._encoder, shortcut, change)
        return Option(
            OptionKind.SHORTCUT,
            GroundShortcut(shortcut, change, attempt, encoder, self._rollouts),
            self._objects(change),
            accepts=lambda state: encoder().accepts(state),
            attempt=attempt,
            next_attempt=lambda: self._option(shortcut, change, attempt + 1),
            given_up=lambda: self._rollouts.given_up(shortcut),
            deletes=None if self._domain.exact else change.delete,
        )

    def _encoder(self, shortcut: Shortcut, change: Change) -> ObservationEncoder:
        """The encoder of a shortcut for a change, made when it is needed."""
        key = (shortcut.name, change)
        if key not in self._encoders:
            self._encoders[key] = ObservationEncoder(
                self._domain, self._space, shortcut.signature, change
            )
        return self._encoders[key]

    def _objects(self, change: Change) -> tuple[Object, ...]:
        """The objects of a change; the same change joins many pairs of nodes."""
        if change not in self._concerned:
            self._concerned[change] = concerned(change, self._space)
        return self._concerned[change]
