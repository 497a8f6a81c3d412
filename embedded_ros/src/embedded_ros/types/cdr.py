# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""CDR (XCDR1): messages to bytes and back, through code generated once a type.

Consecutive numbers are packed with one ``struct`` call, nested messages are inlined, and
alignment is resolved while generating wherever it is known: a 2 KB message takes tens of
microseconds each way.
"""

from __future__ import annotations

import functools
import struct
import sys
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .catalogue import catalogue
from .errors import InterfaceError, MessageFieldError, SerializationError
from .fields import NUMPY_TYPES, explain, is_numeric_collection
from .interfaces import Message, message_class
from .model import FieldType, MessageSpec, Primitive, Shape

HEADER_SIZE = 4  # bytes: representation identifier and options
HEADER = bytes((0, sys.byteorder == "little", 0, 0))  # CDR in this machine's byte order
NATIVE_ORDER = "<" if sys.byteorder == "little" else ">"
MAX_ALIGNMENT = 8

Writer = Callable[[bytearray, Any], None]
Reader = Callable[[bytes, int], tuple[Any, int]]


def serialize(message: Message, prefix: bytes = HEADER) -> bytes:
    """Serialize a message, padded to a multiple of 4 bytes as CycloneDDS wants it.

    Args:
        message: The message.
        prefix: What comes first: the CDR header, and for a service its request header (16
            bytes, so that alignment is as without).

    Raises:
        MessageFieldError: A field holds a value its type does not allow; says which.
    """
    buffer = bytearray(prefix)
    try:
        writer_of(message.ros_type)(buffer, message)
    except (struct.error, TypeError, ValueError, AttributeError, OverflowError) as error:
        explain(message)
        raise MessageFieldError(f"{message.ros_type}: {error}") from error
    buffer += bytes(-len(buffer) % 4)
    return bytes(buffer)


def deserialize(data: bytes, full_name: str, start: int = HEADER_SIZE) -> Any:
    """Read a message.

    Args:
        data: The bytes, CDR header first.
        full_name: The message's full name.
        start: Where the message begins, in bytes.

    Raises:
        SerializationError: The bytes are no message of this type.
    """
    if len(data) < HEADER_SIZE or data[0] != 0 or data[1] > 1:
        raise SerializationError(f"{full_name}: {data[:HEADER_SIZE]!r} is no CDR header")
    reader = reader_of(full_name, "<" if data[1] else ">")
    try:
        message, end = reader(data, start)
    except (struct.error, UnicodeDecodeError, ValueError, IndexError) as error:
        raise SerializationError(f"{full_name}: {error}") from error
    if end > len(data):
        raise SerializationError(f"{full_name}: {len(data)} bytes, at least {end} expected")
    return message


@functools.cache
def writer_of(full_name: str) -> Writer:
    """The function that appends a message of this type to a buffer."""
    return _WriterSource(full_name).function()


@functools.cache
def element_writer_of(full_name: str) -> Writer:
    """The same for an element of a collection, which may begin at any position."""
    return _WriterSource(full_name, alignment=_Alignment(modulus=1)).function()


@functools.cache
def reader_of(full_name: str, order: str) -> Reader:
    """The function that reads a message of this type from bytes in this byte order."""
    return _ReaderSource(full_name, order).function()


@functools.cache
def element_reader_of(full_name: str, order: str) -> Reader:
    """The same for an element of a collection, which may begin at any position."""
    return _ReaderSource(full_name, order, alignment=_Alignment(modulus=1)).function()


@dataclass
class _Alignment:
    """What is known while generating about the position: position % modulus == remainder."""

    modulus: int = MAX_ALIGNMENT
    remainder: int = 0

    def advance(self, size: int) -> None:
        self.remainder = (self.remainder + size) % self.modulus

    def forget(self, modulus: int = 1) -> None:
        self.modulus, self.remainder = modulus, 0

    def padding(self, size: int) -> int | None:
        """Bytes up to a multiple of size, or None where not known."""
        return -self.remainder % size if self.modulus % size == 0 else None


@dataclass
class _Source:
    """Lines of a function in the making, the names it uses, and a run of pending numbers."""

    full_name: str
    order: str = NATIVE_ORDER
    lines: list[str] = field(default_factory=list)
    names: dict[str, Any] = field(default_factory=dict)
    alignment: _Alignment = field(default_factory=_Alignment)
    run_format: str = ""
    run_items: list[tuple[str, Primitive]] = field(default_factory=list)
    indent: int = 1
    counter: int = 0

    def emit(self, line: str) -> None:
        self.lines.append("    " * self.indent + line)

    def name(self, stem: str, value: Any = None) -> str:
        self.counter += 1
        name = f"{stem}{self.counter}"
        if value is not None:
            self.names[name] = value
        return name

    def align(self, size: int) -> None:
        """Close the run and emit padding to a multiple of size."""
        self.flush()
        padding = self.alignment.padding(size)
        if padding is None:
            self.emit_runtime_padding(size)
            self.alignment.forget(size)
        elif padding:
            self.emit_padding(padding)
            self.alignment.advance(padding)

    def number(self, target: str, primitive: Primitive) -> None:
        """Add a number to the run."""
        padding = self.alignment.padding(primitive.size)
        if padding is None:
            self.align(primitive.size)
            padding = 0
        self.run_format += "x" * padding + primitive.code
        self.run_items.append((target, primitive))
        self.alignment.advance(padding + primitive.size)

    def flush(self) -> None:
        """Emit the pending run of numbers."""
        if self.run_items:
            packer = self.name("S", struct.Struct(self.order + self.run_format))
            items, self.run_items, self.run_format = self.run_items, [], ""
            self.emit_run(packer, items)

    def emit_run(self, packer: str, items: list[tuple[str, Primitive]]) -> None:
        raise NotImplementedError

    def emit_padding(self, size: int) -> None:
        raise NotImplementedError

    def emit_runtime_padding(self, size: int) -> None:
        raise NotImplementedError

    def compile(self, header: str, footer: str) -> Any:
        source = "\n".join([header, *self.lines, f"    {footer}"])
        exec(compile(source, f"<cdr of {self.full_name}>", "exec"), self.names)
        return self.names["function"]


def _refuse_wide(spec: MessageSpec) -> None:
    for item in spec.fields:
        if item.type.base == "wstring":
            raise InterfaceError(
                f"{spec.full_name}.{item.name}: wstring is not supported by embedded_ros"
            )


class _WriterSource(_Source):
    """Generates ``function(buffer, message)``."""

    def function(self) -> Writer:
        self.names.update(
            U32=struct.Struct(self.order + "I").pack,
            PAD=[bytes(n) for n in range(MAX_ALIGNMENT)],
            error=_type_error,
        )
        self.message("m", catalogue().message(self.full_name))
        self.flush()
        writer: Writer = self.compile("def function(b, m):", "return")
        return writer

    def message(self, variable: str, spec: MessageSpec) -> None:
        _refuse_wide(spec)
        if not spec.fields:
            self.number("0", _UINT8)
        for item in spec.fields:
            access = f"{variable}.{item.name}"
            if is_numeric_collection(item.type):
                self.numbers(f"{variable}._{item.name}", item.type)
            elif item.type.shape is not Shape.SINGLE:
                self.collection(access, item.type)
            else:
                self.single(access, item.type)

    def single(self, access: str, kind: FieldType) -> None:
        value = self.name("v")
        primitive = kind.primitive
        self.emit(f"{value} = {access}")
        if primitive is None:
            expected = self.name("T", message_class(kind.base))
            self.emit(f"if type({value}) is not {expected}: error({value}, {expected})")
            self.message(value, catalogue().message(kind.base))
        elif primitive.python is str:
            self.string(value, kind)
        else:
            expected = primitive.python.__name__
            self.emit(f"if type({value}) is not {expected}: error({value}, {expected})")
            self.number(value, primitive)

    def string(self, value: str, kind: FieldType) -> None:
        self.emit(f"{value} = {value}.encode() + b'\\0'")
        if kind.string_bound:
            self.emit(f"if len({value}) > {kind.string_bound + 1}: error({value}, str)")
        self.emit(f"if {value}.find(0) != len({value}) - 1: error({value}, str)")
        self.align(4)
        self.emit(f"b += U32(len({value}))")
        self.emit(f"b += {value}")
        self.alignment.forget()

    def numbers(self, access: str, kind: FieldType) -> None:
        primitive = kind.primitive
        assert primitive is not None
        value = self.name("v")
        self.emit(f"{value} = {access}")
        if kind.shape is Shape.ARRAY:
            self.align(primitive.size)
            self.emit(f"b += {value}.tobytes()")
            self.alignment.advance(primitive.size * kind.size)
            return
        self.length(value)
        if kind.size:  # appended to in place, after the check on assignment
            self.emit(f"if len({value}) > {kind.size}: error({value}, list)")
        self.emit(f"if {value}:")
        self.nested_block(primitive.size, f"b += {value}.tobytes()")
        self.alignment.forget(min(primitive.size, 4))

    def nested_block(self, alignment: int, line: str) -> None:
        """A block of elements: padding comes only where there is an element."""
        self.indent += 1
        if alignment > 4:
            self.emit_runtime_padding(alignment)
        self.emit(line)
        self.indent -= 1

    def length(self, value: str) -> None:
        self.align(4)
        self.emit(f"b += U32(len({value}))")
        self.alignment.advance(4)

    def collection(self, access: str, kind: FieldType) -> None:
        value = self.name("v")
        primitive = kind.primitive
        self.emit(f"{value} = {access}")
        self.emit(f"if type({value}) is not list: {value} = as_list({value})")
        self.names["as_list"] = _as_list
        if kind.shape is Shape.ARRAY:
            self.flush()
            self.emit(f"if len({value}) != {kind.size}: error({value}, list)")
        else:
            self.length(value)
            if kind.size:
                self.emit(f"if len({value}) > {kind.size}: error({value}, list)")
        if primitive is not None and primitive.python in (bool, bytes):
            expected = primitive.python.__name__
            self.emit(f"for e in {value}:")
            self.emit(f"    if type(e) is not {expected}: error(e, {expected})")
            self.emit(f"b += bytes({value})" if expected == "bool" else f"b += one_byte({value})")
            self.names["one_byte"] = _join_bytes
        elif primitive is not None:
            self.strings(value, kind)
        else:
            expected = self.name("T", message_class(kind.base))
            write = self.name("w", element_writer_of(kind.base))
            self.emit(f"for e in {value}:")
            self.emit(f"    if type(e) is not {expected}: error(e, {expected})")
            self.emit(f"    {write}(b, e)")
        self.alignment.forget()

    def strings(self, value: str, kind: FieldType) -> None:
        self.flush()
        self.emit(f"for e in {value}:")
        self.indent += 1
        self.alignment.forget()
        self.string_element(kind)
        self.indent -= 1

    def string_element(self, kind: FieldType) -> None:
        element = self.name("v")
        self.emit(f"{element} = e")
        self.string(element, kind)

    def emit_run(self, packer: str, items: list[tuple[str, Primitive]]) -> None:
        self.emit(f"b += {packer}.pack({', '.join(target for target, _ in items)})")

    def emit_padding(self, size: int) -> None:
        self.emit(f"b += PAD[{size}]")

    def emit_runtime_padding(self, size: int) -> None:
        if size > 1:
            self.emit(f"b += PAD[({HEADER_SIZE} - len(b)) & {size - 1}]")


class _ReaderSource(_Source):
    """Generates ``function(data, position) -> (message, position)``."""

    def function(self) -> Reader:
        self.names.update(
            U32=struct.Struct(self.order + "I").unpack_from,
            array=array,
            np=np,
            swap=self.order != NATIVE_ORDER,
            take=_take,
        )
        variable = self.message(self.full_name)
        reader: Reader = self.compile("def function(d, p):", f"return {variable}, p")
        return reader

    def message(self, full_name: str) -> str:
        """Emit the reading of a message; returns the variable that holds it."""
        spec = catalogue().message(full_name)
        _refuse_wide(spec)
        cls = message_class(full_name)
        variable = self.name("m")
        self.emit(f"{variable} = {self.name('new', functools.partial(cls.__new__, cls))}()")
        if not spec.fields:
            self.number("_", _UINT8)
        for item in spec.fields:
            if is_numeric_collection(item.type):
                self.numbers(f"{variable}._{item.name}", item.type)
            elif item.type.shape is not Shape.SINGLE:
                self.collection(f"{variable}.{item.name}", item.type)
            else:
                self.single(f"{variable}.{item.name}", item.type)
        self.flush()
        return variable

    def single(self, target: str, kind: FieldType) -> None:
        primitive = kind.primitive
        if primitive is None:
            self.flush()
            self.emit(f"{target} = {self.message(kind.base)}")
        elif primitive.python is str:
            self.string(target)
        else:
            self.number(target, primitive)

    def string(self, target: str) -> None:
        self.length()
        self.emit(f"{target} = take(d, p, n)[:-1].decode()")
        self.emit("p += n")
        self.alignment.forget()

    def length(self) -> None:
        """Emit the reading of a length into n."""
        self.align(4)
        self.emit("n = U32(d, p)[0]")
        self.emit("p += 4")
        self.alignment.advance(4)

    def numbers(self, target: str, kind: FieldType) -> None:
        primitive = kind.primitive
        assert primitive is not None
        if kind.shape is Shape.ARRAY:
            size = primitive.size * kind.size
            self.align(primitive.size)
            dtype = self.name("D", np.dtype(self.order + NUMPY_TYPES[kind.base]))
            native = self.name("N", np.dtype(NUMPY_TYPES[kind.base]))
            self.emit(f"{target} = np.frombuffer(take(d, p, {size}), {dtype}).astype({native})")
            self.emit(f"p += {size}")
            self.alignment.advance(size)
            return
        self.length()
        self.emit(f"a = array({primitive.code!r})")
        self.emit("if n:")
        self.indent += 1
        if primitive.size > 4:
            self.emit_runtime_padding(primitive.size)
        self.emit(f"n *= {primitive.size}")
        self.emit("a.frombytes(take(d, p, n))")
        self.emit("p += n")
        if primitive.size > 1:
            self.emit("if swap: a.byteswap()")
        self.indent -= 1
        self.emit(f"{target} = a")
        self.alignment.forget(min(primitive.size, 4))

    def collection(self, target: str, kind: FieldType) -> None:
        primitive = kind.primitive
        if kind.shape is Shape.ARRAY:
            self.flush()
            self.emit(f"n = {kind.size}")
        else:
            self.length()
        if primitive is not None and primitive.python is bool:
            self.emit(f"{target} = [x != 0 for x in take(d, p, n)]")
            self.emit("p += n")
        elif primitive is not None and primitive.python is bytes:
            self.emit(f"{target} = [bytes((x,)) for x in take(d, p, n)]")
            self.emit("p += n")
        else:
            self.elements(target, kind)
        self.alignment.forget()

    def elements(self, target: str, kind: FieldType) -> None:
        values = self.name("l")
        self.emit(f"{values} = []")
        self.emit("for _ in range(n):")
        self.indent += 1
        self.alignment.forget()
        if kind.primitive is not None:
            self.string("e")
        else:
            read = self.name("r", element_reader_of(kind.base, self.order))
            self.emit(f"e, p = {read}(d, p)")
        self.emit(f"{values}.append(e)")
        self.indent -= 1
        self.emit(f"{target} = {values}")

    def emit_run(self, packer: str, items: list[tuple[str, Primitive]]) -> None:
        size = self.names[packer].size
        targets = ", ".join(target for target, _ in items)
        self.emit(f"{targets}, = {packer}.unpack_from(d, p)")
        self.emit(f"p += {size}")

    def emit_padding(self, size: int) -> None:
        self.emit(f"p += {size}")

    def emit_runtime_padding(self, size: int) -> None:
        if size > 1:
            self.emit(f"p += ({HEADER_SIZE} - p) & {size - 1}")


_UINT8 = Primitive(1, "B", int, 3, True)


def _take(data: bytes, position: int, size: int) -> bytes:
    chunk = data[position : position + size]
    if len(chunk) != size:
        raise SerializationError(
            f"{size} bytes expected at position {position}, {len(chunk)} are left"
        )
    return chunk


def _type_error(value: object, expected: type) -> None:
    """The slow path of a generated type check: subclasses (numpy.float64, enums) may pass."""
    if isinstance(value, bool) and expected is int:
        raise TypeError(f"bool {value!r} where int is expected")
    if expected in (list, str) or not isinstance(value, expected):
        raise TypeError(f"{value!r} where {expected.__name__} is expected")


def _as_list(value: Any) -> list[Any]:
    if isinstance(value, str | bytes):
        raise TypeError(f"{value!r} where a list is expected")
    return list(value)


def _join_bytes(values: list[bytes]) -> bytes:
    joined = b"".join(values)
    if len(joined) != len(values):
        raise TypeError("a byte is not of length 1")
    return joined
