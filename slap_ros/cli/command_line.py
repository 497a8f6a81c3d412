# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command that makes a result again, as text."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any


def command_line(*words: str, **options: Any) -> str:
    """A ``slap`` command.

    Args:
        words: Sub-commands and arguments.
        options: By name. Those that say nothing (None, or a mapping) are left out; a list repeats
            its option.

    Returns:
        The command, to be pasted into a shell.
    """
    parts = ["slap", *words]
    for name, value in options.items():
        values = value if isinstance(value, list) else [value]
        if not isinstance(value, Mapping) and value is not None:
            flag = f"--{name.replace('_', '-')}"
            parts += [part for one in values for part in (flag, str(one))]
    return shlex.join(parts)
