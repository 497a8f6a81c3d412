# SPDX-FileCopyrightText: The slap_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Objects of Objaverse by identifier. Each has a licence of its own: see its annotations.

M. Deitke et al.: Objaverse: A Universe of Annotated 3D Objects, CVPR 2023.
"""

from __future__ import annotations

import re
from pathlib import Path

from slap_ros.errors import InvalidMeshError, MeshUnavailableError
from slap_ros.files import read_bytes
from slap_ros.meshes.cache import cache_folder, store
from slap_ros.meshes.decomposition import (
    DEFAULT_SETTINGS,
    MAX_MESH_BYTES,
    DecompositionSettings,
    load_mesh,
)
from slap_ros.meshes.solid import Solid

IDENTIFIER = re.compile(r"[0-9a-f]{32}")


def load_objaverse(
    identifier: str, size_m: float, settings: DecompositionSettings = DEFAULT_SETTINGS
) -> Solid:
    """An object of Objaverse, downloaded once.

    Where there is no network, put it into the cache folder as ``objaverse/IDENTIFIER.glb``.

    Args:
        identifier: Identifier (uid) of the object: 32 hexadecimal digits.
        size_m: Longest edge of the box around the object, m; see
            :func:`slap_ros.meshes.decomposition.load_mesh`, also for what else may fail.
        settings: Settings that say how closely the pieces follow the object.

    Returns:
        The solid; its origin is its centre of mass.

    Raises:
        MeshUnavailableError: It cannot be downloaded.
        InvalidMeshError: That is no identifier.
    """
    if not IDENTIFIER.fullmatch(identifier):
        raise InvalidMeshError(
            f"{identifier!r} is no identifier of Objaverse: those are 32 hexadecimal digits"
        )
    cached = cache_folder() / "objaverse" / f"{identifier}.glb"
    if not cached.exists():
        store(cached, read_bytes(_downloaded(identifier, cached), MAX_MESH_BYTES))
    return load_mesh(cached, size_m, settings)


def _downloaded(identifier: str, cached: Path) -> Path:
    advice = f"or get it elsewhere, and put it at {cached}"
    try:
        import objaverse
    except ImportError as error:
        raise MeshUnavailableError(
            f"to download {identifier} needs objaverse; pip install 'slap_ros[meshes]', {advice}"
        ) from error
    try:
        files = objaverse.load_objects(uids=[identifier])
        return Path(files[identifier])
    except KeyError as error:
        raise MeshUnavailableError(f"Objaverse has no object {identifier}") from error
    except OSError as error:  # no network, among others
        raise MeshUnavailableError(
            f"{identifier} cannot be downloaded ({error}); try again with a network, {advice}"
        ) from error
