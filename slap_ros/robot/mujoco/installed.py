# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether MuJoCo, which is an optional extra, is installed."""

from __future__ import annotations

from importlib.util import find_spec

from slap_ros.errors import InvalidParameterError

INSTALL = "pip install 'slap_ros[mujoco]'"


def require_mujoco() -> None:
    """Refuse to go on without MuJoCo, before anything is started; imports nothing.

    Raises:
        InvalidParameterError: It is not installed; says how to install it.
    """
    if find_spec("mujoco") is None:
        raise InvalidParameterError(f"MuJoCo is not installed: {INSTALL}")
