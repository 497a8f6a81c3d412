# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Strict JSON schemas of answers; their enumerations are the task's predicates, types, metrics.

Strict, as servers want it: every property required, nothing additional. Each comes with the form
of plain text that says the same, for servers that take no schema.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from slap_ros.language.request import Schema
from slap_ros.relational import LiftedOperator, Metric, Predicate, Type

_STRING = {"type": "string"}
DECOMPOSITION_TEXT = (
    "Answer with one line and nothing else: the list of actions in brackets, each with its "
    "variables, which are named after their types, as in\n[Act(?thing), Act2(?thing, ?place)]"
)
OPERATOR_TEXT = """Answer with these four lines and nothing else:
PAR: {?variable: type, ...}
PRE: {Predicate(?variable, ...), ...}
EFF-: {Predicate(?variable, ...), ...}
EFF+: {Predicate(?variable, ...), ...}"""
REWARD_TEXT = (
    "Answer with one line and nothing else: the sum of weighted metrics with their arguments, as in"
    "\nR = 0.5 * metric(?variable) + 0.25 * metric2(?variable, ?variable2)"
)
PLAN_TEXT = (
    "Answer with one line and nothing else: the list of actions in brackets, each with names of "
    "objects, as in\n[Act(thing1), Act2(thing1, place1)]"
)


def decomposition_schema(types: Sequence[Type]) -> Schema:
    """Of the actions that a task is made of."""
    action = _object(name=_STRING, parameters=_array(_parameter(types)))
    return Schema("decomposition", _object(actions=_array(action)), DECOMPOSITION_TEXT)


def operator_schema(name: str, types: Sequence[Type], predicates: Sequence[Predicate]) -> Schema:
    """Of the operator of one action.

    Args:
        name: The action's.
        types: The task's.
        predicates: The task's.

    Returns:
        The schema, which allows no other name.
    """
    predicate = _choice([predicate.name for predicate in predicates])
    atoms = _array(_object(predicate=predicate, arguments=_array(_STRING)))
    definition = _object(
        name=_choice([name]),
        parameters=_array(_parameter(types)),
        preconditions=atoms,
        delete_effects=atoms,
        add_effects=atoms,
    )
    return Schema("operator", definition, OPERATOR_TEXT)


def reward_schema(metrics: Sequence[Metric], operator: LiftedOperator) -> Schema:
    """Of the dense reward of one operator, whose parameters metrics may be about."""
    metric = _choice([metric.name for metric in metrics])
    variable = _choice([variable.name for variable in operator.parameters])
    term = _object(metric=metric, arguments=_array(variable), weight={"type": "number"})
    return Schema("reward", _object(terms=_array(term)), REWARD_TEXT)


def plan_schema(actions: Sequence[str], objects: Sequence[str]) -> Schema:
    """Of a plan that a model makes by itself.

    Args:
        actions: Names of the operators.
        objects: Names of the task's objects.
    """
    step = _object(action=_choice(actions), objects=_array(_choice(objects)))
    return Schema("plan", _object(plan=_array(step)), PLAN_TEXT)


def _parameter(types: Sequence[Type]) -> dict[str, Any]:
    return _object(name=_STRING, type=_choice([kind.name for kind in types]))


def _object(**properties: Any) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }


def _array(items: Any) -> dict[str, Any]:
    return {"type": "array", "items": items}


def _choice(names: Sequence[str]) -> dict[str, Any]:
    return {"type": "string", "enum": list(names)}
