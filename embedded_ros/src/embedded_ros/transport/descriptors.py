# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""CycloneDDS type descriptors, generated from interface definitions.

CycloneDDS wants to know a topic's type although only serialized bytes ever pass through it.
The fields' names end in an underscore, as rosidl's do in DDS.
"""

from __future__ import annotations

import functools
from typing import Any

from cyclonedds.idl import make_idl_struct
from cyclonedds.idl import types as idl

from ..types import InterfaceError, catalogue, message_type_hash
from ..types.hashing import wire_fields
from ..types.model import FieldType, Shape
from . import names, type_descriptions

_PRIMITIVES: dict[str, Any] = {
    "bool": bool,
    "byte": idl.uint8,
    "char": idl.uint8,
    "int8": idl.int8,
    "uint8": idl.uint8,
    "int16": idl.int16,
    "uint16": idl.uint16,
    "int32": idl.int32,
    "uint32": idl.uint32,
    "int64": idl.int64,
    "uint64": idl.uint64,
    "float32": idl.float32,
    "float64": idl.float64,
    "string": str,
}

# What rmw_cyclonedds puts before every request and response.
_SERVICE_HEADER = {"guid_": idl.uint64, "seq_": idl.int64}


@functools.cache
def message_descriptor(full_name: str) -> Any:
    """The descriptor of a message."""
    return _descriptor(full_name, {})


@functools.cache
def service_message_descriptor(full_name: str) -> Any:
    """The descriptor of a service's request or response, with the header that precedes it."""
    return _descriptor(full_name, _SERVICE_HEADER)


def topic_descriptor(full_name: str, *, service: bool) -> Any:
    """The descriptor of a topic's type, which knows what others are told of it.

    Args:
        full_name: The message's name.
        service: Whether the topic is one of a service.
    """
    of_kind = service_message_descriptor if service else message_descriptor
    descriptor = of_kind(full_name)
    type_descriptions.describe(
        descriptor, f"{message_type_hash(full_name)}{'_in_service' * service}"
    )
    return descriptor


def _descriptor(full_name: str, header: dict[str, Any]) -> Any:
    fields = dict(header)
    for field in wire_fields(catalogue().message(full_name)):
        if field.type.base == "wstring":
            raise InterfaceError(
                f"{full_name}.{field.name}: wstring is not supported by embedded_ros"
            )
        fields[f"{field.name}_"] = _idl_type(field.type)
    name = full_name.split("/")[-1]
    return make_idl_struct(f"{name}_", names.dds_type(full_name).replace("::", "."), fields)


def _idl_type(field_type: FieldType) -> Any:
    if field_type.primitive is None:
        element = message_descriptor(field_type.base)
    elif field_type.string_bound:
        element = idl.bounded_str[field_type.string_bound]
    else:
        element = _PRIMITIVES[field_type.base]
    if field_type.shape is Shape.ARRAY:
        return idl.array[element, field_type.size]
    if field_type.shape is Shape.SEQUENCE:
        return idl.sequence[element, field_type.size] if field_type.size else idl.sequence[element]
    return element
