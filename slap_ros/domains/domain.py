# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a domain is made of: task, world, skills, and the domain that binds them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.domains.view import MakeWorlds, OneByOne, View, Worlds
from slap_ros.errors import InvalidCommandError, InvalidDomainError
from slap_ros.relational import (
    AtomSpace,
    Feature,
    GroundAtom,
    GroundOperator,
    LiftedOperator,
    Object,
    Predicate,
    State,
    Type,
    ground_operators,
    static_predicates,
)

Action = NDArray[np.float64]  # one entry per axis, the gripper last


@dataclass(frozen=True)
class ActionSpace:
    """The axes of an action. The last one is the gripper: > 0.5 closes, < -0.5 opens."""

    axes: tuple[Feature, ...]  # displacement a step in the axis' unit; the gripper is a pure number
    low: tuple[float, ...]
    high: tuple[float, ...]

    @cached_property
    def _bounds(self) -> tuple[Action, Action]:
        tolerance = 1e-9  # rounding of a displacement computed as a difference
        return np.array(self.low) - tolerance, np.array(self.high) + tolerance

    def check(self, action: Action) -> None:
        """Refuse what the robot must not do.

        Raises:
            InvalidCommandError: Wrong length, not finite, or out of range; names the axis.
        """
        low, high = self._bounds
        if action.shape != low.shape:
            raise InvalidCommandError(
                f"a command has {low.size} entries ({', '.join(a.name for a in self.axes)}), "
                f"got shape {action.shape}"
            )
        inside = (action >= low) & (action <= high)  # False for NaN too
        if not inside.all():
            i = int(np.argmin(inside))
            raise InvalidCommandError(
                f"command {self.axes[i].name} = {action[i]} {self.axes[i].unit} is not within "
                f"[{self.low[i]}, {self.high[i]}]"
            )


@dataclass(frozen=True)
class Task:
    """Where to start, what to reach, and in how many environment steps."""

    initial_state: State
    goal: frozenset[GroundAtom]
    step_limit: int


class World(Protocol):
    """Something that can be reset to a state and stepped: a simulator or a robot bridge."""

    @property
    def state(self) -> State:
        """The current state."""
        ...

    def reset(self, state: State) -> None:
        """Continue from this state."""
        ...

    def step(self, action: Action) -> State:
        """Act for one control period.

        Raises:
            InvalidCommandError: The action is not in the domain's action space; nothing moved.
        """
        ...


Policy = Callable[[State], Action | None]  # None: nothing left to do


class Skill(Protocol):
    """The control side of an operator, given or learned, for any objects.

    Everything is a function of its arguments: the same state gives the same policy and the same
    bounds, so that planning, execution and replay agree and roll-outs can be remembered.
    """

    @property
    def name(self) -> str:
        """The operator's or shortcut's name."""
        ...

    @property
    def step_limit(self) -> int:
        """Environment steps after which it counts as failed."""
        ...

    @property
    def least_steps(self) -> int:
        """Environment steps that it takes at least, from any state."""
        ...

    def lower_bound(self, state: State, objects: tuple[Object, ...]) -> int:
        """Environment steps that it takes at least from this state. Never too many."""
        ...

    def start(self, state: State, objects: tuple[Object, ...]) -> Policy:
        """Begin in this state.

        Raises:
            SkillNotApplicableError: It cannot start here.
        """
        ...


@dataclass(frozen=True)
class VisibleBody:
    """A box to be shown, or a body of triangles; pose in the world frame."""

    name: str
    position: tuple[float, float, float]  # m, of its centre
    quaternion: tuple[float, float, float, float]  # x y z w
    size: tuple[float, float, float]  # m, its edges
    colour: tuple[float, float, float, float]  # red green blue opacity, 0 to 1
    # Three corners each, m, in the body's own frame; without any it is a box.
    triangles: tuple[tuple[float, float, float], ...] = ()


# Writes states, one a control step, as a GIF or MP4; tells how many frames are done.
Animate = Callable[[Path, Sequence[State], Callable[[int], None]], None]


@dataclass(frozen=True)
class Domain:
    """A planning domain together with its world."""

    name: str
    preset: str
    types: tuple[Type, ...]
    predicates: tuple[Predicate, ...]
    operators: tuple[LiftedOperator, ...]
    skills: Mapping[str, Skill]  # by operator name
    action_space: ActionSpace
    control_period_s: float
    sample_task: Callable[[np.random.Generator], Task]
    make_world: Callable[[State], World]  # in that state; others of the same objects by reset
    default_goal: Callable[[State], frozenset[GroundAtom]]  # of a state given without a goal
    step_limit: int  # environment steps of a task
    unread_types: frozenset[Type] = frozenset()  # whose features no predicate reads: the robot's
    reading: frozenset[Predicate] = frozenset()  # predicates that read them nevertheless
    # Measured poses put where physics would have them: what lies still lies on something.
    settle: Callable[[State], State] = lambda state: state
    bodies: Callable[[State], Sequence[VisibleBody]] = lambda _: ()  # to be shown
    arm: Callable[[State], Sequence[VisibleBody]] = lambda _: ()  # the robot, unless a body is it
    animate: Animate | None = None
    view: View | None = None  # what a learner sees; without it there are no shortcuts
    learned_actions: ActionSpace | None = None  # of shortcuts, where not all actions are theirs
    make_many: MakeWorlds | None = None  # worlds stepped together, where that is faster
    configuration: Mapping[str, str | int | float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the parts fit.

        Raises:
            InvalidDomainError: A name occurs twice, an operator uses an unknown predicate or
                type, or has no skill.
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
        for operator in self.operators:
            self._check_operator(operator)

    def _check_operator(self, operator: LiftedOperator) -> None:
        where = f"domain {self.name}, operator {operator.name}"
        for atom in operator.preconditions | operator.add_effects | operator.delete_effects:
            if atom.predicate not in self.predicates:
                raise InvalidDomainError(
                    f"{where}: unknown predicate {atom.predicate.name!r} in {atom}; the domain has "
                    f"{', '.join(p.name for p in self.predicates)}"
                )
        for variable in operator.parameters:
            if variable.type not in self.types:
                raise InvalidDomainError(f"{where}: unknown type {variable.type.name!r}")
        if operator.name not in self.skills:
            raise InvalidDomainError(f"{where}: no skill; add one to the domain's skills")

    @property
    def shortcut_actions(self) -> ActionSpace:
        """What a shortcut may command."""
        return self.learned_actions or self.action_space

    @cached_property
    def types_by_name(self) -> dict[str, Type]:
        """The types, as decoding a state wants them."""
        return {t.name: t for t in self.types}

    @cached_property
    def static_predicates(self) -> frozenset[Predicate]:
        """The predicates that no operator changes."""
        return static_predicates(self.predicates, self.operators)

    def atom_space(self, initial: State) -> AtomSpace:
        """The ground atoms over a task's objects."""
        return AtomSpace.of_state(
            self.predicates, self.static_predicates, initial, self.unread_types, self.reading
        )

    def ground(self, space: AtomSpace) -> tuple[GroundOperator, ...]:
        """The operators over a task's objects."""
        return ground_operators(self.operators, space)

    def make_worlds(self, states: Sequence[State]) -> Worlds:
        """Worlds of the same objects, one in each of these states."""
        if self.make_many is not None:
            return self.make_many(states)
        return OneByOne(self.make_world, states)

    def task(self, seed: int, index: int = 0) -> Task:
        """The ``index``-th task of a seed; every (seed, index) has a stream of its own."""
        return self.sample_task(np.random.default_rng([seed, index]))
