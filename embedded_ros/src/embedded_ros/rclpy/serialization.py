# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages to bytes and back."""

from __future__ import annotations

from typing import Any, TypeVar

from embedded_ros.types import cdr

MsgT = TypeVar("MsgT")


def serialize_message(message: Any) -> bytes:
    """Serialize a message to CDR, header included.

    Raises:
        MessageFieldError: A field holds a value its type does not allow; says which.
    """
    return cdr.serialize(message)


def deserialize_message(serialized_message: bytes, message_type: type[MsgT]) -> MsgT:
    """Read a message from CDR, header included.

    Raises:
        SerializationError: The bytes are no message of this type.
    """
    message: MsgT = cdr.deserialize(bytes(serialized_message), message_type.ros_type)  # type: ignore[attr-defined]
    return message
