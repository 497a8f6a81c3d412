# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command that makes a result again, as text."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any


def option_of(name: str) -> str:
    """The option that a parameter of a command is given by."""
    return f"--{name.replace('_', '-')}"


def command_line(*words: str, **options: Any) -> str:
    """A ``slap`` command.

    Args:
        words: Sub-commands and arguments.
        options: Options by name. None, False, and mappings are left out; True gives an option
            without a value, and a list repeats its option.

    Returns:
        The command, to be pasted into a shell.
    """
    parts = ["slap", *words]
    for name, value in options.items():
        values = value if isinstance(value, list) else [value]
        for one in values:
            if one is True:
                parts.append(option_of(name))
            elif not (one is None or one is False or isinstance(one, Mapping)):
                parts += [option_of(name), str(one)]
    return shlex.join(parts)
