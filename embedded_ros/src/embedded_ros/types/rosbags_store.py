# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Message definitions out of rosbags' Jazzy type store.

Two gaps of the store are filled by the catalogue: it has no services and actions, and it drops
default values. Both are shipped as text in ``embedded_ros/interfaces``, which comes first.
"""

from __future__ import annotations

import functools
from typing import Any

from .. import sources
from .hashing import EMPTY_MESSAGE_FIELD
from .model import Constant, Field, FieldType, MessageSpec, Scalar, Shape


class RosbagsStore:
    """The store, imported when first needed (60 ms) and only for packages it has."""

    @functools.cached_property
    def _definitions(self) -> dict[str, Any]:
        from rosbags.typesys.stores import ros2_jazzy

        return dict(ros2_jazzy.FIELDDEFS)

    def names(self, package: str) -> list[str]:
        """The names of a package's messages."""
        if package not in sources.STORE_PACKAGES:
            return []
        prefix = f"{package}/msg/"
        return [name.removeprefix(prefix) for name in self._definitions if name.startswith(prefix)]

    def message(self, full_name: str) -> MessageSpec | None:
        """A message's definition, or None where the store has none."""
        if full_name.split("/")[0] not in sources.STORE_PACKAGES:
            return None
        if full_name not in self._definitions:
            return None
        constants, fields = self._definitions[full_name]
        return MessageSpec(
            full_name,
            tuple(
                Field(name, _field_type(description))
                for name, description in fields
                if name != EMPTY_MESSAGE_FIELD.name
            ),
            tuple(_constant(name, base, value) for name, base, value in constants),
        )


def _constant(name: str, base: str, value: Scalar) -> Constant:
    if base == "byte" and isinstance(value, int):
        value = bytes([value])
    return Constant(name, FieldType(base), value)


def _field_type(description: Any) -> FieldType:
    from rosbags.interfaces import Nodetype

    node, detail = description
    if node == Nodetype.BASE:
        return FieldType(detail[0], detail[1])
    if node == Nodetype.NAME:
        return FieldType(detail)
    element = _field_type(detail[0])
    shape = Shape.ARRAY if node == Nodetype.ARRAY else Shape.SEQUENCE
    return FieldType(element.base, element.string_bound, shape, detail[1])
