# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Presets with some settings changed: ``fair:obstacles=6,mass=0.8..1.2``."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, ClassVar, TypeVar

from slap_ros.errors import InvalidParameterError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    Settings = TypeVar("Settings", bound=DataclassInstance)


LONGEST_TEXT = 60  # characters of a value in a message
Limits = tuple[float, float]


class TaskSettings:
    """A dataclass from whose fields tasks are sampled.

    Attributes:
        limits: The lowest and highest number of a field, both allowed, where it has such. All
            numbers are finite anyway.
        choices: The words that a field may be, where it is a word.
    """

    limits: ClassVar[Mapping[str, Limits]] = {}
    choices: ClassVar[Mapping[str, tuple[str, ...]]] = {}

    def __post_init__(self: DataclassInstance) -> None:
        """Check every number and every word.

        Raises:
            InvalidParameterError: A number is not finite or beyond its limits, or a word is none
                of its choices.
        """
        limits: Mapping[str, Limits] = getattr(self, "limits", {})
        choices: Mapping[str, tuple[str, ...]] = getattr(self, "choices", {})
        for field in fields(self):
            value = getattr(self, field.name)
            words = choices.get(field.name, ())
            if words and value not in words:
                raise InvalidParameterError(
                    f"setting {field.name!r} is {_shortened(str(value))}; it must be "
                    f"{' or '.join(words)}"
                )
            low, high = limits.get(field.name, (-math.inf, math.inf))
            for number in _numbers(value):
                # An integer beyond what floats hold is compared as it is; NaN fails.
                if not low <= number <= high or number in (math.inf, -math.inf):
                    wanted = f"from {low:g} to {high:g}" if field.name in limits else "finite"
                    raise InvalidParameterError(
                        f"setting {field.name!r} is {_shortened(str(value))}; it must be {wanted}"
                    )

    def as_configuration(self: DataclassInstance) -> Mapping[str, str]:
        """The settings by name, as bags record them."""
        return {name: str(value) for name, value in asdict(self).items()}


def parse_preset(text: str) -> tuple[str, dict[str, str]]:
    """A preset's name, and the settings to change.

    Raises:
        InvalidParameterError: Not of the form ``name`` or ``name:setting=value,...``.
    """
    name, colon, rest = text.partition(":")
    changes: dict[str, str] = {}
    for part in rest.split(",") if colon else ():
        key, equals, value = (piece.strip() for piece in part.partition("="))
        if not (key and equals and value):
            raise InvalidParameterError(
                f"preset {text!r}: {part!r} is not of the form setting=value, as in "
                "fair:obstacles=6,mass=0.8..1.2"
            )
        changes[key] = value
    return name, changes


def varied(settings: Settings, changes: Mapping[str, str]) -> Settings:
    """Settings with some changed. A range is ``low..high``, or one number for both; or a word.

    Raises:
        InvalidParameterError: There is no such setting, or it cannot have that value.
    """
    known = {field.name: getattr(settings, field.name) for field in fields(settings)}
    values = {}
    for name, text in changes.items():
        if name not in known:
            raise InvalidParameterError(f"unknown setting {name!r}; there are {', '.join(known)}")
        values[name] = _read(name, text, known[name])
    return replace(settings, **values)


def _numbers(value: object) -> Iterator[float]:
    """The numbers of a setting: itself, or those of a tuple however nested."""
    if isinstance(value, tuple):
        for part in value:
            yield from _numbers(part)
    elif isinstance(value, int | float):
        yield value


def _shortened(text: str) -> str:
    return text if len(text) <= LONGEST_TEXT else f"{text[:LONGEST_TEXT]}… ({len(text)} characters)"


def _read(name: str, text: str, now: object) -> object:
    """The text as a value like the present one."""
    is_range = isinstance(now, tuple) and len(now) == 2
    kind = type(now[0] if isinstance(now, tuple) else now)
    if kind is str:
        return text
    if kind not in (int, float):
        raise InvalidParameterError(f"setting {name!r} cannot be given on the command line")
    pieces = text.split("..") if is_range else [text]
    try:
        numbers = [kind(piece) for piece in pieces]
    except ValueError:
        numbers = []
    if not 1 <= len(numbers) <= 2 or numbers[0] > numbers[-1]:
        wanted = "low..high" if is_range else "a whole number" if kind is int else "a number"
        raise InvalidParameterError(
            f"setting {name!r} is {now}, which {_shortened(repr(text))} cannot replace; "
            f"give {wanted}"
        )
    return (numbers[0], numbers[-1]) if is_range else numbers[0]
