# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``slap propose``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import typer

from slap_ros.acquisition.attempt_log import AttemptLog, Entry
from slap_ros.acquisition.induction import HOLD_STEPS, InducedProposer, hold_steps_of
from slap_ros.acquisition.inquiry import Inquiry
from slap_ros.acquisition.language_proposer import LanguageProposer, LanguageRewarder
from slap_ros.acquisition.operator_file import read_operators
from slap_ros.acquisition.problem import AcquisitionProblem
from slap_ros.acquisition.proposal import Proposal
from slap_ros.acquisition.proposers import (
    ComposedRewarder,
    ManualProposer,
    ManualRewarder,
    Proposer,
    Rewarder,
)
from slap_ros.acquisition.proposers import propose as make_proposal
from slap_ros.bags.demonstrations import read_demonstrations
from slap_ros.bags.reader import read_bag
from slap_ros.cli.console import console, print_json
from slap_ros.cli.options import Goal, Index, Json, Preset, Seed
from slap_ros.core import Domain, task_with_goal
from slap_ros.domains import get_domain
from slap_ros.errors import InvalidParameterError, StorageFullError
from slap_ros.files import read_text, require_writable, write_whole
from slap_ros.language.budget import Budget, BudgetLimits
from slap_ros.language.cassette import open_client, with_recorded
from slap_ros.language.settings import read_settings
from slap_ros.learning.demonstrator import AtomTrace, record_traces
from slap_ros.learning.scripted_skill import with_scripts
from slap_ros.relational import LiftedOperator, RewardTemplate
from slap_ros.relational.pddl import parse_domain, parse_problem

PROPOSERS = ("manual", "induced", "language")
REWARDERS = ("none", "manual", "composed", "language")
DEMONSTRATIONS = 10  # recorded where neither a number nor bags are given


@dataclass(frozen=True)
class ProposeOptions:
    """For which task, by whom, with which model and budget.

    Raises:
        InvalidParameterError: Options do not fit together.
    """

    domain: Annotated[str, typer.Argument(help="One of `slap domains`, or a PDDL domain file.")]
    problem: Annotated[
        Path | None, typer.Argument(help="With a PDDL domain file: the PDDL problem file.")
    ] = None
    proposer: Annotated[
        str,
        typer.Option(
            help="Of operators: manual (the domain's own, or those written by hand for it), "
            "induced (from demonstrations), or language (from a language model)."
        ),
    ] = "manual"
    rewarder: Annotated[
        str,
        typer.Option(
            help="Of rewards: none, manual (written by hand), composed (from metrics), or language."
        ),
    ] = "none"
    operators: Annotated[
        Path | None,
        typer.Option(help="Check these operators instead: PDDL, a proposal's JSON, or text."),
    ] = None
    demonstrations: Annotated[
        list[str] | None,
        typer.Option(
            metavar="N|BAG",
            help="With induced: a bag, can be given several times; or how many the domain's "
            f"demonstrator shall show. Default: {DEMONSTRATIONS} of the demonstrator's.",
        ),
    ] = None
    seed: Seed = 0
    index: Index = 0
    preset: Preset = None
    goal: Goal = None
    model: Annotated[
        str | None, typer.Option(help="Default: SLAP_LANGUAGE_MODEL, or the settings' own.")
    ] = None
    base_url: Annotated[
        str | None,
        typer.Option(
            help="Of a server with the OpenAI-compatible interface. Default: "
            "SLAP_LANGUAGE_BASE_URL, or the settings' own. The key is OPENAI_API_KEY's."
        ),
    ] = None
    language_settings: Annotated[Path | None, typer.Option(help="JSON; see docs/language.md.")] = (
        None
    )
    cassette: Annotated[
        str, typer.Option(help="live, record:FILE, replay:FILE, or off: ask no model.")
    ] = "live"
    attempts: Annotated[int, typer.Option(min=1, help="Answers to ask for at most.")] = (
        BudgetLimits.attempts
    )
    tokens: Annotated[int, typer.Option(min=1, help="To spend at most.")] = BudgetLimits.tokens
    seconds: Annotated[float, typer.Option(help="To wait for answers at most.")] = (
        BudgetLimits.seconds
    )
    output: Annotated[
        Path | None,
        typer.Option(help="Folder for domain.pddl, problem.pddl, proposal.json, attempts.jsonl."),
    ] = None
    json: Json = False

    def __post_init__(self) -> None:
        for kind, value, known in (
            ("proposer", self.proposer, PROPOSERS),
            ("rewarder", self.rewarder, REWARDERS),
        ):
            if value not in known:
                raise InvalidParameterError(f"--{kind} {value!r}: there are {', '.join(known)}")
        if self.demonstrations and self.proposer != "induced":
            raise InvalidParameterError("--demonstrations are for --proposer induced")
        if self.proposer == "induced" and self.problem is not None:
            raise InvalidParameterError(
                "--proposer induced needs a domain with a world, in which something can be shown"
            )
        numbers = [text for text in self.demonstrations or () if _is_number(text)]
        if numbers and (len(self.demonstrations or ()) > 1 or not int(numbers[0])):
            raise InvalidParameterError(
                "--demonstrations is one number, at least 1, or bags: not "
                f"{', '.join(self.demonstrations or ())}"
            )

    @property
    def bags(self) -> list[Path]:
        """Where demonstrations are read from; none where they are recorded."""
        return [Path(text) for text in self.demonstrations or () if not _is_number(text)]

    @property
    def recorded(self) -> int:
        """How many demonstrations are recorded for the purpose."""
        if self.proposer != "induced" or self.bags:
            return 0
        return int(self.demonstrations[0]) if self.demonstrations else DEMONSTRATIONS


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdigit()


