# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a bag's files hold, not yet deserialised, whatever their format."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


@dataclass(frozen=True)
class MessageDefinition:
    """The definition of a message type that a bag carries; empty where it carries none."""

    encoding: str = ""  # ros2msg or ros2idl
    text: str = ""


@dataclass(frozen=True)
class Channel:
    """A topic with messages of one type."""

    topic: str
    type_name: str
    serialization: str  # cdr, or something that we do not read
    definition: MessageDefinition


LONGEST_CAUSE = 160  # characters


def one_line(error: Exception) -> str:
    """The cause that a library gives, without the excerpts of a damaged file that it may carry."""
    text = " ".join(str(error).split())
    return text if len(text) <= LONGEST_CAUSE else f"{text[:LONGEST_CAUSE]} ..."


class RawMessage(NamedTuple):
    """A message, serialised."""

    channel: Channel
    stamp_ns: int  # when it was received, ns since the epoch
    data: bytes | memoryview
