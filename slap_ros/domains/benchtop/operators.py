# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Operators and rewards as they are written by hand, in few words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from slap_ros.relational import (
    LiftedAtom,
    LiftedOperator,
    Metric,
    Predicate,
    RewardTemplate,
    RewardTerm,
    Variable,
)


def atom(predicate: Predicate, *variables: Variable) -> LiftedAtom:
    """A predicate applied to parameters of an operator."""
    return LiftedAtom(predicate, variables)


def operator(
    name: str,
    parameters: Sequence[Variable],
    needs: Iterable[LiftedAtom],
    adds: Iterable[LiftedAtom],
    deletes: Iterable[LiftedAtom],
) -> LiftedOperator:
    """An operator that is exact: what it changes is all that its skill changes.

    Args:
        name: Name of the operator, as in the paper where the paper has it.
        parameters: Parameters of the operator. Its skill begins at the object of the last one.
        needs: Preconditions (PRE).
        adds: Add effects (EFF+).
        deletes: Delete effects (EFF-).

    Returns:
        The operator.
    """
    return LiftedOperator(
        name, tuple(parameters), frozenset(needs), frozenset(adds), frozenset(deletes)
    )


def reward(
    of: LiftedOperator, *terms: tuple[Metric, float, tuple[Variable, ...]]
) -> RewardTemplate:
    """The dense reward of an operator.

    Args:
        of: Operator that the reward is for.
        terms: Metric, weight and parameters of each term.

    Returns:
        The template.
    """
    return RewardTemplate(
        of.name, tuple(RewardTerm(metric, about, weight) for metric, weight, about in terms)
    )
