# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The reward of a skill, from a template and an operator (LG-SAIL Eq. 3 and 4).

R = max(Σ weight · normalised metric, 1 where all of EFF+ hold and none of EFF-).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slap_ros.core import LearnerInterface
from slap_ros.errors import InvalidRewardError
from slap_ros.relational import (
    Column,
    LiftedAtom,
    LiftedOperator,
    Predicate,
    RewardTemplate,
    RewardTerm,
    State,
    Variable,
)
from slap_ros.relational.articles import a_or_an
from slap_ros.relational.predicates import Bools
from slap_ros.relational.state import Array
from slap_ros.skills.groundings import GroundedStates, N


def check_template(template: RewardTemplate, operator: LiftedOperator) -> None:
    """Refuse a template that is not of an operator, or whose terms do not fit it.

    Args:
        template: Template of the dense part of the operator's reward.
        operator: Operator whose skill is to be learned.

    Raises:
        InvalidRewardError: Names the term, and what is wrong with it.
    """
    if template.operator != operator.name:
        raise InvalidRewardError(
            f"the reward of {template.operator} is given for {operator.name}; give each operator "
            "its own"
        )
    for term in template.terms:
        _check_term(term, operator)


def _check_term(term: RewardTerm, operator: LiftedOperator) -> None:
    where = f"reward of {operator.name}, {term.metric.name}"
    if not (math.isfinite(term.weight) and 0.0 <= term.weight <= 1.0):
        raise InvalidRewardError(f"{where}: its weight is {term.weight}; give one from 0 to 1")
    if len(term.arguments) != len(term.metric.types):
        raise InvalidRewardError(
            f"{where}: {len(term.arguments)} arguments, but it is {term.metric.signature}"
        )
    for variable, wanted in zip(term.arguments, term.metric.types, strict=True):
        if variable not in operator.parameters:
            known = ", ".join(map(str, operator.parameters))
            raise InvalidRewardError(
                f"{where}: {variable} is not among the operator's parameters, {known}"
            )
        if not variable.type.is_a(wanted):
            raise InvalidRewardError(
                f"{where}: {variable} is {a_or_an(variable.type)}, but it is "
                f"{term.metric.signature}"
            )


@dataclass(frozen=True)
class _Positions:
    """The parameters of an operator that a metric or an atom is about."""

    numbers: tuple[int, ...]

    @classmethod
    def of(cls, variables: Iterable[Variable], operator: LiftedOperator) -> _Positions:
        return cls(tuple(operator.parameters.index(variable) for variable in variables))

    def columns(self, states: GroundedStates) -> tuple[Column, ...]:
        return tuple(states.columns[i] for i in self.numbers)


class OperatorEffects:
    """Whether an operator's effects hold for good, in many states of many groundings at once.

    The hand that goes away moves a drawer somewhat, or what it lies against. So what is added must
    be some way past its threshold, and the hand able to leave: both as the domain says.
    """

    def __init__(self, operator: LiftedOperator, interface: LearnerInterface) -> None:
        """Bind the effects to the operator's parameters.

        Args:
            operator: Operator whose effects are checked.
            interface: Learner's interface of the domain.
        """
        self.operator, self._interface = operator, interface
        self._added = self._positions(operator.add_effects)
        self._deleted = self._positions(operator.delete_effects)

    def _positions(self, atoms: Iterable[LiftedAtom]) -> list[tuple[LiftedAtom, _Positions]]:
        """Atoms in alphabetic order, since sets have none."""
        ordered = sorted(atoms, key=str)
        return [(atom, _Positions.of(atom.variables, self.operator)) for atom in ordered]

    def hold(self, states: GroundedStates) -> Bools:
        """Whether all that is added holds and nothing that is deleted, for good, shape (n,)."""
        success = np.ones(len(states.choice), dtype=bool)
        for atom, about in self._added:
            success &= self._holds(atom.predicate, states, about.columns(states))
        for atom, about in self._deleted:
            columns = about.columns(states)
            success &= ~_own(states, atom.predicate.classifier(states.state, *columns))
        done = np.flatnonzero(success)
        if done.size:
            ended = State(states.state.layout, states.state.data[done])
            success[done] = self._interface.can_leave(ended)
        return success

    def _holds(
        self, predicate: Predicate, states: GroundedStates, columns: tuple[Column, ...]
    ) -> Bools:
        tolerance = self._interface.success_tolerance(
            predicate(*(column.objects[0] for column in columns))
        )
        if tolerance == 0.0 or predicate.margin is None:
            return _own(states, predicate.classifier(states.state, *columns))
        past: Bools = _own(states, predicate.margin(states.state, *columns)) >= tolerance
        return past


class SkillReward:
    """The reward of an operator's skill, for many states of many groundings at once."""

    def __init__(
        self, operator: LiftedOperator, template: RewardTemplate, interface: LearnerInterface
    ) -> None:
        """Bind the template to the operator's parameters.

        Args:
            operator: Operator whose skill is to be learned.
            template: Template of the dense part of the operator's reward.
            interface: Learner's interface of the domain.

        Raises:
            InvalidRewardError: Template and operator do not fit.
        """
        check_template(template, operator)
        self.operator, self.template = operator, template
        self._terms = [(t, _Positions.of(t.arguments, operator)) for t in template.terms]
        self._effects = OperatorEffects(operator, interface)

    def __call__(self, states: GroundedStates) -> Array:
        """The reward in each state, in [0, max(1, Σ weights)], shape (n,)."""
        return np.maximum(self.dense(states), self.success(states).astype(np.float64))

    def dense(self, states: GroundedStates) -> Array:
        """The weighted metrics in each state, shape (n,)."""
        total = np.zeros(len(states.choice))
        for term, about in self._terms:
            values = term.metric.normalised(states.state, *about.columns(states))
            total += term.weight * _own(states, values)
        return total

    def success(self, states: GroundedStates) -> Bools:
        """Whether the effects hold, as :meth:`OperatorEffects.hold` says, shape (n,)."""
        return self._effects.hold(states)


def _own(states: GroundedStates, values: NDArray[N]) -> NDArray[N]:
    """Each state's own value; what is about no object is the same for all groundings."""
    return values[:, 0] if values.shape[-1] == 1 else states.pick(values)
