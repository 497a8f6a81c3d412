# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A model as a context of tokens, and how what it read already is not read again.

Questions begin alike: those about the operators of a task have its predicates and rules in common,
and one that follows a complaint has the whole first question. Conversations are read in blocks of
fixed length, so that scores are the same to the bit whether the blocks before them were kept or
read again: what a model answers never depends on what it was asked before.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from slap_ros.language.request import Message

BLOCK = 32  # tokens
KEPT = 2  # conversations: about the actions of a task, and about an operator

Logits = NDArray[np.float64]


class TokenModel(Protocol):
    """A model as :mod:`slap_ros.language.local` sees it: tokens, and scores for the next one."""

    @property
    def library(self) -> str:
        """What runs it, with its version: others' scores may differ in their last digits."""

    @property
    def vocabulary(self) -> Sequence[str]:
        """The text of each token."""

    def encode(self, text: str) -> list[int]:
        """The tokens of a text."""

    def begin(self, messages: Sequence[Message]) -> int:
        """Forget everything, and read a conversation; returns how many tokens that were."""

    def advance(self, tokens: Sequence[int]) -> Logits:
        """Read on, and score what may come next, shape (vocabulary,)."""


class Context(Protocol):
    """Tokens that a model has read, from which it can go on."""

    def crop(self, length: int) -> None:
        """Forget all but the first tokens."""

    def read(self, tokens: Sequence[int]) -> Logits:
        """Read on, and score what may come next, shape (vocabulary,)."""


class BlockReader:
    """Reads conversations, and keeps those that it read last."""

    def __init__(self, contexts: Sequence[Context]) -> None:
        """Nothing is read yet.

        Args:
            contexts: One for each conversation that is kept.
        """
        self._kept = [_Kept(context) for context in contexts]  # the one in use last
        self._unread: list[int] = []

    def begin(self, tokens: Sequence[int]) -> None:
        """Read a conversation, but for its last block, whole or not: that waits for what follows.

        Args:
            tokens: The conversation's, one at least.
        """
        whole = (len(tokens) - 1) // BLOCK * BLOCK
        blocks = [tuple(tokens[start : start + BLOCK]) for start in range(0, whole, BLOCK)]
        kept = max(self._kept, key=lambda one: one.in_common(blocks))
        if 2 * kept.in_common(blocks) < len(blocks):  # hardly more than how all of them begin
            kept = self._kept[0]
        self._kept.remove(kept)
        self._kept.append(kept)
        kept.read(blocks)
        self._unread = list(tokens[whole:])

    def advance(self, tokens: Sequence[int]) -> Logits:
        """Read on, and score what may come next, shape (vocabulary,)."""
        scores = self._kept[-1].context.read([*self._unread, *tokens])
        self._unread = []
        return scores


class _Kept:
    """The whole blocks at the beginning of a conversation."""

    def __init__(self, context: Context) -> None:
        self.context = context
        self._blocks: list[tuple[int, ...]] = []

    def in_common(self, blocks: Sequence[tuple[int, ...]]) -> int:
        """How many blocks at the beginning are the same."""
        pairs = zip(self._blocks, blocks, strict=False)
        return next(
            (i for i, (own, other) in enumerate(pairs) if own != other),
            min(len(self._blocks), len(blocks)),
        )

    def read(self, blocks: Sequence[tuple[int, ...]]) -> None:
        """Read those that are not the same; whatever was read after them is forgotten."""
        same = self.in_common(blocks)
        del self._blocks[same:]
        self.context.crop(same * BLOCK)
        for block in blocks[same:]:
            self.context.read(block)
            self._blocks.append(block)
