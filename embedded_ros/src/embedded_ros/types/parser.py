# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the text of ``.msg``, ``.srv`` and ``.action`` files."""

from __future__ import annotations

import ast
import keyword
import re
from dataclasses import dataclass

from .errors import InterfaceError
from .model import (
    PRIMITIVES,
    ActionSpec,
    Constant,
    Default,
    Field,
    FieldType,
    MessageSpec,
    Scalar,
    ServiceSpec,
    Shape,
)

_PACKAGE = r"[a-z](?:_?[a-z0-9])*"
_NAME = r"[A-Z][A-Za-z0-9]*"
_TYPE = re.compile(
    rf"(?P<base>{_PACKAGE}/(?:msg/)?{_NAME}|{_NAME}|[a-z]+[0-9]*)"
    r"(?:<=(?P<string_bound>[0-9]+))?"
    r"(?P<shape>\[(?:<=)?[0-9]*\])?"
)
_FIELD_NAME = re.compile(r"[a-z](?:_?[a-z0-9])*")
_CONSTANT_NAME = re.compile(r"[A-Z](?:_?[A-Z0-9])*")
_SEPARATOR = re.compile(r"---\s*")
_INTEGER_BITS = re.compile(r"(u?)int([0-9]+)")


@dataclass(frozen=True, slots=True)
class Line:
    """One line of an interface file, comment removed, with what an error message needs."""

    full_name: str
    source: str
    number: int
    text: str

    def error(self, what: str) -> InterfaceError:
        """An error that says what is wrong, in which interface, file and line."""
        return InterfaceError(
            f"{self.source}:{self.number}: {self.full_name}: {what}: {self.text!r}"
        )


def parse_message(full_name: str, text: str, source: str) -> MessageSpec:
    """Parse the text of a ``.msg`` file.

    Args:
        full_name: ``package/msg/Name``.
        text: The file's text.
        source: Where the text is from, for error messages.

    Raises:
        InterfaceError: The text is malformed; says file and line.
    """
    (lines,) = _sections(full_name, text, source, count=1)
    return _message(full_name, lines)


def parse_service(full_name: str, text: str, source: str) -> ServiceSpec:
    """Parse the text of a ``.srv`` file; arguments and errors as :func:`parse_message`."""
    request, response = _sections(full_name, text, source, count=2)
    return ServiceSpec(
        full_name,
        _message(f"{full_name}_Request", request),
        _message(f"{full_name}_Response", response),
    )


def parse_action(full_name: str, text: str, source: str) -> ActionSpec:
    """Parse the text of an ``.action`` file; arguments and errors as :func:`parse_message`."""
    goal, result, feedback = _sections(full_name, text, source, count=3)
    return ActionSpec(
        full_name,
        _message(f"{full_name}_Goal", goal),
        _message(f"{full_name}_Result", result),
        _message(f"{full_name}_Feedback", feedback),
    )


def _sections(full_name: str, text: str, source: str, count: int) -> list[list[Line]]:
    sections: list[list[Line]] = [[]]
    for number, raw in enumerate(text.splitlines(), start=1):
        stripped = _without_comment(raw).strip()
        if _SEPARATOR.fullmatch(stripped):
            sections.append([])
        elif stripped:
            sections[-1].append(Line(full_name, source, number, stripped))
    if len(sections) != count:
        raise InterfaceError(
            f"{source}: {full_name}: {len(sections) - 1} '---' separators, expected {count - 1}"
        )
    return sections


def _without_comment(line: str) -> str:
    quote = ""
    escaped = False
    for index, char in enumerate(line):
        if escaped:
            escaped = False
        elif quote:
            escaped = char == "\\"
            quote = "" if char == quote else quote
        elif char in "\"'":
            quote = char
        elif char == "#":
            return line[:index]
    # An apostrophe opens no string in "string name it's": then the first # ends the line.
    return line if not quote else line.split("#", 1)[0]


def _message(full_name: str, lines: list[Line]) -> MessageSpec:
    fields: dict[str, Field] = {}
    constants: dict[str, Constant] = {}
    for line in lines:
        entry = _entry(full_name, line)
        if entry.name in fields or entry.name in constants:
            raise line.error(f"{entry.name!r} is defined twice")
        if isinstance(entry, Field):
            fields[entry.name] = entry
        else:
            constants[entry.name] = entry
    return MessageSpec(full_name, tuple(fields.values()), tuple(constants.values()))


def _entry(full_name: str, line: Line) -> Field | Constant:
    parts = line.text.split(None, 1)
    if len(parts) != 2:
        raise line.error("expected a type and a name")
    field_type = _type(parts[0], full_name.split("/")[0], line)
    name, _, rest = _split_name(parts[1])
    if rest.startswith("="):
        return _constant(field_type, name, rest[1:].strip(), line)
    if not _FIELD_NAME.fullmatch(name):
        raise line.error(f"field name {name!r} is not lower_snake_case")
    if keyword.iskeyword(name):
        raise line.error(f"field name {name!r} is a Python keyword")
    return Field(name, field_type, _default(field_type, rest, line) if rest else None)


