# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The mock robot's parameters as a command line has them: ``latency=0.05,dropout=0.1``."""

from __future__ import annotations

from dataclasses import fields

from robot_bridge.mock.node import Parameters
from slap_ros.errors import InvalidParameterError

GIVEN = frozenset({"domain", "preset", "seed", "index"})  # with the run


def mock_options(text: str) -> dict[str, str | int | float]:
    """Parameters by name, of the types that they have.

    Raises:
        InvalidParameterError: One that there is not, or a value that it cannot have.
    """
    kinds = {item.name: type(item.default) for item in fields(Parameters)}
    known = [name for name in kinds if name not in GIVEN]
    found: dict[str, str | int | float] = {}
    for part in filter(None, text.split(",")):
        name, _, value = part.partition("=")
        if name not in known:
            raise InvalidParameterError(
                f"the mock robot has no parameter {name!r}; it has {', '.join(known)}"
            )
        try:
            found[name] = kinds[name](value)
        except ValueError:
            raise InvalidParameterError(
                f"the mock robot's {name} is a number, not {value!r}"
            ) from None
    return found
