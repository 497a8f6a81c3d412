# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a good model would answer, made from hand-written operators; and how scripts are run."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from slap_ros.acquisition.proposals.attempt_log import AttemptLog
from slap_ros.acquisition.proposals.inquiry import Inquiry
from slap_ros.acquisition.proposals.language_proposer import LanguageProposer, LanguageRewarder
from slap_ros.acquisition.proposals.proposal import Proposal
from slap_ros.acquisition.proposals.proposers import propose
from slap_ros.acquisition.proposals.reward_templates import compose_reward
from slap_ros.errors import SlapError
from slap_ros.language.budget import Budget, BudgetLimits
from slap_ros.language.cassette import open_client, with_recorded
from slap_ros.language.settings import LanguageSettings, RetryPolicy
from slap_ros.relational import LiftedAtom, LiftedOperator
from support.paper_problems import Printed
from support.scripted_server import Script, Step

SETTINGS = LanguageSettings(
    model="scripted",
    answer_seconds=5.0,
    retry=RetryPolicy(tries=4, first_pause=0.01, longest_pause=0.02),
)
LIMITS = BudgetLimits(attempts=20, tokens=100_000, seconds=60.0)


def decomposition_json(operators: Sequence[LiftedOperator]) -> str:
    actions = [{"name": op.name, "parameters": parameters(op)} for op in operators]
    return json.dumps({"actions": actions})


def operator_data(operator: LiftedOperator) -> dict[str, Any]:
    return {
        "name": operator.name,
        "parameters": parameters(operator),
        "preconditions": atoms(operator.preconditions),
        "delete_effects": atoms(operator.delete_effects),
        "add_effects": atoms(operator.add_effects),
    }


def operator_json(operator: LiftedOperator) -> str:
    return json.dumps(operator_data(operator))


def plan_json(steps: Sequence[str]) -> str:
    """A plan of steps such as ``Pick(peg1)``."""
    written = [step.rstrip(")").split("(") for step in steps]
    return json.dumps(
        {"plan": [{"action": name, "objects": rest.split(", ")} for name, rest in written]}
    )


def operator_text(operator: LiftedOperator) -> str:
    """The paper's block."""

    def braces(items: Iterable[object]) -> str:
        return f"{{{', '.join(sorted(map(str, items)))}}}"

    return "\n".join(
        (
            f"PAR: {{{', '.join(f'{v.name}: {v.type}' for v in operator.parameters)}}}",
            f"PRE: {braces(operator.preconditions)}",
            f"EFF-: {braces(operator.delete_effects)}",
            f"EFF+: {braces(operator.add_effects)}",
        )
    )


def parameters(operator: LiftedOperator) -> list[dict[str, str]]:
    return [{"name": v.name, "type": v.type.name} for v in operator.parameters]


def atoms(found: Iterable[LiftedAtom]) -> list[dict[str, Any]]:
    return [
        {"predicate": atom.predicate.name, "arguments": [v.name for v in atom.variables]}
        for atom in sorted(found, key=str)
    ]


def reward_data(printed: Printed, operator: LiftedOperator) -> dict[str, Any]:
    template = compose_reward(operator, printed.problem)
    return {
        "terms": [
            {
                "metric": term.metric.name,
                "arguments": [v.name for v in term.arguments],
                "weight": term.weight,
            }
            for term in template.terms
        ]
    }


def good_script(printed: Printed, **replaced: Sequence[Step | str]) -> Script:
    """Good answers, but for some subjects: ``Insert=...``, ``decomposition=...``."""
    script: dict[str, Sequence[Step]] = {
        "decomposition": [Step(decomposition_json(printed.operators))]
    }
    for operator in printed.operators:
        script[f"operator {operator.name}"] = [Step(operator_json(operator))]
        script[f"reward of {operator.name}"] = [Step(json.dumps(reward_data(printed, operator)))]
    for name, steps in replaced.items():
        subject = name if name == "decomposition" else f"operator {name}"
        subject = subject.replace("operator reward_of_", "reward of ")
        script[subject] = [Step(step) if isinstance(step, str) else step for step in steps]
    return script


def classes(log: AttemptLog) -> Counter[str]:
    """The number of entries with each class of complaint, warnings too."""
    return Counter(name for entry in log.entries for name in entry.get("errors", ()))


@dataclass(frozen=True)
class Outcome:
    """What came of a script."""

    proposal: Proposal | None
    error: SlapError | None
    log: AttemptLog
    budget: Budget

    @property
    def classes(self) -> Mapping[str, int]:
        return classes(self.log)


def run(
    printed: Printed,
    url: str,
    cassette: str = "live",
    settings: LanguageSettings = SETTINGS,
    limits: BudgetLimits = LIMITS,
    log: Path | None = None,
    rewards: bool = False,
) -> Outcome:
    """A proposal by whatever answers at an address."""
    attempts, budget = AttemptLog(log), Budget(limits)
    chosen = replace(settings, base_url=url)
    try:
        client = open_client(cassette, chosen)
        inquiry = Inquiry(client, with_recorded(chosen, client), budget, attempts)
        rewarder = LanguageRewarder(inquiry) if rewards else None
        proposal = propose(printed.problem, LanguageProposer(inquiry), rewarder)
    except SlapError as error:
        return Outcome(None, error, attempts, budget)
    return Outcome(proposal, None, attempts, budget)
