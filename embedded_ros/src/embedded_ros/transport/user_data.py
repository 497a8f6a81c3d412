# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ``key=value;`` pairs in an endpoint's USER_DATA."""

from __future__ import annotations

from typing import Any

from cyclonedds.core import Policy


def value(endpoint: Any, key: str) -> str | None:
    """The value of a key in a discovered endpoint's USER_DATA, or None."""
    policy = endpoint.qos[Policy.Userdata]
    if policy is None:
        return None
    pairs = bytes(policy.data).decode(errors="replace").split(";")
    found = dict(pair.split("=", 1) for pair in pairs if "=" in pair)
    return found.get(key)
