# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Deserialising messages by the definitions that their bag carries."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from typing import cast

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc, Typesdict
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
from slap_ros.messages.interfaces import PACKAGE, PLAN, PLAN_EVENT
from slap_ros.messages.typestore import definition, message_texts, typestore

IDL_SEPARATOR = "=" * 80 + "\n"
# With those of nested types, and constants; an array of fixed length counts as many fields as it
# has texts or messages, since a program is generated that reads them one after the other.
# The compiler of Python takes 2 ms for a field, and much more in longer programs.
MAX_DEFINITION_FIELDS = 2_000
MAX_DEFINITION_CHARACTERS = 2**20
MAX_BAG_FIELDS = 10_000  # of all definitions of a bag that are not ours,
FIELDS_PER_DEFINITION = 10  # each of which takes as long as so many fields
# Fields and constants of messages that earlier bags do not have, by type. In them they would have
# been empty, so that being without them means the same.
ADDED = {
    PLAN: ("bound",),
    PLAN_EVENT: ("IMPROVED",),
    "slap_msgs/msg/PlanEdge": ("others_may_appear", "forbidden_atoms"),
    "slap_msgs/msg/AcquisitionEvent": (
        *("ROLLED_OUT", "JUDGED", "ACQUIRED", "operators", "iteration", "task", "progress"),
        *("success", "segment_steps", "digest", "VALIDATED", "lengths", "kept"),
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
        TypesysError: The type is not known; :func:`undecodable` tells beforehand.
    """
    try:
        return store_for(channel).deserialize_cdr(data, channel.type_name)
    except UNREADABLE as error:
        raise DamagedBagError(
            f"a message on {channel.topic} is no {channel.type_name}: {one_line(error)}"
        ) from error


def store_for(channel: Channel) -> Typestore:
    """The types by which a channel's messages are deserialised: the bag's own, else ours.

    Raises:
        TypesysError: The bag does not define the type, or not in a way that we can read.
    """
    if channel.serialization != "cdr":
        raise TypesysError(f"it is serialised as {channel.serialization!r}, not as cdr")
    if _is_known(channel):
        return typestore()
    return _compiled(channel.type_name, channel.definition)


def undecodable(channels: Iterable[Channel]) -> dict[str, str]:
    """The types that cannot be deserialised, each with the reason.

    Definitions of slap_msgs are compiled first, and all of them within :data:`MAX_BAG_FIELDS`.
    """
    found: dict[str, str] = {}
    left, compiled = MAX_BAG_FIELDS, set()
    for channel in sorted(channels, key=lambda channel: not is_ours(channel.type_name)):
        try:
            defined = channel.type_name, channel.definition
            if not _is_known(channel) and defined not in compiled:
                compiled.add(defined)
                left -= FIELDS_PER_DEFINITION + _count(_parsed(*defined))
            if left < 0:
                raise TypesysError(
                    f"the definitions of the bag have more than {MAX_BAG_FIELDS} fields"
                )
            store_for(channel)
        except TypesysError as error:
            found[channel.type_name] = str(error)
    return found


def _is_known(channel: Channel) -> bool:
    """Whether a channel's type is defined here, and its bag does not define it otherwise."""
    text = channel.definition.text
    known = channel.type_name in typestore().fielddefs
    return known and (not text or text == definition(channel.type_name))


@lru_cache(maxsize=2 * MAX_BAG_FIELDS // FIELDS_PER_DEFINITION)
def _compiled(type_name: str, given: MessageDefinition) -> Typestore:
    store = get_typestore(Stores.EMPTY)
    types = _parsed(type_name, given)
    try:
        store.register(types)
        store.get_msgdef(type_name)
    except UNDEFINED as error:
        raise TypesysError(f"its definition cannot be read: {one_line(error)}") from error
    return store


@lru_cache(maxsize=16)
def _parsed(type_name: str, given: MessageDefinition) -> Typesdict:
    """The types of a definition that is short enough to be compiled."""
    if not given.text:
        raise TypesysError("the bag does not define it")
    _require_short(given.text)
    try:
        types = _parse(given, type_name)
    except UNDEFINED as error:
        raise TypesysError(f"its definition cannot be read: {one_line(error)}") from error
    _require_few(types)
    return types


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


def _require_few(types: Typesdict) -> None:
    """Refuse arrays that make a definition longer than it looks, or take no bytes in a message.

    Raises:
        TypesysError: It has such arrays.
    """
    if 0 in (length for _, length in _arrays(types)):
        raise TypesysError("its definition has an array of length 0")
    if (count := _count(types)) > MAX_DEFINITION_FIELDS:
        raise TypesysError(
            f"its definition has {count} fields, with the elements of its arrays of texts and "
            f"messages; at most {MAX_DEFINITION_CHARACTERS} characters, and "
            f"{MAX_DEFINITION_FIELDS} fields, are read"
        )


def _count(types: Typesdict) -> int:
    """The number of fields and constants, array elements that are read one by one among them."""
    fields = sum(len(constants) + len(fields) for constants, fields in types.values())
    return fields + sum(length for element, length in _arrays(types) if _is_unrolled(element))


def _arrays(types: Typesdict) -> Iterator[tuple[FieldDesc, int]]:
    """Element and length of each array of fixed length."""
    for _, fields in types.values():
        for _, (node, content) in fields:
            if node == Nodetype.ARRAY:
                yield cast(tuple[FieldDesc, int], content)


def _is_unrolled(element: FieldDesc) -> bool:
    """Whether an array of such elements is read one by one: numbers are read at once."""
    return element[0] != Nodetype.BASE or element[1][0] == "string"


def _parse(given: MessageDefinition, type_name: str) -> Typesdict:
    if given.encoding != "ros2idl":
        return get_types_from_msg(given.text, type_name)
    types: Typesdict = {}
    for part in given.text.split(IDL_SEPARATOR):
        if part.strip():
            types.update(get_types_from_idl(part.partition("\n")[2]))
    return types


def check_versions(channels: Iterable[Channel], undecoded: Mapping[str, str]) -> None:
    """Refuse types of slap_msgs that lack something that this version reads.

    Args:
        channels: Channels of a bag.
        undecoded: Types that cannot be deserialised, each with the reason.

    Raises:
        ForeignBagError: Names the first type, and what it lacks.
    """
    for channel in channels:
        if channel.type_name in undecoded and channel.type_name in message_texts():
            raise ForeignBagError(_mismatch(channel, undecoded[channel.type_name]))
        if is_ours(channel.type_name):
            _check_version(channel)


def _check_version(channel: Channel) -> None:
    """Refuse a slap_msgs type that lacks something that this version reads.

    Raises:
        ForeignBagError: Names the first field or constant that is missing or different.
    """
    ours = typestore()
    if channel.type_name not in message_texts():
        return  # of another version, and nothing here reads it
    theirs = store_for(channel)
    if theirs is ours:
        return
    for name in _nested(channel.type_name):
        constants, fields = theirs.fielddefs.get(name, ([], []))
        wanted_constants, wanted_fields = ours.fielddefs[name]
        missing = [e[0] for e in wanted_constants if e not in constants]
        missing += [e[0] for e in wanted_fields if e not in fields]
        theirs_too = {entry[0] for entry in (*constants, *fields)}
        added = set(ADDED.get(name, ())) - theirs_too  # what is there must be what it is here
        missing = [entry for entry in missing if entry not in added]
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
