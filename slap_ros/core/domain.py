# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The domain: what planning, execution, display and learning need, bound together."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from numbers import Real

import numpy as np

from slap_ros.core.acquisition import Acquisition
from slap_ros.core.action_space import ActionSpace
from slap_ros.core.display import Display
from slap_ros.core.learner_interface import Learning
from slap_ros.core.notebook import ShownInNotebooks
from slap_ros.core.skill import Skill
from slap_ros.core.task import Task
from slap_ros.core.world import SyncVectorWorld, VectorWorld, World
from slap_ros.errors import (
    InvalidDomainError,
    UnknownGoalError,
    UnknownObjectError,
)
from slap_ros.relational import (
    AtomSpace,
    GroundAtom,
    GroundOperator,
    LiftedOperator,
    Metric,
    Predicate,
    State,
    Type,
    ground_operators,
    static_predicates,
)
from slap_ros.whole_numbers import require_whole

# Of a task that begins in a state; an UnknownObjectError where that lacks an object of the goal.
Goal = Callable[[State], frozenset[GroundAtom]]
MOST_DRAWN = 1_000  # tasks, until one has the objects of a named goal
# What the configuration of a domain says whose states are measured on a robot.
MEASURED: Mapping[str, str] = {"states": "measured"}


@dataclass(frozen=True)
class Execution:
    """How a domain's world runs in time, and how measured states are corrected.

    Args:
        control_period_s: Duration of one environment step, s.
        settle: Function that puts measured poses where physics would have them. What rests on
            something in the given state still rests on it afterwards.
        clear: Function that clears a measured state, so that a plan can begin in it: what is held
            of what it touches, or a hand of what it is inside by the planner's shapes.
    """

    control_period_s: float
    settle: Callable[[State], State] = lambda state: state
    clear: Callable[[State], State] = lambda state: state

    def __post_init__(self) -> None:
        """Check the period.

        Raises:
            InvalidDomainError: It is not a number above 0.
        """
        period = self.control_period_s
        if not (isinstance(period, Real) and 0.0 < period < math.inf):
            raise InvalidDomainError(f"control_period_s is {period!r}, expected seconds, above 0")


