# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What produced a result: versions of the software, revision of the source."""

from __future__ import annotations

import platform
import subprocess
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import slap_ros

LIBRARIES = (
    "numpy",
    "rosbags",
    "cyclonedds",
    "pybullet",
    "pybullet-arm64",
    "torch",
    "stable-baselines3",
    "matplotlib",
)


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """Versions by name; libraries that are not installed are left out."""
    found = {"slap_ros": slap_ros.__version__, "python": platform.python_version()}
    for library in LIBRARIES:
        try:
            found[library] = version(library)
        except PackageNotFoundError:
            continue
    return found | {"revision": revision()}


@lru_cache(maxsize=1)
def revision() -> str:
    """Git revision of the source, ``-dirty`` where changed; unknown for an installed copy."""
    root = Path(__file__).parent.parent
    if not (root / ".git").exists():
        return "unknown"
    try:
        described = subprocess.run(
            ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=12"],
            capture_output=True,
            text=True,
            timeout=5,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"  # no git here, or not its repository
    return described.stdout.strip()
