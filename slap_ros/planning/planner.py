# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planners: from a state and a goal to a plan."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Protocol

from slap_ros.core import Domain
from slap_ros.errors import (
    InvalidParameterError,
    NoSkillsError,
    PlanningLimitError,
    UnsolvableError,
)
from slap_ros.planning.abstract_graph import (
    AbstractGraph,
    Edge,
    EdgeBeyond,
    add_beyond,
    build_abstract_graph,
    build_unrolled_graph,
)
from slap_ros.planning.astar import find_shortest_sequence
from slap_ros.planning.failures import Failures, unreachable_atoms
from slap_ros.planning.ff import find_operator_sequence
from slap_ros.planning.model import Model
from slap_ros.planning.options import Option, given_option
from slap_ros.planning.plan import Plan, PlanEdge, PlanningResult
from slap_ros.planning.search import (
    FailedPath,
    failed_paths,
    search_exhaustively,
    search_lazily,
)
from slap_ros.relational import (
    AtomSpace,
    GroundOperator,
    State,
    Target,
    ground_operators,
    list_atoms,
)

SIDE_EFFECTS = 3  # from which is searched on: each search may take as long as the first

Search = Callable[[AbstractGraph, State, Model], Plan]


class Planner(Protocol):
    """Plans for tasks over one set of objects."""

    def plan(self, state: State, goal: int) -> PlanningResult:
        """Plan from ``state`` to where the atoms of ``goal``, a mask, hold.

        Raises:
            UnsolvableError: There is no plan.
            PlanningLimitError: A limit was reached first.
        """
        ...


GroundedOptions = tuple[tuple[GroundOperator, Option], ...]


def require_skills(domain: Domain) -> None:
    """Refuse a domain whose skills are still to be acquired.

    Raises:
        NoSkillsError: The domain has no operators, and hence no skills.
    """
    if not domain.operators:
        by_hand = domain.acquisition is not None and domain.acquisition.operators
        advice = (
            "`slap acquire` acquires them, for --skills; `slap plan` plans with its hand-written "
            "operators, and `slap run --skills demonstrator` lets its demonstrator act"
            if by_hand
            else "give it operators and skills"
        )
        raise NoSkillsError(
            f"domain {domain.name} has no skills yet, so there is nothing to plan with: {advice}"
        )


def ground_options(domain: Domain, space: AtomSpace) -> GroundedOptions:
    """The domain's operators over a task's objects, each with the option that carries it out.

    Raises:
        NoSkillsError: The domain has no operators.
    """
    require_skills(domain)
    return tuple((ground, _option(domain, ground)) for ground in domain.ground(space))


def _option(domain: Domain, ground: GroundOperator) -> Option:
    option = given_option(domain, ground.operator.name, ground.objects)
    return option if domain.exact else replace(option, deletes=ground.delete_effects)


@dataclass(frozen=True)
class Problem:
    """A domain over one set of objects: what planners share.

    Args:
        model: Rolls options out.
        operators: To plan with.
        unskilled: Operators that lack a skill, for messages.
        exact: Whether nothing else changes than what operators say, as with given skills.
    """

    model: Model
    operators: GroundedOptions
    unskilled: tuple[GroundOperator, ...] = ()
    exact: bool = True

    @classmethod
    def of(cls, domain: Domain, initial: State) -> Problem:
        """The problem over the objects of ``initial``.

        Raises:
            NoSkillsError: The domain has no operators.
        """
        space = domain.atom_space(initial)
        unskilled = ground_operators(domain.unskilled, space)
        options = ground_options(domain, space)
        return cls(Model.of(domain, initial), options, unskilled, domain.exact)

    def why_not(self, start: int, goal: int) -> str:
        """Why operators alone do not lead from an abstract state to a goal, both masks."""
        grounds = [ground for ground, _ in self.operators]
        return why_unreachable(self.model.space, start, goal, grounds, self.unskilled)


def why_unreachable(
    space: AtomSpace,
    start: int,
    goal: int,
    operators: Sequence[GroundOperator],
    unskilled: Sequence[GroundOperator] = (),
) -> str:
    """Why operators alone do not lead from an abstract state to a goal.

    Args:
        space: The task's atoms.
        start: A mask.
        goal: A mask.
        operators: Over that space.
        unskilled: Others over it that lack a skill.
    """
    with suppress(UnsolvableError, PlanningLimitError):
        every = (*operators, *unskilled)
        sequence = [every[i] for i in find_shortest_sequence(start, goal, every)]
        lacking = [str(one) for one in sequence if one in unskilled]
        if lacking:
            return f"the plan {', '.join(map(str, sequence))} lacks a skill for {lacking[0]}"
    never = unreachable_atoms(start, goal, operators)
    if never:
        return f"no operator leads to {list_atoms(space, never)}"
    return f"{list_atoms(space, goal)} never hold all together"


