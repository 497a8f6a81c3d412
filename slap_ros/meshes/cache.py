# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The folder in which decomposed and downloaded meshes are cached."""

from __future__ import annotations

import os
from pathlib import Path

from slap_ros.files import user_cache


def cache_folder() -> Path:
    """``slap_ros/meshes`` in the user's cache folder; it may not exist yet."""
    return user_cache("meshes")


def store(file: Path, content: bytes) -> None:
    """Write a whole file or none: two processes may both do so."""
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_name(f".{file.name}.{os.getpid()}")
    part.write_bytes(content)
    part.replace(file)
