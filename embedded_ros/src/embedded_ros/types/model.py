# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an interface file says, as plain data."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple


class Primitive(NamedTuple):
    """How one primitive type looks on the wire and in Python."""

    size: int  # bytes; 0 for strings
    code: str  # struct format; also the array.array typecode of the numeric ones
    python: type
    type_id: int  # of type_description_interfaces/FieldType, for a single value
    numeric: bool  # sequences of it are array.array, fixed arrays numpy.ndarray


PRIMITIVES: dict[str, Primitive] = {
    "bool": Primitive(1, "?", bool, 15, False),
    "byte": Primitive(1, "c", bytes, 16, False),
    # rosidl maps a .msg file's "char" to uint8, in its hash as well.
    "char": Primitive(1, "B", int, 3, True),
    "int8": Primitive(1, "b", int, 2, True),
    "uint8": Primitive(1, "B", int, 3, True),
    "int16": Primitive(2, "h", int, 4, True),
    "uint16": Primitive(2, "H", int, 5, True),
    "int32": Primitive(4, "i", int, 6, True),
    "uint32": Primitive(4, "I", int, 7, True),
    "int64": Primitive(8, "q", int, 8, True),
    "uint64": Primitive(8, "Q", int, 9, True),
    "float32": Primitive(4, "f", float, 10, True),
    "float64": Primitive(8, "d", float, 11, True),
    "string": Primitive(0, "", str, 17, False),
    "wstring": Primitive(0, "", str, 18, False),
}


class Shape(Enum):
    """Whether a field holds one value, a fixed number or a variable number of them."""

    SINGLE = "single"
    ARRAY = "array"
    SEQUENCE = "sequence"


@dataclass(frozen=True, slots=True)
class FieldType:
    """The type of a field.

    Attributes:
        base: A key of :data:`PRIMITIVES`, or a message's full name (``pkg/msg/Name``).
        string_bound: Longest allowed string in bytes, 0 for unbounded.
        shape: Single value, fixed array or sequence.
        size: Length of an array, or upper bound of a sequence (0: unbounded).
    """

    base: str
    string_bound: int = 0
    shape: Shape = Shape.SINGLE
    size: int = 0

    @property
    def primitive(self) -> Primitive | None:
        """The primitive behind it, or None for a nested message."""
        return PRIMITIVES.get(self.base)

    @property
    def element(self) -> FieldType:
        """The type of one element of an array or sequence."""
        return FieldType(self.base, self.string_bound)

    def __str__(self) -> str:
        package_and_name = self.base.split("/")
        text = (
            self.base
            if len(package_and_name) < 3
            else f"{package_and_name[0]}/{package_and_name[2]}"
        )
        if self.string_bound:
            text += f"<={self.string_bound}"
        if self.shape is Shape.ARRAY:
            return f"{text}[{self.size}]"
        if self.shape is Shape.SEQUENCE:
            return f"{text}[<={self.size}]" if self.size else f"{text}[]"
        return text


Scalar = bool | int | float | str | bytes
Default = Scalar | tuple[Scalar, ...]


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message; ``default`` is None where the file gives none."""

    name: str
    type: FieldType
    default: Default | None = None


@dataclass(frozen=True, slots=True)
class Constant:
    """One constant of a message."""

    name: str
    type: FieldType
    value: Scalar


@dataclass(frozen=True, slots=True)
class MessageSpec:
    """A message definition; ``full_name`` is ``package/kind/Name``."""

    full_name: str
    fields: tuple[Field, ...] = ()
    constants: tuple[Constant, ...] = ()


@dataclass(frozen=True, slots=True)
class ServiceSpec:
    """A service definition: its two messages."""

    full_name: str
    request: MessageSpec
    response: MessageSpec


@dataclass(frozen=True, slots=True)
class ActionSpec:
    """An action definition: its three messages."""

    full_name: str
    goal: MessageSpec
    result: MessageSpec
    feedback: MessageSpec
