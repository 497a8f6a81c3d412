# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The problem that operators and rewards are proposed for: names, objects, start, goal."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from slap_ros.core import Domain, Task
from slap_ros.relational import AtomSpace, GroundAtom, Layout, Metric, Predicate, State, Type
from slap_ros.relational.pddl import PddlDomain, PddlProblem
from slap_ros.skills.operator_json import metrics_of


@dataclass(frozen=True)
class AcquisitionProblem:
    """A task without operators.

    Args:
        name: Name of the domain.
        types: Types of the domain.
        predicates: Predicates of the domain.
        metrics: Metrics that rewards can be made of; none for problems without a world.
        static: Predicates that nothing changes.
        layout: Layout of the task's objects.
        init: Atoms that hold at first.
        goal: Atoms that shall hold in the end.
        shown: Abstract states that demonstrations went through, in order, for each demonstration;
            none where there are none.
        start: Initial state of the task; None for problems without a world.
    """

    name: str
    types: tuple[Type, ...]
    predicates: tuple[Predicate, ...]
    metrics: tuple[Metric, ...]
    static: frozenset[Predicate]
    layout: Layout
    init: frozenset[GroundAtom]
    goal: frozenset[GroundAtom]
    shown: tuple[tuple[frozenset[GroundAtom], ...], ...] = ()
    start: State | None = None

    @classmethod
    def of_pddl(cls, domain: PddlDomain, problem: PddlProblem) -> AcquisitionProblem:
        """The problem that two PDDL files state; the domain's own operators are left out.

        Which predicates are static is taken from them, though: it is a fact about the world.
        """
        static = domain.static_predicates if domain.actions else frozenset()
        return cls(
            domain.name,
            domain.types,
            domain.predicates,
            (),
            static,
            problem.objects,
            problem.init,
            problem.goal,
        )

    @classmethod
    def of_task(
        cls,
        domain: Domain,
        task: Task,
        goal: Collection[GroundAtom] = (),
    ) -> AcquisitionProblem:
        """The problem of a domain's task.

        Args:
            domain: Domain with a world; its operators are left out.
            task: Task to start from.
            goal: Atoms to reach; the task's goal if left out.
        """
        space = domain.atom_space(task.initial_state)
        return cls(
            domain.name,
            domain.types,
            domain.predicates,
            tuple(dict.fromkeys((*metrics_of(domain.predicates), *domain.metrics))),
            domain.static_predicates,
            space.layout,
            frozenset(space.decode(space.abstract(task.initial_state))),
            frozenset(goal or task.goal),
            start=task.initial_state,
        )

    @cached_property
    def space(self) -> AtomSpace:
        """The ground atoms over the problem's objects; static ones are as they are at first."""
        return AtomSpace(
            self.predicates,
            self.static,
            self.layout,
            self.init.__contains__,
            one_object_twice=self.start is None,  # as in PDDL
        )

    @cached_property
    def start_mask(self) -> int:
        """The abstract state to start from, a mask."""
        return self.space.mask(self.init)

    @cached_property
    def goal_mask(self) -> int:
        """The atoms to reach, a mask."""
        return self.space.mask(self.goal)

    @cached_property
    def usable_types(self) -> tuple[Type, ...]:
        """The types whose objects some predicate can be about."""
        taken = [kind for predicate in self.predicates for kind in predicate.types]
        return tuple(kind for kind in self.types if any(kind.is_a(one) for one in taken))

    @cached_property
    def types_by_name(self) -> dict[str, Type]:
        """The types, as drafts name them."""
        return {kind.name: kind for kind in self.types}

    @cached_property
    def predicates_by_name(self) -> dict[str, Predicate]:
        """The predicates, as drafts name them."""
        return {predicate.name: predicate for predicate in self.predicates}

    @cached_property
    def metrics_by_name(self) -> dict[str, Metric]:
        """The metrics, as drafts name them."""
        return {metric.name: metric for metric in self.metrics}

    @cached_property
    def shown_to_change(self) -> frozenset[Predicate]:
        """The predicates of atoms that changed in a demonstration."""
        return frozenset(
            atom.predicate
            for demonstration in self.shown
            for before, after in pairwise(demonstration)
            for atom in before ^ after
        )
