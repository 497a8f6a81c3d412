# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap propose``."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import typer

from slap_ros.acquisition.proposals.attempt_log import AttemptLog, Entry
from slap_ros.acquisition.proposals.inquiry import described
from slap_ros.acquisition.proposals.operator_file import read_operators
from slap_ros.acquisition.proposals.problem import AcquisitionProblem
from slap_ros.acquisition.proposals.proposal import Proposal
from slap_ros.acquisition.proposals.proposal_request import ProposalRequest
from slap_ros.acquisition.proposals.proposer_names import (
    INDUCED,
    MANUAL,
    NO_REWARDER,
    REWARDERS,
    require_known,
)
from slap_ros.api.command_options import Preset
from slap_ros.api.proposing import answer, request_for
from slap_ros.cli.console import console, print_json, print_result
from slap_ros.cli.operators import print_operator
from slap_ros.cli.options import DomainOrFile, Goal, Index, Json, Seed
from slap_ros.cli.outputs import write_files
from slap_ros.cli.plan_pddl import read_pddl
from slap_ros.cli.proposer_options import ProposerOptions
from slap_ros.core import task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError
from slap_ros.files import require_writable
from slap_ros.relational.pddl import parse_domain, parse_problem


@dataclass(frozen=True)
class ProposeOptions:
    """For which task, with which rewards, and where to keep it.

    Raises:
        InvalidParameterError: There is no such rewarder.
    """

    domain: DomainOrFile
    problem: Annotated[
        Path | None, typer.Argument(help="PDDL problem file. Give it with a PDDL domain file.")
    ] = None
    rewarder: Annotated[
        str,
        typer.Option(
            help="Source of rewards: none, manual (hand-written), composed (from metrics), or "
            "language (from a language model)."
        ),
    ] = NO_REWARDER
    operators: Annotated[
        Path | None,
        typer.Option(help="File of operators to check instead: PDDL, a proposal's JSON, or text."),
    ] = None
    seed: Seed = 0
    index: Index = 0
    preset: Preset = None
    goal: Goal = None
    output: Annotated[
        Path | None,
        typer.Option(help="Folder for domain.pddl, problem.pddl, proposal.json, attempts.jsonl."),
    ] = None
    json: Json = False

    def __post_init__(self) -> None:
        require_known("--rewarder", self.rewarder, (NO_REWARDER, *REWARDERS))


def propose(options: ProposeOptions, proposers: ProposerOptions) -> None:
    """Propose operators and rewards for a task, check them, and plan with them.

    Two PDDL files state a symbolic problem. Then the proposer manual takes the actions of the
    domain file; no model sees these actions.
    """
    if options.output is not None:
        require_writable(options.output)
    request = _request(options, proposers)
    log = AttemptLog(
        None if options.output is None else options.output / "attempts.jsonl", show_entry
    )
    proposal, inquiry = answer(request, proposers, log)
    problem = request.problem
    files = _write(options.output, proposal, problem) if options.output is not None else []
    if options.json:
        print_json({"proposal": proposal.to_data(), "attempts": log.entries, "files": files})
    else:
        _show(proposal)
        if inquiry is not None:
            console.print(f"answers are {described(inquiry.answered_by)}")


def _request(options: ProposeOptions, proposers: ProposerOptions) -> ProposalRequest:
    request = _posed(options, proposers)
    if options.operators is None:
        return request
    path = options.operators
    operators = read_operators(path, request.problem)
    return replace(request, proposer=MANUAL, operators=operators, source=path.name)


def _posed(options: ProposeOptions, proposers: ProposerOptions) -> ProposalRequest:
    """What is to be proposed for, by those who are named."""
    if options.problem is not None:
        return _posed_by_files(options, options.problem, proposers.proposer)
    domain = get_domain(options.domain, options.preset)
    task = task_with_goal(domain, options.seed, options.index, options.goal)
    return request_for(domain, task, proposers, options.rewarder)


def _posed_by_files(options: ProposeOptions, problem: Path, proposer: str) -> ProposalRequest:
    if options.goal is not None:
        raise InvalidParameterError("--goal is for domains with a world: edit the problem file")
    if proposer == INDUCED:
        raise InvalidParameterError(
            "--proposer induced needs a domain with a world, in which something can be shown"
        )
    path = Path(options.domain)
    stated = parse_domain(read_pddl(path), str(path))
    task = parse_problem(read_pddl(problem), stated, str(problem))
    posed = AcquisitionProblem.of_pddl(stated, task)
    # Nobody else looks at the file's actions, which may be more than skills can be learned for.
    manual = proposer == MANUAL and options.operators is None
    operators = stated.operators if manual else ()
    return ProposalRequest(posed, proposer, options.rewarder, operators, source=path.name)


def show_entry(entry: Entry) -> None:
    """A line of the log as it comes."""
    subject, left = entry.get("subject", "plan"), entry["left"]
    if entry["event"] == "failure":
        return  # the command ends with it
    verdict = "; ".join(entry["complaints"]) or (
        "accepted" if entry["event"] == "answer" else f"{len(entry['plan'] or ())} steps"
    )
    console.print(f"{subject}: {verdict} ({left['attempts']} attempts left)")


def _show(proposal: Proposal) -> None:
    for operator in proposal.operators:
        print_operator(operator, proposal.rewards.get(operator.name))
    for remark in proposal.remarks:
        print_result(f"remark: {remark}")
    print_result(f"plan: {', '.join(proposal.plan or ()) or 'nothing to do'}")
    made = proposal.provenance
    source = f" by {made.model} at {made.source}" if made.model else f" ({made.source})"
    print_result(
        f"proposer {made.proposer}{source if made.source else ''}, rewarder "
        f"{made.rewarder or 'none'}; {made.attempts} attempts, {made.tokens} tokens"
    )


def _write(folder: Path, proposal: Proposal, problem: AcquisitionProblem) -> list[str]:
    """The proposal as files; the log is there already."""
    domain_text, problem_text = proposal.to_pddl(problem)
    files = {
        "domain.pddl": domain_text,
        "problem.pddl": problem_text,
        "proposal.json": proposal.to_json(),
    }
    return list(map(str, [*write_files(folder, files), folder / "attempts.jsonl"]))
