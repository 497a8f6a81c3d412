# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nouns in sentences: their articles, and how many there are."""


def a_or_an(noun: object) -> str:
    """A noun with its indefinite article: ``a block``, ``an obstacle``."""
    word = str(noun)
    return f"{'an' if word[:1].lower() in set('aeiou') else 'a'} {word}"


def counted(number: int, noun: str) -> str:
    """A number with its noun, in the plural unless the number is 1."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
