# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""RIHS01: the type hash that ROS 2 puts into discovery data (REP-2011)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence

from .model import Field, FieldType, MessageSpec, Shape

NESTED_TYPE_ID = 1
BOUNDED_STRING_TYPE_IDS = {"string": 21, "wstring": 22}
ARRAY_OFFSET = 48
BOUNDED_SEQUENCE_OFFSET = 96
UNBOUNDED_SEQUENCE_OFFSET = 144

# IDL forbids empty structures: rosidl gives an empty message this one field.
EMPTY_MESSAGE_FIELD = Field("structure_needs_at_least_one_member", FieldType("uint8"))

Lookup = Callable[[str], MessageSpec]


def wire_fields(message: MessageSpec) -> tuple[Field, ...]:
    """The fields that a message has on the wire."""
    return message.fields or (EMPTY_MESSAGE_FIELD,)


def message_hash(message: MessageSpec, lookup: Lookup) -> str:
    """The type hash of a message, as ``RIHS01_<64 hexadecimal digits>``.

    Args:
        message: The message.
        lookup: Finds the definition of a nested message by its full name.
    """
    return _hash(message.full_name, wire_fields(message), lookup)


def service_hash(full_name: str, lookup: Lookup) -> str:
    """The type hash of a service, by its full name."""
    parts = (
        ("request_message", "Request"),
        ("response_message", "Response"),
        ("event_message", "Event"),
    )
    fields = tuple(Field(name, FieldType(f"{full_name}_{part}")) for name, part in parts)
    return _hash(full_name, fields, lookup)


def action_hash(full_name: str, lookup: Lookup) -> str:
    """The type hash of an action, by its full name."""
    parts = (
        ("goal", "_Goal"),
        ("result", "_Result"),
        ("feedback", "_Feedback"),
        ("send_goal_service", "_SendGoal"),
        ("get_result_service", "_GetResult"),
        ("feedback_message", "_FeedbackMessage"),
    )
    fields = tuple(Field(name, FieldType(f"{full_name}{part}")) for name, part in parts)
    services = {f"{full_name}_SendGoal", f"{full_name}_GetResult"}

    def lookup_with_services(name: str) -> MessageSpec:
        if name not in services:
            return lookup(name)
        parts = (
            ("request_message", "Request"),
            ("response_message", "Response"),
            ("event_message", "Event"),
        )
        return MessageSpec(name, tuple(Field(n, FieldType(f"{name}_{p}")) for n, p in parts))

    return _hash(full_name, fields, lookup_with_services)


def _hash(full_name: str, fields: Sequence[Field], lookup: Lookup) -> str:
    referenced: dict[str, object] = {}
    own = _type_description(full_name, fields, lookup, referenced)
    document = {
        "type_description": own,
        "referenced_type_descriptions": [referenced[name] for name in sorted(referenced)],
    }
    return "RIHS01_" + hashlib.sha256(json.dumps(document).encode()).hexdigest()


def _type_description(
    full_name: str, fields: Sequence[Field], lookup: Lookup, referenced: dict[str, object]
) -> dict[str, object]:
    for field in fields:
        nested = field.type.base
        if field.type.primitive is None and nested not in referenced:
            referenced[nested] = None  # entered before descending: a name is described once
            message = lookup(nested)
            referenced[nested] = _type_description(nested, wire_fields(message), lookup, referenced)
    return {
        "type_name": full_name,
        "fields": [{"name": f.name, "type": _field_type(f.type)} for f in fields],
    }


def _field_type(field_type: FieldType) -> dict[str, object]:
    primitive = field_type.primitive
    if primitive is None:
        type_id = NESTED_TYPE_ID
    elif field_type.string_bound:
        type_id = BOUNDED_STRING_TYPE_IDS[field_type.base]
    else:
        type_id = primitive.type_id
    return {
        "type_id": type_id + _collection_offset(field_type),
        "capacity": field_type.size,
        "string_capacity": field_type.string_bound,
        "nested_type_name": "" if primitive else field_type.base,
    }


def _collection_offset(field_type: FieldType) -> int:
    if field_type.shape is Shape.SINGLE:
        return 0
    if field_type.shape is Shape.ARRAY:
        return ARRAY_OFFSET
    return BOUNDED_SEQUENCE_OFFSET if field_type.size else UNBOUNDED_SEQUENCE_OFFSET
