# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options of all commands that have operators proposed: by whom, from what, at which cost."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

import typer

from slap_ros.acquisition.attempt_log import AttemptLog
from slap_ros.acquisition.inquiry import Inquiry
from slap_ros.acquisition.proposal_request import Demonstrations, ProposalRequest
from slap_ros.acquisition.proposer_names import INDUCED, MANUAL, PROPOSERS, require_known
from slap_ros.bags.demonstrations import read_demonstrations
from slap_ros.bags.reader import read_bag
from slap_ros.cli.console import console
from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.language.budget import BudgetLimits
from slap_ros.language.settings import read_settings
from slap_ros.learning.demonstrator import AtomTrace, record_traces
from slap_ros.learning.scripted_skill import with_scripts

DEMONSTRATIONS = 10  # recorded where neither a number nor bags are given


@dataclass(frozen=True)
class ProposerOptions:
    """Who proposes operators, from what, with which model and budget.

    Raises:
        InvalidParameterError: Options do not fit together.
    """

    proposer: Annotated[
        str,
        typer.Option(
            help="Source of operators: manual (the domain's own, or those hand-written for it), "
            "induced (from demonstrations), or language (from a language model)."
        ),
    ] = MANUAL
    demonstrations: Annotated[
        list[str] | None,
        typer.Option(
            metavar="N|BAG",
            help="With induced: a bag, can be given several times; or how many the domain's "
            f"demonstrator shall show. Default: {DEMONSTRATIONS} of the demonstrator's.",
        ),
    ] = None
    model: Annotated[
        str | None,
        typer.Option(
            help="Name of the language model. Default: SLAP_LANGUAGE_MODEL, "
            "else as in the settings."
        ),
    ] = None
    base_url: Annotated[
        str | None,
        typer.Option(
            help="URL of a server with the OpenAI-compatible interface. Its key is in "
            "OPENAI_API_KEY. Default: SLAP_LANGUAGE_BASE_URL, else as in the settings."
        ),
    ] = None
    language_settings: Annotated[
        Path | None,
        typer.Option(help="JSON file of settings for the language model; see docs/language.md."),
    ] = None
    cassette: Annotated[
        str,
        typer.Option(
            help="How to get answers: live, record:FILE (ask and record), "
            "replay:FILE (repeat a recording), or off (ask no model)."
        ),
    ] = "live"
    attempts: Annotated[int, typer.Option(min=1, help="Maximum number of answers to ask for.")] = (
        BudgetLimits.attempts
    )
    tokens: Annotated[int, typer.Option(min=1, help="Maximum number of tokens to spend.")] = (
        BudgetLimits.tokens
    )
    seconds: Annotated[
        float, typer.Option(help="Maximum time to wait for all answers, in seconds.")
    ] = BudgetLimits.seconds

    def __post_init__(self) -> None:
        require_known("--proposer", self.proposer, PROPOSERS)
        if self.demonstrations and self.proposer != INDUCED:
            raise InvalidParameterError("--demonstrations are for --proposer induced")
        numbers = [text for text in self.demonstrations or () if _is_number(text)]
        if numbers and (len(self.demonstrations or ()) > 1 or not int(numbers[0])):
            raise InvalidParameterError(
                "--demonstrations is one number, at least 1, or bags: not "
                f"{', '.join(self.demonstrations or ())}"
            )

    @property
    def given(self) -> dict[str, Any]:
        """What was chosen, for the command that does the same again: no defaults."""
        chosen = {option.name: getattr(self, option.name) for option in fields(self)}
        defaults = ((option.name, option.default) for option in fields(self))
        same = {name for name, default in defaults if chosen[name] == default}
        return {name: value for name, value in chosen.items() if name not in same - {"proposer"}}

    def demonstrations_in(self, domain: Domain) -> Demonstrations:
        """What the proposer ``induced`` works from: read from bags, or recorded now.

        Raises:
            InvalidParameterError: There are no bags, and no demonstrator.
            ForeignBagError: A bag is of another domain.
        """
        if self.proposer != INDUCED:
            return Demonstrations()
        bags = [Path(text) for text in self.demonstrations or () if not _is_number(text)]
        if bags:
            return read_bags(bags, domain)
        count = int(self.demonstrations[0]) if self.demonstrations else DEMONSTRATIONS
        if domain.acquisition is None or not domain.acquisition.scripts:
            raise InvalidParameterError(
                f"--proposer induced needs --demonstrations BAG here: domain {domain.name} has no "
                "demonstrator that could record some"
            )
        with console.status(f"recording {count} demonstrations"):
            traces = record_traces(with_scripts(domain), count)
        return Demonstrations(tuple(traces), "the domain's demonstrator")

    def inquiry(self, request: ProposalRequest, log: AttemptLog) -> Inquiry | None:
        """A conversation with a model, where one has to be asked.

        Raises:
            InvalidParameterError: Settings that cannot be read, no mode of a cassette, or a model
                or recording that nobody would ask.
            InvalidCassetteError: The cassette cannot be used.
        """
        if not request.asks_model:
            if self.model is not None or self.cassette not in ("live", "off"):
                raise InvalidParameterError(
                    "--model and --cassette are for --proposer language or --rewarder language"
                )
            return None
        settings = read_settings(self.language_settings, self.model, self.base_url)
        limits = BudgetLimits(self.attempts, self.tokens, self.seconds)
        return Inquiry.opened(settings, self.cassette, limits, log)


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdigit()


def read_bags(bags: list[Path], domain: Domain) -> Demonstrations:
    """The demonstrations in bags.

    Raises:
        ForeignBagError: One of them is of another domain, or has no states.
    """
    traces: list[AtomTrace] = []
    for path in bags:
        bag = read_bag(path)
        traces += read_demonstrations(bag, domain)
        if bag.damage is not None:
            console.print(f"{path}: damaged; read up to the damage: {bag.damage}")
    return Demonstrations(tuple(traces), ", ".join(path.name for path in bags))
