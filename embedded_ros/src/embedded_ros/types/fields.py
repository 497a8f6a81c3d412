# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What values fields take: defaults, conversion on assignment, checks before publishing."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from .errors import MessageFieldError
from .model import Field, FieldType, Shape

NUMPY_TYPES: dict[str, str] = {
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}


def is_numeric_collection(field_type: FieldType) -> bool:
    """Whether a field is a sequence or array of numbers, held as one block of memory."""
    primitive = field_type.primitive
    return field_type.shape is not Shape.SINGLE and primitive is not None and primitive.numeric


class SequenceProperty:
    """A numeric sequence field: an ``array.array``, converted to on assignment."""

    def __init__(self, owner: str, field: Field) -> None:
        primitive = field.type.primitive
        assert primitive is not None
        self._owner = owner
        self._field = field
        self._slot = f"_{field.name}"
        self._code = primitive.code

    def __get__(self, message: Any, owner: type | None = None) -> Any:
        return self if message is None else getattr(message, self._slot)

    def __set__(self, message: Any, value: Any) -> None:
        bound = self._field.type.size
        converted = self._convert(value)
        if bound and len(converted) > bound:
            raise _field_error(self._owner, self._field, f"{len(converted)} elements")
        setattr(message, self._slot, converted)

    def _convert(self, value: Any) -> array[Any]:
        if isinstance(value, array) and value.typecode == self._code:
            return value
        if isinstance(value, str):
            raise _field_error(self._owner, self._field, repr(value))
        try:
            if isinstance(value, np.ndarray):
                return _from_numpy(value, self._code, self._field.type)
            return array(self._code, value)
        except (TypeError, ValueError, OverflowError) as error:
            raise _field_error(self._owner, self._field, f"{value!r} ({error})") from None


class ArrayProperty:
    """A numeric fixed array field: a ``numpy.ndarray``, converted to on assignment."""

    def __init__(self, owner: str, field: Field) -> None:
        self._owner = owner
        self._field = field
        self._slot = f"_{field.name}"
        self._dtype = np.dtype(NUMPY_TYPES[field.type.base])

    def __get__(self, message: Any, owner: type | None = None) -> Any:
        return self if message is None else getattr(message, self._slot)

    def __set__(self, message: Any, value: Any) -> None:
        converted = self._convert(value)
        if converted.shape != (self._field.type.size,):
            raise _field_error(self._owner, self._field, f"shape {converted.shape}")
        setattr(message, self._slot, converted)

    def _convert(self, value: Any) -> np.ndarray[Any, Any]:
        if isinstance(value, np.ndarray) and value.dtype == self._dtype:
            return value
        try:
            if isinstance(value, bytes | bytearray):
                return np.frombuffer(bytes(value), np.uint8).astype(self._dtype)
            source = value if isinstance(value, np.ndarray | array) else list(value)
            return _checked(np.asarray(source), self._dtype)
        except (TypeError, ValueError, OverflowError) as error:
            raise _field_error(self._owner, self._field, f"{value!r} ({error})") from None


def _from_numpy(value: np.ndarray[Any, Any], code: str, field_type: FieldType) -> array[Any]:
    if value.ndim != 1:
        raise ValueError(f"{value.ndim} dimensions")
    result: array[Any] = array(code)
    result.frombytes(_checked(value, np.dtype(NUMPY_TYPES[field_type.base])).tobytes())
    return result


def _checked(value: np.ndarray[Any, Any], dtype: np.dtype[Any]) -> np.ndarray[Any, Any]:
    """Convert without silent loss: no float to int, no value out of range."""
    if value.size == 0:
        return value.astype(dtype)
    if dtype.kind in "iu":
        if value.dtype.kind not in "iu":
            raise TypeError(f"{value.dtype} values in an integer field")
        limits = np.iinfo(dtype)
        if int(value.min()) < limits.min or int(value.max()) > limits.max:
            raise OverflowError(f"a value does not fit into {dtype}")
    elif value.dtype.kind not in "iuf":
        raise TypeError(f"{value.dtype} values in a float field")
    return np.ascontiguousarray(value, dtype)


def default_of(field: Field, nested: Callable[[str], type]) -> Callable[[], Any]:
    """A factory of a field's default value.

    Args:
        field: The field.
        nested: Finds a nested message's class; called when a default is first made.
    """
    field_type = field.type
    if field_type.shape is Shape.SINGLE:
        return _single_default(field, nested)
    if is_numeric_collection(field_type):
        return _numeric_default(field)
    if field.default is not None:
        assert isinstance(field.default, tuple)
        values = field.default
        return lambda: list(values)
    if field_type.shape is Shape.SEQUENCE:
        return list
    element = _single_default(Field(field.name, field_type.element), nested)
    return lambda: [element() for _ in range(field_type.size)]