class ShortcutSource(Protocol):
    """Gives shortcut edges for an abstract graph."""

    def edges(self, graph: AbstractGraph) -> Sequence[Edge]:
        """Edges to be added to a graph."""
        ...

    def beyond(self, graph: AbstractGraph, within: Collection[str]) -> Sequence[EdgeBeyond]:
        """Edges to abstract states that a graph may not have.

        Args:
            graph: Where they begin.
            within: Names of the shortcuts that stay in it.
        """
        ...


@dataclass(frozen=True)
class GraphPlanner:
    """The abstract planning graph, then a shortest path through it (SLAP §4.1, Alg. 2).

    Shortcuts are edges like others: one that fails in the model leads nowhere, and without any
    this is pure planning. One of which no edge is on a way to the goal may lead out of the graph
    (:func:`~slap_ros.planning.abstract_graph.add_beyond`). Where no path can be executed, the
    graph is deepened beyond the paper's: by one layer at a time, up to ``max_extra_depth``.

    In the same graph, a plan with shortcuts is never longer in the model than one without; see
    :mod:`slap_ros.planning.search`. A plan that shortcuts make possible in a shallower graph is
    taken, though a deeper one might have a shorter plan.

    Where given skills fail on every path, one of them may end in another abstract state than its
    operator says, if the model has it reach the goal from there.

    Where acquired skills fail on every path, the plan may take a detour, back to an abstract state
    in which it was before: a skill that fails from one low-level state of it may well succeed from
    another. Where every detour fails too, the plan is the one that leaves the goal nearest where it
    fails: a skill may well succeed from where it has left the robot, so that to act and to plan
    again is better than to give up.

    Args:
        problem: The model, and the ground operators with their options.
        search: Lazy or exhaustive.
        max_extra_depth: Layers, one per operator, by which the graph may be deepened, and operators
            of a detour.
        shortcuts: Where shortcut edges come from.
    """

    problem: Problem
    search: Search = search_lazily
    max_extra_depth: int = 2
    shortcuts: ShortcutSource | None = None

    def __post_init__(self) -> None:
        if self.max_extra_depth < 0:
            raise InvalidParameterError(f"max_extra_depth must not be negative: {self}")

    def plan(self, state: State, goal: int) -> PlanningResult:
        """See :class:`Planner`."""
        model = self.problem.model
        before, remark = model.executed, ""
        try:
            plan, graph = self._shortest(state, goal)
        except UnsolvableError as error:
            graph = self._graph(model.space.abstract(state), goal, self.max_extra_depth)
            if self.problem.exact:
                found = self._past_side_effect(state, goal, graph)
            elif (found := self._detour(state, graph)) is None:
                found, remark = self._despite_failures(state, goal, graph), str(error)
            if found is None:
                raise
            plan = found
        rolled_out = model.executed - before
        sizes = len(graph.nodes), len(graph.edges)
        return PlanningResult(plan, *sizes, rolled_out, remark, graph)

    def _shortest(self, state: State, goal: int) -> tuple[Plan, AbstractGraph]:
        """The plan that the search finds, and the shallowest graph in which there is one.

        Args:
            state: Where to start.
            goal: Mask of atoms that must hold.

        Raises:
            UnsolvableError: No path through the deepest graph can be executed.
        """
        model = self.problem.model
        start = model.space.abstract(state)
        for extra_depth in range(self.max_extra_depth):
            graph = self._graph(start, goal, extra_depth)
            with suppress(UnsolvableError):
                return self.search(graph, state, model), graph
        graph = self._graph(start, goal, self.max_extra_depth)
        return self.search(graph, state, model), graph

    def _past_side_effect(self, state: State, goal: int, graph: AbstractGraph) -> Plan | None:
        """A plan in which a skill ends in another abstract state than its operator says.

        A block that leans after a slap may slide off when the next one is put down: no operator
        says so, but the model does, and from there the goal may be near, or hold.

        Args:
            state: Where to start.
            goal: Mask of atoms that must hold.
            graph: In which no path can be executed.

        Returns:
            The plan, exact in all its edges; None if there is none.
        """
        model = self.problem.model
        for path in self._failed_paths(state, goal, graph)[:SIDE_EFFECTS]:
            *before, last = path.plan.edges
            there = state
            for edge in before:
                there = model.roll_out(edge.option, there, edge.target).final
            target = Target.exactly(path.abstract)
            rollout = model.roll_out(last.option, there, target)
            if rollout.steps == 0 or not rollout.reached:
                continue  # it does nothing, or something else by the time it gets there
            with suppress(UnsolvableError):
                rest, _ = self._shortest(rollout.final, goal)
                aside = PlanEdge(last.option, target, rollout.steps)
                return Plan((*before, aside, *rest.edges))
        return None

    def _despite_failures(self, state: State, goal: int, graph: AbstractGraph) -> Plan | None:
        """The plan that leaves the goal nearest where it fails.

        Args:
            state: Where to start.
            goal: Mask of atoms that must hold.
            graph: In which no path can be executed.

        Returns:
            The plan; None if no operators lead to the goal from wherever a path fails.
        """
        for path in self._failed_paths(state, goal, graph):
            symbolic = SymbolicPlanner(self.problem.model.space, self.problem.operators)
            rest = symbolic.edges(graph.nodes[path.node], goal)
            return Plan((*path.plan.edges, *rest))
        return None

    def _failed_paths(self, state: State, goal: int, graph: AbstractGraph) -> list[FailedPath]:
        """The paths that fail where operators still lead to the goal, those with fewest first.

        Args:
            state: Where to start.
            goal: Mask of atoms that must hold.
            graph: In which no path can be executed.
        """
        symbolic = SymbolicPlanner(self.problem.model.space, self.problem.operators)
        to_go: dict[int, int] = {}
        nearest: list[tuple[int, int, int, FailedPath]] = []
        for number, path in enumerate(failed_paths(graph, state, self.problem.model)):
            with suppress(UnsolvableError, PlanningLimitError):
                if path.abstract not in to_go:
                    to_go[path.abstract] = len(symbolic.edges(path.abstract, goal))
                key = to_go[path.abstract], path.plan.predicted_steps, number
                nearest.append((*key, path))
        return [path for *_, path in sorted(nearest)]

    def _detour(self, state: State, graph: AbstractGraph) -> Plan | None:
        """A plan that comes back to an abstract state, without shortcuts; None if there is none.

        Args:
            state: Where to start.
            graph: In which no path can be executed.
        """
        shortest = graph.depth[graph.goal_nodes[0]]  # by operators, which come first
        with suppress(UnsolvableError, PlanningLimitError):
            unrolled = build_unrolled_graph(
                graph.nodes[0],
                graph.goal,
                self.problem.operators,
                shortest + self.max_extra_depth,
            )
            # Whatever the search: it tries the fewest of so many sequences.
            return search_lazily(unrolled, state, self.problem.model)
        return None

    def _graph(self, start: int, goal: int, extra_depth: int) -> AbstractGraph:
        """The top level with shortcuts; an error says which atoms of the goal cannot be had."""
        try:
            graph = build_abstract_graph(start, goal, self.problem.operators, extra_depth)
        except UnsolvableError as error:
            raise UnsolvableError(f"{error}: {self.problem.why_not(start, goal)}") from error
        graph.space = self.problem.model.space
        if self.shortcuts is not None:
            shortcuts, on_way = self.shortcuts.edges(graph), graph.on_way_to_goal()
            within = {edge.option.skill.name for edge in shortcuts if edge.target in on_way}
            add_beyond(graph, self.shortcuts.beyond(graph, within), self.problem.operators)
            graph.edges.extend(shortcuts)
        return graph