def _split_name(text: str) -> tuple[str, str, str]:
    match = re.match(r"[A-Za-z0-9_]*", text)
    name = match.group() if match else ""
    rest = text[len(name) :]
    return name, rest[: len(rest) - len(rest.lstrip())], rest.strip()


def _type(text: str, package: str, line: Line) -> FieldType:
    match = _TYPE.fullmatch(text)
    if not match:
        raise line.error(f"type {text!r} is malformed")
    base = match["base"]
    string_bound = int(match["string_bound"] or 0)
    if base[0].isupper():
        base = f"{package}/msg/{base}"
    elif "/" in base:
        base = f"{base.split('/')[0]}/msg/{base.split('/')[-1]}"
    elif base not in PRIMITIVES:
        raise line.error(f"type {base!r} is unknown")
    if match["string_bound"] and (base not in ("string", "wstring") or string_bound == 0):
        raise line.error("only strings have a bound, of at least 1")
    shape, size = _shape(match["shape"] or "", line)
    return FieldType(base, string_bound, shape, size)


def _shape(text: str, line: Line) -> tuple[Shape, int]:
    if not text:
        return Shape.SINGLE, 0
    size = text[1:-1].removeprefix("<=")
    if text.startswith("[<="):
        if not size or int(size) == 0:
            raise line.error("a bounded sequence needs a bound of at least 1")
        return Shape.SEQUENCE, int(size)
    if not size:
        return Shape.SEQUENCE, 0
    if int(size) == 0:
        raise line.error("an array needs at least 1 element")
    return Shape.ARRAY, int(size)


def _constant(field_type: FieldType, name: str, text: str, line: Line) -> Constant:
    if not _CONSTANT_NAME.fullmatch(name):
        raise line.error(f"constant name {name!r} is not UPPER_SNAKE_CASE")
    if field_type.primitive is None or field_type.shape is not Shape.SINGLE:
        raise line.error("a constant has a single primitive value")
    return Constant(name, field_type, _scalar(field_type, text, line))


def _default(field_type: FieldType, text: str, line: Line) -> Default:
    if field_type.primitive is None:
        raise line.error("a field of message type has no default value")
    if field_type.shape is Shape.SINGLE:
        return _scalar(field_type, text, line)
    if not (text.startswith("[") and text.endswith("]")):
        raise line.error("the default of an array is a [list]")
    values = tuple(_scalar(field_type, part, line) for part in _list_items(text[1:-1]))
    if field_type.shape is Shape.ARRAY and len(values) != field_type.size:
        raise line.error(f"{len(values)} default values for {field_type.size} elements")
    if field_type.shape is Shape.SEQUENCE and field_type.size and len(values) > field_type.size:
        raise line.error(f"{len(values)} default values, the bound is {field_type.size}")
    return values


def _list_items(text: str) -> list[str]:
    items = re.findall(r"\"(?:[^\"\\]|\\.)*\"|'(?:[^'\\]|\\.)*'|[^,]+", text)
    return [item.strip() for item in items if item.strip()]


def _scalar(field_type: FieldType, text: str, line: Line) -> Scalar:
    primitive = field_type.primitive
    if primitive is None:
        raise line.error("a message has no literal value")
    if primitive.python is str:
        return _string(field_type, text, line)
    if primitive.python is bool:
        if text.lower() in ("true", "false", "1", "0"):
            return text.lower() in ("true", "1")
        raise line.error(f"{text!r} is not a bool")
    if primitive.python is float:
        try:
            return float(text)
        except ValueError:
            raise line.error(f"{text!r} is not a {field_type.base}") from None
    return _integer(field_type, text, line)


def _integer(field_type: FieldType, text: str, line: Line) -> Scalar:
    try:
        value = int(text, 0)
    except ValueError:
        raise line.error(f"{text!r} is not a {field_type.base}") from None
    match = _INTEGER_BITS.fullmatch(field_type.base)
    bits = int(match[2]) if match else 8
    signed = bool(match) and not (match and match[1])
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
    if not low <= value <= high:
        raise line.error(f"{value} does not fit into {field_type.base}")
    return bytes([value]) if field_type.base == "byte" else value


def _string(field_type: FieldType, text: str, line: Line) -> str:
    value = text
    if text[:1] in ("'", '"'):
        try:
            value = str(ast.literal_eval(text))
        except (SyntaxError, ValueError):
            raise line.error(f"string {text} is not closed") from None
    if field_type.string_bound and len(value.encode()) > field_type.string_bound:
        raise line.error(f"{value!r} is longer than {field_type.string_bound} bytes")
    return value