def _single_default(field: Field, nested: Callable[[str], type]) -> Callable[[], Any]:
    primitive = field.type.primitive
    if primitive is None:
        base = field.type.base
        return lambda: nested(base)()
    value = field.default
    if value is None:
        value = b"\0" if primitive.python is bytes else primitive.python()
    return lambda: value


def _numeric_default(field: Field) -> Callable[[], Any]:
    primitive = field.type.primitive
    assert primitive is not None
    values = field.default if isinstance(field.default, tuple) else ()
    if field.type.shape is Shape.SEQUENCE:
        prototype: array[Any] = array(primitive.code, values)
        return lambda: prototype[:]
    dtype = np.dtype(NUMPY_TYPES[field.type.base])
    block = np.array(values, dtype) if values else np.zeros(field.type.size, dtype)
    return block.copy


def explain(message: Any, path: str = "") -> None:
    """Find out which field of a message cannot be serialized.

    Raises:
        MessageFieldError: Always, where a field is wrong; says which and how. Returns where
            every field is right.
    """
    name = path or message.ros_type
    for field in message.spec.fields:
        try:
            value = getattr(message, field.name)
        except AttributeError:
            raise MessageFieldError(f"{name}.{field.name} was deleted") from None
        _explain_field(f"{name}.{field.name}", field, value)


def _explain_field(path: str, field: Field, value: Any) -> None:
    if is_numeric_collection(field.type):
        return  # converted and checked on assignment
    if field.type.shape is Shape.SINGLE:
        _explain_single(path, field.type, value)
        return
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise MessageFieldError(f"{path}: expected {field.type}, got {value!r}")
    values = list(value)
    size = field.type.size
    if field.type.shape is Shape.ARRAY and len(values) != size:
        raise MessageFieldError(f"{path}: expected {size} elements, got {len(values)}")
    if field.type.shape is Shape.SEQUENCE and size and len(values) > size:
        raise MessageFieldError(f"{path}: expected at most {size} elements, got {len(values)}")
    for index, element in enumerate(values):
        _explain_single(f"{path}[{index}]", field.type.element, element)


def _explain_single(path: str, field_type: FieldType, value: Any) -> None:
    primitive = field_type.primitive
    expected = str(field_type)
    if primitive is None:
        if getattr(value, "ros_type", None) != field_type.base:
            raise MessageFieldError(f"{path}: expected {expected}, got {_kind(value)} {value!r}")
        explain(value, path)
        return
    # As rclpy's own converters: an int is no float, a numpy integer no int, an int no bool.
    right = isinstance(value, primitive.python) and not (
        isinstance(value, bool) and primitive.python is int
    )
    if not right:
        raise MessageFieldError(f"{path}: expected {expected}, got {_kind(value)} {value!r}")
    if primitive.python is bytes and len(value) != 1:
        raise MessageFieldError(f"{path}: expected one byte, got {value!r}")
    if primitive.python is str:
        _explain_string(path, field_type, value)
    elif primitive.python is int:
        limits = np.iinfo(NUMPY_TYPES[field_type.base])
        if not limits.min <= value <= limits.max:
            raise MessageFieldError(f"{path}: {value} does not fit into {expected}")
    elif field_type.base == "float32":
        largest = float(np.finfo(np.float32).max)
        if np.isfinite(value) and abs(float(value)) > largest:
            raise MessageFieldError(f"{path}: {value} does not fit into float32")


def _explain_string(path: str, field_type: FieldType, value: str) -> None:
    if field_type.base == "wstring":
        raise MessageFieldError(f"{path}: wstring is not supported by embedded_ros")
    try:
        length = len(value.encode())
    except UnicodeEncodeError as error:
        raise MessageFieldError(f"{path}: not encodable as UTF-8 ({error})") from None
    if field_type.string_bound and length > field_type.string_bound:
        raise MessageFieldError(
            f"{path}: {length} bytes, the bound is {field_type.string_bound} bytes"
        )
    if "\0" in value:
        raise MessageFieldError(f"{path}: a string cannot hold a zero byte: {value!r}")


def _kind(value: object) -> str:
    return type(value).__name__


def _field_error(owner: str, field: Field, got: str) -> MessageFieldError:
    return MessageFieldError(f"{owner}.{field.name}: expected {field.type}, got {got}")
