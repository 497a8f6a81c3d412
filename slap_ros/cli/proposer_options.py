# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options of all commands that have operators proposed: by whom, from what, at which cost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

from slap_ros.acquisition.proposals.proposal_request import Demonstrations
from slap_ros.acquisition.proposals.proposer_names import MANUAL
from slap_ros.api.command_options import LanguageFile
from slap_ros.api.left_out import Tell
from slap_ros.api.proposers import DEMONSTRATIONS, Proposers, Status
from slap_ros.cli.console import console
from slap_ros.core import Domain
from slap_ros.language.budget import BudgetLimits


@dataclass(frozen=True)
class ProposerOptions(Proposers):
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
            help="Name of the language model; ask:NAME to carry questions to it by hand. "
            "Default: SLAP_LANGUAGE_MODEL, else as in the settings."
        ),
    ] = None
    base_url: Annotated[
        str | None,
        typer.Option(
            help="URL of a server with the OpenAI-compatible interface. Its key is in "
            "OPENAI_API_KEY. With ask:NAME, folder:PATH for files instead of the terminal. "
            "Default: SLAP_LANGUAGE_BASE_URL, else as in the settings."
        ),
    ] = None
    language_settings: LanguageFile = None
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

    def demonstrations_in(
        self, domain: Domain, tell: Tell = console.print, status: Status = console.status
    ) -> Demonstrations:
        """See :meth:`~slap_ros.api.proposers.Proposers.demonstrations_in`."""
        return super().demonstrations_in(domain, tell, status)
