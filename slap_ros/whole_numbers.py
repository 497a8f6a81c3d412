# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whole numbers that a caller gives, checked before anything is done with them."""

from __future__ import annotations

from operator import index

from slap_ros.errors import InvalidParameterError


def require_whole(name: str, value: int, least: int = 0) -> None:
    """Refuse what is no whole number, or too small.

    Args:
        name: Name of the argument, for the message.
        value: Value that was given.
        least: The least that it may be.

    Raises:
        InvalidParameterError: It is neither.
    """
    try:
        whole = index(value)
    except TypeError:
        raise InvalidParameterError(f"{name} must be a whole number, not {value!r}") from None
    if whole < least:
        raise InvalidParameterError(f"{name} must be at least {least}, not {whole}")