@dataclass(frozen=True)
class FFPlanner:
    """Greedy best-first search with the FF heuristic, then roll-outs (SLAP D.2).

    An edge that cannot be executed is forbidden and the search repeated.

    Args:
        problem: The model, and the ground operators with their options.
        max_attempts: Abstract plans tried.
    """

    problem: Problem
    max_attempts: int = 100

    def plan(self, state: State, goal: int) -> PlanningResult:
        """See :class:`Planner`."""
        model = self.problem.model
        before, start = model.executed, model.space.abstract(state)
        grounds = [ground for ground, _ in self.problem.operators]
        forbidden: set[tuple[int, int]] = set()
        failures = Failures()
        for _ in range(self.max_attempts):
            try:
                sequence = find_operator_sequence(start, goal, grounds, forbidden)
            except UnsolvableError as error:
                why = failures.in_words() or self.problem.why_not(start, goal)
                raise UnsolvableError(f"{error}: {why}") from error
            edges, failed = self._refine(state, start, sequence, failures)
            if failed is None:
                return PlanningResult(
                    Plan(tuple(edges)),
                    len(sequence) + 1,
                    len(sequence),
                    model.executed - before,
                )
            forbidden.add(failed)
        raise PlanningLimitError(
            f"none of {self.max_attempts} abstract plans could be executed; raise max_attempts: "
            f"{failures.in_words()}"
        )

    def _refine(
        self, state: State, abstract: int, sequence: list[int], failures: Failures
    ) -> tuple[list[PlanEdge], tuple[int, int] | None]:
        """Roll the operators out one after the other; second, the one that failed."""
        edges: list[PlanEdge] = []
        for number in sequence:
            ground, option = self.problem.operators[number]
            expected = ground.apply(abstract)
            target = option.target(expected)
            rollout = self.problem.model.roll_out(option, state, target)
            failures.add(option, target, rollout)
            if not rollout.reached:
                return edges, (abstract, number)
            edges.append(PlanEdge(option, target, rollout.steps))
            state, abstract = rollout.final, expected
        return edges, None


