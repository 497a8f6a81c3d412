# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What environments of others return, checked: the message says what is wrong and what is wanted.

Environments differ where Gymnasium lets them, and where it changed: in what ``reset`` and ``step``
return, in the precision and the nesting of observations, in the wrappers around them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from slap_ros.errors import InvalidDomainError, SlapError
from slap_ros.relational import Layout, State

STEP_RETURNS = (4, 5)  # before Gymnasium 0.26, and since
MAX_WRAPPERS = 32  # around each other
SHOWN_NAMES = 8


@contextmanager
def errors_of(environment: object, method: str) -> Iterator[None]:
    """Name the environment and the method where its code raises.

    Args:
        environment: What is called within.
        method: The method's name.

    Raises:
        InvalidDomainError: It raised something that is no error of slap_ros.
    """
    try:
        yield
    except SlapError:
        raise
    except Exception as error:
        advice = _precision_advice(environment) if method == "step" else ""
        raise InvalidDomainError(
            f"{method} of {type(environment).__name__} raised {type(error).__name__}: "
            f"{' '.join(str(error).split())}{advice}{wrapper_advice(environment)}"
        ) from error


@contextmanager
def advised(environment: object) -> Iterator[None]:
    """Say what to do about wrappers where what an environment returned will not do.

    Args:
        environment: What returned it.

    Raises:
        InvalidDomainError: The same, with that advice.
    """
    try:
        yield
    except InvalidDomainError as error:
        raise InvalidDomainError(f"{error}{wrapper_advice(environment)}") from None


def reset_observation(returned: object, environment: object) -> Any:
    """The observation in what ``reset`` returned.

    Args:
        returned: What it returned.
        environment: Environment whose method returned it.

    Raises:
        InvalidDomainError: It is not a pair.
    """
    if isinstance(returned, tuple) and len(returned) == 2:
        return returned[0]
    raise InvalidDomainError(
        f"reset of {type(environment).__name__} returned {described(returned)}; it must return "
        f"(observation, info){wrapper_advice(environment)}"
    )


def step_observation(returned: object, environment: object) -> Any:
    """The observation in what ``step`` returned.

    Args:
        returned: What it returned.
        environment: Environment whose method returned it.

    Raises:
        InvalidDomainError: It is not what a step returns.
    """
    if isinstance(returned, tuple) and len(returned) in STEP_RETURNS:
        return returned[0]
    raise InvalidDomainError(
        f"step of {type(environment).__name__} returned {described(returned)}; it must return "
        f"(observation, reward, terminated, truncated, info){wrapper_advice(environment)}"
    )


def state_from(layout: Layout, observed: Mapping[str, Any]) -> State:
    """The state of each object's features.

    Args:
        layout: The objects.
        observed: Features by the object's name, arrays.

    Raises:
        InvalidDomainError: Other objects, another number of features, or no finite numbers.
    """
    names = {obj.name for obj in layout.objects}
    if set(observed) != names:
        raise InvalidDomainError(
            f"the environment observes {_listed(observed)}; the objects are "
            f"{', '.join(sorted(names))}{_nested_advice(observed, names)}"
        )
    data = np.empty(layout.size)
    for obj, part in layout.slices.items():
        features = _numbers(observed[obj.name])
        if features is None or features.shape != (part.stop - part.start,):
            raise InvalidDomainError(
                f"the environment observes {obj.name} {_form(observed[obj.name], features)}; a "
                f"{obj.type} has {', '.join(feature.name for feature in obj.type.features)}, one "
                "array of them in this order"
            )
        data[part] = features
    state = State(layout, data)
    require_numbers(state, "the environment observes")
    return state


def require_numbers(state: State, origin: str) -> None:
    """Refuse NaN and infinity in what an environment or simulator made.

    Args:
        state: What it made.
        origin: What made it, and how, to begin the message with.

    Raises:
        InvalidDomainError: A feature is not finite; it is named.
    """
    if not np.isfinite(state.data).all():
        at = int(np.flatnonzero(~np.isfinite(state.data))[0])
        name = ".".join(_feature_at(state.layout, at))
        raise InvalidDomainError(f"{origin} {name} as {state.data[at]}, which is no number")


