# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names of types in sentences."""


def a_or_an(noun: object) -> str:
    """A noun with its indefinite article: ``a block``, ``an obstacle``."""
    word = str(noun)
    return f"{'an' if word[:1].lower() in set('aeiou') else 'a'} {word}"
