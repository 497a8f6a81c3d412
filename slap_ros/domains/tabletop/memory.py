# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Answers about states that are asked for again and again while a task is planned."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import ParamSpec, TypeVar, cast

CACHE_SIZE = 1024  # answers of each function

Given = ParamSpec("Given")
T = TypeVar("T")

_CLEAR: list[Callable[[], None]] = []


def memoized(compute: Callable[Given, T]) -> Callable[Given, T]:
    """Compute once what is asked for again, until :func:`clear_caches`: transits, above all."""
    cached = lru_cache(maxsize=CACHE_SIZE)(compute)
    forgotten_with_all(cached.cache_clear)
    return cast(Callable[Given, T], cached)


def forgotten_with_all(clear: Callable[[], None]) -> None:
    """Let :func:`clear_caches` clear another cache as well, by a function that does."""
    _CLEAR.append(clear)


def clear_caches() -> None:
    """Remove every cached answer and motion, for fair measurements; nothing else changes."""
    for clear in _CLEAR:
        clear()
