# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Changes of training settings by dotted names, as ``exploration.rollouts``.

A domain gives them as values (``Learning.settings``), the command line as text (``--set``). Both
are refused where they are unknown, of another type, or out of range.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import is_dataclass, replace
from difflib import get_close_matches
from types import NoneType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from slap_ros.core import SettingValue
from slap_ros.errors import InvalidParameterError
from slap_ros.learning.stored_keys import field_name

S = TypeVar("S")
OFF = "none"  # text on the command line for a part that is left out
LARGEST = 10**9  # largest value of a whole number
# Counts that may be 0; others begin at 1.
ZERO_TOO = frozenset(
    {
        "also_repeat",
        "alternatives",
        "budget",
        "cloning_steps",
        "critic_updates",
        "inside",
        "pushes",
        "refinements",
        "shortcuts",
        "straightened",
        "approaches",
        "disturbed",
    }
)
BELOW_1 = math.nextafter(1.0, 0.0)
RANGES: Mapping[str, tuple[float, float]] = {  # least and greatest value; all others are finite
    "acting": (0.0, 1.0),
    "cloning": (0.0, sys.float_info.max),
    "disturbance": (0.0, sys.float_info.max),
    "gamma": (0.0, BELOW_1),
    "enough": (0.0, 1.0),
    "ent_coef_init": (math.ulp(0.0), sys.float_info.max),
    "entropy": (math.ulp(0.0), sys.float_info.max),
    "ent_coef": (0.0, sys.float_info.max),
    "gae_lambda": (0.0, 1.0),
    "hindsight": (0.0, BELOW_1),
    "learning_rate": (math.ulp(0.0), 1.0),
    "least_saving": (0.0, BELOW_1),
    "least_similarity": (0.0, 1.0),
    "least_success": (0.0, 1.0),
    "log_std_init": (-20.0, 2.0),
    "noise": (math.ulp(0.0), sys.float_info.max),
    "progress": (0.0, 1.0),
    "random_goals": (0.0, 1.0),
    "rehearsal": (0.0, BELOW_1),
    "solved": (0.0, 1.0),
    "scale": (math.ulp(0.0), sys.float_info.max),
    "spread": (0.0, sys.float_info.max),
    "tau": (math.ulp(0.0), 1.0),
    "temperature": (0.0, sys.float_info.max),
}


def setting_names(kind: type, prefix: str = "") -> dict[str, Any]:
    """The dotted names of all settings of a dataclass, each with its type.

    A part that may be left out is a setting of its own, of the type ``None``.
    """
    names: dict[str, Any] = {}
    for name, hint in get_type_hints(kind).items():
        part = _part(hint)
        if part is None:
            names[prefix + name] = hint
            continue
        if NoneType in get_args(hint):
            names[prefix + name] = NoneType
        names |= setting_names(part, f"{prefix}{name}.")
    return names


def _part(hint: Any) -> type | None:
    """The dataclass that a field holds, or may hold; None where it holds a value."""
    for kind in (hint, *get_args(hint)):
        if isinstance(kind, type) and is_dataclass(kind):
            return kind
    return None


def changed(settings: S, changes: Mapping[str, SettingValue]) -> S:
    """Settings with some changed, one after the other.

    Args:
        settings: Settings, a dataclass with parts that are dataclasses of settings.
        changes: New values by dotted name. None leaves a part out that may be left out; a setting
            of a part that is left out puts it back, with its defaults.

    Returns:
        The settings.

    Raises:
        InvalidParameterError: There is no such setting, or it cannot have that value.
    """
    known = setting_names(type(settings))
    for name, value in changes.items():
        _require_known(name, known)
        if not _is_possible(name, known[name], value):
            raise InvalidParameterError(
                f"setting {name!r} must be {_in_words(name, known[name])}, not {value!r}"
            )
        settings = _with(settings, name.split("."), value)
    return settings


