# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Interface classes by name."""

from __future__ import annotations

from typing import Any

from embedded_ros.types import action_class, message_class, service_class
from embedded_ros.types.errors import InterfaceError


def get_message(identifier: str) -> type[Any]:
    """The class of ``pkg/msg/Name`` (or ``pkg/Name``); raises ValueError where unknown."""
    return _get(identifier, "msg", message_class)


def get_service(identifier: str) -> type[Any]:
    """The class of ``pkg/srv/Name`` (or ``pkg/Name``); raises ValueError where unknown."""
    return _get(identifier, "srv", service_class)


def get_action(identifier: str) -> type[Any]:
    """The class of ``pkg/action/Name`` (or ``pkg/Name``); raises ValueError where unknown."""
    return _get(identifier, "action", action_class)


def _get(identifier: str, kind: str, find: Any) -> type[Any]:
    parts = identifier.split("/")
    if len(parts) == 2:
        parts.insert(1, kind)
    if len(parts) != 3 or parts[1] != kind:
        raise ValueError(f"{identifier!r} is no {kind} interface")
    try:
        found: type[Any] = find("/".join(parts))
    except InterfaceError as error:
        raise ValueError(str(error)) from error
    return found
