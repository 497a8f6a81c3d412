# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""MuJoCo, imported: everything here that uses it takes it from this file.

Raises:
    InvalidParameterError: On import, where MuJoCo is not installed.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from slap_ros.robot.mujoco.installed import require_mujoco


def _imported() -> ModuleType:
    require_mujoco()
    return import_module("mujoco")


mujoco: ModuleType = _imported()
