# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Changes of training settings, given as values or as the command line has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from slap_ros.core import SettingValue
from slap_ros.learning.setting_changes import OFF

Changes = Mapping[str, SettingValue] | Sequence[str]


def change_texts(changes: Changes) -> list[str]:
    """Changes as texts, ``exploration.rollouts=16``, as the record of a library has them."""
    if isinstance(changes, Mapping):
        return [f"{name}={_text(value)}" for name, value in changes.items()]
    return list(changes)


def _text(value: SettingValue) -> str:
    if value is None:
        return OFF
    if isinstance(value, bool):
        return str(value).lower()
    return ",".join(map(str, value)) if isinstance(value, tuple) else str(value)