def parse_changes(texts: Sequence[str], kind: type) -> dict[str, SettingValue]:
    """Parse changes as the command line gives them, ``exploration.rollouts=16``.

    Commands that libraries record may have the names of an earlier version, which files still have
    (:mod:`slap_ros.learning.stored_keys`).

    Args:
        texts: Texts of the changes, one per setting.
        kind: Dataclass of the settings.

    Returns:
        Values by dotted name, each of the type of its setting.

    Raises:
        InvalidParameterError: There is no such setting, it is given twice, or its text is no value
            of its type.
    """
    known, changes = setting_names(kind), dict[str, SettingValue]()
    for text in texts:
        given, equals, value = (piece.strip() for piece in text.partition("="))
        if not equals:
            raise InvalidParameterError(f"{text!r} is not of the form exploration.rollouts=16")
        name = _current_name(given, kind)
        _require_known(name, known)
        if name in changes:
            raise InvalidParameterError(f"setting {name!r} is given twice")
        try:
            changes[name] = _parsed(value, known[name])
        except ValueError:
            raise InvalidParameterError(
                f"setting {name!r} must be {_in_words(name, known[name])}, not {value!r}"
            ) from None
    return changes


def _current_name(given: str, kind: type) -> str:
    """A dotted name with each part as its dataclass has it now."""
    names: list[str] = []
    part: type | None = kind
    for piece in given.split("."):
        name = piece if part is None else field_name(part, piece)
        hint = None if part is None else get_type_hints(part).get(name)
        names.append(name)
        part = None if hint is None else _part(hint)
    return ".".join(names)


def _require_known(name: str, known: Mapping[str, Any]) -> None:
    if name not in known:
        near = get_close_matches(name, known, n=1)
        meant = f"did you mean {near[0]}? " if near else ""
        raise InvalidParameterError(
            f"unknown setting {name!r}; {meant}there are {', '.join(known)}"
        )


def _with(settings: Any, path: Sequence[str], value: SettingValue) -> Any:
    """Settings with the one at a path changed, which is known to be there."""
    first, *rest = path
    kind, new = get_type_hints(type(settings))[first], value
    if rest:
        part, now = _part(kind), getattr(settings, first)
        new = _with(part() if now is None and part else now, rest, value)
    elif kind is float and isinstance(value, int):
        new = float(value)
    return replace(settings, **{first: new})


def _range(name: str, kind: Any) -> tuple[float, float]:
    """The least and the greatest value of a number."""
    own = name.rpartition(".")[2]
    if kind is int:
        return (0 if own in ZERO_TOO else 1), LARGEST
    return RANGES.get(own, (-sys.float_info.max, sys.float_info.max))


def _is_possible(name: str, kind: Any, value: object) -> bool:
    if kind is NoneType:
        return value is None
    if kind is bool:
        return isinstance(value, bool)
    if get_origin(kind) is tuple:
        return isinstance(value, tuple) and all(_is_possible(name, int, one) for one in value)
    if isinstance(value, bool) or not isinstance(value, int if kind is int else int | float):
        return False
    low, high = _range(name, kind)
    return low <= value <= high  # False for NaN


def _in_words(name: str, kind: Any) -> str:
    """The values that a setting can have, in words."""
    if kind is NoneType:
        return f"{OFF}, or be set part by part: {name}...."
    if kind is bool:
        return "true or false"
    if get_origin(kind) is tuple:
        return "whole numbers, as 64,64"
    low, high = _range(name, kind)
    number = "a whole number" if kind is int else "a number"
    return f"{number} from {low:.6g} to {high:.6g}"


def _parsed(text: str, kind: Any) -> SettingValue:
    """The value of a type that a text stands for; raises ``ValueError``."""
    words: dict[str, SettingValue] = {}
    if kind is NoneType:
        words = {OFF: None}
    elif kind is bool:
        words = {"true": True, "false": False}
    elif get_origin(kind) is tuple:
        return tuple(int(one) for one in text.split(","))
    else:
        return int(text) if kind is int else float(text)
    if text not in words:
        raise ValueError(text)
    return words[text]