@dataclass(frozen=True, repr=False)
class Domain(ShownInNotebooks):
    """A planning domain together with its world.

    Operators and skills may be missing: ``acquisition`` says what they are acquired with.
    """

    name: str
    preset: str
    types: tuple[Type, ...]
    predicates: tuple[Predicate, ...]
    action_space: ActionSpace
    sample_task: Callable[[np.random.Generator], Task]
    make_world: Callable[[State], World]  # in that state; others of the same objects by reset
    default_goal: Goal  # of a state given without a goal
    step_limit: int  # environment steps of a task
    execution: Execution
    # Where planners roll options out, if not in such a world: it may differ from what will happen.
    make_model: Callable[[State], World] | None = None
    operators: tuple[LiftedOperator, ...] = ()
    skills: Mapping[str, Skill] = field(default_factory=dict)  # by operator name
    # Operators without a skill: no plan has them, but a message says where a plan would need one.
    unskilled: tuple[LiftedOperator, ...] = ()
    # Whether nothing else changes than what operators say; else other atoms may appear.
    exact: bool = True
    # What rewards can be made of, beside the metrics that predicates rest on.
    metrics: tuple[Metric, ...] = ()
    # Predicates that nothing changes; None: those that no operator changes.
    static: frozenset[Predicate] | None = None
    goals: Mapping[str, Goal] = field(default_factory=dict)  # by name; the first is trained for
    # Types of the robot itself: no predicate depends on their features, but for those below.
    robot_types: frozenset[Type] = frozenset()
    robot_predicates: frozenset[Predicate] = frozenset()
    display: Display = field(default_factory=Display)
    learning: Learning | None = None  # without it there are no shortcuts
    acquisition: Acquisition | None = None  # without it no skills are acquired
    configuration: Mapping[str, str | int | float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the parts fit.

        Raises:
            InvalidDomainError: A name occurs twice, an operator uses an unknown predicate or
                type, or has no skill; the robot has another type; an operator changes what is
                called static, or there are neither operators nor static predicates; or learned
                actions have other axes than the robot.
        """
        for kind, names in (
            ("type", [t.name for t in self.types]),
            ("predicate", [p.name for p in self.predicates]),
            ("operator", [o.name for o in self.operators]),
        ):
            for name in names:
                if names.count(name) > 1:
                    raise InvalidDomainError(f"domain {self.name}: two {kind}s named {name}")
        for t in self.types:
            if t.parent is not None and t.parent not in self.types:
                raise InvalidDomainError(
                    f"domain {self.name}: type {t} descends from {t.parent}, which is not "
                    "among the domain's types"
                )
        for t in self.robot_types:
            if t not in self.types:
                raise InvalidDomainError(
                    f"domain {self.name}: robot_types has {t!r}, which is not among the domain's "
                    "types"
                )
        for operator in self.operators:
            self._check_operator(operator)
            if operator.name not in self.skills:
                raise InvalidDomainError(
                    f"domain {self.name}, operator {operator.name}: no skill; add one to the "
                    "domain's skills"
                )
        for operator in (*self.unskilled, *self._written):
            self._check_operator(operator)
        self._check_static_predicates()
        self._check_learned_actions()

    def __str__(self) -> str:
        """Name and preset."""
        return f"{self.name}, preset {self.preset}"

    def _check_static_predicates(self) -> None:
        if self.static is None:
            if not self.operators:
                raise InvalidDomainError(
                    f"domain {self.name}: without operators nothing tells which predicates are "
                    "static; name them, frozenset() for none"
                )
            return
        never_changed = static_predicates(self.predicates, (*self.operators, *self._written))
        if changed := sorted(p.name for p in self.static - never_changed):
            raise InvalidDomainError(
                f"domain {self.name}: {', '.join(changed)} cannot be static: an operator changes "
                "it, or the domain does not have it"
            )

    def _check_learned_actions(self) -> None:
        own, learned = self.action_space, self.learned_actions
        if (own.axes, own.gripper) != (learned.axes, learned.gripper):
            raise InvalidDomainError(
                f"domain {self.name}: learned actions have other axes or another gripper than the "
                f"robot's ({', '.join(axis.name for axis in own.axes)}; {own.gripper}): give "
                "Learning.actions narrower limits and nothing else"
            )

    def _check_operator(self, operator: LiftedOperator) -> None:
        where = f"domain {self.name}, operator {operator.name}"
        for atom in operator.preconditions | operator.add_effects | operator.delete_effects:
            if atom.predicate not in self.predicates:
                raise InvalidDomainError(
                    f"{where}: unknown predicate {atom.predicate.name!r} in {atom}; the domain has "
                    f"{', '.join(p.name for p in self.predicates)}"
                )
            if len(set(atom.variables)) != len(atom.variables):
                raise InvalidDomainError(f"{where}: {atom} relates a parameter to itself")
        for variable in operator.parameters:
            if variable.type not in self.types:
                raise InvalidDomainError(f"{where}: unknown type {variable.type.name!r}")

    @property
    def _written(self) -> tuple[LiftedOperator, ...]:
        """The operators written by hand."""
        return self.acquisition.operators if self.acquisition else ()

    @property
    def learned_actions(self) -> ActionSpace:
        """What a learned policy may command."""
        learned = self.learning.actions if self.learning is not None else None
        return learned or self.action_space

    @property
    def is_measured(self) -> bool:
        """Whether its states are measured on a robot."""
        return MEASURED.items() <= self.configuration.items()

    @property
    def is_foreseeable(self) -> bool:
        """Whether nothing happens in its world but what planners know: to look again is useless."""
        return self.make_model is None and not self.is_measured

    @property
    def steps_together(self) -> bool:
        """Whether many worlds are stepped faster together than one after the other."""
        return self.learning is not None and self.learning.make_vector_world is not None

    @cached_property
    def types_by_name(self) -> dict[str, Type]:
        """The types, as decoding a state wants them."""
        return {t.name: t for t in self.types}

    @cached_property
    def static_predicates(self) -> frozenset[Predicate]:
        """The predicates that nothing changes."""
        if self.static is not None:
            return self.static
        return static_predicates(self.predicates, self.operators)

    def atom_space(self, initial: State) -> AtomSpace:
        """The ground atoms over a task's objects."""
        return AtomSpace.of_state(
            self.predicates,
            self.static_predicates,
            initial,
            self.robot_types,
            self.robot_predicates,
        )

    def ground(self, space: AtomSpace) -> tuple[GroundOperator, ...]:
        """The operators over a task's objects."""
        return ground_operators(self.operators, space)

    def make_vector_world(self, states: Sequence[State]) -> VectorWorld:
        """Worlds of the same objects, one in each of these states, to be stepped together."""
        if self.learning is not None and self.learning.make_vector_world is not None:
            return self.learning.make_vector_world(states)
        return SyncVectorWorld(self.make_world, states)

    def to_plan_from(self, state: State) -> State:
        """The state that a plan begins in: a measured one is cleared, another stays as it is.

        Args:
            state: Newest state.
        """
        return self.execution.clear(state) if self.is_measured else state

    def model_world(self, state: State) -> World:
        """A world as planners know it, in a state; it is nobody else's."""
        return (self.make_model or self.make_world)(state)

    def model_worlds(self, states: Sequence[State]) -> VectorWorld:
        """Worlds as planners know them, one in each of these states, to be stepped together."""
        if self.make_model is not None:
            return SyncVectorWorld(self.make_model, states)
        return self.make_vector_world(states)

    def task(self, seed: int, index: int = 0, goal: str | None = None) -> Task:
        """The ``index``-th task of a seed; every (seed, index) has a stream of its own.

        Args:
            seed: Seed of the task, at least 0.
            index: Index of the task among those of its seed, at least 0.
            goal: Name of a goal, one of ``goals``; the task is the first of the stream that has its
                objects. None for the goal that comes with the task.

        Raises:
            InvalidParameterError: A seed or an index that is negative or no whole number.
            InvalidDomainError: What the domain samples is no task.
            UnknownGoalError: No such goal.
            UnknownObjectError: No task has the objects of that goal.
        """
        require_whole("seed", seed)
        require_whole("index", index)
        task = self._sampled(np.random.default_rng([seed, index]), goal)
        return replace(task, seed=seed, index=index)

    def _sampled(self, rng: np.random.Generator, goal: str | None) -> Task:
        """The next task of a stream, or the next that has the objects of a named goal."""
        if goal is None:
            return self._drawn(rng)
        if goal not in self.goals:
            named = ", ".join(self.goals) or "none with a name"
            raise UnknownGoalError(
                f"domain {self.name} has no goal {goal!r}; there are {named}; or give atoms, "
                f"(PREDICATE OBJECT ...), of what `slap domains {self.name}` lists"
            )
        for _ in range(MOST_DRAWN - 1):
            with suppress(UnknownObjectError):
                return self._posed(self._drawn(rng), goal)
        return self._posed(self._drawn(rng), goal)

    def _drawn(self, rng: np.random.Generator) -> Task:
        """The next task of a stream, by the domain's own code."""
        task = self.sample_task(rng)
        if not isinstance(task, Task):
            raise InvalidDomainError(
                f"domain {self.name}: sample_task gives {type(task).__name__}, expected a Task"
            )
        self._require_goal(task.goal, "of sample_task")
        return task

    def _posed(self, task: Task, goal: str) -> Task:
        """The task with a goal that goes by a name."""
        atoms = self.goals[goal](task.initial_state)
        self._require_goal(atoms, repr(goal))
        return replace(task, goal=atoms)

    def _require_goal(self, goal: object, origin: str) -> None:
        """Refuse a goal that the domain's own code made of something else than atoms."""
        if not (isinstance(goal, frozenset) and all(isinstance(a, GroundAtom) for a in goal)):
            raise InvalidDomainError(
                f"domain {self.name}: the goal {origin} is a {type(goal).__name__}, expected a "
                "frozenset of ground atoms"
            )
