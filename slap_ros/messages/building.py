# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages of rosbags' classes, made and serialised without ROS."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype

from slap_ros.messages.typestore import typestore

TEXT = ("string", "wstring")


def make_message(type_name: str, **fields: Any) -> Any:
    """A message; numbers in sequences become arrays, as rosbags has them.

    Args:
        type_name: Name of the message's type, such as ``slap_msgs/msg/Task``.
        fields: Values of fields by name; fields that are not given are zero or empty, as in ROS.

    Raises:
        TypeError: The type has no such field.
    """
    kinds = _kinds(type_name)
    values = {
        name: _value(kind, fields.pop(name)) if name in fields else _zero(kind)
        for name, kind in kinds.items()
    }
    return typestore().types[type_name](**values, **fields)


def serialised(type_name: str, message: Any) -> memoryview:
    """A message as CDR."""
    return typestore().serialize_cdr(message, type_name)


@lru_cache(maxsize=256)
def _kinds(type_name: str) -> dict[str, Any]:
    """The kind of each field, as rosbags describes it."""
    return dict(typestore().fielddefs[type_name][1])


def _value(kind: Any, value: Any) -> Any:
    node, about = kind
    if node in (Nodetype.ARRAY, Nodetype.SEQUENCE) and _is_number(about[0]):
        return np.asarray(value, dtype=about[0][1][0])
    return value


def _zero(kind: Any) -> Any:
    node, about = kind
    if node is Nodetype.BASE:
        return "" if about[0] in TEXT else False if about[0] == "bool" else 0
    if node is Nodetype.NAME:
        return make_message(about)
    inner, length = about
    count = length if node is Nodetype.ARRAY else 0
    if _is_number(inner):
        return np.zeros(count, dtype=inner[1][0])
    return [_zero(inner) for _ in range(count)]


def _is_number(kind: Any) -> bool:
    return kind[0] is Nodetype.BASE and kind[1][0] not in TEXT
