# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong with interface types."""

from __future__ import annotations


class InterfaceError(Exception):
    """An interface definition is missing or malformed; the message says where."""


class UnknownInterfaceError(InterfaceError):
    """No source of definitions knows an interface of this name."""


class MessageFieldError(TypeError):
    """A message field holds a value its type does not allow."""


class SerializationError(Exception):
    """Bytes cannot be read as the message they are said to be."""
