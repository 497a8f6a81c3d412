# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Operators and reward templates as JSON."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from slap_ros.core import Domain
from slap_ros.relational import (
    LiftedAtom,
    LiftedOperator,
    Metric,
    Predicate,
    RewardTemplate,
    RewardTerm,
    Variable,
)


def operator_data(operator: LiftedOperator) -> dict[str, Any]:
    """An operator as data that JSON can hold, with inequalities only where it has some."""
    differing = [[one.name, other.name] for one, other in operator.inequalities]
    return {
        "name": operator.name,
        "parameters": [{"name": v.name, "type": v.type.name} for v in operator.parameters],
        "preconditions": _atoms_data(operator.preconditions),
        "delete_effects": _atoms_data(operator.delete_effects),
        "add_effects": _atoms_data(operator.add_effects),
    } | ({"inequalities": differing} if differing else {})


def _atoms_data(atoms: frozenset[LiftedAtom]) -> list[dict[str, Any]]:
    """Atoms in alphabetic order, since sets have none."""
    return [
        {"predicate": atom.predicate.name, "arguments": [v.name for v in atom.variables]}
        for atom in sorted(atoms, key=str)
    ]


def template_data(template: RewardTemplate) -> dict[str, Any]:
    """A reward template as data that JSON can hold."""
    return {
        "operator": template.operator,
        "terms": [
            {
                "metric": term.metric.name,
                "arguments": [variable.name for variable in term.arguments],
                "weight": term.weight,
            }
            for term in template.terms
        ],
    }


def read_operator(data: Any, domain: Domain) -> LiftedOperator:
    """The operator of :func:`operator_data`, with the types and predicates of a domain.

    Raises:
        LookupError, TypeError, AttributeError: It is not of that form, or of another domain.
        InvalidDomainError: Its parts do not fit.
    """
    types, predicates = domain.types_by_name, {p.name: p for p in domain.predicates}
    variables = {v["name"]: Variable(v["name"], types[v["type"]]) for v in data["parameters"]}

    def atoms(part: str) -> frozenset[LiftedAtom]:
        return frozenset(
            LiftedAtom(
                predicates[atom["predicate"]],
                tuple(variables[name] for name in atom["arguments"]),
            )
            for atom in data[part]
        )

    return LiftedOperator(
        str(data["name"]),
        tuple(variables.values()),
        atoms("preconditions"),
        atoms("add_effects"),
        atoms("delete_effects"),
        tuple((variables[one], variables[other]) for one, other in data.get("inequalities", ())),
    )


def read_template(data: Any, operator: LiftedOperator, domain: Domain) -> RewardTemplate:
    """The reward template of :func:`template_data`, with the metrics of a domain.

    Args:
        data: Data of the reward, as :func:`template_data` makes it.
        operator: Operator of the reward.
        domain: Domain whose metrics the reward uses.

    Raises:
        LookupError, TypeError, ValueError: It is not of that form, or of another domain.
    """
    metrics = {metric.name: metric for metric in rewarded_metrics(domain)}
    variables = {variable.name: variable for variable in operator.parameters}
    terms = tuple(
        RewardTerm(
            metrics[term["metric"]],
            tuple(variables[name] for name in term["arguments"]),
            float(term["weight"]),
        )
        for term in data["terms"]
    )
    return RewardTemplate(str(data["operator"]), terms)


def rewarded_metrics(domain: Domain) -> tuple[Metric, ...]:
    """The metrics that a domain's rewards can use, those of its hand-written rewards included."""
    written = domain.acquisition.rewards.values() if domain.acquisition else ()
    used = (term.metric for template in written for term in template.terms)
    return tuple(dict.fromkeys((*metrics_of(domain.predicates), *domain.metrics, *used)))


def metrics_of(predicates: Collection[Predicate]) -> tuple[Metric, ...]:
    """The metrics that predicates rest on, each once, in order."""
    return tuple(dict.fromkeys(c.metric for p in predicates for c in p.conditions))
