# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who proposes operators, from what, at which cost."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from slap_ros.acquisition.proposals.attempt_log import AttemptLog
from slap_ros.acquisition.proposals.inquiry import Inquiry
from slap_ros.acquisition.proposals.proposal_request import Demonstrations, ProposalRequest
from slap_ros.acquisition.proposals.proposer_names import INDUCED, MANUAL, PROPOSERS, require_known
from slap_ros.api.left_out import Tell, warn_caller
from slap_ros.bags.demonstrations import read_demonstrations
from slap_ros.bags.reader import read_bag
from slap_ros.core import Domain
from slap_ros.errors import InvalidParameterError
from slap_ros.language.budget import BudgetLimits
from slap_ros.language.settings import read_settings
from slap_ros.skills.demonstrator import AtomTrace, record_traces
from slap_ros.skills.scripted_skill import with_scripts

DEMONSTRATIONS = 10  # recorded where neither a number nor bags are given
Status = Callable[[str], AbstractContextManager[Any]]  # shows a text while something lasts


@dataclass(frozen=True)
class Proposers:
    """A proposer of operators, with its sources, model and budget.

    Args:
        proposer: Name of the proposer: manual (operators written by hand), induced (from
            demonstrations), or language (from a language model).
        demonstrations: Demonstrations for the proposer ``induced``: bags, or one number of
            demonstrations that the domain's demonstrator records; None for ten of them.
        model: Name of the language model; None for that of the environment or the settings.
        base_url: Address of a server with the OpenAI-compatible interface; None likewise.
        language_settings: JSON file with settings of the model.
        cassette: ``live``, ``record:FILE``, ``replay:FILE``, or ``off`` to ask no model.
        attempts: Largest number of answers to ask for.
        tokens: Largest number of tokens to spend.
        seconds: Longest time to wait for answers, s.

    Raises:
        InvalidParameterError: They do not fit together.
    """

    proposer: str = MANUAL
    demonstrations: list[str] | None = None
    model: str | None = None
    base_url: str | None = None
    language_settings: Path | None = None
    cassette: str = "live"
    attempts: int = BudgetLimits.attempts
    tokens: int = BudgetLimits.tokens
    seconds: float = BudgetLimits.seconds

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

    @classmethod
    def of(cls, proposer: str | Proposers) -> Proposers:
        """The proposers as they are, or one by its name, with defaults for the rest."""
        return proposer if isinstance(proposer, Proposers) else cls(proposer)

    @property
    def given(self) -> dict[str, Any]:
        """What was chosen, for the command that does the same again: no defaults."""
        chosen = {option.name: getattr(self, option.name) for option in fields(self)}
        defaults = ((option.name, option.default) for option in fields(self))
        same = {name for name, default in defaults if chosen[name] == default}
        return {name: value for name, value in chosen.items() if name not in same - {"proposer"}}

    def demonstrations_in(
        self, domain: Domain, tell: Tell = warn_caller, status: Status = nullcontext
    ) -> Demonstrations:
        """What the proposer ``induced`` works from: read from bags, or recorded now.

        Args:
            domain: Domain of the demonstrations.
            tell: Function that receives warnings about damaged bags.
            status: Function that shows a text while something lasts.

        Raises:
            InvalidParameterError: There are no bags, and no demonstrator.
            ForeignBagError: A bag is of another domain.
        """
        if self.proposer != INDUCED:
            return Demonstrations()
        bags = [Path(text) for text in self.demonstrations or () if not _is_number(text)]
        if bags:
            return read_bags(bags, domain, tell)
        count = int(self.demonstrations[0]) if self.demonstrations else DEMONSTRATIONS
        if domain.acquisition is None or not domain.acquisition.scripts:
            raise InvalidParameterError(
                f"--proposer induced needs --demonstrations BAG here: domain {domain.name} has no "
                "demonstrator that could record some"
            )
        with status(f"recording {count} demonstrations"):
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


def read_bags(bags: list[Path], domain: Domain, tell: Tell) -> Demonstrations:
    """The demonstrations in bags.

    Args:
        bags: Bags to read.
        domain: Domain that was recorded in them.
        tell: Function that receives warnings about damaged bags.

    Raises:
        ForeignBagError: One of them is of another domain, or has no states.
    """
    traces: list[AtomTrace] = []
    for path in bags:
        bag = read_bag(path)
        traces += read_demonstrations(bag, domain)
        if bag.damage is not None:
            tell(f"{path}: damaged; read up to the damage: {bag.damage}")
    return Demonstrations(tuple(traces), ", ".join(path.name for path in bags))
