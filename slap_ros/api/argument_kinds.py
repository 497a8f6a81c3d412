# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Arguments of the Python API, compared with what its functions are annotated to take."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import (
    Any,
    ParamSpec,
    SupportsIndex,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from slap_ros.core import Domain, Task
from slap_ros.errors import InvalidParameterError
from slap_ros.planning.plan import PlanningResult
from slap_ros.relational.articles import a_or_an

P = ParamSpec("P")
R = TypeVar("R")

# What a person may give where a hint says so: a path may be of any library, a number of numpy.
_TAKEN: dict[Any, type] = {Path: PathLike, int: SupportsIndex}
_WORDS = {
    Path: "a path",
    str: "a text",
    int: "a whole number",
    NoneType: "None",
    Mapping: "a mapping",
    Sequence: "a list",
}
_EXAMPLES = {
    Domain: 'slap_ros.make("obstacle2d")',
    Task: "domain.task(seed=1)",
    PlanningResult: "slap_ros.plan(domain, task)",
}


def checks_arguments(function: Callable[P, R]) -> Callable[P, R]:
    """Let a function refuse arguments of kinds that its annotations do not name.

    Keyword arguments that the function does not name itself are left to it.

    Args:
        function: Function whose parameters are all annotated.

    Returns:
        The function; it raises InvalidParameterError before anything is done.
    """
    signature = inspect.signature(function)

    @wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            given = signature.bind(*args, **kwargs).arguments
        except TypeError:
            return function(*args, **kwargs)  # Python says what is missing, and of which function
        hints = get_type_hints(function)
        for name, value in given.items():
            if signature.parameters[name].kind is inspect.Parameter.VAR_KEYWORD:
                continue
            if not _fits(value, hints[name]):
                raise InvalidParameterError(
                    f"{name} must be {_told(hints[name])}, not {_shown(value)}"
                )
        return function(*args, **kwargs)

    return checked


def _fits(value: object, hint: Any) -> bool:
    """Whether a value is what a hint says."""
    kind = get_origin(hint) or hint
    if kind in (Union, UnionType):
        return any(_fits(value, one) for one in get_args(hint))
    if kind is Sequence:
        (of,) = get_args(hint)
        if isinstance(value, str) or not isinstance(value, Sequence):
            return False  # a text is a sequence of letters, which nobody means
        return all(_fits(one, of) for one in value)
    return isinstance(value, _TAKEN.get(kind, kind))


def _told(hint: Any) -> str:
    """What a hint says, in words."""
    kind = get_origin(hint) or hint
    if kind in (Union, UnionType):
        *others, last = map(_told, get_args(hint))
        return f"{', '.join(others)} or {last}"
    words = _WORDS.get(kind) or a_or_an(kind.__name__)
    if kind is Sequence:
        (of,) = get_args(hint)
        words = f"{words} (each {_told(of)})"
    return f"{words} such as {_EXAMPLES[kind]}" if kind in _EXAMPLES else words


def _shown(value: object) -> str:
    """A value as it is written, or of what kind it is where that would be long."""
    is_short = isinstance(value, str | int | float | None)
    return repr(value) if is_short else a_or_an(type(value).__name__)
