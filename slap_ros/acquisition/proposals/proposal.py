# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A proposal: operators, a reward template for each, a plan, and the provenance."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.core import Domain
from slap_ros.relational import LiftedOperator, RewardTemplate
from slap_ros.relational.pddl import with_different_objects, write_domain, write_problem
from slap_ros.skills.operator_json import (
    operator_data,
    read_operator,
    read_template,
    template_data,
)

VERSION = 1


@dataclass(frozen=True)
class ProposalProvenance:
    """Where a proposal comes from.

    Args:
        proposer: Name of the proposer: manual, induced, language.
        rewarder: Name of the rewarder: manual, composed, language; empty while there are no
            rewards.
        source: Source of the operators: the address of a server, the folders of demonstrations, a
            file.
        model: Name of the model, as it was asked for; empty where no model was asked.
        requests: Hashes (sha256) of the requests whose answers are in the proposal.
        attempts: Number of answers that the proposal took.
        tokens: Number of tokens that the proposal took.
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
        problem: Name of the domain.
        operators: Operators in the order of the decomposition.
        plan: Ground operators of a shortest plan, as text; None where none was looked for.
        provenance: Provenance of operators and rewards.
        rewards: Reward templates by operator name.
        remarks: Remarks for people: warnings of the checks, preconditions seen only once.
    """

    problem: str
    operators: tuple[LiftedOperator, ...]
    plan: tuple[str, ...] | None
    provenance: ProposalProvenance
    rewards: Mapping[str, RewardTemplate] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    def to_data(self) -> dict[str, Any]:
        """The proposal as data that JSON can hold, in the same order for the same proposal."""
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
        """The proposal as JSON, the same bytes for the same proposal."""
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


def read_proposal(data: Any, domain: Domain) -> Proposal:
    """Read the proposal of :meth:`Proposal.to_data` with the types and predicates of a domain.

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
