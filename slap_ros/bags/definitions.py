# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Deserialising messages by the definitions that their bag carries."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from functools import lru_cache

from rosbags.interfaces.typing import Typesdict
from rosbags.serde import SerdeError
from rosbags.typesys import (
    Stores,
    TypesysError,
    get_types_from_idl,
    get_types_from_msg,
    get_typestore,
)
from rosbags.typesys.store import Typestore

from slap_ros.bags.raw import Channel, MessageDefinition, one_line
from slap_ros.errors import DamagedBagError, ForeignBagError
from slap_ros.messages.interfaces import PACKAGE, definition, message_texts, typestore

IDL_SEPARATOR = "=" * 80 + "\n"
MAX_DEFINITION_FIELDS = 5_000  # with those of nested types, constants included
MAX_DEFINITION_CHARACTERS = 2**20
# Fields and constants of messages that earlier bags do not have, by type. In them they would have
# been empty, so that being without them means the same.
ADDED = {
    "slap_msgs/msg/PlanEdge": ("others_may_appear", "forbidden_atoms"),
    "slap_msgs/msg/AcquisitionEvent": (
        *("ROLLED_OUT", "JUDGED", "ACQUIRED", "operators", "iteration", "task", "progress"),
        *("success", "segment_steps", "digest"),
    ),
}
UNDEFINED = (TypesysError, SyntaxError, ValueError, KeyError, IndexError, RecursionError)
UNREADABLE = (SerdeError, struct.error, ValueError, KeyError, IndexError, TypeError, OverflowError)


def is_ours(type_name: str) -> bool:
    """Whether a message type is one of slap_msgs."""
    return type_name.startswith(f"{PACKAGE}/")


def decode(channel: Channel, data: bytes | memoryview) -> object:
    """Deserialise a message.

    Raises:
        DamagedBagError: The bytes are no such message.
        TypesysError: The type is not known; :func:`store_for` tells beforehand.
    """
    try:
        return store_for(channel).deserialize_cdr(data, channel.type_name)
    except UNREADABLE as error:
        raise DamagedBagError(
            f"a message on {channel.topic} is no {channel.type_name}: {one_line(error)}"
        ) from error


@lru_cache(maxsize=256)
def store_for(channel: Channel) -> Typestore:
    """The types by which a channel's messages are deserialised: the bag's own, else ours.

    Raises:
        TypesysError: The bag does not define the type, or not in a way that we can read.
    """
    if channel.serialization != "cdr":
        raise TypesysError(f"it is serialised as {channel.serialization!r}, not as cdr")
    known = channel.type_name in typestore().fielddefs
    text = channel.definition.text
    if known and (not text or text == definition(channel.type_name)):
        return typestore()
    if not text:
        raise TypesysError("the bag does not define it")
    _require_short(text)
    store = get_typestore(Stores.EMPTY)
    try:
        store.register(_parse(channel.definition, channel.type_name))
        store.get_msgdef(channel.type_name)
    except UNDEFINED as error:
        raise TypesysError(f"its definition cannot be read: {one_line(error)}") from error
    return store


def _require_short(text: str) -> None:
    """Refuse what takes long to read: a program is generated from a definition.

    Raises:
        TypesysError: It has more fields than any message in use.
    """
    lines = (line.strip() for line in re.split(r"[\n;]", text[: MAX_DEFINITION_CHARACTERS + 1]))
    count = sum(1 for line in lines if line and line[0] not in "#/=")
    if count > MAX_DEFINITION_FIELDS or len(text) > MAX_DEFINITION_CHARACTERS:
        raise TypesysError(
            f"its definition has {len(text)} characters; at most {MAX_DEFINITION_CHARACTERS}, "
            f"and {MAX_DEFINITION_FIELDS} fields, are read"
        )


def _parse(given: MessageDefinition, type_name: str) -> Typesdict:
    if given.encoding != "ros2idl":
        return get_types_from_msg(given.text, type_name)
    types: Typesdict = {}
    for part in given.text.split(IDL_SEPARATOR):
        if part.strip():
            types.update(get_types_from_idl(part.partition("\n")[2]))
    return types


def check_version(channel: Channel) -> None:
    """Refuse a slap_msgs type that lacks something that this version reads.

    Raises:
        ForeignBagError: Names the first field or constant that is missing or different.
    """
    ours = typestore()
    if channel.type_name not in message_texts():
        return  # of another version, and nothing here reads it
    try:
        theirs = store_for(channel)
    except TypesysError as error:
        raise ForeignBagError(_mismatch(channel, str(error))) from error
    if theirs is ours:
        return
    for name in _nested(channel.type_name):
        constants, fields = theirs.fielddefs.get(name, ([], []))
        wanted_constants, wanted_fields = ours.fielddefs[name]
        missing = [e[0] for e in wanted_constants if e not in constants]
        missing += [e[0] for e in wanted_fields if e not in fields]
        missing = [entry for entry in missing if entry not in ADDED.get(name, ())]
        if missing:
            raise ForeignBagError(
                _mismatch(channel, f"{', '.join(missing)} of {name} missing or different")
            )


def _mismatch(channel: Channel, what: str) -> str:
    return (
        f"version mismatch: {channel.topic} was recorded with another version of "
        f"{channel.type_name} ({what}); read the bag with the version of slap_ros that wrote it"
    )


def _nested(type_name: str) -> Iterator[str]:
    """A slap_msgs type and those of slap_msgs within it."""
    yield type_name
    for _, description in typestore().fielddefs[type_name][1]:
        inner = description
        while isinstance(inner[1], tuple) and isinstance(inner[1][0], tuple):
            inner = inner[1][0]  # what an array is made of
        if isinstance(inner[1], str) and is_ours(inner[1]):
            yield from _nested(inner[1])