def require_begun(wanted: State, begun: State, how: str) -> None:
    """Refuse an environment that does not begin in the state that it was given.

    Args:
        wanted: The state it was given.
        begun: The state it has.
        how: Code of the call that must continue from the given state, for the message.

    Raises:
        InvalidDomainError: They differ; the message names the first feature that does.
    """
    if np.array_equal(wanted.data, begun.data):
        return
    require_double(wanted, begun)
    obj, feature = _feature_at(wanted.layout, _first_difference(wanted, begun))
    raise InvalidDomainError(
        f"{obj} is not as it was reset to ({feature}: {_change(wanted, begun)}); {how} must "
        "continue from it exactly"
    )


def require_double(wanted: State, begun: State) -> None:
    """Refuse an environment that rounds states to float32.

    Args:
        wanted: The state it was given.
        begun: The state it has.

    Raises:
        InvalidDomainError: They differ by that rounding alone.
    """
    rounded = wanted.data.astype(np.float32).astype(np.float64)
    if np.array_equal(wanted.data, begun.data) or not np.array_equal(rounded, begun.data):
        return
    name = ".".join(_feature_at(wanted.layout, _first_difference(wanted, begun)))
    raise InvalidDomainError(
        f"the environment keeps states in float32: {_change(wanted, begun)} ({name}). States must "
        "come back exactly: use float64 in its arrays and its observation space"
    )


def described(value: object) -> str:
    """What a value is, in words that tell a dictionary from an array from a tuple."""
    if isinstance(value, Mapping):
        return f"a dictionary with {_listed(value)}"
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    if isinstance(value, tuple):
        return f"a tuple of {len(value)}"
    return "None" if value is None else f"a value of type {type(value).__name__}"


def wrapper_advice(environment: object) -> str:
    """What to do about wrappers around an environment; empty where there are none."""
    names: list[str] = []
    inner = getattr(environment, "env", None)
    while inner is not None and len(names) < MAX_WRAPPERS:
        names.append(type(environment).__name__)
        environment, inner = inner, getattr(inner, "env", None)
    if not names:
        return ""
    return (
        f"; it is wrapped in {', '.join(names)}: wrappers may check or change what is returned, so "
        "give env.unwrapped"
    )


def _precision_advice(environment: object) -> str:
    """What to do about an action space that takes no numbers of ours: Gymnasium's are float32."""
    dtype = getattr(getattr(environment, "action_space", None), "dtype", None)
    if dtype is None or np.can_cast(np.float64, dtype):
        return ""
    return (
        f"; its action space is {dtype}, and actions are float64: make it float64 if it is checked"
    )


def _numbers(value: object) -> Any:
    """An array of numbers; None for what is none."""
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        return None


def _form(value: object, features: Any) -> str:
    return f"as {described(value)}" if features is None else f"with shape {features.shape}"


def _nested_advice(observed: Mapping[Any, Any], names: set[str]) -> str:
    """Where the objects are, if they are in an entry of the observation."""
    for key, value in observed.items():
        if isinstance(value, Mapping) and names <= set(value):
            return f". They are in its entry {key!r}, which alone is to be returned"
    return ""


def _listed(names: Mapping[Any, Any]) -> str:
    shown = sorted(map(str, names))
    more = f" and {len(shown) - SHOWN_NAMES} more" if len(shown) > SHOWN_NAMES else ""
    return f"{', '.join(shown[:SHOWN_NAMES])}{more}" if shown else "nothing"


def _feature_at(layout: Layout, index: int) -> tuple[str, str]:
    """Names of an object and of its feature at a place of a state's array."""
    for obj, part in layout.slices.items():
        if index < part.stop:
            return obj.name, obj.type.features[index - part.start].name
    raise IndexError(index)


def _first_difference(wanted: State, begun: State) -> int:
    return int(np.flatnonzero(wanted.data != begun.data)[0])


def _change(wanted: State, begun: State) -> str:
    """Two numbers that differ, with as many digits as show it."""
    at = _first_difference(wanted, begun)
    before, after = float(wanted.data[at]), float(begun.data[at])
    short = f"{after:.12g}"
    return f"{before!r} became {after if float(short) == before else short}"