def plan_symbolically(
    space: AtomSpace,
    start: int,
    goal: int,
    operators: Sequence[GroundOperator],
    unskilled: Sequence[GroundOperator] = (),
) -> list[int]:
    """A shortest sequence of operators, by A*; see :mod:`slap_ros.planning.astar`.

    Args:
        space: The task's atoms.
        start: The abstract state to start from, a mask.
        goal: Mask of atoms that must hold.
        operators: Over that space.
        unskilled: Others over it that lack a skill, for messages.

    Returns:
        Indices into ``operators``.

    Raises:
        UnsolvableError: No sequence leads to the goal; the message says which atoms are missing.
        PlanningLimitError: None was found within the limit of abstract states.
    """
    try:
        return find_shortest_sequence(start, goal, operators)
    except UnsolvableError as error:
        why = why_unreachable(space, start, goal, operators, unskilled)
        raise UnsolvableError(f"{error}: {why}") from error


@dataclass(frozen=True)
class SymbolicPlanner:
    """A shortest sequence of operators, by A*; nothing is rolled out in a model.

    Where a rollout takes as long as doing it, doing it and planning again is as good; and a plan is
    wanted before its skills can be had.

    Args:
        space: The task's atoms.
        options: The operators over its objects.
        unskilled: Operators that lack a skill, for messages.
    """

    space: AtomSpace
    options: GroundedOptions
    unskilled: tuple[GroundOperator, ...] = ()

    def plan(self, state: State, goal: int) -> PlanningResult:
        """See :class:`Planner`; the steps that are predicted are the least that skills take."""
        edges = self.edges(self.space.abstract(state), goal)
        return PlanningResult(Plan(tuple(edges)), len(edges) + 1, len(edges), 0)

    def edges(self, abstract: int, goal: int) -> list[PlanEdge]:
        """The plan from an abstract state to a goal, both masks.

        Raises:
            UnsolvableError: There is none.
            PlanningLimitError: None was found within the limit of abstract states.
        """
        grounds, edges = [ground for ground, _ in self.options], []
        for number in plan_symbolically(self.space, abstract, goal, grounds, self.unskilled):
            ground, option = self.options[number]
            abstract = ground.apply(abstract)
            edges.append(PlanEdge(option, option.target(abstract), option.skill.least_steps))
        return edges


def _lazy(problem: Problem, shortcuts: ShortcutSource | None) -> Planner:
    return GraphPlanner(problem, shortcuts=shortcuts)


def _exhaustive(problem: Problem, shortcuts: ShortcutSource | None) -> Planner:
    return GraphPlanner(problem, search_exhaustively, shortcuts=shortcuts)


def _ff(problem: Problem, shortcuts: ShortcutSource | None) -> Planner:
    if shortcuts is not None:
        raise InvalidParameterError("the planner ff plans without shortcuts; use lazy")
    return FFPlanner(problem)


def _astar(problem: Problem, shortcuts: ShortcutSource | None) -> Planner:
    if shortcuts is not None:
        raise InvalidParameterError("the planner astar plans without shortcuts; use lazy")
    return SymbolicPlanner(problem.model.space, problem.operators, problem.unskilled)


PLANNERS: Mapping[str, Callable[[Problem, ShortcutSource | None], Planner]] = {
    "lazy": _lazy,
    "exhaustive": _exhaustive,
    "ff": _ff,
    "astar": _astar,
}
WITH_SHORTCUTS = ("lazy", "exhaustive")  # planners that can use them


def make_planner(
    name: str, domain: Domain, initial: State, shortcuts: ShortcutSource | None = None
) -> Planner:
    """A planner by name.

    Args:
        name: One of ``PLANNERS``.
        domain: For whose tasks.
        initial: A state with the objects of the tasks.
        shortcuts: Where shortcut edges come from; None for pure planning.

    Returns:
        The planner, with a model of its own.

    Raises:
        InvalidParameterError: No planner of that name, or none that can use shortcuts.
        NoSkillsError: The domain has no operators.
    """
    if name not in PLANNERS:
        raise InvalidParameterError(f"unknown planner {name!r}; there are {', '.join(PLANNERS)}")
    return PLANNERS[name](Problem.of(domain, initial), shortcuts)
