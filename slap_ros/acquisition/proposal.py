# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A proposal: operators, a reward template for each, a plan, and where it all comes from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from slap_ros.acquisition.problem import AcquisitionProblem, metrics_of
from slap_ros.core import Domain
from slap_ros.relational import (
    LiftedAtom,
    LiftedOperator,
    Metric,
    RewardTemplate,
    RewardTerm,
    Variable,
)
from slap_ros.relational.pddl import with_different_objects, write_domain, write_problem

VERSION = 1


@dataclass(frozen=True)
class ProposalProvenance:
    """Where a proposal comes from.

    Args:
        proposer: By name: manual, induced, language.
        rewarder: By name: manual, composed, language; empty while there are no rewards.
        source: What was asked: the address of a server, the folders of demonstrations, a file.
        model: As it was asked for; empty where none was.
        requests: The sha256 of the requests whose answers are in the proposal.
        attempts: Answers that it took.
        tokens: That it took.
    """

    proposer: str
    rewarder: str = ""
    source: str = ""
    model: str = ""
    requests: tuple[str, ...] = ()
    attempts: int = 0
    tokens: int = 0


@dataclass(frozen=True)
class Proposal:
    """Operators for a problem, with everything that learning their skills takes.

    Args:
        problem: The domain's name.
        operators: In the order of the decomposition.
        plan: The ground operators of a shortest plan, as text; None where none was looked for.
        provenance: Where it comes from.
        rewards: By operator name.
        remarks: What people should know: warnings of the checks, preconditions seen only once.
    """

    problem: str
    operators: tuple[LiftedOperator, ...]
    plan: tuple[str, ...] | None
    provenance: ProposalProvenance
    rewards: Mapping[str, RewardTemplate] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    def to_data(self) -> dict[str, Any]:
        """What JSON can hold, in the same order for the same proposal."""
        return {
            "format": "slap_ros proposal",
            "version": VERSION,
            "problem": self.problem,
            "operators": [operator_data(operator) for operator in self.operators],
            "rewards": [
                template_data(self.rewards[operator.name])
                for operator in self.operators
                if operator.name in self.rewards
            ],
            "plan": None if self.plan is None else list(self.plan),
            "remarks": list(self.remarks),
            "provenance": asdict(self.provenance),
        }

    def to_json(self) -> str:
        """JSON, the same bytes for the same proposal."""
        return json.dumps(self.to_data(), indent=2, allow_nan=False) + "\n"

    def to_pddl(self, problem: AcquisitionProblem) -> tuple[str, str]:
        """Domain and problem, readable by ``slap plan``.

        Raises:
            MalformedPddlError: A name that PDDL cannot hold, as an object's may be.
        """
        operators = self.operators
        if problem.start is not None:  # a world, whose atoms relate different objects
            operators = tuple(with_different_objects(operators))
        domain = write_domain(self.problem, problem.types, problem.predicates, operators)
        init = sorted(problem.init, key=str)
        task = write_problem("task", self.problem, problem.layout.objects, init, problem.goal)
        return domain, task


def operator_data(operator: LiftedOperator) -> dict[str, Any]:
    """What JSON can hold of an operator; which parameters must differ only where some must."""
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
    """What JSON can hold of a reward."""
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


def read_proposal(data: Any, domain: Domain) -> Proposal:
    """The proposal of :meth:`Proposal.to_data`, in a domain's words.

    Raises:
        LookupError, TypeError, ValueError, AttributeError: It is not of that form, or of another
            domain.
        InvalidDomainError: Its parts do not fit.
    """
    operators = {entry["name"]: read_operator(entry, domain) for entry in data["operators"]}
    rewards = {
        entry["operator"]: read_template(entry, operators[entry["operator"]], domain)
        for entry in data["rewards"]
    }
    made = dict(data["provenance"])
    provenance = ProposalProvenance(**{**made, "requests": tuple(made["requests"])})
    plan = None if data["plan"] is None else tuple(map(str, data["plan"]))
    remarks = tuple(map(str, data["remarks"]))
    return Proposal(
        str(data["problem"]), tuple(operators.values()), plan, provenance, rewards, remarks
    )


def read_operator(data: Any, domain: Domain) -> LiftedOperator:
    """The operator of :func:`operator_data`, in a domain's words.

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
    """The reward of :func:`template_data`, in a domain's words.

    Args:
        data: As JSON has it.
        operator: Whose reward it is.
        domain: Whose metrics it uses.

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
    """What rewards can be made of in a domain, those of its hand-written rewards included."""
    written = domain.acquisition.rewards.values() if domain.acquisition else ()
    used = (term.metric for template in written for term in template.terms)
    return tuple(dict.fromkeys((*metrics_of(domain.predicates), *domain.metrics, *used)))
