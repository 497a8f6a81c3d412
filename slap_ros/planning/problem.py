# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What planners share: the operators over a task's objects, and a model to roll options out in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from slap_ros.core import Domain
from slap_ros.errors import NoSkillsError, PlanningLimitError, UnsolvableError
from slap_ros.planning.astar import find_shortest_sequence
from slap_ros.planning.failures import unreachable_atoms
from slap_ros.planning.model import Model
from slap_ros.planning.mutexes import never_together
from slap_ros.planning.options import Option, given_option, never
from slap_ros.relational import AtomSpace, GroundOperator, State, ground_operators, list_atoms

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
        measured: Whether states are measured on a robot, which may stop where no operator begins.
    """

    model: Model
    operators: GroundedOptions
    unskilled: tuple[GroundOperator, ...] = ()
    exact: bool = True
    measured: bool = False

    @classmethod
    def of(cls, domain: Domain, initial: State, is_canceled: Callable[[], bool] = never) -> Problem:
        """The problem over the objects of ``initial``.

        Args:
            domain: Domain of the tasks.
            initial: A state with the objects of the tasks.
            is_canceled: Whether nobody wants a plan any more; see
                :class:`~slap_ros.planning.model.Model`.

        Raises:
            NoSkillsError: The domain has no operators.
        """
        space = domain.atom_space(initial)
        unskilled = ground_operators(domain.unskilled, space)
        options = ground_options(domain, space)
        model = Model.of(domain, initial, is_canceled)
        return cls(model, options, unskilled, domain.exact, domain.is_measured)

    @property
    def grounds(self) -> list[GroundOperator]:
        """The operators without their options."""
        return [ground for ground, _ in self.operators]

    def require_reachable(self, start: int, goal: int) -> None:
        """Refuse a goal that is easily seen to be out of reach.

        Args:
            start: Abstract state to start from, a mask.
            goal: Mask of atoms that must hold.

        Raises:
            UnsolvableError: Atoms of it never hold, or never hold together.
        """
        if why := _what_never_holds(self.model.space, start, goal, self.grounds):
            raise UnsolvableError(why)

    def why_not(self, start: int, goal: int) -> str:
        """Why operators alone do not lead from an abstract state to a goal, both masks."""
        return why_unreachable(self.model.space, start, goal, self.grounds, self.unskilled)


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
    why = _what_never_holds(space, start, goal, operators)
    return why or f"{list_atoms(space, goal)} never hold all together"


def _what_never_holds(
    space: AtomSpace, start: int, goal: int, operators: Sequence[GroundOperator]
) -> str:
    """Atoms of a goal that never hold, or two that never hold together; empty if there are none."""
    if never := unreachable_atoms(start, goal, operators):
        return f"no operator leads to {list_atoms(space, never)}"
    if pair := never_together(goal, start, operators):
        return f"{list_atoms(space, pair)} never hold together"
    return ""
