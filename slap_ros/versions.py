# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What produced a result: versions of the software, revision of the source, the processor."""

from __future__ import annotations

import platform
import subprocess
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import slap_ros
from slap_ros.files import read_text

LIBRARIES = (
    "numpy",
    "rosbags",
    "cyclonedds",
    "pybullet",
    "pybullet-arm64",
    "mujoco",
    "pupil-apriltags",
    "franky-control",
    "franky-sim",
    "torch",
    "stable-baselines3",
    "matplotlib",
)
SOURCE = (".", ":(exclude)docs")
CHANGED = "-dirty"  # how the revision ends of sources that were changed since


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
def processor() -> str:
    """Name of the processor: torch sums in an order of its own on each kind."""
    try:
        lines = read_text(Path("/proc/cpuinfo")).splitlines()
    except OSError:
        lines = []  # not on Linux
    models = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(models, platform.processor() or platform.machine())


@lru_cache(maxsize=1)
def revision() -> str:
    """Git revision of the source, ``-dirty`` where changed; unknown for an installed copy."""
    return revision_of(Path(__file__).parent.parent)


def revision_of(root: Path) -> str:
    """The same of a source tree, documentation aside: studies write their results there."""
    if not (root / ".git").exists():
        return "unknown"
    try:
        described = _git(root, "describe", "--always", "--abbrev=12")
        changed = _git(root, "status", "--porcelain", "--untracked-files=no", "--", *SOURCE)
    except (OSError, subprocess.SubprocessError):
        return "unknown"  # no git here, or not its repository
    return f"{described}{CHANGED}" if changed else described


def _git(root: Path, *arguments: str) -> str:
    ran = subprocess.run(
        ["git", "-C", str(root), *arguments], capture_output=True, text=True, timeout=5, check=True
    )
    return ran.stdout.strip()
