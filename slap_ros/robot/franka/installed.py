# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether franky and franky-sim are installed, and in which Python."""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path

from slap_ros.errors import InvalidParameterError

INSTALL = "pip install 'slap_ros[franka]'"
SIMULATOR_PYTHON = "SLAP_FRANKA_SIM_PYTHON"  # environment variable
INSTALL_SIMULATOR = (
    "python3 -m venv FOLDER, FOLDER/bin/pip install franky-sim, then "
    f"export {SIMULATOR_PYTHON}=FOLDER/bin/python"
)


def require_franky() -> None:
    """Refuse to go on without franky, before anything is started; imports nothing.

    Raises:
        InvalidParameterError: It is not installed; says how to install it.
    """
    if find_spec("franky") is None:
        raise InvalidParameterError(f"franky-control is not installed: {INSTALL}")


def simulator_python() -> Path:
    """The Python that has franky-sim: the one of the environment variable, or this one.

    Raises:
        InvalidParameterError: There is none; says how to install it.
    """
    given = os.environ.get(SIMULATOR_PYTHON, "")
    if given:
        if not Path(given).is_file():
            raise InvalidParameterError(f"{SIMULATOR_PYTHON} is {given}, where there is no file")
        return Path(given)
    if find_spec("franky_sim") is None:
        raise InvalidParameterError(f"franky-sim is not installed: {INSTALL_SIMULATOR}")
    return Path(sys.executable)