def propose(options: ProposeOptions) -> None:
    """Propose operators and rewards for a task, check them, and plan with them.

    With two PDDL files: for the symbolic problem that they state; the domain file's own actions
    are what the proposer manual takes, and are shown to no model.
    """
    if options.output is not None:
        require_writable(options.output)
    posed = _pose(options)
    problem = posed.problem
    log = AttemptLog(
        None if options.output is None else options.output / "attempts.jsonl", _show_entry
    )
    inquiry = _inquiry(options, log)
    proposer = _proposer(options, posed, inquiry)
    proposal = make_proposal(problem, proposer, _rewarder(options, posed, inquiry))
    files = _write(options.output, proposal, problem) if options.output is not None else []
    if options.json:
        print_json({"proposal": proposal.to_data(), "attempts": log.entries, "files": files})
    else:
        _show(proposal)


@dataclass(frozen=True)
class _Posed:
    """What is to be proposed for, and what people wrote for it."""

    problem: AcquisitionProblem
    operators: Sequence[LiftedOperator]
    rewards: Mapping[str, RewardTemplate] = field(default_factory=dict)
    hold_steps: int = HOLD_STEPS  # that atoms must stay for a change to count


def _pose(options: ProposeOptions) -> _Posed:
    if options.problem is not None:
        if options.goal is not None:
            raise InvalidParameterError("--goal is for domains with a world: edit the problem file")
        path = Path(options.domain)
        stated = parse_domain(_read(path), str(path))
        task = parse_problem(_read(options.problem), stated, str(options.problem))
        return _Posed(AcquisitionProblem.of_pddl(stated, task), stated.operators)
    domain = get_domain(options.domain, options.preset)
    posed = task_with_goal(domain, options.seed, options.index, options.goal)
    problem = AcquisitionProblem.of_task(domain, posed)
    problem = replace(problem, shown=tuple(_shown(options, domain)))
    hold_steps = hold_steps_of(domain.execution.control_period_s)
    if (by_hand := domain.acquisition) is None:
        return _Posed(problem, domain.operators, hold_steps=hold_steps)
    operators = domain.operators or by_hand.operators
    return _Posed(problem, operators, by_hand.rewards, hold_steps)


def _shown(options: ProposeOptions, domain: Domain) -> list[AtomTrace]:
    """Demonstrations: read from bags, or recorded."""
    if options.recorded:
        if domain.acquisition is None or not domain.acquisition.scripts:
            raise InvalidParameterError(
                f"--proposer induced needs --demonstrations BAG here: domain {domain.name} has no "
                "demonstrator that could record some"
            )
        with console.status(f"recording {options.recorded} demonstrations"):
            return record_traces(with_scripts(domain), options.recorded)
    found = []
    for path in options.bags:
        bag = read_bag(path)
        found += read_demonstrations(bag, domain)
        if bag.damage is not None:
            console.print(f"{path}: damaged; read up to the damage: {bag.damage}")
    return found


def _inquiry(options: ProposeOptions, log: AttemptLog) -> Inquiry | None:
    """A conversation with a model, where one is asked for."""
    asked = options.proposer == "language" and options.operators is None
    if not asked and options.rewarder != "language":
        return None
    settings = read_settings(options.language_settings, options.model, options.base_url)
    limits = BudgetLimits(options.attempts, options.tokens, options.seconds)
    client = open_client(options.cassette, settings)
    return Inquiry(client, with_recorded(settings, client), Budget(limits), log)


def _proposer(options: ProposeOptions, posed: _Posed, inquiry: Inquiry | None) -> Proposer:
    if options.operators is not None:
        path = options.operators
        return ManualProposer(read_operators(path, posed.problem), source=path.name)
    if options.proposer == "induced":
        bags = ", ".join(path.name for path in options.bags)
        source = bags or "the domain's demonstrator"
        shown = f"demonstrations: {len(posed.problem.shown)}, from {source}"
        return InducedProposer(shown, posed.hold_steps)
    if inquiry is not None and options.proposer == "language":
        return LanguageProposer(inquiry)
    return ManualProposer(posed.operators)


def _rewarder(options: ProposeOptions, posed: _Posed, inquiry: Inquiry | None) -> Rewarder | None:
    if options.rewarder == "language" and inquiry is not None:
        return LanguageRewarder(inquiry)
    if options.rewarder == "manual":
        return ManualRewarder(posed.rewards)
    return ComposedRewarder() if options.rewarder == "composed" else None


def _show_entry(entry: Entry) -> None:
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
        console.print(f"{operator}")
        for label, atoms in (
            ("PRE", operator.preconditions),
            ("EFF-", operator.delete_effects),
            ("EFF+", operator.add_effects),
        ):
            console.print(f"  {label:5}{', '.join(sorted(map(str, atoms))) or '-'}")
        if operator.name in proposal.rewards:
            terms = " + ".join(map(str, proposal.rewards[operator.name].terms))
            console.print(f"  {'R':5}{terms}")
    for remark in proposal.remarks:
        console.print(f"remark: {remark}")
    console.print(f"plan: {', '.join(proposal.plan or ()) or 'nothing to do'}")
    made = proposal.provenance
    source = f" by {made.model} at {made.source}" if made.model else f" ({made.source})"
    console.print(
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
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            write_whole(folder / name, text)
    except OSError as error:
        raise StorageFullError(f"cannot write to {folder}: {error.strerror}") from error
    return [str(folder / name) for name in (*files, "attempts.jsonl")]


def _read(path: Path) -> str:
    try:
        return read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidParameterError(f"cannot read {path}: {error}") from error
