# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The libraries for tags, an optional extra: everything here takes them from this file."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

from slap_ros.errors import InvalidParameterError

INSTALL = "pip install 'slap_ros[camera]'"
LIBRARIES = ("cv2", "pupil_apriltags", "PIL")


def require_camera_libraries() -> None:
    """Refuse to go on without the libraries, before anything is started; imports nothing.

    Raises:
        InvalidParameterError: One is not installed; says how to install it.
    """
    missing = [name for name in LIBRARIES if find_spec(name) is None]
    if missing:
        raise InvalidParameterError(
            f"camera and tags need {', '.join(missing)}, not installed: {INSTALL}"
        )


def camera_library(name: str) -> ModuleType:
    """One of the libraries, imported.

    Args:
        name: Name of the module.

    Raises:
        InvalidParameterError: It is not installed; says how to install it.
    """
    require_camera_libraries()
    return import_module(name)
